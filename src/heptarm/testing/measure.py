"""Measuring: what a scenario saw has to be what it should be; every measurement is kept for the report."""

from __future__ import annotations

from collections.abc import Sequence
from contextvars import ContextVar
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from heptarm.arm.arm import Arm
from heptarm.errors import HeptarmError
from heptarm.values.checks import Array
from heptarm.values.condition.condition import Condition
from heptarm.values.mode.mode import Mode
from heptarm.values.motion.motion import Motion
from heptarm.values.result import Result
from heptarm.values.state import State

#: A set-point slower than this does not move [rad/s].
_STILL = 1e-6
#: More numbers than this are reported by their least and largest.
_MANY = 16
_SEEN: ContextVar[list[str] | None] = ContextVar("heptarm_measured", default=None)


class NotShown(HeptarmError):
    """A measurement is not what it should be."""


class Unfit(HeptarmError):
    """There is nothing here to show it with."""


def collect() -> list[str]:
    """A list to which everything measured from now on, in this thread, is added in words."""
    seen: list[str] = []
    _SEEN.set(seen)
    return seen


def note(words: str) -> None:
    """Keep something that was measured."""
    seen = _SEEN.get()
    if seen is not None:
        seen.append(words)


def holds(truth: object, what: str) -> None:
    """Something is so.

    Raises:
        NotShown: it is not.
    """
    note(what if truth else f"NOT {what}")
    if not truth:
        raise NotShown(f"it is not so: {what}")


def near(value: npt.ArrayLike, wanted: npt.ArrayLike, by: float, what: str, *, unit: str = "") -> None:
    """Numbers are what they should be.

    Args:
        value: what was measured.
        wanted: what it should be, of the same shape or a single number.
        by: how far it may be off.
        what: in words.
        unit: of all of them.

    Raises:
        NotShown: one is farther off, or not finite.
    """
    off = float(np.max(np.abs(np.asarray(value, dtype=np.float64) - np.asarray(wanted, dtype=np.float64))))
    words = f"{what}: {_text(value)} {unit}".rstrip()
    aim = f"wanted {_text(wanted)} within {by:.3g}, off by {off:.3g}"
    note(f"{words} ({aim})")
    if not off <= by:
        raise NotShown(f"{words}; {aim}")


def below(value: float, limit: float, what: str, *, unit: str = "") -> None:
    """A number is below a limit.

    Raises:
        NotShown: it is not.
    """
    words = f"{what}: {value:.4g} {unit}".rstrip() + f" (below {limit:.4g})"
    note(words)
    if not value < limit:
        raise NotShown(words)


def above(value: float, limit: float, what: str, *, unit: str = "") -> None:
    """A number is above a limit.

    Raises:
        NotShown: it is not.
    """
    words = f"{what}: {value:.4g} {unit}".rstrip() + f" (above {limit:.4g})"
    note(words)
    if not value > limit:
        raise NotShown(words)


def _text(value: npt.ArrayLike) -> str:
    numbers = np.asarray(value, dtype=np.float64)
    if numbers.size > _MANY:
        return f"{numbers.size} numbers from {numbers.min():.4g} to {numbers.max():.4g}"
    return f"{float(numbers):.5g}" if numbers.ndim == 0 else " ".join(f"{v:.4g}" for v in numbers.flat)


