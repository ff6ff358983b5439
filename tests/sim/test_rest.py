"""A plant at rest passes its time without simulation, and notices whatever ends the rest."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field

import numpy as np
import pytest

from heptarm.fri.protocol.version import Version
from heptarm.sim import seam
from heptarm.sim.fri.sessions import Sessions
from heptarm.sim.planning.command import Order
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.shared_state import SharedState
from heptarm.sim.runtime.operator import SimulatedOperator
from heptarm.sim.runtime.realtime_loop import RealtimeLoop
from heptarm.sim.runtime.rest import AWAKE, LONGEST, Rest
from heptarm.sim.seam import SLOTS, HeaderWords, StateWords
from heptarm.values.robot import Body
from tests.sim.driving import ready


@dataclass
class Bed:
    """Where the loop sleeps, without Java."""

    roused: bool = False
    latest: list[int] = field(default_factory=list)

    def rest(self, latest: int) -> bool:
        self.latest.append(latest)
        roused, self.roused = self.roused, False
        return roused

    def rouse(self) -> None:
        self.roused = True


def rested(plant: Plant, *, ticks: int = 3000) -> tuple[Rest, Bed, SimulatedOperator]:
    """A plant and its rest, after it has come to rest."""
    bed, operator = Bed(), SimulatedOperator(plant)
    rest = Rest(plant, Sessions(plant, version=Version.of("1.15"), speed=1.0), operator, bed)
    for _ in range(ticks):
        plant.tick()
        if rest.begins():
            return rest, bed, operator
    raise AssertionError("the plant does not come to rest")


def _motion() -> Order:
    return Order(1, "ptp", joints=(0.2, 0.5, 0.0, -1.2, 0.0, 0.9, 0.2))


@pytest.mark.parametrize("count", [1, 20, 100, SLOTS - 1])
def test_repeated_states_are_those_of_their_ticks(count: int) -> None:
    plant = ready()
    plant.step(200)
    before = plant.shared.read(200)
    plant.shared.repeat(count)
    assert before is not None and int(plant.shared.header[HeaderWords.NEWEST]) == 200 + count
    for tick in range(max(200, 201 + count - SLOTS), 201 + count):
        state = plant.shared.read(tick)
        assert state is not None and state.view(np.int64)[StateWords.TIME] == tick * 1_000_000
        assert np.array_equal(state[2:], before[2:], equal_nan=True)
    assert plant.shared.read(201 + count) is None


def test_time_passes_at_rest_and_the_next_tick_continues() -> None:
    plant = ready()
    rest, bed, _ = rested(plant)
    began, world, state = plant.tick_count, float(plant.data.time), plant.snapshot
    assert not rest.sleep() and bed.latest == [(began + LONGEST) * 1_000_000]
    rest.skip(LONGEST)
    assert plant.tick_count == began + LONGEST and plant.time_ns == plant.tick_count * 1_000_000
    assert float(plant.data.time) == pytest.approx(world + 0.02)
    plant.tick()
    assert np.abs(plant.snapshot.q - state.q).max() < 1e-8
    assert int(plant.shared.header[HeaderWords.NEWEST]) == began + LONGEST + 1


def test_readers_are_woken_for_the_tick_that_they_wait_for() -> None:
    plant = ready()
    rest, _, _ = rested(plant)
    woken: list[int] = []
    plant.on_wake = woken.append
    plant.shared.header[HeaderWords.WAKE] = (plant.tick_count + 2) * 1_000_000
    rest.skip(1)
    rest.wake_readers()
    assert woken == []
    rest.skip(1)
    rest.wake_readers()
    assert woken == [plant.time_ns]


def test_a_moving_arm_does_not_rest() -> None:
    plant = ready()
    rest, _, _ = rested(plant)
    plant.submit(_motion())
    assert rest.sleep()
    while not plant.idle:
        plant.tick()
        assert not rest.begins()


def _never(_: bool) -> None:
    raise AssertionError


WAYS = {
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


@pytest.mark.parametrize("way", WAYS)
def test_whatever_happens_ends_the_rest(way: str) -> None:
    plant = ready()
    rest, _, operator = rested(plant)
    assert not rest.sleep()
    WAYS[way](plant, operator)
    assert rest.sleep()
    woken = plant.tick_count
    while plant.tick_count < woken + AWAKE - 1:
        plant.tick()
        assert not rest.begins()


def test_a_stop_and_its_end_show_in_the_next_states() -> None:
    plant = ready()
    rest, _, operator = rested(plant)
    operator.do("emergency_stop")
    assert rest.sleep()
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
    rest.sleep()
    assert rested(plant)[0] is not None


def test_a_scheduled_action_is_not_passed_over() -> None:
    plant = ready()
    rest, bed, operator = rested(plant)
    due = plant.tick_count + 7
    operator.schedule(f"emergency_stop@{due / 1000}")
    assert not rest.sleep() and bed.latest[-1] == due * 1_000_000
    rest.skip(LONGEST)
    assert plant.tick_count == due
    assert rest.sleep()
    operator.tick()
    assert plant.safety.stop_requested


def test_a_load_that_changes_is_simulated() -> None:
    plant = ready()
    rest, _, _ = rested(plant)
    before = plant.snapshot.tau
    plant.set_payload(Body(3.0, np.array([0.0, 0.0, 0.05])))
    rest.rouse()  # as each call of Java does
    assert rest.sleep()
    plant.step(AWAKE)
    assert np.abs(plant.snapshot.tau - before).max() > 1.0


def test_a_closed_brake_rests_too() -> None:
    plant = ready()
    _, _, operator = rested(plant)
    operator.do("emergency_stop")
    assert rested(plant)[0] is not None


class Sleeper:
    """A plant that rests from the start, and sleeps by an event."""

    def __init__(self, shared: SharedState) -> None:
        self._shared, self.event = shared, threading.Event()
        self.skipped = 0

    def begins(self) -> bool:
        return not self.event.is_set()

    def sleep(self) -> bool:
        return self.event.wait(0.005)

    def skip(self, ticks: int) -> None:
        self._shared.repeat(ticks)
        self.skipped += ticks

    def wake_readers(self) -> None:
        return


def test_the_loop_publishes_the_ticks_that_are_due_and_ticks_on_when_it_is_roused() -> None:
    shared, ticks = SharedState(), []
    shared.header[HeaderWords.NEWEST] = 0

    def tick() -> None:
        shared.repeat(1)
        ticks.append(time.monotonic())
        if len(ticks) == 6:
            loop.stop()

    sleeper = Sleeper(shared)
    loop = RealtimeLoop(shared, tick, rest=sleeper)
    roused: list[float] = []

    def rouse() -> None:
        roused.append(time.monotonic())
        sleeper.event.set()

    threading.Timer(0.3, rouse).start()
    loop.run()
    assert len(ticks) == 6 and ticks[1] >= roused[0]  # the first one came before the rest
    report = loop.statistics
    assert report.rested == sleeper.skipped and report.ticks == 6
    # as much time has passed for the plant as for the machine, unless the machine stood still
    assert report.rebased or sleeper.skipped >= 1000 * (roused[0] - ticks[0]) - 50
