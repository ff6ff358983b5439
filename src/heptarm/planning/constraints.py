"""Constraints along a path: how far joint positions are from them, and joint positions nearby that obey them.

Each constraint gives an offset from what it asks for, and how the joints move that offset. All of them are one system
for Newton's method (projection of CBiRRT, Berenson et al. 2009), so that any of them can be combined.
"""

from __future__ import annotations

import ast
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from heptarm.errors import CommandRejected, HeptarmError, LimitError, NoPath, ShapeError
from heptarm.model.batch import forward_batch
from heptarm.model.kinematics import jacobian
from heptarm.values.checks import Array, shown
from heptarm.values.frames import BASE
from heptarm.values.motion.planned_path import OnLine, OnPlane, PathConstraint, Upright
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.values.workspace import Workspace

#: Fraction of a tolerance to which Newton's method brings joint positions, and which steps of the search may use. A
#: spline between them may use all of it.
_AIM, _USED = 0.7, 0.85
_ITERATIONS = 30
#: A curve is checked at samples. Between two of them, where an arm that brakes may come to rest, it exceeds a tolerance
#: by at most this fraction: the sag of a sixteenth of the longest step of a tree.
_SAG = 2e-3
#: A tolerance that is exceeded by this fraction is kept.
_ROUNDING = 1e-9
#: Of a workspace: so far from its faces [m] and from its joint limits [rad] is nothing to correct, where there is room.
_WALL, _STOP = 0.01, 0.03
#: Distance of a point from the axis of the joint that moves it, for the sag of a step [m].
_REACH = 0.8
#: Longest and shortest step of a tree under constraints [rad].
_STEP, _SHORTEST = 0.4, 0.03
#: Random joint positions from which constraints that contradict each other are tried.
_TRIALS = 8
#: Constraints that a text may name, and its most characters.
_WRITTEN: dict[str, Callable[..., PathConstraint]] = {
    one.__name__: one for one in (Upright, OnPlane, OnLine, Workspace)
}
_LONGEST_TEXT = 1000


