"""`heptarm plan`: how a motion would go, without moving anything; also what `heptarm move --dry-run` prints."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter

from heptarm.cli.options import NO_TARGET, CommandTarget, Degrees, FrameOfPose, Json, Overwrite, Speed
from heptarm.cli.output import emit
from heptarm.errors import ShapeError
from heptarm.planning.constraints import constraint_from_text
from heptarm.planning.search import TIMEOUT
from heptarm.values.frames import BASE
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.motion.motion import Motion
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose

if TYPE_CHECKING:
    from heptarm.arm.motion.preview import ProgramPreview

Metres = Annotated[float, Parameter(help="Along this axis [m].")]
Turn = Annotated[
    float, Parameter(help="Rotation [rad], with --deg [deg]: a about z, then b about y, then c about x.")
]
Axis = Annotated[float, Parameter(help="Position of this joint [rad], with --deg [deg].")]


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class PlanOptions:
    """Options of every `heptarm plan`."""

    degrees: Degrees = False
    speed: Speed = 0.1
    scene: Annotated[
        str,
        Parameter(help="Bodies to keep clear of, or to find a path around: a ready scene, or a file (MJCF)."),
    ] = ""
    box: Annotated[
        tuple[str, ...],
        Parameter(help="Likewise this fixed box: X,Y,Z,LENGTH,WIDTH,HEIGHT [m]; may be repeated."),
    ] = ()
    out: Annotated[
        Path | None, Parameter(name=["--out", "-o"], help="Write a figure: .png, .svg, .pdf or .html.")
    ] = None
    overwrite: Overwrite = False
    show: Annotated[
        bool,
        Parameter(negative="", help="Show it in an open panel, otherwise as a figure in the web browser."),
    ] = False
    target: CommandTarget = NO_TARGET
    as_json: Json = False


_OPTIONS = PlanOptions()


def plan_ptp(
    a1: Axis,
    a2: Axis,
    a3: Axis,
    a4: Axis,
    a5: Axis,
    a6: Axis,
    a7: Axis,
    /,
    *,
    options: PlanOptions = _OPTIONS,
) -> int:
    """Point to point, to seven joint positions [rad].

    For example:

        heptarm plan ptp 0 30 0 -90 0 60 0 --deg --speed 0.5 --target lab1
    """
    return _plan(ptp(_angles((a1, a2, a3, a4, a5, a6, a7), options)), options)


def plan_lin(
    x: Metres,
    y: Metres,
    z: Metres,
    a: Turn,
    b: Turn,
    c: Turn,
    /,
    *,
    frame: FrameOfPose = BASE,
    options: PlanOptions = _OPTIONS,
) -> int:
    """Straight line to a pose: x y z [m], a b c about z y x [rad], in the base or a taught frame.

    For example:

        heptarm plan lin 0.5 0 0.4 180 0 180 --deg --scene table --target lab1
    """
    return _plan(lin(Pose.xyz_abc(x, y, z, *_angles((a, b, c), options)), frame=frame), options)


def plan_lin_rel(
    *,
    x: Metres = 0.0,
    y: Metres = 0.0,
    z: Metres = 0.0,
    a: Turn = 0.0,
    b: Turn = 0.0,
    c: Turn = 0.0,
    frame: Annotated[str, Parameter(help='Whose axes: "tool" or "base".')] = "tool",
    options: PlanOptions = _OPTIONS,
) -> int:
    """Straight line by an offset [m], [rad].

    For example:

        heptarm plan lin-rel --z -0.05 --frame base --out plan.png --target lab1
    """
    return _plan(lin_rel(x, y, z, *_angles((a, b, c), options), frame=frame), options)


def plan_to(
    goal: Annotated[
        tuple[float, ...],
        Parameter(
            help="Seven joint positions [rad]; or a pose of the tool frame in the base, with any elbow: x y z [m], "
            "a b c [rad]. Angles with --deg [deg]."
        ),
    ],
    /,
    *,
    seed: Annotated[int, Parameter(help="Of the search: the same seed finds the same path.")] = 0,
    timeout: Annotated[float, Parameter(help="Longest search [s].")] = TIMEOUT,
    tcp_speed: Annotated[
        float | None, Parameter(help="Largest speed of the tool frame on the path [m/s].")
    ] = None,
    improve: Annotated[
        int,
        Parameter(help="Joint positions that the search reaches after a path was found, for faster paths."),
    ] = 0,
    keep: Annotated[
        tuple[str, ...],
        Parameter(
            help="Constraint along the path as in Python, such as \"Upright('z', within=0.3)\", OnPlane(...), "
            "OnLine(...) or Workspace(...) [m], [rad]; may be repeated."
        ),
    ] = (),
    options: PlanOptions = _OPTIONS,
) -> int:
    """Around the bodies of --scene and --box, to joint positions or a pose.

    For example:

        heptarm plan to 0.5 0.3 0.4 180 0 180 --deg --scene shelf --target lab1
    """
    from heptarm.sim.collision import CollisionModel

    if len(goal) not in (6, 7):
        raise ShapeError(
            f"goal must be seven joint positions or the six numbers of a pose, got {len(goal)} numbers",
            parameter="goal",
            hint="for example heptarm plan to 0 30 0 -90 0 60 0 --deg",
        )
    angles = _angles(goal if len(goal) == 7 else goal[3:], options)
    to = np.array(angles) if len(goal) == 7 else Pose.xyz_abc(*goal[:3], *angles)
    kept = [constraint_from_text(one) for one in keep]
    with options.target.connect(control=False) as arm:
        world = CollisionModel(arm.robot.name, scene=options.scene, boxes=options.box)
        path = arm.find_path(
            to,
            avoid=world,
            keep=kept,
            speed=options.speed,
            tcp_speed=tcp_speed,
            timeout=timeout,
            improve=improve,
            seed=seed,
        )
        preview = arm.plan(path, speed=options.speed)
    found = {
        "path": str(path),
        "points": [point.q.tolist() for point in path.points],
        "clearance_m": None if path.clearance is None else path.clearance.distance,
        "states": path.stats.states,
        "seconds": path.stats.seconds,
    }
    return _show(preview, options, found)


def _angles(values: tuple[float, ...], options: PlanOptions) -> list[float]:
    return [float(value) for value in (np.radians(values) if options.degrees else values)]


def _plan(motion: Motion, options: PlanOptions) -> int:
    """Look ahead and print it."""
    with options.target.connect(control=False) as arm:
        check = None
        if options.scene or options.box:
            from heptarm.sim.collision import CollisionModel

            check = CollisionModel(arm.robot.name, scene=options.scene, boxes=options.box)
        preview = arm.plan(motion, speed=options.speed, collision_check=check)
    return _show(preview, options, {})


def _show(preview: ProgramPreview, options: PlanOptions, found: dict[str, Any]) -> int:
    """Print a preview behind what was found, and draw it; the exit code is 1 if bodies would touch."""
    written: dict[str, Any] = {}
    if options.out is not None:
        written = {"file": str(preview.chart().save(options.out, overwrite=options.overwrite))}
    if options.show:
        preview.show()
    if options.as_json:
        emit(found | preview_data(preview) | written)
    else:
        print(*([found["path"]] if found else []), preview, *written.values(), sep="\n")
    return 1 if preview.collisions else 0


def preview_data(preview: ProgramPreview) -> dict[str, Any]:
    """A preview as plain data, SI."""
    closest = {name: preview.closest(name) for name in ("position", "velocity", "acceleration", "torque")}
    return {
        "duration_s": preview.duration,
        "length_m": preview.length,
        "end_q": preview.q[-1].tolist(),
        "end_xyz": preview.end.xyz.tolist(),
        "end_quat": preview.end.quat.tolist(),
        "closest": {
            name: {"axis": place.axis, "fraction": place.fraction, "t_s": place.t}
            for name, place in closest.items()
        },
        "checked": preview.is_checked,
        "collisions": [
            {
                "first": touch.clearance.first,
                "second": touch.clearance.second,
                "t_s": touch.t,
                "motion": touch.motion,
            }
            for touch in preview.collisions
        ],
    }
