"""Paths that a search has found around bodies, and what a search is asked for beside joint positions and poses."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from heptarm.values.checks import Array, Value, array, frozen, instance, within, word
from heptarm.values.clearance import Clearance
from heptarm.values.motion.spline import JointSpline
from heptarm.values.pose import Pose, check_pose

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
        keep: constraint along it; None: none.
        world: the model of bodies that it keeps clear of, and against which it is checked again before it is sent.
    """

    start: Array = field(kw_only=True)
    curve: Array = field(kw_only=True)
    duration: float = field(kw_only=True)
    clearance: Clearance | None = field(kw_only=True)
    stats: SearchStats = field(kw_only=True)
    goal: tuple[Array | Pose | Region, ...] = field(kw_only=True, repr=False)
    keep: Upright | None = field(kw_only=True)
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


@dataclass(frozen=True, slots=True)
class Upright(Value):
    """A constraint along a path: an axis of the tool frame keeps its direction, as that of a full glass.

    Attributes:
        axis: "x", "y" or "z" of the tool frame.
        within: largest angle between its direction and the one at the start [rad], 0.01 to pi.

    Raises:
        ShapeError: no such axis.
        LimitError: an angle outside its range.
    """

    axis: Literal["x", "y", "z"] = "z"
    within: float = 0.1

    def __post_init__(self) -> None:
        word(self.axis, "axis", tuple(_AXES))
        object.__setattr__(self, "within", within(self.within, "within", 0.01, pi, unit="rad"))

    @property
    def column(self) -> int:
        """Column of a rotation matrix that is the axis."""
        return _AXES[self.axis]


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
