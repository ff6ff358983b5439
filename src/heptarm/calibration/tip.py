"""TCP calibration: where the tip of a tool is, from poses of the flange in which it touches one fixed point.

The tip t in the flange frame and the fixed point x in the base satisfy R_i t + p_i = x in every pose i: linear least
squares in six unknowns, also called pivot calibration (Yaniv, "Which pivot calibration?", SPIE Medical Imaging 2015).
The orientation follows from poses in which the fixed point touches the tool's axes, or in which the tool is aligned
with known axes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from heptarm.arm.verbs import ArmVerbs
from heptarm.errors import CommandRejected, LimitError, ShapeError, StaleState
from heptarm.io.targets import save_tool
from heptarm.model.kinematics import forward
from heptarm.values.checks import Array, Value, callback, frozen, instance, integer, shown, within
from heptarm.values.pose import Pose, check_pose, quaternion
from heptarm.values.state import State
from heptarm.values.text import fixed, lines
from heptarm.values.tool import KnownTool, Tool, as_tool

#: Fewest poses about a tip.
FEWEST = 4
#: Most by which the poses may amplify an error of pointing: more, and the tip is not known along a direction.
_AMPLIFICATION = 4.0
#: Default of how far the tip may be from the fixed point in a pose [m].
TOLERANCE = 0.005
#: The worst pose is suspect if the errors of the others are smaller by this factor.
_SUSPECT = 2.0
#: Shortest distance from the tip to a point that is touched on an axis [m], and smallest angle between two axes [rad].
_LEVER, _ANGLE = 0.02, math.radians(15.0)
#: Axes of the tool by name.
_AXES = {
    name: sign * np.eye(3)[index]
    for index, axis in enumerate("xyz")
    for name, sign in ((axis, 1.0), (f"-{axis}", -1.0))
}
#: A tool that points down: its z axis is the base's -z, its x axis the base's x.
POINTS_DOWN = Pose.xyz_abc(c=math.pi)
#: States that are averaged for a pose, and the most by which a joint may move meanwhile [rad].
_STATES, _STILL = 20, 1e-3
#: Least angle between two recorded poses [rad].
_APART = math.radians(5.0)


@dataclass(frozen=True, slots=True, eq=False)
class TcpEstimate(Value):
    """A tip that was measured. Standard deviations count how few poses there were (Student's t).

    Attributes:
        pose: flange to tip; its orientation is that of the flange unless `sigma_angle` is a number.
        point: the fixed point that the tip touched, in the base frame, shape (3,) [m].
        sigma: standard deviation of the tip along the axes of the flange, shape (3,) [m].
        sigma_angle: standard deviation of the orientation [rad]; NaN: it was not measured, or from a single pose.
        residuals: distance of the tip from the fixed point in each pose, shape (n,) [m].
        spread: standard deviation of pointing along an axis [m], from the residuals.
        worst: the pose that fits the others least, from 1.
        spread_without: `spread` without the worst pose [m]; NaN: there are too few poses to tell.
    """

    pose: Pose
    point: Array
    sigma: Array
    sigma_angle: float
    residuals: Array
    spread: float
    worst: int
    spread_without: float

    @property
    def is_suspect(self) -> bool:
        """Whether the worst pose contradicts the others: measure it again, or leave it out."""
        return self.spread > _SUSPECT * self.spread_without

    def __str__(self) -> str:
        """The tip with its standard deviations, the residuals, and the pose that fits least."""
        x, y, z = self.pose.xyz * 1e3
        sx, sy, sz = self.sigma * 1e3
        worst = f"pose {self.worst}: {_mm(self.residuals[self.worst - 1])}"
        if self.is_suspect:
            worst += f"; without it the spread is {_mm(self.spread_without)}: measure it again"
        rows = {
            "tip": f"x {x:.2f} ± {sx:.2f}  y {y:.2f} ± {sy:.2f}  z {z:.2f} ± {sz:.2f} mm from the flange",
            "orientation": self._orientation(),
            "residuals": " ".join(f"{1e3 * residual:.2f}" for residual in self.residuals) + " mm",
            "spread": _mm(self.spread),
            "worst": worst,
        }
        return lines(f"TCP from {len(self.residuals)} poses", rows)

    def _orientation(self) -> str:
        a, b, c = np.degrees(self.pose.abc)
        turned = f"a {a:.2f}  b {b:.2f}  c {c:.2f} deg"
        if math.isnan(self.sigma_angle):
            return (
                f"{turned} (not estimated from residuals)"
                if self.pose.quat[3] < 1.0
                else "that of the flange"
            )
        return f"{turned} ± {math.degrees(self.sigma_angle):.2f} deg"

    def to_tool(self, tool: Tool | KnownTool | str, *, frame: str = "tcp") -> Tool:
        """A tool with this tip.

        Args:
            tool: whose other frames, load data and shapes stay; or the name of a new tool.
            frame: the frame that the tip becomes; a new one is the first, which motions move.
        """
        old = as_tool(tool)
        known = dict(old.frames)
        frames = known | {frame: self.pose} if frame in known else {frame: self.pose} | known
        return Tool(
            old.name, mass=old.mass, com=old.com, inertia=old.inertia, frames=frames, shapes=old.shapes
        )

    def save(self, target: str, tool: Tool | KnownTool | str, *, frame: str = "tcp") -> Tool:
        """Save `to_tool` with a saved target, whose arms know it from their next connection on.

        Raises:
            CommandRejected: there is no such target; nothing is changed.
        """
        made = self.to_tool(tool, frame=frame)
        save_tool(target, made)
        return made


def tcp(
    poses: Sequence[Pose],
    *,
    along: Mapping[str, Pose] | None = None,
    aligned: Sequence[Pose] | None = (),
    world: Pose = POINTS_DOWN,
    tolerance: float = TOLERANCE,
) -> TcpEstimate:
    """Compute the tip of a tool from poses of the flange in the base, in which the tip touches one fixed point.

    Tilt the flange by 20 to 40 degrees about different axes from pose to pose. More poses than four are more accurate
    and find a wrong one.

    Args:
        poses: four or more, with the tip at the fixed point.
        along: two more poses for the orientation, by an axis of the tool: in the first the fixed point touches that
            axis, in the second the half-plane between that axis and the second one. For example `{"z": p, "x": q}`.
        aligned: instead of `along`: poses in which the tool's axes are those of `world`; their mean counts. None: none.
        world: orientation of the tool in the base in the poses of `aligned`; points down unless you say otherwise.
        tolerance: the most by which a pose may miss the fixed point [m].

    Raises:
        ShapeError: fewer than four poses, or not poses.
        CommandRejected: the poses differ too little, or one misses the fixed point; the text names the pose.
        LimitError: a value outside its range.
    """
    given = checked_poses(poses, "poses", FEWEST, "touch the same point with the flange tilted differently")
    allowed = within(tolerance, "tolerance", 0.0, 0.1, above=True, unit="m")
    parallel = checked_poses(() if aligned is None else aligned, "aligned")
    if along is not None and parallel:
        raise CommandRejected(
            "along and aligned both give the orientation", parameter="along", hint="give one of them"
        )
    turns, places = np.array([pose.rotation for pose in given]), np.array([pose.xyz for pose in given])
    matrix = np.concatenate([np.concatenate([turn, -np.eye(3)], axis=1) for turn in turns])
    found = np.linalg.lstsq(matrix, -places.ravel(), rcond=None)[0]
    missed = (matrix @ found + places.ravel()).reshape(-1, 3)
    made = estimate_of(Pose.of(found[:3]), found[3:], matrix, missed, tolerance=allowed)
    if along is None and not parallel:
        return made
    if along is not None:
        freedom = 3 * len(given) - 6
        pointing = math.hypot(made.spread * student(freedom), *_sigma(matrix, made.spread))
        quat, sigma_angle = _along(along, found[:3], found[3:], pointing)
    else:
        quat, sigma_angle = _aligned(parallel, world)
    return replace(made, pose=Pose.of(found[:3], quat), sigma_angle=sigma_angle)


def estimate_of(
    pose: Pose,
    point: Array,
    matrix: Array,
    missed: Array,
    *,
    tolerance: float,
    fewest: int = FEWEST,
    common: float = 0.0,
    what: str = "pose",
) -> TcpEstimate:
    """The estimate of a tip from the residuals of least squares.

    Args:
        pose: flange to tip.
        point: that it touched, shape (3,) [m].
        matrix: of the least squares, shape (k n, m): k rows of each of n poses, the tip in the first three columns.
        missed: by how much the tip misses what it touches in each pose, shape (n, k) [m].
        tolerance: the most of that [m].
        fewest: number of poses up to which none can be left out.
        common: standard deviation of an error that all rows have in common [m].
        what: a pose is called in errors.

    Raises:
        CommandRejected: the poses differ too little, or one contradicts the others; the text names it.
    """
    count, each = missed.shape
    _check_differ(matrix)
    residuals = np.linalg.norm(missed, axis=1)
    spread = math.sqrt(float((missed**2).sum()) / (count * each - matrix.shape[1]))
    worst, without = _worst(matrix, missed, fewest)
    if residuals.max() > tolerance:
        raise CommandRejected(
            f"{what} {worst + 1} contradicts the others: the tip misses the fixed point by up to "
            f"{_mm(residuals.max())}, and {_mm(tolerance)} are allowed",
            parameter=f"poses[{worst}]",
            value=float(residuals.max()),
            allowed=f"[0, {tolerance:g}] m",
            hint=f"measure {what} {worst + 1} again, or leave it out",
        )
    sigma = np.hypot(_sigma(matrix, spread), common * np.linalg.pinv(matrix).sum(axis=1))
    return TcpEstimate(
        pose, frozen(point), frozen(sigma[:3]), math.nan, frozen(residuals), spread, worst + 1, without
    )


def _sigma(matrix: Array, spread: float) -> Array:
    """Standard deviations of the unknowns of least squares whose rows have a spread."""
    covariance = spread**2 * np.linalg.inv(matrix.T @ matrix)
    return np.asarray(np.sqrt(np.diagonal(covariance)) * student(len(matrix) - matrix.shape[1]))


def checked_poses(poses: Sequence[Pose], name: str, fewest: int = 0, hint: str = "") -> list[Pose]:
    """Poses that a person gave.

    Raises:
        ShapeError: they are not poses, or too few.
    """
    if isinstance(poses, Pose) or not isinstance(poses, Sequence):
        raise ShapeError(
            f"{name} must be a sequence of poses, got {shown(poses)}", parameter=name, value=poses
        )
    for index, pose in enumerate(poses):
        check_pose(pose, f"{name}[{index}]")
    if len(poses) < fewest:
        raise ShapeError(
            f"{name} must be at least {fewest}, got {len(poses)}",
            parameter=name,
            value=len(poses),
            hint=hint,
        )
    return list(poses)


def _mm(value: float) -> str:
    return f"{1e3 * float(value):.2f} mm"


def _check_differ(matrix: Array) -> None:
    """Refuse poses that differ too little to know the tip along some direction.

    Raises:
        CommandRejected: they do; the text has the direction.
    """
    # what is known of the tip, whatever the other unknowns are
    whole = matrix.T @ matrix
    others = whole[:3, 3:] @ np.linalg.inv(whole[3:, 3:]) @ whole[3:, :3]
    moments, axes = np.linalg.eigh(whole[:3, :3] - others)
    least = math.sqrt(max(float(moments[0]), 1e-12))
    if 1.0 / least > _AMPLIFICATION:
        blind = axes[:, 0] * np.sign(axes[np.argmax(np.abs(axes[:, 0])), 0])
        direction = ", ".join(fixed(component, 2) for component in blind)
        raise CommandRejected(
            f"the poses differ too little: they amplify errors of pointing {1.0 / least:.0f} times along "
            f"({direction}) of the flange, and {_AMPLIFICATION:g} times are allowed",
            parameter="poses",
            value=1.0 / least,
            allowed=f"[1, {_AMPLIFICATION:g}]",
            hint="tilt the flange by 20 to 40 degrees about different axes, not only about that direction",
        )


def _worst(matrix: Array, missed: Array, fewest: int) -> tuple[int, float]:
    """The pose that the others predict least, from 0, and the spread without it [m]."""
    count, each = missed.shape
    hat = matrix @ np.linalg.pinv(matrix)
    apart = []
    for index in range(count):
        rows = slice(each * index, each * (index + 1))
        # the squared error that goes when this pose is left out
        free = np.eye(each) - hat[rows, rows]
        apart.append(float(missed[index] @ np.linalg.pinv(free, rcond=1e-9) @ missed[index]))
    worst = int(np.argmax(apart))
    left = float((missed**2).sum()) - apart[worst]
    freedom = each * (count - 1) - matrix.shape[1]
    return worst, math.sqrt(max(left, 0.0) / freedom) if count > fewest else math.nan


def student(freedom: int) -> float:
    """By how much two standard deviations grow for so few degrees of freedom; series in Abramowitz, Stegun 26.7.5."""
    z = 2.0
    first, second = (z**3 + z) / 4.0, (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / 96.0
    return (z + first / freedom + second / freedom**2) / z


def _along(along: Mapping[str, Pose], tip: Array, point: Array, pointing: float) -> tuple[Array, float]:
    """Orientation of the tool from poses in which the fixed point touches its axes, and its standard deviation."""
    if not isinstance(along, Mapping) or len(along) != 2 or not set(along) <= set(_AXES):
        raise ShapeError(
            f"along must have two poses by axes of the tool, got {shown(along)}",
            parameter="along",
            value=along,
            allowed=", ".join(_AXES),
            hint='for example {"z": pose, "x": pose}',
        )
    first, second = along
    if first[-1] == second[-1]:
        raise ShapeError(
            f"along must have two different axes, got {first} and {second}", parameter="along", value=along
        )
    seen = []
    for name, pose in along.items():
        check_pose(pose, f"along[{name!r}]")
        lever = pose.rotation.T @ (point - pose.xyz) - tip  # from the tip to the fixed point, flange axes
        if np.linalg.norm(lever) < _LEVER:
            raise LimitError(
                f"along[{name!r}] must have the fixed point at least {_mm(_LEVER)} from the tip, got "
                f"{_mm(float(np.linalg.norm(lever)))}",
                code=2,
                parameter=f"along[{name!r}]",
                hint="touch a point of the axis that is farther from the tip",
            )
        seen.append(lever)
    main = seen[0] / np.linalg.norm(seen[0])
    beside = seen[1] - (seen[1] @ main) * main
    if np.linalg.norm(beside) < math.sin(_ANGLE) * np.linalg.norm(seen[1]):
        raise CommandRejected(
            f"the poses of along for {first} and {second} touch nearly one line, at less than "
            f"{math.degrees(_ANGLE):.0f} deg to each other",
            parameter=f"along[{second!r}]",
            hint=f"touch a point away from the axis {first}",
        )
    side = beside / np.linalg.norm(beside)
    measured = np.column_stack([main, side, np.cross(main, side)])
    named = np.column_stack([_AXES[first], _AXES[second], np.cross(_AXES[first], _AXES[second])])
    sigma = math.hypot(math.sqrt(2.0) / np.linalg.norm(seen[0]), 1.0 / np.linalg.norm(beside)) * pointing
    return quaternion(measured @ named.T), sigma


def _aligned(aligned: Sequence[Pose], world: Pose) -> tuple[Array, float]:
    """Mean orientation of the tool in the flange frame, and its standard deviation; NaN of a single pose."""
    check_pose(world, "world")
    each = [Pose.of(np.zeros(3), (pose.inverse() @ world).quat) for pose in aligned]
    # the mean of quaternions is the eigenvector of their outer products (Markley et al., 2007)
    quats = np.array([pose.quat for pose in each])
    mean = Pose.of(np.zeros(3), np.linalg.eigh(quats.T @ quats)[1][:, -1])
    off = np.array([mean.angle_to(pose) for pose in each])
    if len(each) == 1:
        return mean.quat, math.nan
    freedom = 3 * (len(each) - 1)
    return mean.quat, student(freedom) * math.sqrt(3.0 * float((off**2).sum()) / freedom / len(each))


def record_poses(
    arm: ArmVerbs, *, count: int = FEWEST, confirm: Callable[[str], bool], timeout: float = 30.0
) -> tuple[Pose, ...]:
    """Record poses of the flange while a person brings the tip to one fixed point again and again.

    Nothing moves by this function: the person guides the arm by hand, jogs it at the smartPAD or in the panel, or
    `confirm` moves it. So an observer can record while another client controls the arm.

    Args:
        arm: connected.
        count: number of poses.
        confirm: called with what to do next; returns true as soon as the arm is there, false to give up.
        timeout: longest wait for the arm to be still after that [s].

    Returns:
        Poses of the flange in the base, for `tcp`.

    Raises:
        CommandRejected: the person gave up.
        Timeout: the arm did not come to rest.
    """
    wanted = integer(count, "count", 1, 1000)
    callback(confirm, "confirm")
    found: list[Pose] = []
    remark = ""
    while len(found) < wanted:
        number = f"pose {len(found) + 1} of {wanted}"
        if not confirm(f"{remark}{number}: bring the tip to the fixed point"):
            raise CommandRejected(f"{number} was not confirmed: nothing is changed", parameter="confirm")
        pose = _still_pose(arm, timeout)
        near = [index for index, other in enumerate(found) if other.angle_to(pose) < _APART]
        if near:
            apart = math.degrees(found[near[0]].angle_to(pose))
            remark = f"this pose is only {apart:.1f} deg from pose {near[0] + 1}, tilt the flange more; "
            continue
        found.append(pose)
        remark = ""
    return tuple(found)


def _still_pose(arm: ArmVerbs, timeout: float) -> Pose:
    """Mean pose of the flange of a still arm."""
    if arm.state_rate <= 0 or "joints" not in arm.groups:
        raise StaleState(
            'recording poses needs the state group "joints"',
            hint='arm.subscribe(rate=100, groups=(..., "joints"))',
        )
    rows: dict[int, Array] = {}

    def is_still(state: State) -> bool:
        if state.joints is not None:
            rows[state.joints.stamp] = state.q
        for stamp in sorted(rows)[:-_STATES]:
            del rows[stamp]
        return len(rows) == _STATES and bool(np.ptp(np.array(list(rows.values())), axis=0).max() < _STILL)

    arm.wait_until(is_still, timeout=timeout)
    return Pose.from_matrix(
        forward(instance(arm, ArmVerbs, "arm").robot, np.mean(list(rows.values()), axis=0))
    )
