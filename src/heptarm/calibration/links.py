"""Kinematic calibration: joint offsets and errors of the links, from points of the tip that were measured from outside.

The unknowns are the pose of the measuring device, the tip, and of each joint an offset, an error of its origin and a
tilt of its axis (Hayati, Mirmirani, "Improving the absolute positioning accuracy of robot manipulators", 1985, for
joints that are parallel). What points cannot tell apart, the accuracy of manufacture as prior knowledge decides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.checks import Array, Value, array, finite_entries, frozen, instance, numbers, within
from heptarm.values.robot import RobotModel, robot
from heptarm.values.text import lines

_AXES = 7
#: Directions of the axes of A1 to A7 in the base of the stretched arm.
_DIRECTIONS = np.array(
    [[0, 0, 1], [0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, 1], [0, 1, 0], [0, 0, 1]], dtype=float
)
#: Places of the unknowns: pose of the measuring device (m, rad), tip (m), offsets (rad), origins (m), tilts (rad).
_DEVICE, _TIP, _OFFSETS, _ORIGINS, _TILTS = (
    slice(0, 6),
    slice(6, 9),
    slice(9, 16),
    slice(16, 37),
    slice(37, 51),
)
_COUNT = 51
#: Prior standard deviations: accuracy of manufacture, of an origin [m] and of an axis [rad]; of a mastered joint [rad].
ORIGIN, TILT, OFFSET = 3e-4, 5e-4, 0.02
#: Fewest points, and least noise of them that is assumed [m].
FEWEST, _LEAST_NOISE = 20, 1e-7
#: An offset is known from this fraction of what is known before on.
_KNOWN = 0.5
_STEPS = 6
#: What is known better than this is not estimated; step of a derivative [m], [rad].
_FIXED, _STEP = 1e-8, 1e-7


@dataclass(frozen=True, slots=True, eq=False)
class KinematicFit(Value):
    """Errors of an arm's kinematics.

    Attributes:
        robot: the robot.
        offset: added to a measured joint position it is the true one, shape (7,) [rad].
        sigma_offset: standard deviations, shape (7,) [rad].
        origin: errors of the joints' origins in the axes of the link before, shape (7, 3) [m].
        sigma_origin: standard deviations, shape (7, 3) [m].
        tilt: turns of the joints' axes about the two directions across them, shape (7, 2) [rad].
        sigma_tilt: standard deviations, shape (7, 2) [rad].
        tip: in the flange frame, shape (3,) [m].
        before: root mean square distance of the points from the nominal arm, best placed [m].
        after: from the calibrated one [m].
    """

    robot: RobotModel
    offset: Array
    sigma_offset: Array
    origin: Array
    sigma_origin: Array
    tilt: Array
    sigma_tilt: Array
    tip: Array
    before: float
    after: float

    @property
    def is_known(self) -> npt.NDArray[np.bool_]:
        """Which offsets the points determine, shape (7,): not that of A1 without the device's pose, for example."""
        return np.asarray(self.sigma_offset < _KNOWN * OFFSET)

    def __str__(self) -> str:
        """Offsets with their standard deviations, and how much better the points fit."""
        pairs = zip(self.offset, self.sigma_offset, self.is_known, strict=True)
        offsets = [
            f"{np.degrees(angle):.3f} ± {np.degrees(sigma):.3f}" if known else "not known"
            for angle, sigma, known in pairs
        ]
        rows = {
            "offsets": "  ".join(offsets) + " deg",
            "origins": f"up to {1e3 * np.abs(self.origin).max():.2f} mm off",
            "axes": f"up to {1e3 * np.abs(self.tilt).max():.2f} mrad tilted",
            "points": f"{1e3 * self.before:.3f} mm from the nominal arm, {1e3 * self.after:.3f} mm from this one",
        }
        return lines(f"Kinematics of the {self.robot.title}", rows)


def kinematics(
    q: npt.ArrayLike,
    points: npt.ArrayLike,
    *,
    robot: RobotModel | str,
    tip: npt.ArrayLike = (0.0, 0.0, 0.0),
    is_base_known: bool = False,
) -> KinematicFit:
    """Compute joint offsets and errors of the links from measured points of one tip. Nothing moves.

    Use a tracker, a camera or a measuring arm, and many postures with all joints far apart.

    Args:
        q: joint positions as the robot showed them, shape (n, 7) [rad], n of 20 or more.
        points: where the tip was, in the frame of the measuring device, shape (n, 3) [m].
        robot: the robot, or its name.
        tip: roughly where it is in the flange frame, shape (3,) [m]; it is estimated, too.
        is_base_known: the frame of the device is the robot's base; otherwise its pose is estimated, too, and the offset
            of A1 is a part of it.

    Raises:
        ShapeError: wrong shapes, or too few points.
        CommandRejected: the postures do not determine the arm.
    """
    return _fit(_model(robot), *_checked(q, points), array(tip, 3, "tip"), is_base_known=is_base_known)


def _model(given: RobotModel | str) -> RobotModel:
    return robot(given) if isinstance(given, str) else instance(given, RobotModel, "robot")


