"""States of the robot: groups of measurements, each with its own time stamp.

A cabinet samples each group at its own period, since reading takes time; so a state is a set of groups that are each
consistent in themselves. Reading from a group that is not subscribed raises an error that names it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from math import nan
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np

from heptarm.errors import StaleState
from heptarm.values.checks import Array, Value, frozen
from heptarm.values.io import SignalValues
from heptarm.values.mode.mode import HandGuiding, Mode
from heptarm.values.pose import Pose, Redundancy
from heptarm.values.text import aligned, columns, fixed, lines

_T = TypeVar("_T")


def _unknown() -> Array:
    return frozen(np.full(3, nan))


class OperationMode(Enum):
    """The cabinet's operation mode."""

    T1 = "t1"  # reduced speed, enabling switch held
    T2 = "t2"  # full speed, enabling switch held
    AUT = "aut"  # automatic
    UNKNOWN = "unknown"  # the cabinet does not report it


@dataclass(frozen=True, slots=True, eq=False)
class Joints(Value):
    """Joint positions.

    Attributes:
        stamp: cabinet time of the measurement [ns].
        q: measured, shape (7,) [rad].
        q_cmd: commanded, shape (7,) [rad].
        dq: velocity, shape (7,) [rad/s]: the difference of measured positions behind a first-order low-pass of 10 ms,
            since a cabinet does not measure it; NaN before the second sample.
    """

    stamp: int
    q: Array
    q_cmd: Array
    dq: Array

    def __post_init__(self) -> None:
        for name in ("q", "q_cmd", "dq"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True, slots=True, eq=False)
class Torques(Value):
    """Joint torques.

    Attributes:
        stamp: cabinet time of the measurement [ns].
        tau: measured, shape (7,) [Nm].
        tau_ext: external load acting on the robot, shape (7,) [Nm].
        tau_cmd: commanded, shape (7,) [Nm]; NaN where the cabinet does not report it.
    """

    stamp: int
    tau: Array
    tau_ext: Array
    tau_cmd: Array

    def __post_init__(self) -> None:
        for name in ("tau", "tau_ext", "tau_cmd"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True, slots=True, eq=False)
class Cartesian(Value):
    """Poses of the motion frame in the base frame.

    Attributes:
        stamp: cabinet time of the measurement [ns].
        pose: measured.
        pose_cmd: commanded; None: the cabinet does not report it.
        redundancy: E1, Status and Turn of the arm.
    """

    stamp: int
    pose: Pose
    pose_cmd: Pose | None
    redundancy: Redundancy