class Constraints:
    """The constraints of one search.

    Args:
        keep: the constraints, at least one.
        robot: the robot.
        tcp: pose of the tool frame in the flange frame.
        start: joint positions at which the path begins, shape (7,) [rad].

    Attributes:
        keep: the constraints; an axis that had no direction of its own has that of the start.
        step: longest step of a tree [rad]: between its ends the constraints hold.
        most: largest deviation that a curve may have, in tolerances.

    Raises:
        NoPath: the start contradicts them, or they contradict each other.
        ShapeError: something else than constraints.
        CommandRejected: a workspace in a frame other than the base.
    """

    def __init__(self, keep: Sequence[PathConstraint], robot: RobotModel, tcp: Pose, start: Array) -> None:
        self._robot, self._tcp = robot, tcp
        turn = self._tools(start[None])[1][0]
        self.keep = tuple(_directed(constraint, turn) for constraint in keep)
        self._parts = [part for constraint in self.keep for part in _parts(constraint, robot)]
        self._most = _USED
        self.step = min(part.step for part in self._parts)
        self._check_start(start)

    def _check_start(self, start: Array) -> None:
        deviation = float(self.deviations(start[None])[0])
        if deviation > 1.0 + _SAG:
            random = np.random.default_rng(0)
            tried = [start, *random.uniform(self._robot.q_min, self._robot.q_max, (_TRIALS, 7))]
            if all(self.projected(point) is None for point in tried):
                raise NoPath(
                    "keep contradicts itself: no joint positions obey "
                    f"{' and '.join(part.name for part in self._parts)}",
                    reason="constraint",
                    parameter="keep",
                    hint="leave out one of the constraints, or allow more",
                )
            raise NoPath(
                f"start contradicts keep: {self.described(start)}",
                reason="constraint",
                parameter="start",
                hint="move the arm there first, for example by find_path without keep",
            )
        self.most = max(1.0, deviation) + _ROUNDING
        self.allow(deviation)

    def allow(self, deviation: float) -> None:
        """Let the search use more of the tolerances: as much as at joint positions where it begins or ends."""
        self._most = max(self._most, min(deviation + 0.02, self.most))

    def deviations(self, q: Array) -> Array:
        """Largest deviation at n joint positions, in tolerances: more than 1 violates a constraint; shape (n,)."""
        xyz, turns = self._tools(q)
        worst: Array = np.max([part.deviations(part.offsets(xyz, turns, q)) for part in self._parts], axis=0)
        return worst

    def is_kept(self, q: Array) -> bool:
        """Whether joint positions keep that part of the tolerances which the search may use."""
        return bool(self.deviations(q[None])[0] <= self._most)

    def described(self, q: Array) -> str:
        """The constraint that joint positions violate most, in words."""
        xyz, turns = self._tools(q[None])
        found = [float(part.deviations(part.offsets(xyz, turns, q[None]))[0]) for part in self._parts]
        worst = int(np.argmax(found))
        return self._parts[worst].described(found[worst])

    def projected(self, q: Array) -> Array | None:
        """Joint positions nearby that obey the constraints and the limits of the joints; None: there are none.

        Newton's method: an offset moves the joints by the pseudo-inverse of the rows of the Jacobian that change it.
        A row that was off once stays in the system, so that the correction of another one does not move it back.
        """
        held = [np.zeros(part.size, bool) for part in self._parts]
        for _ in range(_ITERATIONS):
            xyz, turns = self._tools(q[None])
            offsets = [part.offsets(xyz, turns, q[None]) for part in self._parts]
            deviations = [float(part.deviations(point)[0]) for part, point in zip(self._parts, offsets)]
            if max(deviations) <= _AIM:
                is_inside = (q >= self._robot.q_min).all() and (q <= self._robot.q_max).all()
                return np.asarray(q) if is_inside else None
            moves = jacobian(self._robot, q, xyz[0])
            rows, wanted = [], []
            for index, (part, (offset,), deviation) in enumerate(zip(self._parts, offsets, deviations)):
                held[index] |= offset != 0.0
                rows.append(part.rows(moves, turns[0])[held[index]])
                fraction = max(0.0, 1.0 - 0.9 * _AIM / deviation) if deviation else 0.0
                wanted.append(fraction * offset[held[index]])
            q = q - np.linalg.pinv(np.concatenate(rows), rcond=1e-3) @ np.concatenate(wanted)
        return None

    def _tools(self, q: Array) -> tuple[Array, Array]:
        """Origins and rotations of the tool frame, shapes (n, 3) and (n, 3, 3)."""
        frames = forward_batch(self._robot, q)
        turns = frames[:, :3, :3] @ self._tcp.rotation
        return frames[:, :3, 3] + frames[:, :3, :3] @ self._tcp.xyz, turns


class _Part(ABC):
    """One constraint.

    Attributes:
        name: in words.
        size: numbers of an offset.
        within: its tolerance, in the unit of its offsets.
        step: longest step of a tree [rad].
    """

    name: str
    size: int
    within: float
    step: float = _STEP

    @abstractmethod
    def offsets(self, xyz: Array, turns: Array, q: Array) -> Array:
        """What would have to be taken away, at n joint positions, shape (n, k)."""

    @abstractmethod
    def rows(self, moves: Array, turn: Array) -> Array:
        """How the joints change the offset, shape (k, 7); `moves` is the Jacobian of the origin of the tool frame."""

    @abstractmethod
    def described(self, deviation: float) -> str:
        """A deviation in words."""

    def deviations(self, offsets: Array) -> Array:
        """Of n offsets, in tolerances, shape (n,)."""
        return np.asarray(np.linalg.norm(offsets, axis=1) / self.within)


