"""The polishing task: press a pad with a given force along a path over a surface that is known to some millimetres.

* **Scene.** A ball of 30 mm on the flange, a plate.
* **Reset.** The ball is above one end of the path; height and tilt of the plate are drawn.
* **Observation.** Besides the pad's own: the force that is wanted, and how much is done.
* **Action.** Steps along x, y, z.
* **Reward.** The wanted force, on the path, and the part of it that is done.
* **Success.** All of the path but `radius` was passed with the wanted force, within 35 %.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from math import radians
from typing import ClassVar

import numpy as np

from heptarm.rl.contact.task import ContactTask, Moment, quantity
from heptarm.values.checks import Array

#: Radius of the pad, how far from the path is on it, and how far the ball begins above the plate [m].
_PAD, _ON, _ABOVE = 0.015, 3e-3, 6e-3
#: Parts of the path that are counted, and the error of the force that counts as the wanted one.
_CELLS, _CLOSE = 24, 0.35
#: Scale of forces [N].
_NEWTONS = 10.0

_SCENE = f"""<mujoco>
  <worldbody>
    <body name="tool">
      <geom name="holder" type="cylinder" size="0.008" fromto="0 0 0.02 0 0 0.15" mass="0.4"/>
      <geom name="pad" type="sphere" size="{_PAD}" pos="0 0 {0.16 - _PAD}" mass="0.1" solref="0.01 1"/>
      <site name="tip" pos="0 0 0.16"/>
    </body>
    <body name="plate" mocap="true">
      <geom name="plate" type="box" size="0.06 0.12 0.01" pos="0 0 0.01" solref="0.01 1"/>
    </body>
  </worldbody>
</mujoco>"""


@dataclass(frozen=True, slots=True)
class Polish(ContactTask):
    """Polish along a path with a force.

    The origin of the task is the middle of the path, where the plate is presumed; z goes into it, the path along y. The
    target is where the plate truly is, its height [m] and its tilt about x and y [rad], and the wanted force [N].

    Attributes:
        length: of the path [m].
        height: half width of the error of the plate's height [m].
        tilt: largest tilt about each axis [rad].
        least: smallest wanted force [N].
        most: largest wanted force [N].

    Raises:
        CommandRejected: unknown robot.
        ShapeError: something that is no number.
        LimitError: a number outside its range.
    """

    name: ClassVar[str] = "polish"
    axes: ClassVar[tuple[int, ...]] = (0, 1, 2)
    look_size: ClassVar[int] = 3
    memory_size: ClassVar[int] = _CELLS
    has_teacher: ClassVar[bool] = True
    scales: ClassVar[tuple[float, ...]] = (0.01, 0.03, 0.01, 0.1, 0.1, 0.1)
    friction: ClassVar[tuple[float, float]] = (0.1, 0.4)

    _: KW_ONLY
    steps: int = 240
    radius: float = quantity(0.012, "m")
    step: float = quantity(1.5e-3, "m")
    leash: float = quantity(0.015, "m")
    length: float = quantity(0.12, "m")
    height: float = quantity(3e-3, "m")
    tilt: float = quantity(radians(2.0), "rad")
    least: float = quantity(6.0, "N")
    most: float = quantity(12.0, "N")

    def scene(self) -> str:
        """Plate and pad."""
        return _SCENE

    @property
    def box(self) -> tuple[Array, Array]:
        """Around the path."""
        side, along, deep = 0.01, 0.6 * self.length, 3.0 * self.height + self.leash
        return np.array([-side, -along, -0.03, 0.0, 0.0, 0.0]), np.array([side, along, deep, 0.0, 0.0, 0.0])

    def targets(self, random: np.random.Generator, count: int) -> Array:
        """Height and tilt of the plate, and the force."""
        spread = np.array([self.height, self.tilt, self.tilt])
        plate = random.uniform(-spread, spread, (count, 3))
        return np.concatenate([plate, random.uniform(self.least, self.most, (count, 1))], axis=1)

    def starts(self, random: np.random.Generator, count: int) -> Array:
        """Above the beginning of the path."""
        found = np.zeros((count, 6))
        found[:, 1], found[:, 2] = -0.5 * self.length, -_ABOVE - self.height
        return found

    def bodies(self, target: Array) -> dict[str, Array]:
        """The plate."""
        pose = np.zeros((len(target), 6))
        pose[:, 2:5] = target[:, :3]
        return {"plate": pose}

    def look(self, now: Moment) -> Array:
        """The wanted force, what of it is missing, and the part of the path that is done."""
        wanted = now.target[..., 3]
        shown = [wanted / _NEWTONS, (wanted - self._force(now)) / _NEWTONS, now.memory.mean(axis=-1)]
        return np.stack(shown, axis=-1)

    def remember(self, now: Moment) -> Array:
        """Which parts of the path were passed with the wanted force."""
        part = np.floor((now.pose[..., 1] / self.length + 0.5) * _CELLS)
        counts = (np.abs(now.pose[..., 0]) < _ON) & (self._error(now) < _CLOSE)
        passed = (np.arange(_CELLS) == part[..., None]) & counts[..., None]
        result: Array = np.maximum(now.memory, passed)
        return result

    def missing(self, now: Moment) -> Array:
        """Length of the path that was not passed with the wanted force."""
        result: Array = self.length * (1.0 - now.memory.mean(axis=-1))
        return result

    def reward(self, now: Moment) -> Array:
        """The wanted force, on the path, much of it done."""
        aside = np.abs(now.pose[..., 0]) / _ON
        result: Array = (
            now.memory.mean(axis=-1)
            - 0.3 * np.minimum(self._error(now), 2.0)
            - 0.1 * np.minimum(aside, 2.0)
            - 0.5
        )
        return result

    def teach(self, now: Moment) -> Array:
        """Press, and go on while the force is the wanted one."""
        height, about_x, about_y, wanted = np.moveaxis(now.target, -1, 0)
        x, y = now.pose[..., 0], now.pose[..., 1]
        surface = height + about_x * y - about_y * x
        touches = now.pose[..., 2] > surface - 1e-3
        goal = np.zeros((*x.shape, 6))
        goal[..., 1] = np.where(
            self._error(now) < _CLOSE, now.command[..., 1] + 1.5 * self.step, now.command[..., 1]
        )
        more = (wanted - self._force(now)) / self.stiffness
        goal[..., 2] = np.where(touches, now.command[..., 2] + more, surface + 1e-3)
        return self.steer(now, goal)

    @staticmethod
    def _force(now: Moment) -> Array:
        """With which the pad presses, shape (n,) [N]."""
        result: Array = -now.wrench[..., 2]
        return result

    def _error(self, now: Moment) -> Array:
        """Of the force, as a fraction of the wanted one."""
        wanted = now.target[..., 3]
        return np.abs(self._force(now) - wanted) / wanted
