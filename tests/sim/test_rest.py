"""A plant at rest passes its time without simulation, and notices whatever ends the rest."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
import pytest

from heptarm.fri.protocol.version import Version
from heptarm.planning import seam
from heptarm.planning.seam import SLOTS, HeaderWords, StateWords
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.fri.sessions import Sessions
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.shared_state import SharedState
from heptarm.sim.runtime.operator import SimulatedOperator
from heptarm.sim.runtime.realtime_loop import RealtimeLoop
from heptarm.sim.runtime.rest import AWAKE, LONGEST, Rest
from heptarm.values.robot import Body
from tests.sim import motions
from tests.sim.driving import ready


@dataclass
class Timers:
    """Passes the time at once, as Java does when nobody waits for it."""

    plant: Plant
    roused: bool = False
    latest: list[int] = field(default_factory=list)

    def rest(self, latest: int) -> bool:
        self.latest.append(latest)
        roused, self.roused = self.roused, False
        if not roused:
            repeat(self.plant.shared, latest // 1_000_000)
        return roused

    def rouse(self) -> None:
        self.roused = True


def repeat(shared: SharedState, last: int) -> None:
    """Publish the newest state again, up to a tick."""
    newest = int(shared.header[HeaderWords.NEWEST])
    for tick in range(newest + 1, last + 1):
        words = shared.ints[tick % SLOTS]
        words[:] = shared.ints[newest % SLOTS]
        words[StateWords.SEQ], words[StateWords.TIME] = 2 * tick + 2, tick * 1_000_000
    shared.header[HeaderWords.NEWEST] = max(newest, last)


def rested(plant: Plant, *, ticks: int = 3000) -> tuple[Rest, Timers, SimulatedOperator]:
    """A plant and its rest, after it has come to rest."""
    timers, operator = Timers(plant), SimulatedOperator(plant)
    rest = Rest(plant, Sessions(plant, version=Version.of("1.15"), speed=1.0), operator, timers)
    for _ in range(ticks):
        plant.tick()
        if rest.begins():
            return rest, timers, operator
    raise AssertionError("the plant does not come to rest")


def _motion() -> MotionCommand:
    return MotionCommand(1, motions.ptp((0.2, 0.5, 0.0, -1.2, 0.0, 0.9, 0.2)))


def test_time_passes_at_rest_and_the_next_tick_continues() -> None:
    plant = ready()
    rest, timers, _ = rested(plant)
    began, world, state = plant.tick_count, float(plant.data.time), plant.snapshot
    assert not rest.pass_time() and timers.latest == [(began + LONGEST) * 1_000_000]
    assert plant.tick_count == began + LONGEST and plant.time_ns == plant.tick_count * 1_000_000
    assert float(plant.data.time) == pytest.approx(world + 1e-3 * LONGEST)
    plant.tick()
    assert np.abs(plant.snapshot.q - state.q).max() < 1e-8
    assert int(plant.shared.header[HeaderWords.NEWEST]) == began + LONGEST + 1


def test_a_moving_arm_does_not_rest() -> None:
    plant = ready()
    rest, _, _ = rested(plant)
    plant.submit(_motion())
    assert rest.pass_time()
    while not plant.idle:
        plant.tick()
        assert not rest.begins()


def _never(_: bool) -> None:
    raise AssertionError


CAUSES: dict[str, Callable[[Any, Any], object]] = {
    "a motion": lambda plant, operator: plant.submit(_motion()),
    "a condition": lambda plant, operator: plant.condition_monitor.observe(
        seam.SignalIs(place=0, value=True), _never, at_once=False
    ),
    "a cancellation": lambda plant, operator: plant.cancel(7),
    "an override": lambda plant, operator: setattr(plant, "override", 0.5),
    "a signal": lambda plant, operator: plant.shared.signals.__setitem__(3, 1.0),
    "a stop": lambda plant, operator: operator.do("emergency_stop"),
    "a push": lambda plant, operator: operator.do("push 0 0 -20"),
    "the override at the smartPAD": lambda plant, operator: operator.do("override 0.3"),
}


@pytest.mark.parametrize("cause", CAUSES)
def test_whatever_happens_ends_the_rest(cause: str) -> None:
    plant = ready()
    rest, _, operator = rested(plant)
    assert not rest.pass_time()
    CAUSES[cause](plant, operator)
    assert rest.pass_time()
    woken = plant.tick_count
    while plant.tick_count < woken + AWAKE - 1:
        plant.tick()
        assert not rest.begins()


def test_a_stop_and_its_end_show_in_the_next_states() -> None:
    plant = ready()
    rest, _, operator = rested(plant)
    operator.do("emergency_stop")
    assert rest.pass_time()
    plant.tick()
    flags = int(plant.shared.ints[plant.tick_count % SLOTS, StateWords.FLAGS])
    assert flags & seam.SafetyFlags.EMERGENCY_STOP


def test_a_push_goes_on_while_it_lasts() -> None:
    plant = ready()
    rest, _, operator = rested(plant)
    operator.do("push 0 0 -20")
    for _ in range(3000):
        plant.tick()
        assert not rest.begins()
    operator.do("push 0 0 0")
    rest.pass_time()
    assert rested(plant)[0] is not None


def test_a_scheduled_action_is_not_passed_over() -> None:
    plant = ready()
    rest, timers, operator = rested(plant)
    due = plant.tick_count + 7
    operator.schedule(f"emergency_stop@{due / 1000}")
    assert rest.pass_time() and timers.latest[-1] == due * 1_000_000
    assert plant.tick_count == due
    operator.tick()
    assert plant.safety.stop_requested


def test_a_load_that_changes_is_simulated() -> None:
    plant = ready()
    rest, _, _ = rested(plant)
    before = plant.snapshot.tau
    plant.set_payload(Body(3.0, np.array([0.0, 0.0, 0.05])))
    rest.rouse()  # as each call of Java does
    assert rest.pass_time()
    plant.step(AWAKE)
    assert np.abs(plant.snapshot.tau - before).max() > 1.0


def test_a_closed_brake_rests_too() -> None:
    plant = ready()
    _, _, operator = rested(plant)
    operator.do("emergency_stop")
    assert rested(plant)[0] is not None


class Sleeper:
    """A plant that rests from the start, until an event."""

    def __init__(self, shared: SharedState) -> None:
        self._shared, self.event = shared, threading.Event()
        self.passed = 0

    def begins(self) -> bool:
        return not self.event.is_set()

    def pass_time(self) -> bool:
        roused = self.event.wait(0.005)
        header = self._shared.header
        due = (time.monotonic_ns() - int(header[HeaderWords.ANCHOR])) // 1_000_000
        self.passed += due - int(header[HeaderWords.NEWEST])
        repeat(self._shared, due)
        return roused


def test_the_loop_lets_time_pass_and_ticks_on_when_the_rest_is_over() -> None:
    shared, ticks = SharedState(), []
    shared.header[HeaderWords.NEWEST] = 0

    def tick() -> None:
        repeat(shared, int(shared.header[HeaderWords.NEWEST]) + 1)
        ticks.append(time.monotonic())
        if len(ticks) == 6:
            loop.stop()

    sleeper = Sleeper(shared)
    loop = RealtimeLoop(shared, tick, rest=cast(Rest, sleeper))
    roused: list[float] = []

    def rouse() -> None:
        roused.append(time.monotonic())
        sleeper.event.set()

    threading.Timer(0.3, rouse).start()
    loop.run()
    assert len(ticks) == 6 and ticks[1] >= roused[0]  # the first one came before the rest
    report = loop.statistics
    assert report.rested == sleeper.passed and report.ticks == 6
    # as much time has passed for the plant as for the machine
    assert sleeper.passed >= 1000 * (roused[0] - ticks[0]) - 50
