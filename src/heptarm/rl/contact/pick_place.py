"""The pick-and-place task: take a cube from a table and put it down at a goal, with the two-finger gripper.

* **Scene.** A cube of 36 mm on a table, the shipped gripper.
* **Reset.** The open gripper is above the table, the cube on one side of it, the goal on the other.
* **Observation.** Besides the gripper's own: where the cube and the goal are, as a camera shows them.
* **Action.** Steps along x, y, z; and the gripper closes or opens.
* **Reward.** Near the cube, the cube near the goal.
* **Success.** The cube is within `radius` of the goal on the table at the end, and released.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import ClassVar

import numpy as np

from heptarm.rl.contact.task import ContactTask, Moment, quantity
from heptarm.values.checks import Array
from heptarm.values.pose import Pose

#: Half an edge of the cube, heights of the tip where it grasps and where it travels (z goes down) [m].
_HALF, _GRASP, _TRAVEL = 0.018, -0.022, -0.08
#: A finger that is no farther from the middle holds the cube [m].
_HELD = 0.0192
#: How near in x and y is above something [m]; what a cube that is held adds to what is missing; scale of places.
_NEAR, _UNRELEASED, _SCALE = 0.004, 0.02, 0.1

_SCENE = f"""<mujoco>
  <option cone="elliptic" impratio="10"/>
  <include file="two-finger-gripper.xml"/>
  <worldbody>
    <geom name="table" type="box" size="0.3 0.3 0.01" pos="0.6 0 0.19" solref="0.01 1"/>
    <body name="cube" pos="0.6 0 0.218">
      <freejoint/>
      <geom name="cube" type="box" size="{_HALF} {_HALF} {_HALF}" mass="0.1" condim="4" solref="0.01 1"/>
    </body>
  </worldbody>
