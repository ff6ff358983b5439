"""Ticks that need no more than the table of a motion: many at once are those one by one, and events are seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from heptarm.planning.seam import SLOTS, TICK_NS, HeaderWords, StateWords
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from tests.long import longer
from tests.sim import motions
from tests.sim.driving import READY

FAR, NEAR = (0.8, 0.2, 0.3, -1.0, 0.4, 0.5, -0.8), (0.1, 0.5, 0.0, -1.3, 0.0, 0.9, 0.001)
BATCH = MotionCommand(1, motions.batch(*(motions.ptp(one) for one in (FAR, NEAR))))
#: What can happen during a motion.
EVENTS: dict[str, Callable[[Plant], object]] = {
    "pause": Plant.pause,
    "resume": Plant.resume,
    "stop": Plant.stop,
    "stop fast": Plant.stop_fast,
    "another motion": lambda plant: plant.submit(MotionCommand(2, motions.ptp(NEAR))),
    "slower": lambda plant: setattr(plant, "override", 0.4),
    "faster": lambda plant: setattr(plant, "override", 1.0),
    "slower by hand": lambda plant: setattr(plant.safety, "manual", 0.6),
    "a push": lambda plant: plant.apply_wrench((0.0, 5.0, -10.0), duration=0.02),
    "an enabling switch": lambda plant: plant.safety.enable(),
    "the safeguard opens": lambda plant: plant.safety.request_stop(StopRequest.OPERATOR_SAFETY),
    "and closes": lambda plant: plant.safety.withdraw(),
    "an abort": lambda plant: plant.abort(0, "enough"),
}


class Parts:
    """Records the ticks at which the parts of a motion begin."""

    def __init__(self, plant: Plant) -> None:
        self._plant, self.ticks = plant, list[int]()

    def started(self) -> None:
        """The motion begins."""

    def finished(self, cause: str, text: str) -> None:
        """The motion has ended."""

    def reached(self, part: int) -> None:
        """A part begins."""
        self.ticks.append(self._plant.tick_count)


def moving(order: MotionCommand) -> tuple[Plant, Parts]:
    """A plant with a motion, and what it reports."""
    plant = Plant("iiwa14", q=READY)
    parts = Parts(plant)
    plant.submit(replace(order, part_listener=parts))
    return plant, parts


def record(plant: Plant, ticks: int, most: int = 1) -> Array:
    """States of the next ticks."""
    states: list[Array] = []
    while len(states) < ticks:
        done = plant.tick(min(most, ticks - len(states)))
        newest = plant.tick_count
        states += [plant.shared.floats[k % SLOTS].copy() for k in range(newest - done + 1, newest + 1)]
    return np.array(states)


def equal(first: Array, second: Array) -> bool:
    """Whether two records agree in every bit."""
    return first.tobytes() == second.tobytes()


def test_many_at_once_are_those_one_by_one() -> None:
    (one, ones), (many, parts) = moving(BATCH), moving(BATCH)
    assert equal(record(one, 2500), record(many, 2500, most=40))
    assert one.idle and many.idle
    assert ones.ticks == parts.ticks and len(parts.ticks) == 1
    assert (one.snapshot.q_cmd == many.snapshot.q_cmd).all()


def test_many_at_once_save_calls() -> None:
    plant, _ = moving(BATCH)
    calls = 0
    while plant.tick_count < 1000:
        plant.tick(50)
        calls += 1
    assert calls < 60


@settings(max_examples=longer(10, 25), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.tuples(st.integers(1, 1200), st.sampled_from(sorted(EVENTS))), max_size=5))
def test_whatever_happens_is_seen_by_the_next_tick(happening: list[tuple[int, str]]) -> None:
    records = []
    for most in (0, 1, 25):
        plant, _ = moving(BATCH)
        if not most:  # every tick the long way
            plant._foresee = lambda: None  # type: ignore[method-assign]
        states = []
        for until, event in [*sorted(happening), (1300, "resume")]:
            states.append(record(plant, until - plant.tick_count, max(1, most)))
            EVENTS[event](plant)
        records.append(np.concatenate([one for one in states if len(one)]))
    assert equal(records[0], records[1])
    assert equal(records[0], records[2])


def test_they_end_where_somebody_waits_for_a_state() -> None:
    plant, _ = moving(BATCH)
    plant.step(100)
    woken: list[int] = []

    def wake(time_ns: int) -> None:
        woken.append(time_ns)
        plant.shared.header[HeaderWords.WAKE] = 2**62

    plant.on_wake = wake
    plant.shared.header[HeaderWords.WAKE] = 130 * TICK_NS
    before = plant.tick_count
    assert plant.tick(80) == 130 - before
    assert plant.tick_count == 130 and woken == [130 * TICK_NS]
    assert plant.tick(10) == 10 and len(woken) == 1


def test_the_set_points_are_known_in_between() -> None:
    plant, _ = moving(BATCH)
    plant.step(200)
    assert plant.tick(30) == 30
    shown = plant.shared.read(plant.tick_count)
    assert shown is not None
    assert (plant.interpolated == shown[StateWords.Q_CMD]).all()
    assert not plant.interpolator.rests