class _Direction(_Part):
    """An axis of the tool frame keeps its direction; the offset is the rotation from it [rad]."""

    size = 3

    def __init__(self, keep: Upright) -> None:
        self.name, self.within = f'Upright("{keep.axis}")', keep.within
        self._axis, self._up = keep.column, np.asarray(keep.direction)
        self._across = np.linalg.svd(self._up[None])[2][1]  # for an axis upside down any direction will do
        self.step = _longest_step(keep.within)

    def offsets(self, xyz: Array, turns: Array, q: Array) -> Array:
        axes = turns[:, :, self._axis]
        about = np.cross(self._up, axes)
        sines = np.linalg.norm(about, axis=1)
        angles = np.arctan2(sines, axes @ self._up)
        is_clear = sines > 1e-9
        units = np.where(is_clear[:, None], about / np.where(is_clear, sines, 1.0)[:, None], self._across)
        return np.asarray(units * angles[:, None])

    def rows(self, moves: Array, turn: Array) -> Array:
        axis = turn[:, self._axis]
        return np.asarray(
            (np.eye(3) - np.outer(axis, axis)) @ moves[3:]
        )  # a turn about the axis does not count

    def described(self, deviation: float) -> str:
        return (
            f"the {'xyz'[self._axis]} axis of the tool frame would be turned by {deviation * self.within:.3f} rad, "
            f"at most {self.within:g} rad are allowed"
        )


class _Place(_Part):
    """The origin of the tool frame stays on a plane or a line; the offset is the way to it [m]."""

    def __init__(self, keep: OnPlane | OnLine) -> None:
        is_plane = isinstance(keep, OnPlane)
        self._what = "plane" if is_plane else "line"
        direction = np.asarray(keep.normal if isinstance(keep, OnPlane) else keep.direction)
        # directions across which the origin may not move
        self._across = direction[None] if is_plane else np.linalg.svd(direction[None])[2][1:]
        self.size = len(self._across)
        self._point, self.within = np.asarray(keep.point), keep.within
        self.name = f"{type(keep).__name__}(({', '.join(f'{x:g}' for x in self._point)}))"
        self.step = _longest_step(keep.within / _REACH)

    def offsets(self, xyz: Array, turns: Array, q: Array) -> Array:
        return np.asarray((xyz - self._point) @ self._across.T)

    def rows(self, moves: Array, turn: Array) -> Array:
        return np.asarray(self._across @ moves[:3])

    def described(self, deviation: float) -> str:
        return (
            f"the tool frame would be {deviation * self.within * 1e3:.1f} mm from the {self._what}, "
            f"at most {self.within * 1e3:g} mm are allowed"
        )


class _Range(_Part):
    """Numbers stay in a range; the offset is how far they are beyond a range that is smaller by the tolerance."""

    def __init__(self, low: Array, high: Array, tolerance: float, *, unit: str) -> None:
        self.within = float(min(tolerance, 0.25 * (high - low).min()))
        self.size = len(low)
        self._low, self._high, self._unit = low, high, unit

    def offsets(self, xyz: Array, turns: Array, q: Array) -> Array:
        values = self._values(xyz, q)
        return np.asarray(values - np.clip(values, self._low + self.within, self._high - self.within))

    def deviations(self, offsets: Array) -> Array:
        return np.asarray(np.abs(offsets).max(axis=1) / self.within)

    def described(self, deviation: float) -> str:
        outside = (deviation - 1.0) * self.within
        amount = f"{outside * 1e3:.1f} mm" if self._unit == "m" else f"{outside:.3f} rad"
        return f"it would be {amount} outside of the {self.name} of the workspace"

    @abstractmethod
    def _values(self, xyz: Array, q: Array) -> Array:
        """The numbers, shape (n, k)."""


class _Box(_Range):
    """The origin of the tool frame stays in a box, with edges along the base."""

    name = "box"

    def _values(self, xyz: Array, q: Array) -> Array:
        return xyz

    def rows(self, moves: Array, turn: Array) -> Array:
        return moves[:3]


class _Joints(_Range):
    """The joints stay in ranges."""

    name = "joints"

    def _values(self, xyz: Array, q: Array) -> Array:
        return q

    def rows(self, moves: Array, turn: Array) -> Array:
        return np.eye(7)


def _longest_step(within: float) -> float:
    """Step [rad] whose chord sags by what the search may use beyond its aim: by angle^2 / 8 of the radius.

    Args:
        within: tolerance of the constraint, as a fraction of the radius.
    """
    return float(np.clip(np.sqrt(8.0 * (_USED - _AIM) * within), _SHORTEST, _STEP))


