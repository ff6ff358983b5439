"""The command line's groups, and the options that several commands share."""

from __future__ import annotations

from typing import Annotated

from cyclopts import App, Group, Parameter

from heptarm import __version__

app = App(
    name="heptarm", help="Control a KUKA LBR iiwa, with or without a robot on the desk.", version=__version__
)
move_app = App(name="move", help="Move the arm and wait until it rests.")
app.command(move_app)
rl_app = App(name="rl", help="Train a policy that reaches targets, look how good it is, let it drive an arm.")
app.command(rl_app)

COMMON = Group("Common options")
FRI = Group("FRI")
Target = Annotated[
    str | None,
    Parameter(
        name="--target",
        group=COMMON,
        help="What to connect to: ADDRESS[:PORT], sim://HOST:PORT or sim://iiwa14. Default: HEPTARM_TARGET.",
    ),
]
Json = Annotated[
    bool, Parameter(name="--json", group=COMMON, negative="", help="Print one JSON object a line.")
]
Degrees = Annotated[bool, Parameter(name="--deg", negative="", help="Angles are degrees.")]
Speed = Annotated[float, Parameter(name="--speed", help="Fraction of the full speed, (0, 1].")]
Yes = Annotated[bool, Parameter(name="--yes", negative="", help="Do not ask before a real robot moves.")]
DryRun = Annotated[
    bool, Parameter(name="--dry-run", negative="", help="Check and show the motion, move nothing.")
]
