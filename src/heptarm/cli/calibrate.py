"""`heptarm calibrate`: measure the tip of a tool, the load on the flange, and the arm itself."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from heptarm import calibration
from heptarm.arm.arm import Arm
from heptarm.arm.link.target import target_from_env
from heptarm.calibration.excitation import REACH
from heptarm.calibration.excitation import SECONDS as EXCITED
from heptarm.calibration.excitation import SPEED as FASTEST
from heptarm.calibration.load_motion import SECONDS, SPEED
from heptarm.calibration.proposal import RATE
from heptarm.calibration.tip import TOLERANCE
from heptarm.calibration.touching import TOUCHES
from heptarm.cli.options import Access, CommandTarget, Model
from heptarm.cli.output import emit
from heptarm.errors import CommandRejected
from heptarm.io.targets import saved_target
from heptarm.model.kinematics import forward
from heptarm.panel.points import PointList
from heptarm.sim.collision import CollisionModel
from heptarm.values.files import read_text, writable_file
from heptarm.values.mode.compliance import compliance
from heptarm.values.motion.hand_guiding import hand_guide
from heptarm.values.motion.motion import hold
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel, robot
from heptarm.values.tool import KnownTool, Tool

_ACCESS = Access()
#: Longest time in which a person guides the arm to a pose [s].
_GUIDED = 600.0

Save = Annotated[
    str,
    Parameter(
        name="--save",
        help="Save the result as this tool of the saved target. Default: it is only printed.",
    ),
]


def tcp(
    *,
    poses: Annotated[int, Parameter(help="Number of poses about the fixed point.")] = 6,
    along: Annotated[
        str,
        Parameter(
            help="Two axes of the tool such as z,x: two more poses, in which the fixed point touches these axes, give "
            "the orientation. Default: that of the flange."
        ),
    ] = "",
    guide: Annotated[
        Literal["none", "hand", "compliance"],
        Parameter(
            help="How the arm gets to a pose. none: you jog it at the smartPAD, in the panel or by another program; "
            "hand: by the hand guiding device; compliance: it is compliant between the poses."
        ),
    ] = "none",
    points: Annotated[
        Path | None,
        Parameter(help="File of taught points that the panel has saved: computed from them, without an arm."),
    ] = None,
    model: Annotated[Model, Parameter(help="Robot of --points, with its media flange.")] = "iiwa14",
    tolerance: Annotated[
        float, Parameter(help="The most by which a pose may miss the fixed point [m].")
    ] = TOLERANCE,
    frame: Annotated[str, Parameter(help="Frame of the tool that the tip becomes.")] = "tcp",
    surface: Annotated[
        str,
        Parameter(
            help="The arm touches this surface instead, a level plane or a sphere: plane:X,Y,Z or sphere:X,Y,Z,RADIUS "
            "in the base [m]. Begin with the tip 2 to 50 mm over it, and a tool frame near the tip."
        ),
    ] = "",
    tip_radius: Annotated[
        float, Parameter(help="Radius of a round tip, whose middle is found; with --surface [m].")
    ] = 0.0,
    touches: Annotated[int, Parameter(help="Number of contacts with --surface.")] = TOUCHES,
    dry_run: Annotated[
        bool,
        Parameter(name="--dry-run", negative="", help="Show what would move with --surface; move nothing."),
    ] = False,
    save: Save = "",
    access: Access = _ACCESS,
) -> int:
    """Measure the tip of a tool: bring it to one fixed point in several poses, and confirm each; or touch a surface.

    For example:

        heptarm calibrate tcp --target lab1

        heptarm calibrate tcp --along z,x --guide compliance --save gripper --target lab1

        heptarm calibrate tcp --points points.json

        heptarm calibrate tcp --surface plane:0.6,0,0.2 --tip-radius 0.004 --save pen --target lab1
    """
    axes = tuple(part.strip() for part in along.split(",")) if along else ()
    if len(axes) not in (0, 2):
        raise CommandRejected(
            f"along must be two axes of the tool, got {along!r}", parameter="along", hint="for example z,x"
        )
    if points is not None and (axes or guide != "none"):
        raise CommandRejected(
            "points are computed without an arm, so along and guide have no effect with them",
            parameter="points",
            hint="leave them out, or use calibration.tcp(..., along=...) in Python",
        )
    if surface and (axes or guide != "none" or points is not None):
        raise CommandRejected(
            "the arm touches a surface by itself, so along, guide and points have no effect with it",
            parameter="surface",
            value=surface,
            hint="leave them out",
        )
    if not surface and (tip_radius or dry_run):
        raise CommandRejected(
            "tip-radius and dry-run are of a surface that the arm touches",
            parameter="surface",
            hint="give --surface, or leave them out",
        )
    target, place = access.target, saved_as(save, access.target)
    old: Tool | KnownTool | str
    if surface:
        known = calibration.KnownSurface.parse(surface)
        with target.connect(control=not dry_run, state_rate=RATE) as arm:
            plan = calibration.touch_plan(arm, known, tip_radius=tip_radius, touches=touches)
            if dry_run:
                print(plan)
                return 0
            found = calibration.touch_tcp(arm, plan=plan, confirm=access.consent(arm), tolerance=tolerance)
            old = arm.tools.get(save, save)
    elif points is not None:
        taught = _taught(points, robot(model))
        found = calibration.tcp(taught, tolerance=tolerance)
        saved = saved_target(place) if place else None
        named = {tool.name: tool for tool in saved.tools} if saved is not None else {}
        old = named.get(save, save)
    else:
        with target.connect(control=guide != "none") as arm, _guiding(arm, guide) as confirm:
            about = calibration.record_poses(arm, count=poses, confirm=confirm)
            extra = {}
            for axis in axes:
                what = f"let the fixed point touch the {axis} axis of the tool"
                (extra[axis],) = calibration.record_poses(arm, count=1, confirm=_asking(confirm, what))
            old = arm.tools.get(save, save)
        found = calibration.tcp(about, along=extra or None, tolerance=tolerance)
    if place:
        found.save(place, old, frame=frame)
    if access.as_json:
        emit(
            {"tcp": found.pose.array.tolist(), "sigma_m": found.sigma.tolist(), "point": found.point.tolist()}
            | {"sigma_rad": found.sigma_angle, "residuals_m": found.residuals.tolist(), "worst": found.worst}
            | {"suspect": found.is_suspect, "saved": bool(place)}
        )
    else:
        print(found)
        print(outcome("tool", save, place))
    return 0


def load(
    *,
    inertia: Annotated[
        bool,
        Parameter(negative="", help="Measure the inertia, too: A4 to A7 swing by 8 degrees at each rest."),
    ] = False,
    speed: Annotated[float, Parameter(help="Fraction of the full speed, (0, 1].")] = SPEED,
    seconds: Annotated[float, Parameter(help="Time of each rest [s].")] = SECONDS,
    dry_run: Annotated[
        bool, Parameter(name="--dry-run", negative="", help="Show what would move; move nothing.")
    ] = False,
    save: Save = "",
    access: Access = _ACCESS,
) -> int:
    """Measure mass and centre of mass of what is on the flange, and compare them with the load data in use.

    A4 to A7 move to nine postures around the present one, and back; what moves is shown first.

    For example:

        heptarm calibrate load --target lab1

        heptarm calibrate load --inertia --save gripper --target lab1
    """
    place = saved_as(save, access.target)
    with access.target.connect(control=not dry_run, state_rate=RATE) as arm:
        plan = calibration.load_plan(
            arm, excitation="full" if inertia else "rests", speed=speed, seconds=seconds
        )
        if dry_run:
            print(plan)
            return 0
        found = calibration.load(arm, plan=plan, confirm=access.consent(arm))
        old = arm.tools.get(save, save)
    if place:
        found.save(place, old)
    if access.as_json:
        emit(
            {"mass_kg": found.mass, "sigma_kg": found.sigma_mass, "declared_kg": found.declared.mass}
            | {"com_m": found.com.tolist(), "sigma_com_m": found.sigma_com.tolist()}
            | {"inertia": found.inertia.tolist(), "sigma_inertia": found.sigma_inertia.tolist()}
            | {"offset_nm": found.offset.tolist(), "agrees": found.is_as_declared, "saved": bool(place)}
        )
    else:
        print(found)
        print(outcome("tool", save, place))
    return 0


def arm(
    run: Annotated[
        Path | None,
        Parameter(
            help="Recording of the arm, computed without one. Default: the arm moves, and is recorded to --record."
        ),
    ] = None,
    *,
    validate: Annotated[
        Path | None,
        Parameter(help="Another recording, of other motions, that the result has to predict."),
    ] = None,
    fri: Annotated[
        Path | None,
        Parameter(
            help="Recording of FRI sessions that move the arm, for their delay. Default: those of RUN."
        ),
    ] = None,
    fri_period: Annotated[
        int,
        Parameter(
            help="An FRI session with this period swings A7 at last, so that the delay of FRI commands is found, "
            "1 to 10 [ms]; 0: there is none."
        ),
    ] = 0,
    record: Annotated[Path, Parameter(help="File of the recording.")] = Path("excitation.mcap"),
    seconds: Annotated[float, Parameter(help="Least duration of the motions [s].")] = EXCITED,
    speed: Annotated[float, Parameter(help="Fraction of the full speed, (0, 1].")] = FASTEST,
    reach: Annotated[float, Parameter(help="The most by which an axis moves from here [rad].")] = REACH,
    model: Annotated[str, Parameter(help="Robot of RUN. Default: that of the recording.")] = "",
    commissioning: Annotated[
        Path | None, Parameter(help="JSON report of heptarm check --commission: what differs is kept.")
    ] = None,
    save: Annotated[
        Path | None,
        Parameter(
            name="--save",
            help="File for the result, for sim://MODEL?fitted=FILE. Default: it is only printed.",
        ),
    ] = None,
    overwrite: Annotated[bool, Parameter(negative="", help="Replace files that exist.")] = False,
    dry_run: Annotated[
        bool, Parameter(name="--dry-run", negative="", help="Show what would move; move nothing.")
    ] = False,
    access: Access = _ACCESS,
) -> int:
    """Identify the arm: friction, stiffness, rotors, errors of its sensors, delay of states and of FRI commands.

    All axes move around the present posture, and back; what moves is shown first. Bodies that would touch are looked
    for among the arm and the floor only.

    For example:

        heptarm calibrate arm --target lab1 --save my-arm.toml

        heptarm calibrate arm --fri-period 2 --target lab1 --save my-arm.toml

        heptarm calibrate arm run.mcap --validate other.mcap --save my-arm.toml
    """
    if save is not None:
        writable_file(save, overwrite=overwrite, name="save")
    if run is None:
        with access.target.connect(control=not dry_run, state_rate=RATE) as one:
            world = CollisionModel(one.robot.name)
            plan = calibration.excitation(
                one,
                seconds=seconds,
                speed=speed,
                reach=reach,
                collision_check=world,
                fri_period_ms=fri_period,
            )
            if dry_run:
                print(plan)
                return 0
            run = calibration.record_excitation(
                one, record, plan=plan, confirm=access.consent(one), overwrite=overwrite
            )
            declared = one.load
    else:
        declared = None
    found = calibration.simulator(
        run,
        robot=model or None,
        validation=validate,
        fri=fri,
        declared=declared,
        commissioning=commissioning,
    )
    if save is not None:
        found.save(save, overwrite=overwrite)
    if access.as_json:
        emit(
            {
                numbers.name: {"value": numbers.value.tolist(), "sigma": numbers.sigma.tolist()}
                for numbers in found.arm.numbers
            }
            | {"ratio": found.validation.ratio.tolist(), "contradictions": list(found.arm.contradictions)}
            | {"fri_cycles": None if found.fri is None else found.fri.cycles}
            | {"remarks": list(found.remarks), "saved": "" if save is None else str(save)}
        )
    else:
        print(found)
        print("nothing is saved; --save FILE does" if save is None else f"saved as {save}")
    return 0


def saved_as(name: str, target: CommandTarget) -> str:
    """Name of the saved target that gets a tool or a camera; empty: nothing is to be saved.

    Raises:
        CommandRejected: the target is not a saved one, so that nothing could be saved: before anything moves.
    """
    if not name:
        return ""
    Tool(name)  # the name is checked before anything is measured
    text = target_from_env() if target.text is None else target.text
    if saved_target(text) is None:
        raise CommandRejected(
            f"{text} is not a saved target, so that nothing can be saved with it",
            parameter="save",
            value=name,
            hint="heptarm targets add NAME ADDRESS, then --target NAME",
        )
    return text


def outcome(what: str, name: str, place: str) -> str:
    """What became of a result: a "tool" or a "camera" of a name, in the entry of a place, a saved target, if any."""
    if place:
        return f"saved as the {what} {name} of {place}"
    return f"nothing is changed; --save {what.upper()} saves it with a saved target"


def _taught(file: Path, model: RobotModel) -> list[Pose]:
    """Poses of the flange of the points in a file of the panel."""
    points = PointList(model)
    points.load(read_text(file, name="points"))
    return [Pose.from_matrix(forward(model, point.q)) for point in points]


@contextmanager
def _guiding(arm: Arm, guide: str) -> Iterator[Callable[[str], bool]]:
    """What asks the person for the next pose, while the arm can be moved as the person chose."""
    if guide == "compliance":
        arm.verify_load()  # a compliant arm sinks under a load that it does not know

    def confirm(text: str) -> bool:
        if guide == "none":
            return _ask(text)
        motion, mode = (hand_guide(), None) if guide == "hand" else (hold(_GUIDED), compliance("xyzabc"))
        if guide == "compliance" and not _ask(f"{text}; Enter makes the arm compliant"):
            return False
        handle = arm.start(motion, mode=mode, when="reject")
        try:
            return _ask(text)
        finally:
            handle.cancel()
            arm.wait_for_rest()

    yield confirm


def _asking(confirm: Callable[[str], bool], what: str) -> Callable[[str], bool]:
    """What asks for something else than a pose about the tip."""
    return lambda _: confirm(f"{what}, not its tip")


def _ask(text: str) -> bool:
    """Show what to do, and wait for Enter; q, or the end of the input, gives up."""
    print(f"{text} [Enter; q gives up] ", end="", file=sys.stderr, flush=True)
    line = sys.stdin.readline()
    return bool(line) and line.strip().lower() not in ("q", "quit")
