"""`heptarm teleop`: a second arm, a phone or an input device moves an arm, and episodes are recorded."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from heptarm.arm.motion.servo import ServoStats
from heptarm.cli.jog import DEVICES
from heptarm.cli.options import COMMON, Access, CommandTarget
from heptarm.cli.output import emit
from heptarm.cli.record import numbers_of
from heptarm.devices.pose_stream import PORT, pose_stream
from heptarm.errors import CommandRejected
from heptarm.record.episodes import Episode
from heptarm.skills.pose_following import SPEED, LeaderArm, follow_poses
from heptarm.skills.teleoperation import teleoperate
from heptarm.values.camera import Camera
from heptarm.values.checks import integer, within
from heptarm.values.workspace import Workspace

_ACCESS = Access()


def teleop(
    *,
    leader: Annotated[
        str | None,
        Parameter(help="Target of a second arm that a person guides; it is compliant from the beginning."),
    ] = None,
    follower: Annotated[
        str | None, Parameter(group=COMMON, help="Target of the arm that follows; another word for --target.")
    ] = None,
    device: Annotated[
        Literal["keyboard", "gamepad", "spacemouse"] | None,
        Parameter(help="An input device instead of a leader."),
    ] = None,
    poses: Annotated[
        int | None,
        Parameter(
            help=f"UDP port for poses of a phone or a VR controller instead of a leader, such as {PORT}."
        ),
    ] = None,
    host: Annotated[
        str, Parameter(help="Address of this machine at which poses are received; 0.0.0.0: from everywhere.")
    ] = "127.0.0.1",
    scale: Annotated[float, Parameter(help="Movement of the follower per movement of the leader.")] = 1.0,
    speed: Annotated[
        float, Parameter(help="Ceiling of the joints' speeds, a fraction of their maxima.")
    ] = SPEED,
    clutch: Annotated[
        str,
        Parameter(help="Signal of the leader's IO that is held while the follower follows. Default: always."),
    ] = "",
    reflect: Annotated[
        float, Parameter(help="Fraction of the follower's force that the leader's hand feels, over FRI.")
    ] = 0.0,
    workspace: Annotated[
        str, Parameter(help="X,Y,Z,X,Y,Z: two corners of a box that the follower's tool stays in [m].")
    ] = "",
    record: Annotated[
        Path | None, Parameter(help="Folder to which episodes are recorded, see heptarm episodes.")
    ] = None,
    task: Annotated[str, Parameter(help="What is done, in words, for the episodes.")] = "",
    rate: Annotated[float, Parameter(help="Steps per second of an episode [Hz].")] = 20.0,
    camera: Annotated[
        bool,
        Parameter(negative="", help="Record pictures of a simulated camera, 96 x 96, with each episode."),
    ] = False,
    episodes: Annotated[int, Parameter(help="Episodes to record.")] = 1,
    seconds: Annotated[
        float | None,
        Parameter(name="--for", help="How long each lasts at most [s]. Default: until its end button."),
    ] = None,
    access: Access = _ACCESS,
) -> int:
    """Let an arm follow a second arm, a phone, a VR controller or an input device, and record episodes of it.

    For example:

        heptarm teleop --leader sim://iiwa7 --follower sim://iiwa14 --scale 0.5

        heptarm teleop --poses 30310 --target lab1 --record insert --task "Insert the peg" --episodes 20
    """
    limit = None if seconds is None else within(seconds, "for", 0.0, 86400.0, above=True, unit="s")
    chosen = [
        name
        for name, given in (("leader", leader), ("device", device), ("poses", poses))
        if given is not None
    ]
    if len(chosen) != 1:
        raise CommandRejected(
            f"there must be one of --leader, --device and --poses, got {', '.join(chosen) or 'none'}",
            parameter="leader",
        )
    if reflect and leader is None:
        raise CommandRejected(
            "reflect needs a leader that an FRI session moves", parameter="reflect", value=reflect
        )
    box = None if not workspace else _box(workspace)
    target = access.target if follower is None else replace(access.target, text=follower)
    with ExitStack() as stack:
        arm = stack.enter_context(target.connect())
        access.ask_first(arm, f"Let the real {arm.robot.title} follow?")
        if box is not None:
            arm.workspace = box
        move: Callable[[], ServoStats]
        if device is not None:
            opened = DEVICES[device]()
            stack.callback(opened.close)
            move = lambda: teleoperate(arm, opened, duration=limit)  # noqa: E731
        elif poses is not None:
            stream = stack.enter_context(pose_stream(poses, host=host))
            _tell(f"waiting for poses at UDP port {stream.port}; hold clutch to move, quit ends", access)
            move = lambda: follow_poses(arm, stream, scale=scale, speed=speed, duration=limit)  # noqa: E731
        else:
            guide = stack.enter_context(CommandTarget(text=leader).connect())
            access.ask_first(guide, f"Make the real {guide.robot.title} compliant? Somebody has to hold it.")
            guided = stack.enter_context(LeaderArm(guide, clutch=clutch, reflect=reflect))
            _tell("the leader is compliant; Ctrl-C ends", access)
            move = lambda: follow_poses(arm, guided, scale=scale, speed=speed, duration=limit)  # noqa: E731
        stats = []
        if record is None:
            stats.append(_moved(move))
        else:
            cameras = {"scene": Camera(size=(96, 96), rate=min(60.0, rate))} if camera else {}
            recorded = stack.enter_context(arm.episodes(record, rate=rate, task=task, cameras=cameras))
            for _ in range(integer(episodes, "episodes", 1, 100_000)):
                with recorded.episode() as episode:
                    stats.append(_moved(move))
                    _label(episode)
    if access.as_json:
        emit(
            {
                "episodes": 0 if record is None else len(stats),
                "streams": [asdict(found) for found in stats if found],
            }
        )
    else:
        for found in stats:
            if found is not None:
                print(found)
        if record is not None:
            print(f"{len(stats)} episodes in {record}")
    return 0


def _moved(move: Callable[[], ServoStats]) -> ServoStats | None:
    """Move until the end; Ctrl-C is one, too."""
    try:
        return move()
    except KeyboardInterrupt:
        return None


def _label(episode: Episode) -> None:
    """Ask the person for the label; on no terminal it stays open."""
    if not sys.stdin.isatty():
        return
    answer = input("[s]uccess, [f]ailure or [d]iscard? ").strip().lower()[:1]
    if answer == "s":
        episode.succeed()
    elif answer == "f":
        episode.fail()
    elif answer == "d":
        episode.discard()


def _tell(text: str, access: Access) -> None:
    if not access.as_json:
        print(text, flush=True)


def _box(text: str) -> Workspace:
    """The workspace of two corners.

    Raises:
        CommandRejected: the text has other numbers.
    """
    form = "X,Y,Z,X,Y,Z in metres, such as 0.4,-0.3,0.2,0.7,0.3,0.6"
    found = numbers_of(text, "workspace", ",", float, form=form)
    return Workspace((found[:3], found[3:]))