</mujoco>"""


@dataclass(frozen=True, slots=True)
class PickPlace(ContactTask):
    """Put a cube down at a goal.

    The origin of the task is on the table; z goes down. The target is where the cube begins and where it is to go: x, y
    each [m].

    Attributes:
        reach: half width of the areas in which cube and goal are drawn [m].
        apart: from the middle of the one area to that of the other along y [m].

    Raises:
        CommandRejected: unknown robot.
        ShapeError: something that is no number.
        LimitError: a number outside its range.
    """

    name: ClassVar[str] = "pick-place"
    axes: ClassVar[tuple[int, ...]] = (0, 1, 2)
    has_gripper: ClassVar[bool] = True
    look_size: ClassVar[int] = 6
    has_teacher: ClassVar[bool] = True
    site: ClassVar[str] = "tcp"
    scales: ClassVar[tuple[float, ...]] = (0.05, 0.05, 0.05, 0.1, 0.1, 0.1)
    origin: ClassVar[Pose] = Pose.of((0.6, 0.0, 0.2), (0.0, 1.0, 0.0, 0.0))
    friction: ClassVar[tuple[float, float]] = (0.3, 0.6)
    frequency: ClassVar[float] = 500.0

    _: KW_ONLY
    rate: float = quantity(10.0, "Hz")
    steps: int = 120
    history: tuple[int, ...] = (0, 1, 2, 4)
    radius: float = quantity(0.01, "m")
    step: float = quantity(8e-3, "m")
    leash: float = quantity(0.015, "m")
    reach: float = quantity(0.03, "m")
    apart: float = quantity(0.12, "m")

    def scene(self) -> str:
        """Table, cube and gripper."""
        return _SCENE

    @property
    def box(self) -> tuple[Array, Array]:
        """Above the table."""
        return np.array([-0.15, -0.2, -0.15, 0.0, 0.0, 0.0]), np.array([0.15, 0.2, _GRASP, 0.0, 0.0, 0.0])

    def targets(self, random: np.random.Generator, count: int) -> Array:
        """Where the cube begins on one side, and its goal on the other."""
        side = 0.5 * self.apart * random.choice([-1.0, 1.0], (count, 1)) * [0.0, 1.0, 0.0, -1.0]
        result: Array = side + random.uniform(-self.reach, self.reach, (count, 4))
        return result

    def goals(self, targets: Array) -> Array:
        """Where the cube is to be, on the table."""
        return np.column_stack([targets[:, 2:4], np.zeros(len(targets))])

    def starts(self, random: np.random.Generator, count: int) -> Array:
        """Above the middle."""
        found = np.zeros((count, 6))
        found[:, :2] = random.uniform(-0.02, 0.02, (count, 2))
        found[:, 2] = _TRAVEL
        return found

    def bodies(self, target: Array) -> dict[str, Array]:
        """The cube on the table."""
        pose = np.zeros((len(target), 6))
        pose[:, :2], pose[:, 2] = target[:, :2], -_HALF
        return {"cube": pose}

    def look(self, now: Moment) -> Array:
        """The cube from the tip, and its goal from it."""
        cube = now.bodies["cube"][..., :3]
        return np.concatenate([cube - now.pose[..., :3], self._goal(now) - cube], axis=-1) / _SCALE

    def missing(self, now: Moment) -> Array:
        """From the cube to its goal, and more while it is not released."""
        away = np.linalg.norm(self._goal(now) - now.bodies["cube"][..., :3], axis=-1)
        result: Array = away + _UNRELEASED * (now.command[..., 6] > 0.0)
        return result

    def reward(self, now: Moment) -> Array:
        """Near the cube, the cube near the goal, and there."""
        left, cube = self.missing(now), now.bodies["cube"][..., :3]
        away = np.linalg.norm(cube - now.pose[..., :3], axis=-1)
        is_there = left <= self.radius
        result: Array = (
            -0.5 * np.minimum(left / _SCALE, 2.0)
            - 0.2 * np.where(is_there, 0.0, np.minimum(away / _SCALE, 2.0))
            + 0.5 * is_there
        )
        return result

    def teach(self, now: Moment) -> Array:
        """Above the cube, down, close, up, above the goal, down, open, up."""
        tip, cube, goal = now.pose[..., :3], now.bodies["cube"][..., :3], self._goal(now)
        is_low = cube[..., 2] > -_HALF - 0.004
        is_done = (np.linalg.norm((goal - cube)[..., :2], axis=-1) < 0.5 * self.radius) & is_low
        is_over = np.linalg.norm((cube - tip)[..., :2], axis=-1) < _NEAR
        is_around = is_over & (np.abs(tip[..., 2] - cube[..., 2]) < 0.008)
        is_closed = now.command[..., 6] > 0.0
        holds = is_around & is_closed & (now.joints["left_finger"] < _HELD)
        is_over_goal = np.linalg.norm((goal - cube)[..., :2], axis=-1) < 0.5 * _NEAR
        across = np.where(holds[..., None], tip[..., :2] + (goal - cube)[..., :2], cube[..., :2])
        is_high = tip[..., 2] < _TRAVEL + 0.02
        moves = np.where(holds, is_high | is_over_goal, True) & ~is_done
        height = np.where(np.where(holds, is_over_goal, is_over) & ~is_done, _GRASP, _TRAVEL)
        waits = is_around & ~holds & ~is_done  # for the fingers
        wanted = np.zeros((*tip.shape[:-1], 6))
        wanted[..., :2] = np.where(moves[..., None], across, now.command[..., :2])
        wanted[..., 2] = np.where(waits, now.command[..., 2], height)
        action = self.steer(now, wanted)
        grips = np.where(is_around & ~is_done, 1.0, -1.0)
        return np.concatenate([action, grips[..., None]], axis=-1)

    def _goal(self, now: Moment) -> Array:
        """Where the middle of the cube is to be, shape (n, 3) [m]."""
        return np.concatenate([now.target[..., 2:4], np.full((*now.target.shape[:-1], 1), -_HALF)], axis=-1)
