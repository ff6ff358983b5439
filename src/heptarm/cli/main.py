"""`heptarm`: the table of commands, and the entry point.

Each command is one function with its options and its help, in the module named here; the module is imported when
the command runs.
"""

from __future__ import annotations

import os
import sys

from cyclopts import App

from heptarm import __version__
from heptarm.errors import HeptarmError

#: Commands and where their functions are.
COMMANDS = {
    "demo": "demo:demo",
    "sim": "sim:sim",
    "state": "state:state",
    "stop": "motion:stop",
    "recover": "motion:recover",
    "servo": "motion:servo",
    "teach": "motion:teach",
    "replay": "motion:replay",
    "doctor": "doctor:doctor",
    "bench": "bench:bench",
    "check": "check:check",
    "install-cabinet": "install_cabinet:install_cabinet",
}
MOVES = {"ptp": "motion:move_ptp", "lin": "motion:move_lin", "lin_rel": "motion:move_lin_rel"}
KEYS = {"new": "key:new", "set": "key:store", "list": "key:show", "forget": "key:forget"}
LEARNING = {"train": "rl:train", "eval": "rl:evaluate", "deploy": "rl:deploy"}

app = App(
    name="heptarm", help="Control a KUKA LBR iiwa, with or without a robot on the desk.", version=__version__
)


def _add(group: App, commands: dict[str, str]) -> App:
    for name, place in commands.items():
        group.command(f"heptarm.cli.{place}", name=name)
        if _ASKS_FOR_HELP:
            group[name]  # imported now: the summary of its docstring is listed
    return group


_ASKS_FOR_HELP = len(sys.argv) == 1 or bool({"-h", "--help"} & set(sys.argv))
_add(app, COMMANDS)
app.command(_add(App(name="move", help="Move the arm and wait until it is at rest."), MOVES))
app.command(_add(App(name="key", help="Make, store and list the pre-shared keys of cabinets."), KEYS))
app.command(_add(App(name="rl", help="Train, evaluate and deploy a policy that reaches targets."), LEARNING))


def main() -> None:
    """Run the command line: an error of heptarm is one sentence on standard error and exit code 1."""
    try:
        code = app()
    except HeptarmError as error:
        from heptarm.arm.translate.text import printable

        if os.environ.get("HEPTARM_DEBUG"):
            raise
        print(f"heptarm: {printable(str(error), lines=True)}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:  # the reader of our output has gone, as in `heptarm state --watch | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    sys.exit(code if isinstance(code, int) else 0)


if __name__ == "__main__":
    main()