@dataclass(frozen=True, slots=True)
class MotionStates:
    """The states pushed during a motion, in their order; in each one joints and pose were sampled again.

    Attributes:
        result: how it ended.
        states: what was seen.
    """

    result: Result
    states: tuple[State, ...]

    @property
    def t(self) -> Array:
        """Cabinet time of the joints since the first state, shape (n,) [s]."""
        return _times([state.joints.stamp for state in self.states if state.joints is not None])

    @property
    def t_pose(self) -> Array:
        """Cabinet time of the poses since the first state, shape (n,) [s]."""
        return _times([state.groups.pose.stamp for state in self.states if state.groups.pose is not None])

    @property
    def begin(self) -> float:
        """When a state first showed its program [s since the first state]: a busy cabinet begins later."""
        ids = [0 if state.motion is None else state.motion.id for state in self.states]
        return float(self.t[ids.index(max(ids))])

    @property
    def q(self) -> Array:
        """Measured joint positions, shape (n, 7) [rad]."""
        return np.array([state.q for state in self.states])

    @property
    def q_cmd(self) -> Array:
        """Commanded joint positions, shape (n, 7) [rad]."""
        return np.array([state.q_cmd for state in self.states])

    @property
    def xyz(self) -> Array:
        """Measured places of the motion frame, shape (n, 3) [m]."""
        return np.array([state.pose.xyz for state in self.states])

    @property
    def xyz_cmd(self) -> Array:
        """Commanded places of the motion frame, shape (n, 3) [m]."""
        return np.array([state.pose_cmd.xyz for state in self.states])

    @property
    def rates(self) -> Array:
        """Commanded joint speeds between two states, shape (n - 1, 7) [rad/s]."""
        return np.asarray(np.diff(self.q_cmd, axis=0) / np.diff(self.t)[:, None])

    @property
    def moving(self) -> float:
        """Time for which the set-point moved [s]; unlike the result's duration, no late thread makes it longer."""
        (moved,) = np.nonzero(np.abs(self.rates).max(axis=1) > _STILL)
        return float(self.t[moved[-1] + 1] - self.t[moved[0]]) if len(moved) else 0.0

    @property
    def speeds(self) -> Array:
        """Commanded speeds of the motion frame between two states, shape (n - 1,) [m/s]."""
        return np.asarray(np.linalg.norm(np.diff(self.xyz_cmd, axis=0), axis=1) / np.diff(self.t_pose))

    @property
    def turns(self) -> Array:
        """Commanded turning speeds of the motion frame between two states, shape (n - 1,) [rad/s]."""
        pairs = zip(self.states, self.states[1:])
        return np.array([b.pose_cmd.angle_to(a.pose_cmd) for a, b in pairs]) / np.diff(self.t_pose)


def _times(stamps: Sequence[int]) -> Array:
    return np.asarray((np.array(stamps, dtype=np.float64) - stamps[0]) * 1e-9)


def _is_newer(state: State, than: State | None) -> bool:
    """Whether joints and pose were both sampled again: a cabinet sends a group again that takes long to read."""
    if than is None or state.joints is None or than.joints is None:
        return True
    pose, before = state.groups.pose, than.groups.pose
    return state.joints.stamp > than.joints.stamp and (
        pose is None or before is None or pose.stamp > before.stamp
    )


def record(
    arm: Arm,
    motion: Motion | Sequence[Motion],
    *,
    mode: Mode | None = None,
    until: Condition | None = None,
    speed: float | None = None,
) -> MotionStates:
    """Carry out a motion, or several, and keep all states meanwhile. Raises as `Arm.move` does."""
    before = arm.state.stamp
    pushed = arm.states()  # from before the beginning: a slow machine would miss the first of them
    handle = arm.start(motion, mode=mode, until=until, speed=speed)
    states: list[State] = []
    end = None
    for state in pushed:
        if state.stamp > before and _is_newer(state, states[-1] if states else None):
            states.append(state)
        if end is None and handle.done:
            end = arm.state.stamp  # a slow machine has not seen all of them yet
        if state.stamp >= end if end is not None else state.stamp - before > handle.limit * 1e9:
            break
    pushed.close()
    return MotionStates(handle.wait(), tuple(states))


def fresh(arm: Arm, *, after: float = 0.03) -> State:
    """A state with all groups sampled later than now by so many cabinet seconds: everything before counts in it."""
    due = arm.state.stamp + round(after * 1e9)

    def is_fresh(state: State) -> bool:
        return all(group.stamp > due for group in state.groups if group is not None)

    return arm.wait_until(is_fresh)


@dataclass(frozen=True, slots=True)
class Baseline:
    """What the torque sensors show while nobody touches the arm: their offsets, and what the load data lack.

    Attributes:
        force: external force at the motion frame, base axes, shape (3,) [N].
        torque: external torque there, shape (3,) [Nm].
        tau: torques of the joints, shape (7,) [Nm].
        tau_ext: external torques of the joints, shape (7,) [Nm].
    """

    force: Array
    torque: Array
    tau: Array
    tau_ext: Array


def baseline(arm: Arm) -> Baseline:
    """The mean of a tenth of a second in which nothing changes."""
    states = watch(arm, 0.1)

    def mean(values: Sequence[Array]) -> Array:
        return np.asarray(np.mean(values, axis=0), dtype=np.float64)

    return Baseline(
        mean([state.wrench.force for state in states]),
        mean([state.wrench.torque for state in states]),
        mean([state.tau for state in states]),
        mean([state.tau_ext for state in states]),
    )


def watch(arm: Arm, seconds: float) -> tuple[State, ...]:
    """States of so many cabinet seconds."""
    first = arm.state.stamp
    states: dict[int, State] = {}
    for state in arm.states():
        states[state.stamp] = state
        if state.stamp - first > seconds * 1e9:
            break
    return tuple(states.values())
