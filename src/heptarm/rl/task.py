"""The reach task: move the flange to a point. All its numbers, its observations and its actions.

Training, the Gymnasium environment and deployment all call these functions, so that a policy has the same
observation, the same integration of its actions and the same success radius everywhere. State, action and
reward are those of the libiiwa paper: s = [q, dq, target], a = joint step, r = -distance.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, asdict, dataclass, fields
from math import pi
from typing import Any, ClassVar

import numpy as np

from heptarm.errors import CommandRejected, ShapeError
from heptarm.model.batch import forward_batch
from heptarm.rl.cartesian import step_towards
from heptarm.values.checks import Array, array, integer, within, word
from heptarm.values.robot import RobotModel, robot

ACTIONS = ("joint", "cartesian")
FEATURES = ("", "kinematic")
#: Numbers of a task that must be positive, and their units; most decisions of an episode, and largest number.
_UNITS = {"rate": "Hz", "radius": "m", "joint_step": "rad", "cartesian_step": "m", "leash": "rad"}
_MANY, _LARGE = 1_000_000, 1e6
#: Scales of the kinematic feature [m]: the vector to the target, coarse, and clipped near the target.
COARSE = 0.2
FINE = 0.02


@dataclass(frozen=True, slots=True)
class ReachTask:
    """Reach a point with the flange.

    Attributes:
        robot: name of the robot, "iiwa7" or "iiwa14" (or the Med ones).
        action: "joint": seven joint steps; "cartesian": a step of the flange along the base's axes, its
            rotation held.
        feature: "" for the paper's observation; "kinematic" adds the way from the target to the flange,
            which is a fixed function of the paper's state.
        rate: decisions a second [Hz].
        steps: decisions an episode.
        home: joint positions around which an episode begins, shape (7,) [rad].
        spread: half width of the uniform noise on them [rad].
        centre: of the box of targets, base frame, shape (3,) [m].
        size: of that box, shape (3,) [m].
        radius: distance that counts as success [m].
        joint_step: of the commanded joints at |action| = 1 [rad].
        cartesian_step: of the commanded flange at |action| = 1 [m].
        leash: farthest that commanded joints may be from the measured ones [rad].

    Raises:
        CommandRejected: unknown robot.
        ShapeError: unknown action or feature, or something that is no number.
        LimitError: a number outside its range.
    """

    #: Name at the command line.
    name: ClassVar[str] = "reach"
    #: What the value network sees beyond an observation while a policy is trained: nothing. And no one teaches.
    hidden_size: ClassVar[int] = 0
    has_teacher: ClassVar[bool] = False

    robot: str = "iiwa14"
    _: KW_ONLY
    action: str = "joint"
    feature: str = ""
    rate: float = 30.0
    steps: int = 100
    home: tuple[float, ...] = (0.0, 0.0, 0.0, -pi / 2, 0.0, pi / 2, 0.0)
    spread: float = 0.125
    centre: tuple[float, ...] = (0.6, 0.0, 0.4)
    size: tuple[float, ...] = (0.2, 0.4, 0.4)
    radius: float = 0.035
    joint_step: float = 2.5 / 120
    cartesian_step: float = 0.01
    leash: float = 0.25

    def __post_init__(self) -> None:
        self.model  # noqa: B018  raises for an unknown robot
        word(self.action, "action", ACTIONS)
        word(self.feature, "feature", FEATURES)
        for name, length in (("home", 7), ("centre", 3), ("size", 3)):
            object.__setattr__(self, name, tuple(array(getattr(self, name), length, name).tolist()))
        integer(self.steps, "steps", 1, _MANY)
        for name, unit in _UNITS.items():
            object.__setattr__(
                self, name, within(getattr(self, name), name, 0.0, _LARGE, above=True, unit=unit)
            )
        object.__setattr__(self, "spread", within(self.spread, "spread", 0.0, pi, unit="rad"))

    @property
    def model(self) -> RobotModel:
        """The robot's dimensions and limits."""
        return robot(self.robot)

    @property
    def observation_size(self) -> int:
        """Size of an observation."""
        return 23 if self.feature else 17

    @property
    def action_size(self) -> int:
        """Size of an action."""
        return 7 if self.action == "joint" else 3

    # ------------------------------------------------------------------------------ drawing episodes

    def starts(self, random: np.random.Generator, count: int) -> Array:
        """Joint positions at the start of episodes, shape (count, 7) [rad]."""
        return np.asarray(self.home) + random.uniform(-self.spread, self.spread, (count, 7))

    def targets(self, random: np.random.Generator, count: int) -> Array:
        """Random targets in the box, base frame, shape (count, 3) [m]."""
        half = np.asarray(self.size) / 2
        return np.asarray(self.centre) + random.uniform(-half, half, (count, 3))

    def goals(self, targets: Array) -> Array:
        """Where targets are, base frame, shape (n, 3) [m]: they are places themselves."""
        return targets

    # ------------------------------------------------------------------------------ what a decision is

    def begin(self, q: Array) -> Array:
        """The command of an arm at rest, shape (..., 7) [rad]: where it is."""
        return q

    def tip(self, q: Array) -> Array:
        """Positions of the flange, shape (..., 7) [rad] to (..., 3) [m].

        That is 35 mm past the origin of the seventh link, which libiiwa's environments (`iiwa_link_7`) measure.
        """
        return self._poses(q)[..., :3, 3]

    def hold(self, q: Array) -> Array:
        """The rotation that a Cartesian episode keeps, that of its start; (..., 7) to (..., 3, 3)."""
        return self._poses(q)[..., :3, :3]

    def _poses(self, q: Array) -> Array:
        given = np.asarray(q)
        return forward_batch(self.model, given.reshape(-1, 7)).reshape(*given.shape[:-1], 4, 4)

    def observe(self, q: Array, dq: Array, target: Array) -> Array:
        """The observation.

        Args:
            q: measured joint positions, shape (..., 7) [rad].
            dq: measured velocities, shape (..., 7) [rad/s].
            target: base frame, shape (..., 3) [m].

        Returns:
            Shape (..., 17): positions scaled to the joint range, a tenth of the velocities, the target. With
            the feature (..., 23): the way from target to flange over 0.2 m, and over 0.02 m clipped to 1.
        """
        model = self.model
        result = np.empty((*np.shape(q)[:-1], self.observation_size))
        result[..., :7] = (q - model.q_min) * (2.0 / (model.q_max - model.q_min)) - 1.0
        result[..., 7:14] = 0.1 * np.asarray(dq)
        result[..., 14:17] = target
        if self.feature:
            offset = self.tip(q) - target
            result[..., 17:20] = offset / COARSE
            result[..., 20:23] = np.clip(offset / FINE, -1.0, 1.0)
        return result

    def advance(self, command: Array, q: Array, action: Array, held: Array | None = None) -> Array:
        """The next commanded joint positions: the action is added to the last command, not to the measured positions.

        The distance of the command from the arm (of a stopped or pushed robot) is limited.

        Args:
            command: the last commanded joints, shape (..., 7) [rad].
            q: measured joints, shape (..., 7) [rad].
            action: shape (..., 7) or (..., 3), clipped to +-1.
            held: rotation to keep, shape (..., 3, 3); for "cartesian".

        Returns:
            Shape (..., 7) [rad].

        Raises:
            ShapeError: "cartesian" without `held`.
        """
        model = self.model
        bounded = np.clip(action, -1.0, 1.0)
        if self.action == "joint":
            wanted = command + self.joint_step * bounded
        elif held is None:
            raise ShapeError(
                "held must be the rotation of the flange for a Cartesian action, got None", parameter="held"
            )
        else:
            moved = step_towards(
                model,
                np.reshape(command, (-1, 7)),
                np.reshape(self.cartesian_step * bounded, (-1, 3)),
                np.reshape(held, (-1, 3, 3)),
            )
            wanted = moved.reshape(np.shape(command))
            # a Cartesian step may not turn a joint faster than a joint action could twice over
            wanted = command + np.clip(wanted - command, -2 * self.joint_step, 2 * self.joint_step)
        wanted = np.minimum(np.maximum(wanted, q - self.leash), q + self.leash)
        result: Array = np.minimum(np.maximum(wanted, model.q_min), model.q_max)
        return result

    def distance(self, tip: Array, target: Array) -> Array:
        """Distance from the flange to the target, shapes (..., 3) to (...,) [m]."""
        offset = tip - target
        result: Array = np.sqrt((offset * offset).sum(axis=-1))
        return result

    def reward(self, distance: Array) -> Array:
        """Reward of one decision: the negative distance after it."""
        return -distance

    # ------------------------------------------------------------------------------ in files

    def as_dict(self) -> dict[str, Any]:
        """For a file; `from_dict` reads it."""
        return asdict(self)

    @classmethod
    def from_dict(cls, entries: dict[str, Any]) -> ReachTask:
        """Of `as_dict`.

        Raises:
            CommandRejected: entries that are not of this task.
        """
        unknown = set(entries) - {field.name for field in fields(cls)}
        if unknown:
            raise CommandRejected(
                f"unknown entries of the task: {', '.join(sorted(unknown))}",
                hint="the file may be of a newer heptarm",
            )
        given: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in entries.items()}
        return cls(**given)
