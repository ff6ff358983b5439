"""Distances between bodies, and what a collision check answers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from heptarm.values.checks import Array, Value
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.values.shape import Shape
from heptarm.values.tool import KnownTool, Workpiece
from heptarm.values.world import WorldOutline

if TYPE_CHECKING:
    from typing_extensions import Self


@dataclass(frozen=True, slots=True)
class Clearance(Value):
    """The distance between two bodies.

    Attributes:
        first: name of a body of the arm, its tool, or what it holds.
        second: name of the other body.
        distance: between their surfaces [m]; negative: they overlap by so much.
    """

    first: str
    second: str
    distance: float

    def __str__(self) -> str:
        """In words."""
        if self.distance < 0.0:
            return f"{self.first} is {-self.distance * 1e3:.0f} mm inside {self.second}"
        return f"{self.first} is {self.distance * 1e3:.0f} mm from {self.second}"


@dataclass(frozen=True, slots=True, eq=False)
class TouchOnPath(Value):
    """The first place on a joint path at which two bodies touch.

    Attributes:
        clearance: the bodies, and their distance there.
        at: fraction of the path, 0 to 1: of the length that the fastest joint moves.
        q: joint positions there, shape (7,) [rad].
    """

    clearance: Clearance
    at: float
    q: Array


class CollisionCheck(Protocol):
    """What `Arm.collision_check` needs; `heptarm.CollisionModel` is one."""

    def first_on(self, path: Array) -> TouchOnPath | None:
        """The first place on a joint path, shape (n, 7) [rad], at which two bodies touch; None: there is none."""


class ClearanceModel(Protocol):
    """What `keep_clear_of` of a servo stream needs; `heptarm.CollisionModel` is one."""

    @property
    def margin(self) -> float:
        """Bodies nearer than this count as touching [m]."""

    @property
    def allowed(self) -> frozenset[frozenset[str]]:
        """Pairs of names of bodies that may touch."""

    def clearances(self, q: Array, *, below: float) -> tuple[Clearance, ...]:
        """Pairs of bodies nearer than a distance [m] at joint positions, shape (7,) [rad]."""


@runtime_checkable
class CollisionWorld(CollisionCheck, ClearanceModel, Protocol):
    """What a client of an arm asks of a `heptarm.CollisionModel`, without MuJoCo, which its module imports."""

    @property
    def robot(self) -> RobotModel:
        """The robot and its limits."""

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of all bodies."""

    @property
    def checks(self) -> int:
        """Postures whose distances were computed so far."""

    def distances(self, q: Array, *, below: float) -> Array:
        """Distance of the nearest two bodies at n joint positions, shape (n, 7) [rad]; shape (n,) [m]."""

    def touching(self, q: Array) -> tuple[Clearance, ...]:
        """Pairs of bodies that touch at joint positions, shape (7,) [rad]."""

    def is_free(self, first: Array, last: Array) -> bool:
        """Whether nothing touches on a straight joint path, both shape (7,) [rad]."""

    # What changes.

    @property
    def revision(self) -> int:
        """Counts the changes of the world."""

    def wait_for_change(self, revision: int, *, timeout: float) -> int:
        """Wait up to `timeout` [s] until the world has changed since a revision; the revision now."""

    def outline(self) -> WorldOutline:
        """What a panel shows of the world."""

    # What an arm grasps and carries.

    def pose(self, body: str) -> Pose:
        """Pose of a free body in the base."""

    def held(self, body: str) -> Pose | None:
        """Pose in the flange frame of a free body that the arm holds; None: the arm does not hold it."""

    def shapes(self, body: str) -> tuple[Shape, ...]:
        """Shapes of a free body in its frame."""

    def place(self, body: str, pose: Pose) -> None:
        """Put a free body somewhere: its pose in the base."""

    def hold(self, body: str, pose: Pose) -> None:
        """Let the flange carry a free body; its pose in the flange frame."""

    def allowing(self, pairs: Iterable[tuple[str, str]]) -> Self:
        """The same world, in which more pairs of bodies may touch."""

    def carrying(
        self,
        tool: KnownTool | None,
        workpiece: Workpiece | KnownTool | None = None,
        *,
        at: Pose | None = None,
    ) -> Self:
        """The same world, of an arm that carries a tool, and a workpiece at a frame in the flange frame."""

    # Other arms.

    @property
    def arms(self) -> tuple[str, ...]:
        """Names of the other arms in the world."""

    def seen_by(self, name: str, *, own: str) -> Self:
        """The same world for another arm in it, where this one has the name `own`."""

    def first_together(self, t: Array, q: Array, others: Mapping[str, Array]) -> ForeseenCollision | None:
        """The first time at which this arm and another one touch, when they move; None: nothing touches."""


@dataclass(frozen=True, slots=True, eq=False)
class ForeseenCollision(Value):
    """Two bodies that would touch in a program that was looked ahead.

    Attributes:
        clearance: the bodies, and their distance there.
        t: time from the beginning of the program [s].
        motion: index of the motion.
        q: joint positions there, shape (7,) [rad].
    """

    clearance: Clearance
    t: float
    motion: int
    q: Array

    def __str__(self) -> str:
        """In words."""
        return f"{self.clearance} after {self.t:.2f} s, in motion {self.motion}"
