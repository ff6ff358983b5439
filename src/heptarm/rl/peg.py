"""The peg-in-hole task: put a round peg into a hole whose place is known to a few millimetres and degrees.

One definition serves training, evaluation and an arm: the scene's dimensions, how an episode begins, what the policy
observes, what its actions do, what is rewarded, what counts as success, and what bounds the forces.

* **Scene.** That of the shipped scene `peg-in-hole`: a peg of 20 mm in the gripper, a hole wider by `clearance`.
* **Reset.** The tip is some millimetres above the place where the hole should be; the hole itself is drawn around it.
* **Observation.** Of some of the last decisions each: pose of the tip and of its set-point in the frame of the presumed
  hole, and the wrench at the tip in its axes, from joint torques, zeroed when the episode begins. A peg that is pressed
  onto the rim is supported on one side: the moment shows where the hole is, which is why no spiral is needed.
* **Action.** A step of the set-point of a Cartesian impedance: x, y, z and turns about x and y. A round peg needs no
  turn about its own axis.
* **Reward.** Privileged: the true hole is known to the simulator alone.
* **Success.** The peg is `depth` deep in the hole at the end, within `radius`.
* **Safety.** The set-point stays within a leash of the measured pose, so that the spring cannot press harder than leash
  times stiffness, and within a box around the presumed hole.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, asdict, dataclass, fields
from math import radians
from typing import Any, ClassVar

import numpy as np

from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.checks import Array, array, integer, numbers, shown, within
from heptarm.values.robot import RobotModel, robot

#: Numbers of a frame of the observation: pose, set-point and wrench, five each.
_FRAME = 15
#: Largest number of a task, and the age of the oldest frame.
_LARGE, _OLDEST = 1e6, 1000
#: Scales of an observation: [m], [rad], [N], [Nm].
_POSE = np.array([3e-3, 3e-3, 10e-3, 0.035, 0.035])
_WRENCH = np.array([10.0, 10.0, 10.0, 0.2, 0.2])
#: Coordinates that a policy acts on: x, y, z and the turns about x and y, of six.
AXES = np.arange(5)
#: Force with which the teacher presses onto the rim while it looks for the hole [N].
PRESS = 7.0
_UNITS = {
    "rate": "Hz",
    "clearance": "m",
    "depth": "m",
    "radius": "m",
    "place": "m",
    "height": "m",
    "tilt": "rad",
    "leash": "m",
    "turn_leash": "rad",
    "stiffness": "N/m",
    "turn_stiffness": "Nm/rad",
    "step": "m",
    "turn": "rad",
    "force": "N",
}


@dataclass(frozen=True, slots=True)
class PegInHole:
    """Insert a round peg into a hole.

    Poses are of the peg's tip in the frame of the presumed hole: origin in the middle of the rim, z into the hole.

    Attributes:
        robot: name of the robot.
        clearance: diameter of the hole less that of the peg [m].
        rate: decisions a second [Hz].
        steps: decisions an episode.
        history: ages of the frames that an observation shows [decisions]; what is older than the episode is its start.
        depth: how deep the peg is to go [m].
        radius: missing depth that counts as success [m].
        place: half width of the error of the presumed place, across the hole [m].
        height: half width of that along the hole [m].
        tilt: largest angle between the presumed axis and the true one [rad].
        above: tip above the presumed rim at the start, lowest and highest [m].
        step: of the set-point at |action| = 1 [m].
        turn: likewise [rad].
        leash: farthest that the set-point may be from the measured pose [m]; times the stiffness: the largest force.
        turn_leash: likewise [rad].
        stiffness: of the impedance [N/m].
        turn_stiffness: likewise [Nm/rad].
        force: what a peak force above costs in training [N].

    Raises:
        CommandRejected: unknown robot.
        ShapeError: something that is no number.
        LimitError: a number outside its range.
    """

    #: Name at the command line.
    name: ClassVar[str] = "peg-in-hole"

    robot: str = "iiwa14"
    _: KW_ONLY
    clearance: float = 0.5e-3
    rate: float = 20.0
    steps: int = 160
    history: tuple[int, ...] = (0, 1, 3, 7, 15)
    depth: float = 0.03
    radius: float = 1.5e-3
    place: float = 3e-3
    height: float = 1e-3
    tilt: float = radians(2.0)
    above: tuple[float, float] = (2e-3, 6e-3)
    step: float = 1.0e-3
    turn: float = 5e-3
    leash: float = 9e-3
    turn_leash: float = 0.04
    stiffness: float = 1500.0
    turn_stiffness: float = 60.0
    force: float = 20.0

    def __post_init__(self) -> None:
        self.model  # noqa: B018  raises for an unknown robot
        for name, unit in _UNITS.items():
            object.__setattr__(
                self, name, within(getattr(self, name), name, 0.0, _LARGE, above=True, unit=unit)
            )
        integer(self.steps, "steps", 1, 1_000_000)
        ages = numbers(self.history, "history", "ages in decisions").tolist()
        if not isinstance(ages, list) or not ages:
            raise ShapeError(
                f"history must be ages in decisions, got {shown(self.history)}", parameter="history"
            )
        ages = [int(one) if isinstance(one, float) and one.is_integer() else one for one in ages]
        object.__setattr__(self, "history", tuple(integer(one, "history", 0, _OLDEST) for one in ages))
        low, high = array(self.above, 2, "above").tolist()
        within(high, "above", within(low, "above", 0.0, 0.1, unit="m"), 0.1, unit="m")
        object.__setattr__(self, "above", (low, high))

    @property
    def model(self) -> RobotModel:
        """The robot's dimensions and limits."""
        return robot(self.robot)

    @property
    def frame_size(self) -> int:
        """Size of what a decision shows."""
        return _FRAME

    @property
    def observation_size(self) -> int:
        """Size of an observation."""
        return _FRAME * len(self.history)

    @property
    def hidden_size(self) -> int:
        """Size of `hidden`."""
        return 6

    @property
    def action_size(self) -> int:
        """Size of an action."""
        return len(AXES)

    # ------------------------------------------------------------------------------ drawing episodes

    def targets(self, random: np.random.Generator, count: int) -> Array:
        """True holes in the frame of the presumed one: x, y, z [m] and a rotation vector [rad], shape (count, 6)."""
        found = np.zeros((count, 6))
        found[:, :2] = random.uniform(-self.place, self.place, (count, 2))
        found[:, 2] = random.uniform(-self.height, self.height, count)
        angle, axis = random.uniform(0.0, self.tilt, count), random.uniform(0.0, 2.0 * np.pi, count)
        found[:, 3], found[:, 4] = angle * np.cos(axis), angle * np.sin(axis)
        return found

    def starts(self, random: np.random.Generator, count: int) -> Array:
        """Poses of the tip at the start of episodes, shape (count, 6) [m, rad]."""
        found = np.zeros((count, 6))
        found[:, 2] = -random.uniform(*self.above, count)
        return found

    # ------------------------------------------------------------------------------ what a decision is

    def frame(self, pose: Array, command: Array, wrench: Array) -> Array:
        """What a decision shows, one frame of an observation.

        Args:
            pose: measured pose of the tip, shape (..., 6) [m, rad].
            command: its set-point, likewise.
            wrench: on the tip in the axes of the presumed hole, zeroed at the start, shape (..., 6) [N, Nm].

        Returns:
            Shape (..., 15).
        """
        shown = pose[..., AXES] / _POSE
        aim = (command - pose)[..., AXES] / _POSE
        return np.concatenate([shown, aim, np.clip(wrench[..., AXES] / _WRENCH, -5.0, 5.0)], axis=-1)

    def observe(self, frames: Array) -> Array:
        """The observation: some of the last frames.

        Args:
            frames: the newest first, shape (max(history) + 1, ..., 15).

        Returns:
            Shape (..., n).
        """
        return np.concatenate([frames[age] for age in self.history], axis=-1)

    def hidden(self, pose: Array, hole: Array, friction: Array) -> Array:
        """What the value network alone sees while a policy is trained: where the hole is, as in Pinto et al. 2018.

        Args:
            pose: of the tip, shape (..., 6) [m, rad].
            hole: the true one, likewise.
            friction: of peg and hole, shape (...,).

        Returns:
            Shape (..., 6).
        """
        turn = (hole - pose)[..., 3:5] / _POSE[3:]
        return np.concatenate([self.offset(pose, hole) / _POSE[:3], turn, friction[..., None]], axis=-1)

    def advance(self, command: Array, pose: Array, action: Array) -> Array:
        """The next set-point of the impedance.

        Args:
            command: the last one, shape (..., 6) [m, rad].
            pose: measured, likewise.
            action: shape (..., 5), clipped to +-1.

        Returns:
            Shape (..., 6) [m, rad].
        """
        wanted: Array = np.array(command)
        wanted[..., :3] += self.step * np.clip(action[..., :3], -1.0, 1.0)
        wanted[..., 3:5] += self.turn * np.clip(action[..., 3:], -1.0, 1.0)
        leash = np.repeat([self.leash, self.turn_leash], 3)
        wanted = np.minimum(np.maximum(wanted, pose - leash), pose + leash)
        side, angle = 2.0 * self.place + self.leash, 2.0 * self.tilt + self.turn_leash
        low = np.array([-side, -side, -self.above[1] - self.leash, -angle, -angle, 0.0])
        high = np.array([side, side, self.depth + self.height + self.leash, angle, angle, 0.0])
        result: Array = np.minimum(np.maximum(wanted, low), high)
        return result

    def teach(self, command: Array, pose: Array, hole: Array) -> Array:
        """The action of one who knows the true hole, shape (..., 5): align while pressing gently, then push.

        A policy can be taught by it what to do about what it feels: no arm knows the hole.

        Args:
            command: the last set-point, shape (..., 6) [m, rad].
            pose: of the tip, likewise.
            hole: the true one, likewise.
        """
        height = self.offset(pose, hole)[..., 2]
        deep = np.maximum(height, 0.0)[..., None]
        goal = hole[..., :2] + deep * np.stack([hole[..., 4], -hole[..., 3]], axis=-1)
        away, turn = goal - pose[..., :2], hole[..., 3:5] - pose[..., 3:5]
        action = np.empty((*pose.shape[:-1], 5))
        action[..., :2] = (goal + away - command[..., :2]) / (1.5 * self.step)
        action[..., 3:] = (hole[..., 3:5] + 0.5 * turn - command[..., 3:5]) / (1.5 * self.turn)
        aside, turned = np.linalg.norm(away, axis=-1), np.linalg.norm(turn, axis=-1)
        is_aligned = (aside < 0.6 * self.clearance) & (turned < 0.015) | (height > 1e-3)
        pressed = (pose[..., 2] + PRESS / self.stiffness - command[..., 2]) / self.step
        action[..., 2] = np.where(is_aligned, 1.0, np.minimum(pressed, 1.0))
        return np.clip(action, -1.0, 1.0)

    def offset(self, pose: Array, hole: Array) -> Array:
        """The tip in the frame of the true hole, shape (..., 3) [m]; rotations are small.

        Args:
            pose: of the tip, shape (..., 6).
            hole: shape (..., 6).
        """
        away = pose[..., :3] - hole[..., :3]
        return away - np.cross(hole[..., 3:], away)

    def missing(self, pose: Array, hole: Array) -> Array:
        """Depth that is missing, shape (...,) [m]; what is beside the hole is not in it."""
        inside = self.offset(pose, hole)
        beside = np.hypot(inside[..., 0], inside[..., 1]) > 0.5 * self.clearance + 1e-3
        return self.depth - np.where(
            beside, np.minimum(inside[..., 2], 0.0), np.minimum(inside[..., 2], self.depth)
        )

    def reward(self, pose: Array, hole: Array, wrench: Array) -> Array:
        """Reward of one decision, about -1 to 1."""
        inside = self.offset(pose, hole)
        aside = np.hypot(inside[..., 0], inside[..., 1]) / self.place
        left = self.missing(pose, hole)
        turned = np.linalg.norm((pose - hole)[..., 3:5], axis=-1) / self.tilt
        hard = np.maximum(np.linalg.norm(wrench[..., :3], axis=-1) / self.force - 1.0, 0.0)
        result: Array = (
            -0.4 * np.minimum(aside, 2.0)
            - 0.5 * left / self.depth
            - 0.1 * np.minimum(turned, 2.0)
            - 0.2 * np.minimum(hard, 5.0)
            + 0.5 * (left <= self.radius)
        )
        return result

    # ------------------------------------------------------------------------------ in files

    def as_dict(self) -> dict[str, Any]:
        """For a file; `from_dict` reads it."""
        return {"name": self.name, **asdict(self)}

    @classmethod
    def from_dict(cls, entries: dict[str, Any]) -> PegInHole:
        """Of `as_dict`.

        Raises:
            CommandRejected: entries that are not of this task.
        """
        given: dict[str, Any] = {
            k: tuple(v) if isinstance(v, list) else v for k, v in entries.items() if k != "name"
        }
        unknown = set(given) - {field.name for field in fields(cls)}
        if unknown:
            raise CommandRejected(
                f"unknown entries of the task: {', '.join(sorted(unknown))}",
                hint="the file may be of a newer heptarm",
            )
        return cls(**given)