def _checked(q: npt.ArrayLike, points: npt.ArrayLike) -> tuple[Array, Array]:
    joints, places = finite_entries(numbers(q, "q"), "q"), finite_entries(numbers(points, "points"), "points")
    if joints.ndim != 2 or joints.shape[1] != _AXES or len(joints) < FEWEST:
        raise ShapeError(
            f"q must have shape (n, {_AXES}) with n >= {FEWEST}, got {joints.shape}", parameter="q"
        )
    if places.shape != (len(joints), 3):
        raise ShapeError(
            f"points must have shape ({len(joints)}, 3) as q, got {places.shape}", parameter="points"
        )
    spread = np.ptp(joints, axis=0)
    axis = int(spread.argmin())
    if spread[axis] < 0.1:
        raise CommandRejected(
            f"the postures must differ by 0.1 rad in every axis, got {spread[axis]:.3f} rad in A{axis + 1}",
            parameter="q",
            value=float(spread[axis]),
            hint="measure postures in which all joints are far apart",
        )
    for index, posture in enumerate(joints):
        within(float(np.abs(posture).max()), f"|q[{index}]|", 0.0, 2.0 * np.pi, unit="rad")
    return joints, places


def _fit(model: RobotModel, q: Array, points: Array, tip: Array, *, is_base_known: bool) -> KinematicFit:
    prior = np.concatenate(
        [
            np.full(6, 1e-9 if is_base_known else 10.0),
            np.full(3, 0.5),
            np.full(7, OFFSET),
            np.full(21, ORIGIN),
            np.full(14, TILT),
        ]
    )
    start = np.zeros(_COUNT)
    start[_TIP] = tip
    if not is_base_known:
        start[_DEVICE] = _placed(_points(model, q, start), points)
    # first with the nominal arm, where only device and tip are unknown
    nominal = prior.copy()
    nominal[_OFFSETS.start :] = 1e-12
    first, _, before = _solved(model, q, points, start, nominal)
    x, covariance, after = _solved(model, q, points, first, prior, mean=start)
    sigma = np.sqrt(np.diagonal(covariance))
    return KinematicFit(
        model,
        frozen(x[_OFFSETS]),
        frozen(sigma[_OFFSETS]),
        frozen(x[_ORIGINS].reshape(7, 3)),
        frozen(sigma[_ORIGINS].reshape(7, 3)),
        frozen(x[_TILTS].reshape(7, 2)),
        frozen(sigma[_TILTS].reshape(7, 2)),
        frozen(x[_TIP]),
        before,
        after,
    )


def _solved(
    model: RobotModel, q: Array, points: Array, start: Array, prior: Array, mean: Array | None = None
) -> tuple[Array, Array, float]:
    """Most likely unknowns, their covariance, and the root mean square distance of the points [m]."""
    x, expected = start.copy(), start if mean is None else mean
    noise = 1e-3
    for _ in range(_STEPS):
        here = _points(model, q, x)
        off = (points - here).ravel()
        free = np.flatnonzero(prior > _FIXED)
        slope = np.zeros((len(off), _COUNT))
        for place in free:
            x[place] += _STEP
            slope[:, place] = (_points(model, q, x) - here).ravel() / _STEP
            x[place] -= _STEP
        scaled = slope * prior
        information = scaled.T @ scaled / noise**2 + np.eye(_COUNT)
        right = scaled.T @ off / noise**2 + (expected - x) / prior
        x = x + prior * np.linalg.solve(information, right)
        left = (points - _points(model, q, x)).ravel()
        freedom = max(1.0, len(left) - float(np.trace(np.eye(_COUNT) - np.linalg.inv(information))))
        noise = max(float(np.sqrt(left @ left / freedom)), _LEAST_NOISE)
    covariance = np.linalg.inv(information) * np.outer(prior, prior)
    return x, covariance, float(np.sqrt((left**2).reshape(-1, 3).sum(axis=1).mean()))


def _points(model: RobotModel, q: Array, x: Array) -> Array:
    """Where the tip is in the frame of the device, shape (n, 3) [m]."""
    turn = np.tile(_rotations(x[3:6][None])[0], (len(q), 1, 1))
    place = np.tile(x[:3], (len(q), 1))
    origins = model.links.origin + x[_ORIGINS].reshape(7, 3)
    tilts = x[_TILTS].reshape(7, 2)
    for axis, direction in enumerate(_DIRECTIONS):
        place = place + turn @ origins[axis]
        across = np.roll(np.abs(direction), 1), np.roll(np.abs(direction), 2)
        tilted = _rotations((tilts[axis, 0] * across[0] + tilts[axis, 1] * across[1])[None])[0] @ direction
        turn = turn @ _rotations((q[:, axis] + x[_OFFSETS][axis])[:, None] * tilted)
    return place + turn @ (model.links.flange + x[_TIP])


def _rotations(vectors: Array) -> Array:
    """Rotation matrices of rotation vectors (Rodrigues), shape (n, 3) to (n, 3, 3)."""
    angle = np.linalg.norm(vectors, axis=1)
    x, y, z = (vectors / np.maximum(angle, 1e-300)[:, None]).T
    nothing = np.zeros_like(x)
    cross = np.array([[nothing, -z, y], [z, nothing, -x], [-y, x, nothing]]).transpose(2, 0, 1)
    sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross))


def _placed(nominal: Array, points: Array) -> Array:
    """Position and rotation vector of the device that bring nominal onto measured points (Kabsch, 1976)."""
    middle, other = nominal.mean(axis=0), points.mean(axis=0)
    left, _, right = np.linalg.svd((points - other).T @ (nominal - middle))
    turn = left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right
    moments, axes = np.linalg.eig(turn)
    axis = np.real(axes[:, np.argmin(np.abs(moments - 1.0))])
    skew = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    angle = float(np.arctan2(skew @ axis, np.trace(turn) - 1.0))
    return np.concatenate([other - turn @ middle, angle * axis])
