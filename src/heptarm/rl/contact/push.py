"""The push task: push a puck across a table to a goal, with a rod.

* **Scene.** A puck of 60 mm on a table, a rod of 20 mm on the flange, its end 10 mm above the table.
* **Reset.** The puck is somewhere in front of the rod, the goal somewhere behind the puck.
* **Observation.** Besides the rod's own: where the puck and the goal are, as a camera shows them.
* **Action.** Steps along x and y. The height is held.
* **Reward.** The puck near the goal, the rod behind the puck.
* **Success.** The puck is within `radius` of the goal at the end.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import ClassVar

import numpy as np

from heptarm.rl.contact.task import ContactTask, Moment, quantity
from heptarm.values.checks import Array
from heptarm.values.pose import Pose

#: Radii of puck and rod [m].
_PUCK, _ROD = 0.03, 0.01
#: How far rod and puck are apart before the push [m], and what counts as behind the puck.
_GAP, _BEHIND = 0.012, 0.008
#: Scale of places [m].
_SCALE = 0.1

_SCENE = f"""<mujoco>
  <worldbody>
    <body name="tool">
      <geom name="rod" type="capsule" size="{_ROD}" fromto="0 0 0.02 0 0 0.19" mass="0.3"/>
      <site name="tip" pos="0 0 0.2"/>
    </body>
    <geom name="table" type="box" size="0.3 0.3 0.01" pos="0.6 0 0.19" solref="0.01 1"/>
    <body name="puck" pos="0.6 0 0.215">
      <freejoint/>
      <geom name="puck" type="cylinder" size="{_PUCK} 0.015" mass="0.3" solref="0.01 1"/>
    </body>
  </worldbody>
</mujoco>"""


@dataclass(frozen=True, slots=True)
class Push(ContactTask):
    """Push a puck to a goal.

    The origin of the task is on the table, 10 mm below the end of the rod; z goes down. The target is where the puck
    begins and where it is to go: x, y each [m].

    Attributes:
        reach: half width of the area in which puck and goal are drawn, along x [m].
        side: likewise along y [m].

    Raises:
        CommandRejected: unknown robot.
        ShapeError: something that is no number.
        LimitError: a number outside its range.
    """

    name: ClassVar[str] = "push"
    axes: ClassVar[tuple[int, ...]] = (0, 1)
    look_size: ClassVar[int] = 6
    has_teacher: ClassVar[bool] = True
    scales: ClassVar[tuple[float, ...]] = (0.05, 0.05, 0.05, 0.1, 0.1, 0.1)
    origin: ClassVar[Pose] = Pose.of((0.6, 0.0, 0.2), (0.0, 1.0, 0.0, 0.0))
    friction: ClassVar[tuple[float, float]] = (0.2, 0.5)

    _: KW_ONLY
    rate: float = quantity(10.0, "Hz")
    steps: int = 120
    history: tuple[int, ...] = (0, 1, 3)
    radius: float = quantity(0.01, "m")
    step: float = quantity(6e-3, "m")
    leash: float = quantity(0.015, "m")
    reach: float = quantity(0.03, "m")
    side: float = quantity(0.06, "m")

    def scene(self) -> str:
        """Table, puck and rod."""
        return _SCENE

    @property
    def box(self) -> tuple[Array, Array]:
        """Above the table, at one height."""
        side = np.array([0.2, 0.2, 0.0, 0.0, 0.0, 0.0])
        height = np.array([0.0, 0.0, -0.01, 0.0, 0.0, 0.0])
        return height - side, height + side

    def targets(self, random: np.random.Generator, count: int) -> Array:
        """Where the puck begins, and its goal farther along x."""
        places = random.uniform(-1.0, 1.0, (count, 4)) * [self.reach, self.side, self.reach, self.side]
        result: Array = places + [-0.02, 0.0, 0.08, 0.0]
        return result

    def goals(self, targets: Array) -> Array:
        """Where the puck is to be, on the table."""
        return np.column_stack([targets[:, 2:4], np.zeros(len(targets))])

    def starts(self, random: np.random.Generator, count: int) -> Array:
        """Before the area of the puck."""
        found = np.zeros((count, 6))
        found[:, 0], found[:, 2] = -0.12, -0.01
        found[:, 1] = random.uniform(-0.02, 0.02, count)
        return found

    def bodies(self, target: Array) -> dict[str, Array]:
        """The puck on the table."""
        pose = np.zeros((len(target), 6))
        pose[:, :2], pose[:, 2] = target[:, :2], -0.015
        return {"puck": pose}

    def look(self, now: Moment) -> Array:
        """The puck from the rod, the goal from the puck and from the rod."""
        puck, goal, rod = now.bodies["puck"][..., :2], now.target[..., 2:4], now.pose[..., :2]
        return np.concatenate([puck - rod, goal - puck, goal - rod], axis=-1) / _SCALE

    def missing(self, now: Moment) -> Array:
        """From the puck to its goal."""
        result: Array = np.linalg.norm(now.target[..., 2:4] - now.bodies["puck"][..., :2], axis=-1)
        return result

    def reward(self, now: Moment) -> Array:
        """The puck near its goal, and the rod behind the puck."""
        left = self.missing(now)
        behind, _ = self._behind(now)
        away = np.linalg.norm(behind - now.pose[..., :2], axis=-1)
        result: Array = (
            -0.5 * np.minimum(left / _SCALE, 2.0)
            - 0.1 * np.minimum(away / _SCALE, 2.0)
            + 0.5 * (left <= self.radius)
        )
        return result

    def teach(self, now: Moment) -> Array:
        """Go round the puck to behind it, then push it along the line to the goal."""
        puck, goal, rod = now.bodies["puck"][..., :2], now.target[..., 2:4], now.pose[..., :2]
        behind, ahead = self._behind(now)
        aside = np.stack([-ahead[..., 1], ahead[..., 0]], axis=-1)
        off = ((rod - puck) * aside).sum(axis=-1, keepdims=True)
        along = ((rod - puck) * ahead).sum(axis=-1, keepdims=True)
        is_behind = (along < 0.0) & (np.abs(off) < _BEHIND)
        is_beside = (along > -_PUCK - _ROD) & ~is_behind
        side = np.where(off >= 0.0, 1.0, -1.0) * (_PUCK + _ROD + _GAP)
        around = np.where(np.abs(off) < _PUCK + _ROD, rod + (side - off) * aside, behind + side * aside)
        left = np.linalg.norm(goal - puck, axis=-1, keepdims=True)
        push = puck - (_PUCK + _ROD) * ahead - 1.5 * off * aside + np.minimum(left, 0.02) * ahead
        goal_of_rod = np.where(is_behind, push, np.where(is_beside, around, behind))
        is_there = left < 0.3 * self.radius
        wanted = np.concatenate(
            [np.where(is_there, rod - 0.01 * ahead, goal_of_rod), now.pose[..., 2:]], axis=-1
        )
        return self.steer(now, wanted)

    def _behind(self, now: Moment) -> tuple[Array, Array]:
        """Where the rod begins to push, and the direction to the goal; shape (n, 2) each."""
        puck, goal = now.bodies["puck"][..., :2], now.target[..., 2:4]
        ahead = goal - puck
        ahead = ahead / np.maximum(np.linalg.norm(ahead, axis=-1, keepdims=True), 1e-6)
        return puck - (_PUCK + _ROD + _GAP) * ahead, ahead