@dataclass(frozen=True, slots=True, eq=False)
class Wrench(Value):
    """External force and torque acting on the robot at the motion frame, in base axes.

    Attributes:
        stamp: cabinet time of the measurement [ns].
        force: shape (3,) [N].
        torque: shape (3,) [Nm].
        force_inaccuracy: of the estimate, shape (3,) [N]; NaN where the cabinet does not report it.
        torque_inaccuracy: of the estimate, shape (3,) [Nm]; NaN where the cabinet does not report it.
    """

    stamp: int
    force: Array
    torque: Array
    force_inaccuracy: Array = field(default_factory=_unknown)
    torque_inaccuracy: Array = field(default_factory=_unknown)

    def __post_init__(self) -> None:
        for name in ("force", "torque", "force_inaccuracy", "torque_inaccuracy"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def __str__(self) -> str:
        """One line."""
        force, torque = (" ".join(fixed(v, 2) for v in vector) for vector in (self.force, self.torque))
        doubt = "" if self.valid() else "   inaccurate here"
        return f"force {force} N   torque {torque} Nm{doubt}"

    def seen(self, lever: Array, axes: Array) -> Wrench:
        """The same load at another point in other axes.

        Args:
            lever: from that point to the current one, base axes, shape (3,) [m].
            axes: the other axes as columns in the base frame, shape (3, 3).
        """
        back, arm = np.abs(axes.T), np.abs(lever)
        reach = np.array([[0.0, arm[2], arm[1]], [arm[2], 0.0, arm[0]], [arm[1], arm[0], 0.0]])
        return Wrench(
            self.stamp,
            axes.T @ self.force,
            axes.T @ (self.torque + np.cross(lever, self.force)),
            back @ self.force_inaccuracy,
            back @ (self.torque_inaccuracy + reach @ self.force_inaccuracy),
        )

    @property
    def array(self) -> Array:
        """Fx fy fz [N], tx ty tz [Nm], shape (6,)."""
        return np.concatenate([self.force, self.torque])

    def valid(self, *, force: float = 10.0, torque: float = 10.0) -> bool:
        """Whether no inaccuracy exceeds its tolerance; near a singularity the estimate is useless.

        Args:
            force: largest inaccuracy that is accepted [N].
            torque: largest inaccuracy that is accepted [Nm].
        """
        return not bool((self.force_inaccuracy > force).any() or (self.torque_inaccuracy > torque).any())


@dataclass(frozen=True, slots=True, eq=False)
class MotionStatus(Value):
    """The running program.

    Attributes:
        stamp: cabinet time of the sample [ns].
        id: of the running program; 0: none.
        item: index of its running motion.
        queued: number of waiting programs.
        progress: of the motion, [0, 1]; NaN where the cabinet does not report it.
        remaining: time to the destination [s]; NaN where the cabinet does not report it.
        override: application override, [0, 1].
    """

    stamp: int
    id: int = 0
    item: int = 0
    queued: int = 0
    progress: float = nan
    remaining: float = nan
    override: float = 1.0

    def __str__(self) -> str:
        """One line."""
        if not self.active:
            return f"none, {self.queued} waiting, override {self.override:.0%}"
        progress = "" if self.progress != self.progress else f", {self.progress:.0%}"
        return f"{self.id}, item {self.item}{progress}, {self.queued} waiting, override {self.override:.0%}"

    @property
    def active(self) -> bool:
        """Whether a program runs."""
        return self.id != 0


@dataclass(frozen=True, slots=True, eq=False)
class Safety(Value):
    """Readiness and safety. What a cabinet does not report is None, so that nothing unknown looks fine.

    Attributes:
        stamp: cabinet time of the sample [ns].
        mode: operation mode.
        ready_to_move: the robot would accept a motion.
        paused: execution is paused.
        brakes_open: the brakes are open; only a simulator reports it, on a cabinet it is never true.
        moving: a motion command is active.
        mastered: all axes are mastered.
        emergency_stop: a local or external emergency stop is active.
        protective_stop: a safety stop is active.
        operator_safety_open: the safeguard is open.
        enabling_switch: the enabling switch is held.
        torque_referenced: the torque sensors are referenced.
        position_referenced: the positions are referenced.
        recovery_required: the robot has to be recovered first.
        hand_guiding_switch: the enabling switch of the hand guiding device is held.
    """

    stamp: int
    mode: OperationMode
    ready_to_move: bool | None = False
    paused: bool | None = False
    brakes_open: bool | None = False
    moving: bool = False
    mastered: bool | None = False
    emergency_stop: bool | None = False
    protective_stop: bool | None = False
    operator_safety_open: bool | None = False
    enabling_switch: bool | None = False
    torque_referenced: bool | None = False
    position_referenced: bool | None = False
    recovery_required: bool | None = False
    hand_guiding_switch: bool | None = False

    def __str__(self) -> str:
        """One line."""
        if not self.is_known:
            return "unknown: this cabinet reports no safety state"
        ready = "ready to move" if self.ready_to_move else "not ready"
        return ", ".join((self.mode.value.upper(), ready, *self.stops))

    @property
    def is_known(self) -> bool:
        """Whether the cabinet reports its safety state; heptarm's preview for Sunrise 2.x does not."""
        return self.mode is not OperationMode.UNKNOWN

    @property
    def stops(self) -> tuple[str, ...]:
        """Reasons why the arm cannot move, as text; empty: none known."""
        released = self.is_known and self.mode is not OperationMode.AUT and not self.enabling_switch
        named = self.emergency_stop or self.operator_safety_open or released
        reasons = {
            "emergency stop": self.emergency_stop,
            "safeguard open": self.operator_safety_open,
            "enabling switch not held": released,
            "safety stop": self.protective_stop and not named,
            "paused": self.paused,
            "recovery required": self.recovery_required,
        }
        return tuple(reason for reason, holds in reasons.items() if holds)


@dataclass(frozen=True, slots=True, eq=False)
class Control(Value):
    """Active control mode and tool.

    Attributes:
        stamp: cabinet time of the sample [ns].
        mode: active control mode with its parameters; `HandGuiding()` while the arm is guided by hand, position control
            while nothing runs.
        tool: name of the attached tool; empty: none.
        workpiece: name of the attached workpiece; empty: none.
        frame: the motion frame unless a motion names another: a frame of the tool, or "flange".
        safety_workpiece: name of the workpiece whose load the safety functions of the cabinet count; empty: none.
    """

    stamp: int
    mode: Mode | HandGuiding
    tool: str = ""
    workpiece: str = ""
    frame: str = "flange"
    safety_workpiece: str = ""


class GroupSource(Protocol):
    """What the groups of a received state are made of."""

    @property
    def stamp(self) -> int:
        """Cabinet time of the newest group [ns]; 0 without any."""
        ...

    def make(self, name: str) -> Any:
        """The group of a name; None: there is none. Raises RemoteProtocolError: its numbers are no such group."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Groups(Value):
    """The groups of a state by the names under which they are subscribed; None: not subscribed, or not received yet.

    Those of a received state are made when they are first used: a loop that reads the joints alone needs a third of the
    time that all groups take.

    Attributes:
        joints: joint positions.
        torques: joint torques.
        pose: poses of the motion frame, and the arm's redundancy.
        wrench: external force and torque.
        motion: the running program.
        safety: safety and readiness.
        mode: control mode and tool.
        io: inputs and outputs of the cabinet.
    """

    joints: Joints | None = None
    torques: Torques | None = None
    pose: Cartesian | None = None
    wrench: Wrench | None = None
    motion: MotionStatus | None = None
    safety: Safety | None = None
    mode: Control | None = None
    io: SignalValues | None = None
    _source: GroupSource | None = field(default=None, init=False, repr=False, compare=False)

    @classmethod
    def of(cls, source: GroupSource) -> Groups:
        """The groups of a received state."""
        groups = object.__new__(cls)
        object.__setattr__(groups, "_source", source)
        return groups

    if not TYPE_CHECKING:  # a type checker knows the fields

        def __getattr__(self, name: str) -> Any:
            """Make a group at its first use."""
            if name not in GROUP_NAMES:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            group = self._source.make(name)
            object.__setattr__(self, name, group)
            return group

    def __reduce__(self) -> tuple[type[Groups], tuple[object, ...]]:
        """Copies and pickles hold the groups themselves."""
        return Groups, tuple(self)

    def __iter__(self) -> Iterator[Any]:
        """All groups in the order of their names; None for those that are missing."""
        return (getattr(self, name) for name in GROUP_NAMES)

    @property
    def stamp(self) -> int:
        """Cabinet time of the newest group [ns]; 0 without any."""
        if self._source is not None:
            return self._source.stamp
        return max((group.stamp for group in self if group is not None), default=0)


#: Names of all groups, as in `arm.subscribe(groups=...)`.
GROUP_NAMES = tuple(field.name for field in fields(Groups) if field.init)


@dataclass(frozen=True, slots=True, eq=False)
class State(Value):
    """A snapshot of the robot. The short names read from the groups and raise StaleState if the group is missing.

    Attributes:
        groups: the measurements, each group with its own time stamp.
        sampled: time of the newest sample on this computer's clock [ns].
        clock: this computer's clock [ns], for the age.
    """

    groups: Groups = Groups()
    sampled: int = 0
    clock: Callable[[], int] | None = field(default=None, repr=False, compare=False)

    def __str__(self) -> str:
        """A few aligned lines: degrees and millimetres, with SI units beside them."""
        groups = self.groups
        rows: dict[str, str] = {}
        if groups.joints is not None or groups.torques is not None:
            rows["joint"] = aligned(f"A{i + 1}" for i in range(7))
        if groups.joints is not None:
            rows["q [deg]"] = columns(np.degrees(self.q), 2)
            rows["q [rad]"] = columns(self.q, 4)
            rows["dq [deg/s]"] = columns(np.degrees(self.dq), 2)
        if groups.torques is not None:
            rows["tau [Nm]"] = columns(self.tau, 2)
            rows["tau_ext [Nm]"] = columns(self.tau_ext, 2)
        if groups.pose is not None:
            rows["pose"] = str(self.pose)
        if groups.wrench is not None:
            rows["wrench"] = str(self.wrench)
        if groups.motion is not None:
            rows["motion"] = str(groups.motion)
        if groups.safety is not None:
            rows["safety"] = str(groups.safety)
        if groups.mode is not None:
            held = self.workpiece + (" (safety workpiece)" if self.safety_workpiece else "")
            attached = ", ".join(part for part in (self.tool, held) if part) or "no tool"
            rows["control"] = f"{self.mode}, {attached}, motion frame {self.frame}"
        if groups.io is not None:
            rows["io"] = str(groups.io).partition("\n")[2].replace("\n  ", "\n").strip()
        age = "" if self.clock is None else f", {fixed(self.age * 1e3, 1)} ms old"
        return lines(f"State at {self.stamp * 1e-9:.3f} s of the cabinet{age}", rows)

    def with_groups(self, **groups: Any) -> State:
        """The same state with other contents of some groups, by their names."""
        return replace(self, groups=replace(self.groups, **groups))

    @property
    def joints(self) -> Joints | None:
        """Joint positions; None: not subscribed."""
        return self.groups.joints

    @property
    def torques(self) -> Torques | None:
        """Joint torques; None: not subscribed."""
        return self.groups.torques

    @property
    def motion(self) -> MotionStatus | None:
        """The running program; None: not subscribed."""
        return self.groups.motion

    @property
    def stamp(self) -> int:
        """Cabinet time of the newest group [ns]; 0 without any.

        Other groups may be older. The velocity of a value follows from the stamps of its own group, such as
        `groups.pose.stamp` for `pose`.
        """
        return self.groups.stamp

    @property
    def age(self) -> float:
        """Time since the newest group was sampled [s]; NaN without a clock."""
        return nan if self.clock is None else (self.clock() - self.sampled) * 1e-9

    @property
    def q(self) -> Array:
        """Measured joint positions, shape (7,) [rad]."""
        return _of(self.groups.joints, "joints").q

    @property
    def q_cmd(self) -> Array:
        """Commanded joint positions, shape (7,) [rad]."""
        return _of(self.groups.joints, "joints").q_cmd

    @property
    def dq(self) -> Array:
        """Joint velocities, shape (7,) [rad/s]; see Joints."""
        return _of(self.groups.joints, "joints").dq

    @property
    def tau(self) -> Array:
        """Measured joint torques, shape (7,) [Nm]."""
        return _of(self.groups.torques, "torques").tau

    @property
    def tau_ext(self) -> Array:
        """External load acting on the robot, shape (7,) [Nm]."""
        return _of(self.groups.torques, "torques").tau_ext

    @property
    def tau_cmd(self) -> Array:
        """Commanded joint torques, shape (7,) [Nm]; see Torques."""
        return _of(self.groups.torques, "torques").tau_cmd

    @property
    def pose(self) -> Pose:
        """Measured pose of the motion frame in the base frame."""
        return _of(self.groups.pose, "pose").pose

    @property
    def pose_cmd(self) -> Pose:
        """Commanded pose of the motion frame in the base frame.

        Raises:
            StaleState: the cabinet does not report it.
        """
        commanded = _of(self.groups.pose, "pose").pose_cmd
        if commanded is None:
            raise StaleState(
                "this cabinet does not report the commanded pose",
                parameter="pose",
                hint="use the measured one: state.pose",
            )
        return commanded

    @property
    def redundancy(self) -> Redundancy:
        """E1, Status and Turn of the arm."""
        return _of(self.groups.pose, "pose").redundancy

    @property
    def wrench(self) -> Wrench:
        """External force and torque."""
        return _of(self.groups.wrench, "wrench")

    @property
    def mode(self) -> Mode | HandGuiding:
        """Active control mode, with its parameters; `HandGuiding()` while the arm is guided by hand."""
        return _of(self.groups.mode, "mode").mode

    @property
    def tool(self) -> str:
        """Name of the attached tool; empty: none."""
        return _of(self.groups.mode, "mode").tool

    @property
    def workpiece(self) -> str:
        """Name of the attached workpiece; empty: none."""
        return _of(self.groups.mode, "mode").workpiece

    @property
    def safety_workpiece(self) -> str:
        """Name of the workpiece whose load the safety functions of the cabinet count; empty: none."""
        return _of(self.groups.mode, "mode").safety_workpiece

    @property
    def frame(self) -> str:
        """Name of the motion frame: a frame of the tool, or "flange"."""
        return _of(self.groups.mode, "mode").frame

    @property
    def io(self) -> SignalValues:
        """Values of the cabinet's signals."""
        return _of(self.groups.io, "io")

    @property
    def safety(self) -> Safety:
        """Safety and readiness."""
        return _of(self.groups.safety, "safety")


def _of(group: _T | None, name: str) -> _T:
    if group is None:
        raise StaleState(
            f"this state has no group {name!r}",
            parameter=name,
            hint=f"subscribe to it: groups=(..., {name!r})",
        )
    return group
