"""Options common to several commands, with their help texts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from cyclopts import Group, Parameter

from heptarm.errors import CommandRejected
from heptarm.values.robot import ROBOTS, robot

COMMON = Group("Common options")
FRI = Group("FRI")


def _check_model(_: object, name: str) -> None:
    """Refuse a robot that heptarm does not know, in the way that cyclopts reports."""
    try:
        robot(name)
    except CommandRejected as error:
        raise ValueError(error.text) from None


Model = Annotated[str, Parameter(validator=_check_model, help=f"Robot: {', '.join(ROBOTS)}.")]
Target = Annotated[
    str | None,
    Parameter(
        name="--target",
        group=COMMON,
        help="What to connect to: ADDRESS[:PORT], sim://HOST:PORT or sim://iiwa14. Default: HEPTARM_TARGET.",
    ),
]
Json = Annotated[
    bool, Parameter(name="--json", group=COMMON, negative="", help="Print one JSON object per line.")
]
Degrees = Annotated[bool, Parameter(name="--deg", negative="", help="Angles are in degrees.")]
Speed = Annotated[float, Parameter(name="--speed", help="Fraction of the full speed, (0, 1].")]
Yes = Annotated[bool, Parameter(name="--yes", negative="", help="Do not ask before a real robot moves.")]
DryRun = Annotated[
    bool, Parameter(name="--dry-run", negative="", help="Check and show the motion, move nothing.")
]


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """Options of every command that moves the arm."""

    yes: Yes = False
    target: Target = None
    as_json: Json = False


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class MoveOptions(Access):
    """Options of every `heptarm move`."""

    degrees: Degrees = False
    speed: Speed = 0.1
    dry_run: DryRun = False


FriPort = Annotated[
    int | None, Parameter(group=FRI, help="Own UDP port. Default: the first free one of 30200 to 30209.")
]
FriPeriod = Annotated[int, Parameter(group=FRI, help="Time between two messages [ms].")]
FriVersion = Annotated[
    str | None,
    Parameter(group=FRI, help="FRI release that the cabinet speaks. Default: taken from its first message."),
]
FriListen = Annotated[
    bool,
    Parameter(
        group=FRI,
        negative="",
        help="Open no session; listen to the FRI application that runs on the cabinet.",
    ),
]
