"""The base of insertions: a part on the flange, and a hole whose place is known to a few millimetres and degrees.

* **Reset.** The tip is some millimetres above the place where the hole should be; the hole itself is drawn around it.
* **Observation.** A part that is pressed onto the rim is supported on one side: the moment shows where the hole is,
  which is why no spiral is needed.
* **Action.** Steps along x, y, z and turns about x and y.
* **Reward.** Privileged: the true hole is known to the simulator alone.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from math import radians
from typing import ClassVar

import numpy as np

from heptarm.rl.contact.task import ContactTask, Moment, quantity
from heptarm.values.checks import Array, array, within
from heptarm.values.pose import Pose

#: Force with which the teacher presses onto the rim while it looks for the hole [N].
PRESS = 7.0
#: Scales of what is hidden [m, rad].
_ASIDE = np.array([3e-3, 3e-3, 10e-3])
_TILT = 0.035


@dataclass(frozen=True, slots=True)
class InsertTask(ContactTask):
    """Insert a part into a hole.

    The frame of the task is the presumed hole: origin in the middle of the rim, z into the hole. The target is where
    the hole truly is in it: x, y, z [m] and a rotation vector [rad].

    Attributes:
        clearance: width of the hole less that of the part [m].
        depth: how deep the part is to go [m].
        place: half width of the error of the presumed place, across the hole [m].
        height: half width of that along the hole [m].
        tilt: largest angle between the presumed axis and the true one [rad].
        above: tip above the presumed rim at the start, lowest and highest [m].
        force: what a peak force above costs in training [N].

    Raises:
        CommandRejected: unknown robot.
        ShapeError: something that is no number.
        LimitError: a number outside its range.
    """

    hidden_size: ClassVar[int] = 6
    has_teacher: ClassVar[bool] = True

    _: KW_ONLY
    clearance: float = quantity(0.5e-3, "m")
    depth: float = quantity(0.03, "m")
    place: float = quantity(3e-3, "m")
    height: float = quantity(1e-3, "m")
    tilt: float = quantity(radians(2.0), "rad")
    above: tuple[float, float] = (2e-3, 6e-3)
    force: float = quantity(20.0, "N")

    def __post_init__(self) -> None:
        ContactTask.__post_init__(self)
        low, high = array(self.above, 2, "above").tolist()
        within(high, "above", within(low, "above", 0.0, 0.1, unit="m"), 0.1, unit="m")
        object.__setattr__(self, "above", (low, high))

    @property
    def box(self) -> tuple[Array, Array]:
        """Around the presumed hole."""
        side, angle = 2.0 * self.place + self.leash, 2.0 * self.tilt + self.turn_leash
        low = np.array([-side, -side, -self.above[1] - self.leash, -angle, -angle, 0.0])
        return low, np.array([side, side, self.depth + self.height + self.leash, angle, angle, 0.0])

    def targets(self, random: np.random.Generator, count: int) -> Array:
        """True holes."""
        found = np.zeros((count, 6))
        found[:, :2] = random.uniform(-self.place, self.place, (count, 2))
        found[:, 2] = random.uniform(-self.height, self.height, count)
        angle, axis = random.uniform(0.0, self.tilt, count), random.uniform(0.0, 2.0 * np.pi, count)
        found[:, 3], found[:, 4] = angle * np.cos(axis), angle * np.sin(axis)
        return found

    def goals(self, targets: Array) -> Array:
        """The true rims."""
        return targets[:, :3]

    def starts(self, random: np.random.Generator, count: int) -> Array:
        """Above the presumed rim."""
        found = np.zeros((count, 6))
        found[:, 2] = -random.uniform(*self.above, count)
        return found

    def bodies(self, target: Array) -> dict[str, Array]:
        """The hole."""
        return {"hole": target}

    def hidden(self, now: Moment) -> Array:
        """Where the hole is, and the friction."""
        turn = (now.target - now.pose)[..., 3:5] / _TILT
        return np.concatenate([self.offset(now) / _ASIDE, turn, now.friction[..., None]], axis=-1)

    def teach(self, now: Moment) -> Array:
        """Align while pressing gently, then push."""
        pose, hole, height = now.pose, now.target, self.offset(now)[..., 2]
        deep = np.maximum(height, 0.0)[..., None]
        goal = np.zeros((*pose.shape[:-1], 6))
        goal[..., :2] = hole[..., :2] + deep * np.stack([hole[..., 4], -hole[..., 3]], axis=-1)
        away, turn = goal[..., :2] - pose[..., :2], hole[..., 3:5] - pose[..., 3:5]
        goal[..., :2] += away
        goal[..., 3:5] = hole[..., 3:5] + 0.5 * turn
        action = self.steer(now, goal)
        aside, turned = np.linalg.norm(away, axis=-1), np.linalg.norm(turn, axis=-1)
        is_aligned = (aside < 0.6 * self.clearance) & (turned < 0.015) | (height > 1e-3)
        pressed = (pose[..., 2] + PRESS / self.stiffness - now.command[..., 2]) / self.step
        action[..., 2] = np.clip(np.where(is_aligned, 1.0, np.minimum(pressed, 1.0)), -1.0, 1.0)
        return action

    def offset(self, now: Moment) -> Array:
        """The tip in the frame of the true hole, shape (..., 3) [m]; rotations are small."""
        away = now.pose[..., :3] - now.target[..., :3]
        return away - np.cross(now.target[..., 3:], away)

    def missing(self, now: Moment) -> Array:
        """Depth that is missing; what is beside the hole is not in it."""
        inside = self.offset(now)
        beside = np.hypot(inside[..., 0], inside[..., 1]) > 0.5 * self.clearance + 1e-3
        return self.depth - np.where(
            beside, np.minimum(inside[..., 2], 0.0), np.minimum(inside[..., 2], self.depth)
        )

    def left(self, now: Moment) -> Array:
        """Depth that is missing. How far aside the tip seems to be does not count: a part turns in its gripper."""
        return self.depth - np.minimum(self.offset(now)[..., 2], self.depth)

    @staticmethod
    def presumed(hole: Pose, error: Array) -> Pose:
        """The frame of the task for a hole that is there, where it is presumed with an error, see `targets`."""
        return hole @ Pose.from_rotvec(error[:3], error[3:]).inverse()

    def reward(self, now: Moment) -> Array:
        """Aligned, deep, gentle, and there."""
        inside, left = self.offset(now), self.missing(now)
        aside = np.hypot(inside[..., 0], inside[..., 1]) / self.place
        turned = np.linalg.norm((now.pose - now.target)[..., 3:5], axis=-1) / self.tilt
        hard = np.maximum(np.linalg.norm(now.wrench[..., :3], axis=-1) / self.force - 1.0, 0.0)
        result: Array = (
            -0.4 * np.minimum(aside, 2.0)
            - 0.5 * left / self.depth
            - 0.1 * np.minimum(turned, 2.0)
            - 0.2 * np.minimum(hard, 5.0)
            + 0.5 * (left <= self.radius)
        )
        return result
