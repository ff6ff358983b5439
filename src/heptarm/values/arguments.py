"""What the makers of motions share: how their arguments become checked values."""

from __future__ import annotations

import numpy.typing as npt

from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.arrays import Array, array, fractions, within
from heptarm.values.limits import Blending, CartesianDynamics, JointDynamics
from heptarm.values.pose import Pose
from heptarm.values.redundancy import Redundancy

#: The frame that a tool moves: the attached tool's, without a tool the flange.
TOOL = "tool"

AXES = JointDynamics()
FREE = CartesianDynamics()
EXACT = Blending()

_LONGEST_NAME = 128
_PATH = (
    ("speed_mps", 10.0, "m/s"),
    ("acceleration_mps2", 100.0, "m/s²"),
    ("jerk_mps3", 1e4, "m/s³"),
    ("speed_radps", 20.0, "rad/s"),
    ("acceleration_radps2", 200.0, "rad/s²"),
    ("jerk_radps3", 2e4, "rad/s³"),
)


def seven(value: npt.ArrayLike | None, name: str) -> Array | None:
    """Joint positions, shape (7,) [rad], or None."""
    return None if value is None else array(value, 7, name)


def joints_of(
    velocity: npt.ArrayLike | None, acceleration: npt.ArrayLike | None, jerk: npt.ArrayLike | None
) -> JointDynamics:
    """Fractions of the axes' maxima; what is None keeps the default."""
    return JointDynamics(
        fractions(velocity, "speed"), fractions(acceleration, "acceleration"), fractions(jerk, "jerk")
    )


def path_of(*values: float | None) -> CartesianDynamics:
    """Limits along the path from velocity, acceleration, jerk [m/s ...], then [rad/s ...]."""
    return CartesianDynamics(
        *(
            within(value, name, 0.0, high, above=True, unit=unit)
            for value, (name, high, unit) in zip(values, _PATH, strict=True)
        )
    )


def blending_of(relative: float, distance: float, orientation: float) -> Blending:
    """Blending from a fraction, a distance [m] and an angle [rad]."""
    return Blending(
        within(relative, "blend_rel", 0.0, 1.0),
        within(distance, "blend_m", 0.0, 2.0, unit="m"),
        within(orientation, "blend_rad", 0.0, 6.3, unit="rad"),
    )


def check_pose(pose: Pose, parameter: str = "pose") -> None:
    """Refuse what is no pose."""
    if not isinstance(pose, Pose):
        raise ShapeError(
            f"{parameter} is {pose!r}; a Pose is wanted",
            parameter=parameter,
            value=pose,
            hint="build one with Pose.xyz_abc(x, y, z, a, b, c)",
        )


def near_of(near: Array | None, redundancy: Redundancy | None) -> Array | None:
    """Joint positions that choose the arm position, unless a redundancy does."""
    if near is not None and redundancy is not None:
        raise CommandRejected(
            "near and redundancy both choose the arm position", parameter="near", hint="give one of them"
        )
    if redundancy is not None and not isinstance(redundancy, Redundancy):
        raise ShapeError(f"redundancy is {redundancy!r}; a Redundancy is wanted", parameter="redundancy")
    return seven(near, "near")


def check_name(value: str, parameter: str) -> None:
    """Refuse what cannot be the name of a frame."""
    if not isinstance(value, str) or not 1 <= len(value.encode()) <= _LONGEST_NAME:
        raise ShapeError(
            f"{parameter} is {value!r}; the name of a frame is wanted, up to {_LONGEST_NAME} octets",
            code=3,
            parameter=parameter,
            value=value,
            hint='for example "tool" or "base"',
        )
