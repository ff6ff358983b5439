"""Paths that a search has found around bodies, goals beside joint positions and poses, and constraints along paths."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.errors import LimitError
from heptarm.values.checks import Array, Value, array, frozen, instance, within, word
from heptarm.values.clearance import Clearance
from heptarm.values.motion.spline import JointSpline
from heptarm.values.pose import Pose, check_pose
from heptarm.values.workspace import Workspace

_AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True, slots=True)
class SearchStats(Value):
    """What a search took.

    Attributes:
        planner: its name: "RRT-Connect", or "straight" where a straight joint path was free.
        seed: with which it was begun; the same seed finds the same path in the same world.
        states: joint positions that it has reached.
        checks: postures whose distances were computed.
        seconds: time for all of it [s].
    """

    planner: str
    seed: int
    states: int
    checks: int
    seconds: float


@dataclass(frozen=True, slots=True, eq=False)
class Path(JointSpline):
    """A path around bodies: a joint spline, found by `find_path`, to be moved along like any motion.

    Attributes:
        start: joint positions at its beginning, where the arm has to rest, shape (7,) [rad].
        curve: joint positions along it that were checked, straight from one to the next, shape (n, 7) [rad].
        duration: at the speed for which it was searched [s].
        clearance: the nearest two bodies on it; None: none are nearer than 0.2 m.
        stats: what the search took.
        goal: what it was searched for: joint positions, poses or regions, of which it reaches one.
        tcp_speed: ceiling of the speed of the tool frame for which it was searched [m/s]; None: any.
        keep: constraints along it; an `Upright` has its direction, so that a path which goes on keeps the same one.
        world: the model of bodies that it keeps clear of, and against which it is checked again before it is sent.
    """

    start: Array = field(kw_only=True)
    curve: Array = field(kw_only=True)
    duration: float = field(kw_only=True)
    clearance: Clearance | None = field(kw_only=True)
    stats: SearchStats = field(kw_only=True)
    goal: tuple[Array | Pose | Region, ...] = field(kw_only=True, repr=False)
    tcp_speed: float | None = field(kw_only=True)
    keep: tuple[PathConstraint, ...] = field(kw_only=True)
    world: Any = field(kw_only=True, compare=False, repr=False)

    @property
    def end(self) -> Array:
        """Joint positions at its end, shape (7,) [rad]."""
        return self.points[-1].q

    @property
    def spline(self) -> JointSpline:
        """What the cabinet executes."""
        return JointSpline(self.points, dynamics=self.dynamics, triggers=self.triggers)

    def __str__(self) -> str:
        """In one line: "1.84 s, 5 waypoints, clearance 21 mm at link_5 ..."."""
        near = self.clearance
        room = "nothing nearer than 200 mm"
        if near is not None:
            room = f"clearance {near.distance * 1e3:.0f} mm at {near.first} ({near.second})"
        count = len(self.points)
        points = "1 waypoint" if count == 1 else f"{count} waypoints"
        took = f"found in {self.stats.seconds * 1e3:.0f} ms ({self.stats.planner})"
        return f"{self.duration:.2f} s, {points}, {room}, {took}"


@dataclass(frozen=True, slots=True, eq=False)
class Upright(Value):
    """A constraint along a path: an axis of the tool frame keeps its direction, as that of a full glass.

    Attributes:
        axis: "x", "y" or "z" of the tool frame.
        within: largest angle between the axis and its direction [rad], 0.01 to pi.
        direction: of the axis, in the base, shape (3,); its length does not matter. None: the one that the axis has
            where the path begins, which is written down in `Path.keep`.

    Raises:
        ShapeError: no such axis, or another shape.
        LimitError: an angle outside its range, or a direction of length 0.
    """

    axis: Literal["x", "y", "z"] = "z"
    within: float = 0.1
    direction: npt.ArrayLike | None = None

    def __post_init__(self) -> None:
        word(self.axis, "axis", tuple(_AXES))
        object.__setattr__(self, "within", within(self.within, "within", 0.01, pi, unit="rad"))
        if self.direction is not None:
            object.__setattr__(self, "direction", unit_vector(self.direction, "direction"))

    @property
    def column(self) -> int:
        """Column of a rotation matrix that is the axis."""
        return _AXES[self.axis]


@dataclass(frozen=True, slots=True, eq=False)
class OnPlane(Value):
    """A constraint along a path: the origin of the tool frame stays on a plane.

    Attributes:
        point: any point of the plane, in the base, shape (3,) [m].
        normal: direction across it, in the base, shape (3,); its length does not matter.
        within: largest distance from the plane [m], 0.001 to 1.

    Raises:
        ShapeError: another shape.
        LimitError: a number outside its range, or a normal without a direction.
    """

    point: npt.ArrayLike
    normal: npt.ArrayLike = (0.0, 0.0, 1.0)
    within: float = 0.005

    def __post_init__(self) -> None:
        _check_place(self, "normal")


@dataclass(frozen=True, slots=True, eq=False)
class OnLine(Value):
    """A constraint along a path: the origin of the tool frame stays on a line without ends.

    Attributes:
        point: any point of the line, in the base, shape (3,) [m].
        direction: of the line, in the base, shape (3,); its length does not matter.
        within: largest distance from the line [m], 0.001 to 1.

    Raises:
        ShapeError: another shape.
        LimitError: a number outside its range, or a direction of length 0.
    """

    point: npt.ArrayLike
    direction: npt.ArrayLike
    within: float = 0.005

    def __post_init__(self) -> None:
        _check_place(self, "direction")


#: What can hold along a whole path; of a `Workspace` the box and the joints.
PathConstraint: TypeAlias = Upright | OnPlane | OnLine | Workspace


@dataclass(frozen=True, slots=True, eq=False)
class Region(Value):
    """A goal that leaves a choice: a box of positions and a cone of orientations of the tool frame.

    Attributes:
        pose: middle of the box and of the cone, in the base.
        box: edges of the box along the axes of the pose, shape (3,) [m], 0 to 4.
        cone: largest angle between the z axes of the tool frame and of the pose [rad], 0 to pi.
        turn: largest angle by which the tool frame may be turned about its own z axis, either way [rad], 0 to pi.

    Raises:
        ShapeError: no pose, or another shape.
        LimitError: a number outside its range.
    """

    pose: Pose
    box: Array = field(default_factory=lambda: frozen(np.zeros(3)))
    cone: float = 0.0
    turn: float = 0.0

    def __post_init__(self) -> None:
        instance(self.pose, Pose, "pose")
        check_pose(self.pose)
        edges = array(self.box, 3, "box")
        for index, edge in enumerate(edges.tolist()):
            within(edge, f"box[{index}]", 0.0, 4.0, unit="m")
        object.__setattr__(self, "box", edges)
        object.__setattr__(self, "cone", within(self.cone, "cone", 0.0, pi, unit="rad"))
        object.__setattr__(self, "turn", within(self.turn, "turn", 0.0, pi, unit="rad"))

    @staticmethod
    def of(
        pose: Pose, *, box: npt.ArrayLike = (0.0, 0.0, 0.0), cone: float = 0.0, turn: float = 0.0
    ) -> Region:
        """A region around a pose; see the attributes. Raises as they state."""
        return Region(pose, array(box, 3, "box"), cone, turn)

    @staticmethod
    def touching(
        point: npt.ArrayLike, *, axis: npt.ArrayLike = (0.0, 0.0, -1.0), gap: float = 0.0, cone: float = 0.0
    ) -> Region:
        """The z axis of the tool frame points along an axis at a point, turned about that axis by any angle.

        Bodies keep the margin of the world from each other also at the goal. To touch a surface, leave a gap and go
        the rest until there is a force: `arm.touch(...)`, `ha.lin_rel(z=gap)` with `until=`.

        Args:
            point: in the base, shape (3,) [m].
            axis: direction in which the tool points there, in the base, shape (3,); its length does not matter.
            gap: distance along the axis by which the tool frame stays before the point [m], 0 to 1.
            cone: largest angle between the z axis of the tool frame and the axis [rad], 0 to pi.

        Raises:
            ShapeError: another shape.
            LimitError: a number outside its range, or an axis of length 0.
        """
        along = unit_vector(axis, "axis")
        place = array(point, 3, "point") - within(gap, "gap", 0.0, 1.0, unit="m") * along
        half = along + (0.0, 0.0, 1.0)  # a half turn about what is between both axes takes z to the axis
        quat = (*half, 0.0) if np.linalg.norm(half) > 1e-6 else (1.0, 0.0, 0.0, 0.0)
        return Region.of(Pose.of(place, np.array(quat) / np.linalg.norm(quat)), cone=cone, turn=pi)


def unit_vector(value: npt.ArrayLike, name: str) -> Array:
    """A direction of length 1, shape (3,).

    Raises:
        ShapeError: another shape.
        LimitError: its length is 0.
    """
    given = array(value, 3, name)
    length = float(np.linalg.norm(given))
    if length < 1e-9:
        raise LimitError(
            f"{name} must have a direction, got {given.tolist()}",
            code=2,
            parameter=name,
            value=given.tolist(),
            hint="for example (0, 0, 1)",
        )
    return frozen(given / length)


def _check_place(part: OnPlane | OnLine, direction: str) -> None:
    """Check a plane or a line, and give its direction the length 1."""
    object.__setattr__(part, "point", array(part.point, 3, "point"))
    object.__setattr__(part, direction, unit_vector(getattr(part, direction), direction))
    object.__setattr__(part, "within", within(part.within, "within", 1e-3, 1.0, unit="m"))
