"""Arcs of circles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.arguments import (
    AXES,
    EXACT,
    FREE,
    TOOL,
    blending_of,
    check_name,
    check_pose,
    joints_of,
    near_of,
    path_of,
    seven,
)
from heptarm.values.arrays import Array, array, within
from heptarm.values.limits import Blending, CartesianDynamics, JointDynamics
from heptarm.values.orientation import VARIABLE, Orientation, orientation_of
from heptarm.values.pose import Pose, multiply, rotation
from heptarm.values.redundancy import Redundancy
from heptarm.values.trigger import Triggered

#: Points nearer to each other than this make no circle [m].
_TOO_NEAR = 1e-5
#: A longer arc ends too near to its start for three points to fix the circle [rad].
_LONGEST_ARC = 6.1
_PLANES = {"xy": (0.0, 0.0, 1.0), "yz": (1.0, 0.0, 0.0), "xz": (0.0, -1.0, 0.0)}


@dataclass(frozen=True, slots=True, eq=False)
class Circ(Triggered):
    """Arc of a circle of the moved frame through a point to a pose.

    Attributes:
        via: a point on the arc; its orientation does not count.
        end: target in the base frame.
        near: joint positions whose arm angle the target takes, shape (7,) [rad]; None: the present one's.
        redundancy: the arm position meant; given instead of `near`.
        moving: the moved frame.
        orientation: how the orientation is led.
        path: limits along the path.
        joints: fractions of the axes' maxima, as well.
        blending: into the following motion.

    Raises:
        CommandRejected: via and end are the same point.
    """

    via: Pose
    end: Pose
    near: Array | None = None
    redundancy: Redundancy | None = None
    moving: str = TOOL
    orientation: Orientation = VARIABLE
    path: CartesianDynamics = FREE
    joints: JointDynamics = AXES
    blending: Blending = EXACT

    def __post_init__(self) -> None:
        check_pose(self.via, "via")
        check_pose(self.end, "end")
        object.__setattr__(self, "near", near_of(self.near, self.redundancy))
        check_name(self.moving, "moving")
        if self.via.distance_to(self.end) < _TOO_NEAR:
            raise CommandRejected(
                "via and end are the same point; three different points make a circle",
                parameter="via",
                hint="give a point between start and end; arc(...) computes one",
            )

    def under(self, ceiling: float) -> Circ:
        """The same motion, no axis faster than that fraction of its maximum."""
        return replace(self, joints=self.joints.under(ceiling))


def circ(
    via: Pose,
    end: Pose,
    *,
    near: npt.ArrayLike | None = None,
    redundancy: Redundancy | None = None,
    moving: str = TOOL,
    orientation: str = "variable",
    reference: str = "base",
    speed_mps: float | None = None,
    acceleration_mps2: float | None = None,
    jerk_mps3: float | None = None,
    speed_radps: float | None = None,
    acceleration_radps2: float | None = None,
    jerk_radps3: float | None = None,
    joint_speed: npt.ArrayLike | None = None,
    joint_acceleration: npt.ArrayLike | None = None,
    joint_jerk: npt.ArrayLike | None = None,
    blend_rel: float = 0.0,
    blend_m: float = 0.0,
    blend_rad: float = 0.0,
) -> Circ:
    """Arc of a circle from where the moved frame is, through a point, to a pose.

    Args:
        via: a point on the arc between start and end; its orientation does not count.
        end: target of the moved frame in the base frame.
        near: see `lin`, as redundancy and moving.
        redundancy: see `lin`.
        moving: see `lin`.
        orientation: "variable": from the start's to the end's; "constant": the start's; "joint": as the joints
            would turn it in a PTP.
        reference: "base", or "path": the orientation is led relative to the tangent of the arc, so that
            "constant" turns the moved frame along with it.
        speed_mps: speed along the arc, see `lin`; the other limits as well.
        acceleration_mps2: see `lin`; along the arc and towards its centre.
        jerk_mps3: see `lin`.
        speed_radps: see `lin`.
        acceleration_radps2: see `lin`.
        jerk_radps3: see `lin`.
        joint_speed: see `lin`.
        joint_acceleration: see `lin`.
        joint_jerk: see `lin`.
        blend_rel: see `lin`.
        blend_m: see `lin`.
        blend_rad: see `lin`.

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
        CommandRejected: via and end coincide, an unknown word, or both `near` and `redundancy`.
    """
    return Circ(
        via,
        end,
        seven(near, "near"),
        redundancy,
        moving,
        orientation_of(orientation, reference),
        path_of(speed_mps, acceleration_mps2, jerk_mps3, speed_radps, acceleration_radps2, jerk_radps3),
        joints_of(joint_speed, joint_acceleration, joint_jerk),
        blending_of(blend_rel, blend_m, blend_rad),
    )


def arc(
    start: Pose,
    angle: float,
    *,
    centre: npt.ArrayLike,
    plane: str | npt.ArrayLike = "xy",
    near: npt.ArrayLike | None = None,
    redundancy: Redundancy | None = None,
    moving: str = TOOL,
    orientation: str = "variable",
    reference: str = "base",
    speed_mps: float | None = None,
    acceleration_mps2: float | None = None,
    jerk_mps3: float | None = None,
    speed_radps: float | None = None,
    acceleration_radps2: float | None = None,
    jerk_radps3: float | None = None,
    joint_speed: npt.ArrayLike | None = None,
    joint_acceleration: npt.ArrayLike | None = None,
    joint_jerk: npt.ArrayLike | None = None,
    blend_rel: float = 0.0,
    blend_m: float = 0.0,
    blend_rad: float = 0.0,
) -> Circ:
    """The circ that leads from a pose about a centre by an angle.

    Args:
        start: where the moved frame will be when the arc begins; its distance from the axis is the radius.
        angle: [rad], up to 6.1 either way, positive by the right hand about the plane's normal. A full circle
            is two arcs.
        centre: a point of the axis in the base frame, shape (3,) [m].
        plane: "xy", "yz" or "xz" of the base (normals z, x, and y backwards), or a normal, shape (3,).
        near: see `circ`; everything else as well. With reference="path" the end's orientation is the start's
            turned by the angle, otherwise the start's own.
        redundancy: see `circ`.
        moving: see `circ`.
        orientation: see `circ`.
        reference: see `circ`.
        speed_mps: see `circ`.
        acceleration_mps2: see `circ`.
        jerk_mps3: see `circ`.
        speed_radps: see `circ`.
        acceleration_radps2: see `circ`.
        jerk_radps3: see `circ`.
        joint_speed: see `circ`.
        joint_acceleration: see `circ`.
        joint_jerk: see `circ`.
        blend_rel: see `circ`.
        blend_m: see `circ`.
        blend_rad: see `circ`.

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
        CommandRejected: no such plane, the start lies on the axis, or the angle is 0.
    """
    check_pose(start, "start")
    angle = within(angle, "angle", -_LONGEST_ARC, _LONGEST_ARC, unit="rad")
    middle, axis = array(centre, 3, "centre"), normal_of(plane)
    lever = start.xyz - middle
    radius = float(np.linalg.norm(lever - (lever @ axis) * axis))
    if radius < _TOO_NEAR or abs(angle) * radius < _TOO_NEAR:
        raise CommandRejected(
            f"an arc of {angle:.6g} rad with a radius of {radius:.6g} m has no length",
            parameter="angle" if radius >= _TOO_NEAR else "centre",
            hint="move the centre away from the start, or give a greater angle",
        )
    follows = reference == "path"
    return circ(
        _turned(start, middle, axis, angle / 2, follows=follows),
        _turned(start, middle, axis, angle, follows=follows),
        near=near,
        redundancy=redundancy,
        moving=moving,
        orientation=orientation,
        reference=reference,
        speed_mps=speed_mps,
        acceleration_mps2=acceleration_mps2,
        jerk_mps3=jerk_mps3,
        speed_radps=speed_radps,
        acceleration_radps2=acceleration_radps2,
        jerk_radps3=jerk_radps3,
        joint_speed=joint_speed,
        joint_acceleration=joint_acceleration,
        joint_jerk=joint_jerk,
        blend_rel=blend_rel,
        blend_m=blend_m,
        blend_rad=blend_rad,
    )


def normal_of(plane: str | npt.ArrayLike) -> Array:
    """Unit normal of a plane: "xy", "yz" or "xz" of the base, or three numbers.

    Raises:
        CommandRejected: no such plane.
        ShapeError: three numbers without a direction.
    """
    if isinstance(plane, str):
        if plane not in _PLANES:
            raise CommandRejected(
                f"plane is {plane!r}; allowed is {', '.join(_PLANES)}, or a normal of three numbers",
                parameter="plane",
                value=plane,
            )
        return np.array(_PLANES[plane])
    normal = array(plane, 3, "plane")
    length = float(np.linalg.norm(normal))
    if length < 1e-9:
        raise ShapeError(
            f"plane is {plane!r}; a normal has a direction",
            parameter="plane",
            value=plane,
            hint='for example "xy"',
        )
    return normal / length


def _turned(pose: Pose, centre: Array, axis: Array, angle: float, *, follows: bool) -> Pose:
    turn = np.array([*(axis * sin(angle / 2)), cos(angle / 2)])
    quat = multiply(turn, pose.quat) if follows else pose.quat
    return Pose(centre + rotation(turn) @ (pose.xyz - centre), quat)
