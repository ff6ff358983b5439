"""`heptarm`: the table of commands, and the entry point.

Each command is one function with its options and its help, in the module named here; the module is imported when
the command runs. A list of commands reads their summaries from the sources, and imports none.
"""

from __future__ import annotations

import ast
import os
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, NoReturn

from cyclopts import App, CycloptsError, Parameter, UnknownOptionError, UnusedCliTokensError

from heptarm import __version__
from heptarm.errors import HeptarmError, missing_extra, shortage

#: Exit code after misuse of a command, as of other tools.
_USAGE = 2
#: What errors say in Python about angles that were given in degrees; a shell has an option for it.
_IN_DEGREES = re.compile(r"did you mean (?:ha\.deg|math\.radians)\([^)]*\)\?")
#: Commands and where their functions are.
COMMANDS = {
    "demo": "demo:demo",
    "sim": "sim.cabinet:sim",
    "panel": "panel:panel",
    "state": "state:state",
    "stop": "stop:stop",
    "recover": "motion:recover",
    "servo": "motion:servo",
    "jog": "jog:jog",
    "teleop": "teleop:teleop",
    "teach": "motion:teach",
    "replay": "motion:replay",
    "live": "live:live",
    "record": "record:record",
    "plot": "plot:plot",
    "convert": "record:convert",
    "episodes": "record:episodes",
    "twin": "twin:twin",
    "export": "export:export",
    "doctor": "doctor:doctor",
    "bench": "bench:bench",
    "check": "check:check",
    "install-cabinet": "install_cabinet:install_cabinet",
    "completion": "completion:completion",
}
MOVES = {"ptp": "motion:move_ptp", "lin": "motion:move_lin", "lin-rel": "motion:move_lin_rel"}
PLANS = {"ptp": "plan:plan_ptp", "lin": "plan:plan_lin", "lin-rel": "plan:plan_lin_rel", "to": "plan:plan_to"}
KEYS = {"new": "key:new", "set": "key:store", "list": "key:show", "forget": "key:forget"}
TARGETS = {"list": "targets:show", "add": "targets:add", "remove": "targets:remove"}
CALIBRATIONS = {
    "tcp": "calibrate:tcp",
    "load": "calibrate:load",
    "arm": "calibrate:arm",
    "eye": "calibrate_eye:eye",
    "board": "calibrate_eye:board",
}
BRIDGES = {"libiiwa": "bridge:libiiwa", "kst": "bridge:kst"}
LEARNING = {
    "train": "rl.policies:train",
    "eval": "rl.policies:evaluate",
    "deploy": "rl.deploy:deploy",
    "record": "rl.record:record",
}
SIMULATIONS = {"app": "sim.application:application", "fri": "sim.fri:fri"}
#: Groups that are commands themselves, and where they are.
_APPS = {"sim": "sim:app"}
_GROUPS = {
    **{"sim": SIMULATIONS, "move": MOVES, "plan": PLANS, "calibrate": CALIBRATIONS},
    **{"key": KEYS, "targets": TARGETS, "rl": LEARNING, "bridge": BRIDGES},
}

app = App(
    name="heptarm",
    help="Control a KUKA LBR iiwa, with or without a robot on the desk.",
    version=__version__,
    default_parameter=Parameter(negative=()),  # no --no-… and --empty-… beside the options
    suppress_keyboard_interrupt=False,  # `main` reports what became of the arm
)


def _summary(place: str) -> str:
    """First line of a command's docstring, read from its source."""
    module, function = place.split(":")
    tree = ast.parse(Path(__file__).parent.joinpath(*module.split(".")).with_suffix(".py").read_bytes())
    (found,) = (node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == function)
    return (ast.get_docstring(found) or "").partition("\n")[0]


def _add(group: App, commands: dict[str, str], *, listed: bool) -> App:
    for name, place in commands.items():
        # the help of a command that runs is its whole docstring, so only a list has summaries
        more = {"help": _summary(place)} if listed else {}
        group.command(f"heptarm.cli.{_APPS.get(name, place)}", name=name, **more)
    return group


def current_spelling(tokens: list[str]) -> list[str]:
    """Translate `heptarm sim --app FOLDER` and `--fri VERSION`, older spellings of `sim app` and `sim fri`."""
    if tokens[:1] != ["sim"] or (tokens[1:2] and tokens[1] in SIMULATIONS):
        return tokens
    for place, token in enumerate(tokens):
        option, equals, value = token.partition("=")
        if option in ("--app", "--fri"):
            rest = [value] * bool(equals) + tokens[place + 1 :]
            return ["sim", option.lstrip("-"), *rest[:1], *tokens[1:place], *rest[1:]]
    return tokens


