"""The base of tasks with contacts: observation, action and safety of an arm under a Cartesian impedance.

A policy moves the set-point of the impedance in steps. The set-point stays within a leash of the measured pose, so that
the spring presses no harder than leash times stiffness, and within a box. An observation shows, of some of the last
decisions each: pose of the tip, its set-point, the wrench on it, joint positions if asked for, and what else a task
looks at.

Everything is given in the frame of the task, whose origin is where the work is, with z along the tool. A task is a
subclass, a frozen dataclass: see `heptarm.rl.contact.push` for one of average size.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, asdict, dataclass, field, fields
from typing import Any, ClassVar

import numpy as np

from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.checks import Array, integer, numbers, shown, within, word
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel, robot

#: Largest number of a task, most decisions of an episode, and the age of the oldest frame.
_LARGE, _MANY, _OLDEST = 1e6, 1_000_000, 1000
#: Scales of wrenches in an observation [N, Nm].
_WRENCH = np.array([10.0, 10.0, 10.0, 0.2, 0.2, 0.2])
#: Scaled wrenches are clipped to this.
_MOST = 5.0
#: x, y, z of a pose, and its rotation vector.
_NUMBERS = 6
_JOINTS = 7
#: What an observation can show, in this order.
_SHOWN = ("joints", "pose", "command", "wrench")


def _observation(given: object) -> tuple[str, ...]:
    """What an observation shows, in the order in which it does."""
    if isinstance(given, str) or not isinstance(given, Sequence) or not given:
        raise CommandRejected(
            f"observation must be some of {', '.join(_SHOWN)}, got {shown(given)}", parameter="observation"
        )
    for what in given:
        word(what, "observation", _SHOWN)
    if len(set(given)) < len(given):
        raise CommandRejected(
            f"observation must name each thing once, got {', '.join(given)}", parameter="observation"
        )
    return tuple(what for what in _SHOWN if what in given)


def quantity(value: float, unit: str) -> Any:
    """A number of a task that must be positive, with its unit."""
    return field(default=value, metadata={"unit": unit})


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """What a task is asked about: one moment of one or many arms, in the frame of the task.

    Rotations are rotation vectors. Shapes are for n arms; for one arm the first axis may be missing.

    Attributes:
        pose: of the tip, shape (n, 6) [m, rad].
        command: set-point of the impedance, shape (n, 6), and as far as the task has them: the gripper, -1 opens it and
            1 closes it; the fraction of the stiffness.
        wrench: on the tip, zeroed when the episode began, shape (n, 6) [N, Nm]. In rewards it is the true one.
        target: what the episode is about, shape (n, k), as the task draws it.
        bodies: poses of the free bodies of the scene by their names, shape (n, 6) each.
        joints: positions of the other joints of the scene by their names, shape (n,) each.
        memory: what `ContactTask.remember` returned last; zeros when an episode begins, shape (n, m).
        time: since the episode began, shape (n,) [s].
        friction: of everything that touches, shape (n,).
        q: joint positions of the arm, shape (n, 7) [rad].
    """

    pose: Array
    command: Array
    wrench: Array
    target: Array
    bodies: Mapping[str, Array] = field(default_factory=dict)
    joints: Mapping[str, Array] = field(default_factory=dict)
    memory: Array = field(default_factory=lambda: np.zeros(0))
    time: Array = field(default_factory=lambda: np.zeros(()))
    friction: Array = field(default_factory=lambda: np.zeros(()))
    q: Array = field(default_factory=lambda: np.zeros(_JOINTS))


@dataclass(frozen=True, slots=True)
class ContactTask(ABC):
    """A task with contacts; a subclass adds the scene, episodes, rewards and success.

    Attributes:
        robot: name of the robot.
        rate: decisions a second [Hz].
        steps: decisions an episode.
        history: ages of the frames that an observation shows [decisions]; what is older than the episode is its start.
        radius: what may be missing at the end for success [m].
        step: of the set-point at |action| = 1 [m].
        turn: likewise [rad].
        leash: farthest that the set-point may be from the measured pose [m]; times the stiffness: the largest force.
        turn_leash: likewise [rad].
        stiffness: of the impedance [N/m].
        turn_stiffness: likewise [Nm/rad].
        softest: lowest fraction of both that a policy may choose, by one more number of its actions; 1: they are fixed.
        observation: what an observation shows: "joints", "pose", "command" (the set-point) and "wrench".

    Raises:
        CommandRejected: unknown robot, or an observation of something else, twice the same, or nothing.
        ShapeError: something that is no number.
        LimitError: a number outside its range.
    """

    #: Name at the command line; at Gymnasium it is "heptarm/" and the class.
    name: ClassVar[str]
    #: Directions that a policy moves and feels, of x, y, z and the turns about them.
    axes: ClassVar[tuple[int, ...]] = (0, 1, 2, 3, 4)
    #: Whether the tool is a gripper: an action has one more number, above 0 to close it.
    has_gripper: ClassVar[bool] = False
    #: Scales of poses in an observation [m, rad].
    scales: ClassVar[tuple[float, ...]] = (3e-3, 3e-3, 10e-3, 0.035, 0.035, 0.035)
    #: Site of the scene that the impedance holds, in its body `tool`.
    site: ClassVar[str] = "tip"
    #: Numbers that `look`, `hidden` and `remember` return.
    look_size: ClassVar[int] = 0
    hidden_size: ClassVar[int] = 0
    memory_size: ClassVar[int] = 0
    #: Whether `teach` is there.
    has_teacher: ClassVar[bool] = False
    #: The frame of the task in the base of the arm.
    origin: ClassVar[Pose] = Pose.of((0.6, 0.1, 0.24), (0.0, 1.0, 0.0, 0.0))
    #: Friction of what touches, lowest and highest.
    friction: ClassVar[tuple[float, float]] = (0.1, 0.3)
    #: Steps of the simulation in a second.
    frequency: ClassVar[float] = 400.0

    robot: str = "iiwa14"
    _: KW_ONLY
    rate: float = quantity(20.0, "Hz")
    steps: int = 160
    history: tuple[int, ...] = (0, 1, 3, 7, 15)
    radius: float = quantity(1.5e-3, "m")
    step: float = quantity(1.0e-3, "m")
    turn: float = quantity(5e-3, "rad")
    leash: float = quantity(9e-3, "m")
    turn_leash: float = quantity(0.04, "rad")
    stiffness: float = quantity(1500.0, "N/m")
    turn_stiffness: float = quantity(60.0, "Nm/rad")
    softest: float = 1.0
    observation: tuple[str, ...] = ("pose", "command", "wrench")

    def __post_init__(self) -> None:
        self.model  # noqa: B018  raises for an unknown robot
        for number in fields(self):
            if unit := number.metadata.get("unit"):
                value = within(getattr(self, number.name), number.name, 0.0, _LARGE, above=True, unit=unit)
                object.__setattr__(self, number.name, value)
        object.__setattr__(self, "softest", within(self.softest, "softest", 0.0, 1.0, above=True))
        integer(self.steps, "steps", 1, _MANY)
        ages = numbers(self.history, "history", "ages in decisions").tolist()
        if not isinstance(ages, list) or not ages:
            raise ShapeError(
                f"history must be ages in decisions, got {shown(self.history)}", parameter="history"
            )
        ages = [int(age) if isinstance(age, float) and age.is_integer() else age for age in ages]
        object.__setattr__(self, "history", tuple(integer(age, "history", 0, _OLDEST) for age in ages))
        object.__setattr__(self, "observation", _observation(self.observation))

    # ------------------------------------------------------------------------------ what a task defines

    @abstractmethod
    def scene(self) -> str:
        """The scene in MuJoCo's format, in the base of the arm.

        Its body `tool` is mounted on the flange; the site `tip` in it is what the impedance holds, its axes those of
        the flange. The shipped gripper, with a site `tcp`, is there by `<include file="two-finger-gripper.xml"/>`.
        """

    @property
    @abstractmethod
    def box(self) -> tuple[Array, Array]:
        """Lowest and highest set-points, shape (6,) each [m, rad]."""

    @abstractmethod
    def targets(self, random: np.random.Generator, count: int) -> Array:
        """What the episodes are about, shape (count, k)."""

    def goals(self, targets: Array) -> Array | None:
        """Where targets are, shape (n, k) to (n, 3) [m], for pictures; None: they are no places."""
        return None

    @abstractmethod
    def starts(self, random: np.random.Generator, count: int) -> Array:
        """Poses of the tip at the start of episodes, shape (count, 6) [m, rad]."""

    @abstractmethod
    def missing(self, now: Moment) -> Array:
        """What is missing for success, shape (n,) [m]; at most `radius` at the end of an episode is success."""

    @abstractmethod
    def reward(self, now: Moment) -> Array:
        """Rewards of a decision, about -1 to 1, shape (n,). It may know what no arm knows."""

    def left(self, now: Moment) -> Array:
        """What is missing as far as an arm can tell; `missing`, unless a task defines it."""
        return self.missing(now)

    def bodies(self, target: Array) -> dict[str, Array]:
        """Where bodies of the scene are when an episode begins: free ones, and those with mocap="true".

        Args:
            target: shape (n, k).

        Returns:
            Poses by names, shape (n, 6) [m, rad].
        """
        return {}

    def look(self, now: Moment) -> Array:
        """What an observation shows besides pose, set-point and wrench, shape (n, look_size), about -1 to 1.

        It may use what an arm knows, so of the target what it knows.
        """
        return np.zeros((*now.pose.shape[:-1], 0))

    def remember(self, now: Moment) -> Array:
        """What has been done so far in an episode, shape (n, memory_size); `now` has what was remembered before."""
        return now.memory

    def hidden(self, now: Moment) -> Array:
        """What the value network alone sees while a policy is trained (Pinto et al. 2018), shape (n, hidden_size)."""
        return np.zeros((*now.pose.shape[:-1], 0))

    def teach(self, now: Moment) -> Array:
        """The action of one who knows everything, shape (n, actions): a policy can be taught by it.

        Raises:
            CommandRejected: the task has none.
        """
        raise CommandRejected(f"the task {self.name} has no teacher", parameter="task")

    # ------------------------------------------------------------------------------ what follows from it

    @property
    def model(self) -> RobotModel:
        """The robot's dimensions and limits."""
        return robot(self.robot)

    def shows(self, what: str) -> bool:
        """Whether an observation shows "joints", "pose", "command" or "wrench"."""
        return what in self.observation

    @property
    def has_stiffness(self) -> bool:
        """Whether a policy chooses the stiffness."""
        return self.softest < 1.0

    @property
    def frame_size(self) -> int:
        """Size of what a decision shows."""
        joints, command = self.shows("joints"), self.shows("command")
        size = _JOINTS * joints + len(self.axes) * (len(self.observation) - joints)
        return size + (self.command_size - _NUMBERS) * command + self.look_size

    @property
    def observation_size(self) -> int:
        """Size of an observation."""
        return self.frame_size * len(self.history)

    @property
    def action_size(self) -> int:
        """Size of an action."""
        return len(self.axes) + self.has_gripper + self.has_stiffness

    @property
    def command_size(self) -> int:
        """Size of a command."""
        return _NUMBERS + self.has_gripper + self.has_stiffness

    def begin(self, pose: Array) -> Array:
        """The command of an arm at rest, its gripper open; shape (..., 6) to (..., command_size)."""
        more = [-1.0] * self.has_gripper + [1.0] * self.has_stiffness
        return np.concatenate([pose, np.broadcast_to(more, (*pose.shape[:-1], len(more)))], axis=-1)

    def fraction(self, command: Array) -> Array:
        """Of the stiffness, in a command, shape (..., command_size) to (...)."""
        return command[..., -1] if self.has_stiffness else np.ones(command.shape[:-1])

    def frame(self, now: Moment) -> Array:
        """What a decision shows, one frame of an observation, shape (n, frame_size)."""
        axes, scales, model = np.array(self.axes), np.array(self.scales), self.model
        away = now.command[..., :_NUMBERS] - now.pose
        shown = {
            "joints": (now.q - model.q_min) * (2.0 / (model.q_max - model.q_min)) - 1.0,
            "pose": (now.pose / scales)[..., axes],
            "command": (away / scales)[..., axes],
            "wrench": np.clip((now.wrench / _WRENCH)[..., axes], -_MOST, _MOST),
        }
        more = now.command[..., _NUMBERS:] if self.shows("command") else now.command[..., :0]
        return np.concatenate([*(shown[what] for what in self.observation), more, self.look(now)], axis=-1)

    def observe(self, frames: Array) -> Array:
        """The observation: some of the last frames.

        Args:
            frames: the newest first, shape (max(history) + 1, ..., frame_size).

        Returns:
            Shape (..., observation_size).
        """
        return np.concatenate([frames[age] for age in self.history], axis=-1)

    def advance(self, command: Array, pose: Array, action: Array) -> Array:
        """The next command.

        Args:
            command: the last one, shape (..., command_size) [m, rad].
            pose: measured, shape (..., 6).
            action: shape (..., action_size), clipped to +-1.

        Returns:
            Shape (..., command_size).
        """
        axes, wanted = np.array(self.axes), np.array(command)
        steps, leash = (
            np.repeat(pair, 3) for pair in ((self.step, self.turn), (self.leash, self.turn_leash))
        )
        wanted[..., axes] += steps[axes] * np.clip(action[..., : len(axes)], -1.0, 1.0)
        near = np.minimum(np.maximum(wanted[..., :_NUMBERS], pose - leash), pose + leash)
        low, high = self.box
        wanted[..., :_NUMBERS] = np.minimum(np.maximum(near, low), high)
        if self.has_gripper:
            wanted[..., _NUMBERS] = np.where(action[..., len(axes)] > 0.0, 1.0, -1.0)
        if self.has_stiffness:  # evenly on a logarithmic scale
            wanted[..., -1] = self.softest ** (0.5 - 0.5 * np.clip(action[..., -1], -1.0, 1.0))
        return wanted

    def steer(self, now: Moment, goal: Array, *, ahead: float = 1.5) -> Array:
        """Actions along `axes` that bring the set-point to a goal, for teachers; shape (n, len(axes)), within +-1.

        Args:
            now: the moment.
            goal: of the set-point, shape (n, 6) [m, rad].
            ahead: decisions in which it is to be there.
        """
        axes = np.array(self.axes)
        steps = np.repeat([self.step, self.turn], 3)
        result: Array = np.clip(
            ((goal - now.command[..., :_NUMBERS]) / (ahead * steps))[..., axes], -1.0, 1.0
        )
        return result

    # ------------------------------------------------------------------------------ in files

    def as_dict(self) -> dict[str, Any]:
        """For a file; `from_dict` reads it."""
        return {"name": self.name, **asdict(self)}

    @classmethod
    def from_dict(cls, entries: dict[str, Any]) -> ContactTask:
        """Of `as_dict`.

        Raises:
            CommandRejected: entries that are not of this task.
        """
        given: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in entries.items()
            if name != "name"
        }
        unknown = set(given) - {number.name for number in fields(cls)}
        if unknown:
            raise CommandRejected(
                f"unknown entries of the task: {', '.join(sorted(unknown))}",
                hint="the file may be of a newer heptarm",
            )
        return cls(**given)