def _directed(keep: PathConstraint, turn: Array) -> PathConstraint:
    """The constraint, with the direction that its axis has in a rotation of the tool frame if it has none."""
    if isinstance(keep, Upright) and keep.direction is None:
        return replace(keep, direction=turn[:, keep.column])
    return keep


def _parts(keep: PathConstraint, robot: RobotModel) -> list[_Part]:
    """The parts of one constraint.

    Raises:
        CommandRejected: a workspace in a frame other than the base.
        ShapeError: no constraint.
    """
    if isinstance(keep, Upright):
        return [_Direction(keep)]
    if isinstance(keep, OnPlane | OnLine):
        return [_Place(keep)]
    if not isinstance(keep, Workspace):
        raise ShapeError(
            f"keep must be Upright, OnPlane, OnLine, a Workspace, or a list of these, got {shown(keep)}",
            parameter="keep",
            value=keep,
            hint='for example heptarm.Upright("z", within=0.1)',
        )
    if keep.box is not None and keep.frame != BASE:
        raise CommandRejected(
            f"the box of a workspace must be in the base where a path is searched, got the frame {keep.frame!r}",
            parameter="keep",
            value=keep.frame,
            hint='Workspace(box=..., frame="base")',
        )
    found: list[_Part] = [] if keep.box is None else [_Box(keep.box[0], keep.box[1], _WALL, unit="m")]
    if keep.joints is not None:
        low, high = np.maximum(keep.joints[0], robot.q_min), np.minimum(keep.joints[1], robot.q_max)
        if (low >= high).any():
            joint = int((low - high).argmax())
            raise LimitError(
                f"the joints of keep must be within the limits of the robot, got {keep.joints[0][joint]:.4g} to "
                f"{keep.joints[1][joint]:.4g} rad for A{joint + 1}",
                code=2,
                parameter="keep",
                value=keep.joints[:, joint].tolist(),
                allowed=f"[{robot.q_min[joint]:.4g}, {robot.q_max[joint]:.4g}] rad",
            )
        found.append(_Joints(low, high, _STOP, unit="rad"))
    return found


def constraints_of(keep: object) -> list[PathConstraint]:
    """The constraints that are given as one, several or none."""
    if keep is None:
        return []
    return list(keep) if isinstance(keep, list | tuple) else [cast("PathConstraint", keep)]


def constraint_from_text(text: str, parameter: str = "keep") -> PathConstraint:
    """Read a constraint that is written as in Python, for a command line or a message.

    Args:
        text: such as "Upright('z', within=0.1)" or "OnPlane((0.5, 0, 0.4), normal=(0, 0, 1))".
        parameter: the parameter that has the text, in errors.

    Raises:
        CommandRejected: no constraint; a value out of range raises as the constraint itself does.
    """
    try:
        if len(text) > _LONGEST_TEXT:
            raise ValueError(f"at most {_LONGEST_TEXT} characters are allowed, got {len(text)}")
        call = ast.parse(text.strip(), mode="eval").body
        if (
            not isinstance(call, ast.Call)
            or not isinstance(call.func, ast.Name)
            or call.func.id not in _WRITTEN
        ):
            raise ValueError("it is no call of one of these")
        named = {str(one.arg): ast.literal_eval(one.value) for one in call.keywords}
        found: PathConstraint = _WRITTEN[call.func.id](*map(ast.literal_eval, call.args), **named)
    except HeptarmError:
        raise  # a value out of range: its own text has more detail
    except (SyntaxError, ValueError, TypeError, RecursionError, MemoryError) as error:
        raise CommandRejected(
            f"{parameter} must be {', '.join(_WRITTEN)} as in Python, got {text[:80]!r}: "
            f"{getattr(error, 'msg', None) or error}",
            parameter=parameter,
            value=text[:_LONGEST_TEXT],
            hint="for example \"Upright('z', within=0.1)\"",
        ) from error
    return found