#: The commands on the command line: a list is printed of those below the last one that is a group.
_tokens = current_spelling(sys.argv[1:])
_words = [token for token in _tokens if not token.startswith("-")]
_add(app, COMMANDS, listed=not _words)
_move = App(name="move", help="Move the arm and wait until it is at rest.")
_plans = App(name="plan", help="Look ahead of a motion: duration, limits, collisions; nothing moves.")
_calibrate = App(
    name="calibrate",
    help="Measure the tip of a tool, the load on the flange, where a camera is, and what the arm itself is like.",
)
_keys = App(name="key", help="Make, store and list the pre-shared keys of cabinets.")
_targets = App(name="targets", help="List, save and remove robots that have a name.")
_bridges = App(
    name="bridge", help="Let programs of other projects, unchanged, control an arm through heptarm's cabinet."
)
_learn = App(name="rl", help="Train, evaluate and deploy policies; record demonstrations of a script.")
app.command(_add(_move, MOVES, listed=_words == ["move"]))
app.command(_add(_plans, PLANS, listed=_words == ["plan"]))
app.command(_add(_calibrate, CALIBRATIONS, listed=_words == ["calibrate"]))
app.command(_add(_keys, KEYS, listed=_words == ["key"]))
app.command(_add(_targets, TARGETS, listed=_words == ["targets"]))
app.command(_add(_bridges, BRIDGES, listed=_words == ["bridge"]))
app.command(_add(_learn, LEARNING, listed=_words == ["rl"]))


@_targets.default
def _list_targets(
    *, as_json: Annotated[bool, Parameter(name="--json", help="Print one JSON object per line.")] = False
) -> int:
    """List, save and remove robots that have a name; without another word: list."""
    from heptarm.cli.targets import show

    return show(as_json=as_json)


def main() -> None:
    """Run the command line: an error is one sentence on standard error and exit code 1; misuse of the command, 2."""
    try:
        code = app(_tokens, print_error=False, exit_on_error=False)
    except UnusedCliTokensError as error:
        _fail(f"unexpected: {' '.join(error.unused_tokens or ())} ({_help()})", code=_USAGE)
    except CycloptsError as error:
        _fail(f"{_misplaced(error) or ' '.join(str(error).split())} ({_help()})", code=_USAGE)
    except HeptarmError as error:
        from heptarm.values.text import printable

        if os.environ.get("HEPTARM_DEBUG"):
            raise
        page = f"\n{error.page}" if error.code and sys.stderr.isatty() else ""
        _fail(
            _IN_DEGREES.sub("did you mean them in degrees? --deg", printable(str(error), lines=True)) + page
        )
    except ModuleNotFoundError as error:
        missing = missing_extra(error.name or "")
        if missing is None or os.environ.get("HEPTARM_DEBUG"):
            raise
        _fail(str(missing))
    except KeyboardInterrupt:
        options = sys.modules.get("heptarm.cli.options")
        if options is not None and (outcome := options.after_interrupt()):
            print(f"heptarm: Ctrl-C: {outcome}", file=sys.stderr)
        sys.exit(130)
    except BrokenPipeError:  # the reader of our output has gone, as in `heptarm state --watch | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except OSError as error:
        remedy = shortage(error)
        if not remedy or os.environ.get("HEPTARM_DEBUG"):
            raise
        _fail(f"{(error.strerror or '').lower()} ({remedy})")
    sys.exit(code if isinstance(code, int) else 0)


def _misplaced(error: CycloptsError) -> str:
    """Why `heptarm sim` does not take an option of one of its siblings; empty: the error is another one."""
    if not isinstance(error, UnknownOptionError) or _words[:1] != ["sim"]:
        return ""
    from heptarm.cli.sim import explain_refusal

    command = _words[1] if _words[1:] and _words[1] in SIMULATIONS else ""
    return explain_refusal(command, (error.token.keyword or "").partition("=")[0])


def _help() -> str:
    """What to type for the help of the command on the command line, as far as there is one."""
    known = ["heptarm"]
    below: Mapping[str, object] = {**COMMANDS, **_GROUPS}
    for word in _words:
        if word not in below:
            break
        known.append(word)
        below = _GROUPS.get(word, {})
    return " ".join([*known, "--help"])


def _fail(sentence: str, *, code: int = 1) -> NoReturn:
    print(f"heptarm: {sentence}", file=sys.stderr)
    sys.exit(code)


if __name__ == "__main__":
    main()
