"""`heptarm`: the table of commands, and the entry point.

Each command is one function with its options and its help, in the module named here; the module is imported when
the command runs. A list of commands reads their summaries from the sources, and imports none.
"""

from __future__ import annotations

import ast
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, NoReturn

from cyclopts import App, CycloptsError, Parameter, UnusedCliTokensError

from heptarm import __version__
from heptarm.errors import HeptarmError, missing_extra

#: Commands and where their functions are.
COMMANDS = {
    "demo": "demo:demo",
    "sim": "sim:sim",
    "panel": "panel:panel",
    "state": "state:state",
    "stop": "stop:stop",
    "recover": "motion:recover",
    "servo": "motion:servo",
    "jog": "jog:jog",
    "teach": "motion:teach",
    "replay": "motion:replay",
    "live": "live:live",
    "record": "record:record",
    "plot": "plot:plot",
    "convert": "record:convert",
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
LEARNING = {"train": "rl:train", "eval": "rl:evaluate", "deploy": "rl:deploy"}
_GROUPS = {"move": MOVES, "plan": PLANS, "key": KEYS, "targets": TARGETS, "rl": LEARNING}

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
    tree = ast.parse(Path(__file__).with_name(f"{module}.py").read_bytes())
    (found,) = (one for one in tree.body if isinstance(one, ast.FunctionDef) and one.name == function)
    return (ast.get_docstring(found) or "").partition("\n")[0]


def _add(group: App, commands: dict[str, str], *, listed: bool) -> App:
    for name, place in commands.items():
        # the help of a command that runs is its whole docstring, so only a list has summaries
        more = {"help": _summary(place)} if listed else {}
        group.command(f"heptarm.cli.{place}", name=name, **more)
    return group


#: The commands on the command line: a list is printed of those below the last one that is a group.
_words = [one for one in sys.argv[1:] if not one.startswith("-")]
_add(app, COMMANDS, listed=not _words)
_move = App(name="move", help="Move the arm and wait until it is at rest.")
_plans = App(name="plan", help="Look ahead of a motion: duration, limits, collisions; nothing moves.")
_keys = App(name="key", help="Make, store and list the pre-shared keys of cabinets.")
_targets = App(name="targets", help="List, save and remove robots that have a name.")
_learn = App(name="rl", help="Train, evaluate and deploy a policy that reaches targets.")
app.command(_add(_move, MOVES, listed=_words == ["move"]))
app.command(_add(_plans, PLANS, listed=_words == ["plan"]))
app.command(_add(_keys, KEYS, listed=_words == ["key"]))
app.command(_add(_targets, TARGETS, listed=_words == ["targets"]))
app.command(_add(_learn, LEARNING, listed=_words == ["rl"]))


@_targets.default
def _list_targets(
    *, as_json: Annotated[bool, Parameter(name="--json", help="Print one JSON object per line.")] = False
) -> int:
    """List, save and remove robots that have a name; without another word: list."""
    from heptarm.cli.targets import show

    return show(as_json=as_json)


def main() -> None:
    """Run the command line: an error is one sentence on standard error and exit code 1."""
    try:
        code = app(print_error=False, exit_on_error=False)
    except UnusedCliTokensError as error:
        _fail(f"unexpected: {' '.join(error.unused_tokens or ())} ({_help()})")
    except CycloptsError as error:
        _fail(f"{' '.join(str(error).split())} ({_help()})")
    except HeptarmError as error:
        from heptarm.arm.translate.text import printable

        if os.environ.get("HEPTARM_DEBUG"):
            raise
        page = f"\n{error.page}" if error.code and sys.stderr.isatty() else ""
        _fail(printable(str(error), lines=True) + page)
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
    sys.exit(code if isinstance(code, int) else 0)


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


def _fail(sentence: str) -> NoReturn:
    print(f"heptarm: {sentence}", file=sys.stderr)
    sys.exit(1)


if __name__ == "__main__":
    main()
