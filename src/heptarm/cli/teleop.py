"""`heptarm teleop`: a second arm, a phone or an input device moves an arm, and episodes are recorded."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from cyclopts import Parameter

from heptarm.arm.arm import Arm
from heptarm.arm.motion.servo import ServoStats
from heptarm.cli.jog import DEVICES
from heptarm.cli.options import COMMON, Access, CommandTarget
from heptarm.cli.output import answer_of, emit
from heptarm.cli.record import numbers_of
from heptarm.devices.pose_stream import PORT, PoseDevice, pose_stream
from heptarm.errors import CommandRejected
from heptarm.record.episodes import Episode
from heptarm.skills.gripper import TwoSignalGripper
from heptarm.skills.pose_following import SPEED, LeaderArm, follow_poses
from heptarm.skills.teleoperation import JOINT_SPEED, teleoperate
from heptarm.values.camera import Camera
from heptarm.values.checks import integer, within
from heptarm.values.io import GripperWiring
from heptarm.values.text import counted
from heptarm.values.workspace import Workspace

_ACCESS = Access()
#: Address at which poses are received, unless another one is given.
_HOST = "127.0.0.1"


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
        str | None,
        Parameter(
            help="Address of this machine at which poses are received; 0.0.0.0: from everywhere. Default: 127.0.0.1."
        ),
    ] = None,
    scale: Annotated[
        float | None, Parameter(help="Movement of the follower per movement of leader or hand. Default: 1.")
    ] = None,
    speed: Annotated[
        float | None,
        Parameter(
            help=f"Ceiling of the joints' speeds, a fraction of their maxima. Default: {SPEED:g}, of a device "
            f"{JOINT_SPEED:g}."
        ),
    ] = None,
    clutch: Annotated[
        str,
        Parameter(help="Signal of the leader's IO that is held while the follower follows. Default: always."),
    ] = "",
    gripper: Annotated[
        str,
        Parameter(
            help='Signals of the follower\'s gripper: "open=OUTPUT close=OUTPUT is_open=INPUT is_closed=INPUT", those '
            'that are not named on the media flange; "scene": the gripper of a ready scene. Default: none.'
        ),
    ] = "",
    grip: Annotated[
        str,
        Parameter(
            help="Signal of the leader's IO whose press opens and closes the gripper. Devices and poses have a button."
        ),
    ] = "",
    tool: Annotated[
        str,
        Parameter(
            help="Tool on the follower's flange, of its project or saved target, attached meanwhile: its load and TCP."
        ),
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

    With a gripper the actions of an episode are the joints and the gripper, 1 open, 0 closed.
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
    _check_options(chosen[0], reflect=reflect, gripper=gripper, grip=grip)
    _check_effect(chosen[0], scale=scale, clutch=clutch, host=host)
    wiring = GripperWiring.of(gripper) if gripper else None
    box = None if not workspace else _box(workspace)
    target = access.target if follower is None else replace(access.target, text=follower)
    with ExitStack() as stack:
        arm = stack.enter_context(target.connect())
        access.ask_first(arm, f"Let the real {arm.robot.title} follow?")
        if tool:
            stack.enter_context(arm.tool(tool))
        fingers = None if wiring is None else TwoSignalGripper(arm, **asdict(wiring))
        if box is not None:
            arm.workspace = box
        guide: PoseDevice
        if device is not None:
            opened = DEVICES[device]()
            stack.callback(opened.close)
        elif poses is not None:
            guide = stream = stack.enter_context(pose_stream(poses, host=host or _HOST))
            _tell(f"waiting for poses at UDP port {stream.port}; hold clutch to move, quit ends", access)
        else:
            second = stack.enter_context(CommandTarget(text=leader).connect())
            access.ask_first(
                second, f"Make the real {second.robot.title} compliant? Somebody has to hold it."
            )
            guide = stack.enter_context(LeaderArm(second, clutch=clutch, gripper=grip, reflect=reflect))
            _tell("the leader is compliant; Ctrl-C ends", access)

        def move(acts: Callable[[object], bool] | None = None) -> ServoStats:
            if device is not None:
                return teleoperate(
                    arm,
                    opened,
                    gripper=fingers,
                    speed=JOINT_SPEED if speed is None else speed,
                    duration=limit,
                    while_true=acts,
                )
            return follow_poses(
                arm,
                guide,
                scale=1.0 if scale is None else scale,
                gripper=fingers,
                speed=SPEED if speed is None else speed,
                duration=limit,
                while_true=acts,
            )

        stats = []
        if record is None:
            stats.append(_moved(move))
        else:
            cameras = {"scene": Camera(size=(96, 96), rate=min(60.0, rate))} if camera else {}
            streams = {} if fingers is None else {"gripper": lambda: float(fingers.is_open)}
            recorded = stack.enter_context(
                arm.episodes(record, rate=rate, task=task, cameras=cameras, streams=streams)
            )
            for _ in range(integer(episodes, "episodes", 1, 100_000)):
                with recorded.episode() as episode:
                    acts = None if wiring is None else _acting(arm, wiring, episode)
                    stats.append(_moved(partial(move, acts)))
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
            print(f"{counted(len(stats), 'episode')} in {record}")
    return 0


def _check_options(source: str, *, reflect: float, gripper: str, grip: str) -> None:
    """Refuse options of a leader without one, and a gripper that no button moves.

    Raises:
        CommandRejected: there are such.
    """
    if reflect and source != "leader":
        raise CommandRejected(
            "reflect needs a leader that an FRI session moves", parameter="reflect", value=reflect
        )
    if grip and (source != "leader" or not gripper):
        raise CommandRejected(
            "grip needs a leader and a gripper that its signal moves",
            parameter="grip",
            value=grip,
            hint="devices and poses have a button for the gripper",
        )
    if gripper and source == "leader" and not grip:
        raise CommandRejected(
            "gripper needs grip, the leader's signal that opens and closes it",
            parameter="gripper",
            value=gripper,
            hint="for example --grip UserButton",
        )


def _check_effect(source: str, *, scale: float | None, clutch: str, host: str | None) -> None:
    """Refuse options that have no effect on what moves the arm: "leader", "device" or "poses".

    Raises:
        CommandRejected: there is one.
    """
    if scale is not None and source == "device":
        raise CommandRejected(
            "scale needs a leader or poses, whose movements it multiplies; a device gives speeds",
            parameter="scale",
            value=scale,
            hint="speed is the ceiling of the joints' speeds; heptarm jog --scale moves the arm slower by a device",
        )
    if clutch and source != "leader":
        raise CommandRejected(
            "clutch needs a leader, whose signal it is",
            parameter="clutch",
            value=clutch,
            hint="devices and poses have a button of their own",
        )
    if host is not None and source != "poses":
        raise CommandRejected(
            "host needs poses, which are received there",
            parameter="host",
            value=host,
            hint=f"for example --poses {PORT}",
        )


def _acting(arm: Arm, wiring: GripperWiring, episode: Episode) -> Callable[[object], bool]:
    """What records the commanded joints and gripper at each reading of the device."""

    def act(_: object) -> bool:
        state = arm.state
        episode.act([*np.where(np.isnan(state.q_cmd), state.q, state.q_cmd), float(arm.io[wiring.open])])
        return True

    return act


def _moved(move: Callable[[], ServoStats]) -> ServoStats | None:
    """Move until the end; Ctrl-C is one, too."""
    try:
        return move()
    except KeyboardInterrupt:
        return None


def _label(episode: Episode) -> None:
    """Ask the person for the label; on no terminal it stays open."""
    answer = answer_of("[s]uccess, [f]ailure or [d]iscard? ").lower()[:1]
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
