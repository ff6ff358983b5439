"""Short forms of the plant's motions, for tests."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan
from typing import TypedDict

from typing_extensions import Unpack

from heptarm.planning import seam
from heptarm.values.motion.hand_guiding import HandGuide

Numbers = Sequence[float]
_OPEN = (nan,) * 7


class Limits(TypedDict, total=False):
    """What a motion allows: fractions of the joints' maxima, and limits along its path."""

    joint_velocity: Numbers
    joint_acceleration: Numbers
    joint_jerk: Numbers
    velocity: float
    acceleration: float
    jerk: float
    orientation_velocity: float
    orientation_acceleration: float
    orientation_jerk: float
    blending: tuple[float, float, float]
    orientation: tuple[str, str]


def joint_dynamics(given: Limits) -> seam.JointDynamics:
    names = ("velocity", "acceleration", "jerk")
    return seam.JointDynamics(**{one: tuple(given.get(f"joint_{one}", _OPEN)) for one in names})  # type: ignore[arg-type]


def path_dynamics(given: Limits) -> seam.CartesianDynamics:
    names = seam.CartesianDynamics.__slots__
    return seam.CartesianDynamics(**{one: given[one] for one in names if one in given})  # type: ignore[literal-required]


def _blending(given: Limits) -> seam.Blending:
    relative, distance, orientation = given.get("blending", (0.0, 0.0, 0.0))
    return seam.Blending(relative=relative, distance=distance, orientation=orientation)


def _orientation(given: Limits) -> seam.Orientation:
    kind, reference = given.get("orientation", ("variable", "base"))
    return seam.Orientation(
        type=seam.OrientationType[kind.upper()], reference=seam.OrientationReference[reference.upper()]
    )


def place(numbers: Numbers) -> seam.Pose:
    """A pose: x y z, quaternion."""
    return seam.Pose(xyz=tuple(numbers[:3]), quat=tuple(numbers[3:]))


def redundant(e1: float = nan, status: int = -1, turn: int = -1) -> seam.Redundancy:
    return seam.Redundancy(e1=e1, status=status, turn=turn)


def ptp(q: Numbers, **limits: Unpack[Limits]) -> seam.Ptp:
    return seam.Ptp(q=tuple(q), dynamics=joint_dynamics(limits), blending=_blending(limits))


def ptp_pose(
    pose: Numbers, redundancy: tuple[float, int, int] = (nan, -1, -1), **limits: Unpack[Limits]
) -> seam.PtpPose:
    return seam.PtpPose(
        target=place(pose),
        redundancy=redundant(*redundancy),
        dynamics=joint_dynamics(limits),
        blending=_blending(limits),
    )


def lin(
    pose: Numbers, redundancy: tuple[float, int, int] = (nan, -1, -1), **limits: Unpack[Limits]
) -> seam.Lin:
    return seam.Lin(
        target=place(pose),
        redundancy=redundant(*redundancy),
        dynamics=path_dynamics(limits),
        joints=joint_dynamics(limits),
        blending=_blending(limits),
        orientation=_orientation(limits),
    )


def lin_rel(offset: Numbers, axes: Numbers | None = None, **limits: Unpack[Limits]) -> seam.LinRel:
    return seam.LinRel(
        offset=place(offset),
        axes=None if axes is None else tuple(axes),
        dynamics=path_dynamics(limits),
        joints=joint_dynamics(limits),
        blending=_blending(limits),
        orientation=_orientation(limits),
    )


def circ(via: Numbers, end: Numbers, **limits: Unpack[Limits]) -> seam.Circ:
    return seam.Circ(
        via=place(via),
        end=place(end),
        redundancy=redundant(),
        dynamics=path_dynamics(limits),
        joints=joint_dynamics(limits),
        blending=_blending(limits),
        orientation=_orientation(limits),
    )


def spl(pose: Numbers, **limits: Unpack[Limits]) -> seam.Spl:
    return seam.Spl(
        target=place(pose),
        dynamics=path_dynamics(limits),
        joints=joint_dynamics(limits),
        orientation=_orientation(limits),
    )


def spline(*segments: seam.PlantMotion) -> seam.Spline:
    return seam.Spline(segments=segments)


def spline_joints(*points: seam.PlantMotion) -> seam.JointSpline:
    return seam.JointSpline(points=points)


def batch(*motions: seam.PlantMotion) -> seam.Batch:
    return seam.Batch(motions=motions)


def hold(duration: float = nan) -> seam.Hold:
    return seam.Hold(duration=duration)


def servo(timing: seam.ServoTiming | None = None, **limits: Unpack[Limits]) -> seam.ServoSmart:
    return seam.ServoSmart(timing=timing or seam.ServoTiming(), dynamics=joint_dynamics(limits))


def direct(timing: seam.ServoTiming | None = None, **limits: Unpack[Limits]) -> seam.ServoDirect:
    return seam.ServoDirect(timing=timing or seam.ServoTiming(), dynamics=joint_dynamics(limits))


def straight(
    timing: seam.ServoTiming | None = None,
    velocity: Numbers = (nan,) * 6,
    acceleration: Numbers = (nan,) * 6,
    axes: Numbers | None = None,
) -> seam.ServoStraight:
    return seam.ServoStraight(
        timing=timing or seam.ServoTiming(),
        velocity=tuple(velocity),
        acceleration=tuple(acceleration),
        axes=None if axes is None else tuple(axes),
    )


def guide(limits: HandGuide) -> seam.HandGuide:
    return seam.HandGuide(
        q_min=tuple(limits.q_min.tolist()),
        q_max=tuple(limits.q_max.tolist()),
        joint_velocity=limits.joint_velocity,
        cartesian_velocity=limits.cartesian_velocity,
        freezes_all=limits.at_limit == "all",
        pulls_back=limits.outside == "pull",
    )
