"""A robot at rest: its ticks repeat the last state instead of simulating it, and many of them pass at once.

The robot rests when nothing runs or waits, no condition is observed, no FRI session is open, nothing in its world moves
and its published state has not changed for a tenth of a second. Then its next states are known: Java repeats the last
one, tick by tick, as soon as somebody waits for it. Whatever could change the state rouses the plant: calls of Java,
written outputs and overrides, actions of the operator. After that it is simulated again for half a second at least.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from heptarm.planning.motion import TICK
from heptarm.planning.seam import SLOTS, TICK_NS, HeaderWords, StateWords
from heptarm.sim.fri.sessions import Sessions
from heptarm.sim.plant.plant import Plant
from heptarm.sim.runtime.operator import SimulatedOperator

#: Ticks that pass at most before the inputs are looked at again.
LONGEST = 250
#: Ticks that are simulated at least after something may have changed: an override needs 0.3 s to take effect.
AWAKE = 500
#: Ticks between two looks at whether the robot rests, and between the two states that are compared.
LOOK, SPAN = 20, 100
#: Changes within `SPAN` that are none: of positions [rad], torques [Nm] and forces [N, Nm].
SAME_PLACE, SAME_LOAD = 1e-7, 2e-3
#: Nothing moves faster than this [rad/s, m/s].
STILL = 1e-5


class Timers(Protocol):
    """Passes the time of the ticks of a resting robot, and wakes their readers: `heptarm.doubles.plant.TimerQueue`."""

    def rest(self, latest: int) -> bool:
        """Repeat the newest state tick by tick, at most until a plant time [ns]; returns whether it was roused."""

    def rouse(self) -> None:
        """End that, or the next one; from any thread."""


class Rest:
    """Lets the time of a plant pass while it rests; used by the thread that ticks the plant.

    Args:
        plant: the plant.
        sessions: its FRI sessions.
        operator: acts on it.
        timers: pass the time.
    """

    def __init__(self, plant: Plant, sessions: Sessions, operator: SimulatedOperator, timers: Timers) -> None:
        self._plant, self._sessions, self._operator, self._timers = plant, sessions, operator, timers
        self._look = AWAKE
        self._inputs = _inputs(plant)
        tolerance = np.full(StateWords.SIZE, np.inf)
        tolerance[StateWords.Q] = tolerance[StateWords.Q_CMD] = SAME_PLACE
        tolerance[StateWords.DQ] = STILL
        for words in (StateWords.TAU, StateWords.TAU_EXT, StateWords.TAU_CMD, StateWords.WRENCH):
            tolerance[words] = SAME_LOAD
        self._compared = np.flatnonzero(np.isfinite(tolerance))
        self._tolerance = tolerance[self._compared]
        self._equal = [StateWords.FLAGS, StateWords.MODE, StateWords.ORDER]
        operator.on_action = self.rouse

    def rouse(self) -> None:
        """Something may change: simulate the next ticks. Any thread."""
        self._timers.rouse()

    def begins(self) -> bool:
        """Whether the robot rests; asked after each tick."""
        tick = self._plant.tick_count
        if tick < self._look:
            return False
        self._look = tick + LOOK
        if not self._is_quiet() or not self._is_still(tick):
            return False
        self._inputs = _inputs(self._plant)
        return True

    def pass_time(self) -> bool:
        """Let time pass; returns whether the rest is over."""
        plant = self._plant
        latest = min(plant.tick_count + LONGEST, self._operator.next_due)
        changed = bool(self._timers.rest(latest * TICK_NS))
        passed = int(plant.shared.header[HeaderWords.NEWEST]) - plant.tick_count
        plant.tick_count += passed
        plant.data.time += passed * TICK
        if changed or not self._is_quiet() or _inputs(plant) != self._inputs:
            self._look = plant.tick_count + AWAKE
            return True
        return False

    def _is_quiet(self) -> bool:
        """Whether nothing is going on that the states do not show."""
        return (
            self._plant.interpolator.is_quiet
            and not self._sessions.is_any_open
            and self._operator.next_due > self._plant.tick_count
        )

    def _is_still(self, tick: int) -> bool:
        """Whether nothing moves in the world, and the state is as it was."""
        data = self._plant.data
        if data.qfrc_applied.any() or data.xfrc_applied.any() or float(np.abs(data.qvel).max()) > STILL:
            return False
        words, reals = self._plant.shared.ints, self._plant.shared.floats
        now, before = tick % SLOTS, (tick - SPAN) % SLOTS
        if (words[now, self._equal] != words[before, self._equal]).any():
            return False
        change = np.abs(reals[now, self._compared] - reals[before, self._compared])
        return bool((change <= self._tolerance).all()) and not words[now, StateWords.ORDER]


def _inputs(plant: Plant) -> bytes:
    """What Java writes into the shared memory: override and IO image."""
    shared = plant.shared
    return bytes(shared.reals[HeaderWords.OVERRIDE].tobytes() + shared.signals.tobytes())
