"""Options common to several commands, with their help texts."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from heptarm.cli.output import confirm
from heptarm.errors import CommandRejected, NotReady
from heptarm.values.robot import ROBOTS, robot

if TYPE_CHECKING:
    from heptarm.arm.arm import Arm

COMMON = Group("Common options")
FRI = Group("FRI")


def check_model(_: object, name: str | None) -> None:
    """Refuse a robot that heptarm does not know, in the way that cyclopts reports; None: not given."""
    try:
        if name is not None:
            robot(name)
    except CommandRejected as error:
        raise ValueError(error.text) from None


Model = Annotated[
    str,
    Parameter(
        validator=check_model, help=f"Robot: {', '.join(ROBOTS)}; with a media flange, such as iiwa14+touch."
    ),
]
KeyFile = Annotated[
    Path | None,
    Parameter(
        name="--key-file",
        group=COMMON,
        help="File with the pre-shared key. Default: HEPTARM_KEY, then the key stored for the target (heptarm key).",
    ),
]


Overwrite = Annotated[
    bool, Parameter(name="--overwrite", negative="", help="Replace a file that exists; otherwise it is kept.")
]


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class CommandTarget:
    """What a command connects to. Every command connects by `connect`, so that none can forget the key.

    Attributes:
        text: as in `heptarm.connect`; None: not given.
        key_file: file with the key; None: the key is looked up elsewhere.
        datagrams: send servo targets and receive states by UDP as far as it gets through.
        flange: media flange of the robot; "": that of the target.
    """

    text: Annotated[
        str | None,
        Parameter(
            name="--target",
            group=COMMON,
            help="What to connect to: ADDRESS[:PORT], sim://HOST:PORT, sim://iiwa14, or the name of a saved target "
            "(heptarm targets). Default: HEPTARM_TARGET.",
        ),
    ] = None
    key_file: KeyFile = None
    datagrams: Annotated[
        bool,
        Parameter(
            negative="",
            group=COMMON,
            help="Servo targets and states go by UDP beside the TCP connection: for networks that lose packets.",
        ),
    ] = False
    flange: Annotated[
        str,
        Parameter(
            group=COMMON,
            help="Media flange of the robot: plain, touch, or its height above a plain one [m]. Default: that of the "
            "target, or plain.",
        ),
    ] = ""

    def or_else(self, default: str | None) -> CommandTarget:
        """Complete it: as given, else HEPTARM_TARGET, else this default."""
        from heptarm.arm.link.target import VARIABLE

        return replace(self, text=self.text or os.environ.get(VARIABLE, "").strip() or default)

    def connect(
        self,
        *,
        control: bool = True,
        state_rate: float | None = None,
        watchdog: float | None = None,
        timeout: float | None = None,
    ) -> Arm:
        """Connect, see `heptarm.connect`; None: its default."""
        from heptarm.arm.connect import connect
        from heptarm.arm.link.connection import STATE_RATE, TIMEOUT
        from heptarm.arm.watchdog import CONNECTION

        arm = connect(
            self.text,
            key_file=self.key_file,
            datagrams=self.datagrams,
            flange=self.flange or None,
            control=control,
            state_rate=STATE_RATE if state_rate is None else state_rate,
            watchdog=CONNECTION.default if watchdog is None else watchdog,
            timeout=TIMEOUT if timeout is None else timeout,
        )
        if control:
            _controlled.append(arm)
        return arm

    def find_key(self) -> str | None:
        """Find the key that `connect` uses; None: there is none."""
        from heptarm.arm.link.target import parse_target, target_from_env
        from heptarm.io import keys

        parsed = parse_target(target_from_env() if self.text is None else self.text)
        file = self.key_file or parsed.key_file
        return keys.find_key(key_file=file, host=parsed.host, port=parsed.port)


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class CommandTargets:
    """What a command for several arms connects to.

    Attributes:
        texts: each as in `heptarm.connect`; none: HEPTARM_TARGET.
        key_file: file with the key of all of them; None: the keys are looked up elsewhere.
    """

    texts: Annotated[
        tuple[str, ...],
        Parameter(
            name="--target",
            group=COMMON,
            help="What to connect to, as of other commands; may be repeated. Default: HEPTARM_TARGET.",
        ),
    ] = ()
    key_file: KeyFile = None

    def each(self) -> list[tuple[str, CommandTarget]]:
        """The targets, and what connects to each of them.

        Raises:
            ConnectFailed: none is given, and HEPTARM_TARGET is not set.
        """
        from heptarm.arm.link.target import target_from_env

        chosen = self.texts or (target_from_env(),)
        return [(text, CommandTarget(text=text, key_file=self.key_file)) for text in chosen]


#: No targets were given on the command line.
NO_TARGETS = CommandTargets()

#: Arms that this process has controlled.
_controlled: list[Arm] = []


def after_interrupt() -> str:
    """What became of the arms of this process after Ctrl-C; empty: it controlled none."""
    if not _controlled:
        return ""
    if all(arm.connection.left_at_rest for arm in _controlled):
        return "the arm was stopped and is at rest"
    return "the arm was not seen at rest: stop it with `heptarm stop`, or with the emergency stop"


#: No target was given on the command line.
NO_TARGET = CommandTarget()

Json = Annotated[
    bool, Parameter(name="--json", group=COMMON, negative="", help="Print one JSON object per line.")
]
Degrees = Annotated[bool, Parameter(name="--deg", negative="", help="Angles are in degrees.")]
Speed = Annotated[float, Parameter(name="--speed", help="Fraction of the full speed, (0, 1].")]
Yes = Annotated[bool, Parameter(name="--yes", negative="", help="Do not ask before a real robot moves.")]
FrameOfPose = Annotated[
    str, Parameter(name="--frame", help='Frame of the pose: "base", or a taught frame such as /Table.')
]
DryRun = Annotated[
    bool,
    Parameter(
        name="--dry-run",
        negative="",
        help="Show how the motion would go, as heptarm plan does; move nothing.",
    ),
]


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """Options of every command that moves the arm."""

    yes: Yes = False
    target: CommandTarget = NO_TARGET
    as_json: Json = False

    def ask_first(self, arm: Arm, question: str) -> None:
        """Ask the person beside a real arm; nobody is asked about a virtual one, or after `--yes`.

        Raises:
            NotReady: the person does not agree.
        """
        if not (arm.is_virtual or self.yes or confirm(question)):
            raise NotReady("nothing was moved", hint="confirm the question, or give --yes")

    def consent(self, arm: Arm) -> Callable[[object], bool]:
        """What shows a plan, and asks a person before a real robot moves like that; it raises NotReady after a no."""

        def ask(plan: object) -> bool:
            print(plan, file=sys.stderr if self.as_json else sys.stdout, flush=True)
            self.ask_first(arm, f"Move the real {arm.robot.title} like this?")
            return True

        return ask


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
