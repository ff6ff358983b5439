"""The shared state is never read torn, and the loop keeps time."""

from __future__ import annotations

import re
import subprocess
import sys
import threading

import numpy as np
import pytest

from heptarm.planning.seam import SLOTS, HeaderWords, SafetyFlags, StateWords
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.shared_state import NEVER
from tests.sim.driving import ready


def test_a_slot_holds_the_state_of_its_tick() -> None:
    plant = ready()
    plant.step(300)
    slot = plant.shared.read(300)
    assert slot is not None
    assert np.array_equal(slot[2:9], plant.snapshot.q) and np.array_equal(slot[9:16], plant.snapshot.q_cmd)
    assert slot.view(np.int64)[StateWords.TIME] == 300_000_000 == plant.time_ns
    assert slot.view(np.int64)[StateWords.FLAGS] & SafetyFlags.READY


def test_overwritten_and_torn_slots_read_as_none() -> None:
    plant = ready()
    plant.step(300)
    assert plant.shared.read(300 - SLOTS) is None and plant.shared.read(301) is None
    plant.shared.ints[300 % SLOTS, StateWords.SEQ] = 2 * 300 + 1  # as while it is written
    assert plant.shared.read(300) is None


def test_somebody_is_woken_only_when_their_time_has_come() -> None:
    plant = ready()
    woken: list[int] = []
    plant.on_wake = woken.append
    plant.step(10)
    assert woken == []
    plant.shared.header[HeaderWords.WAKE] = 15_000_000
    plant.step(4)
    assert woken == []
    plant.step(1)
    assert woken == [15_000_000]


def test_a_reader_never_sees_a_torn_slot_while_the_plant_ticks() -> None:
    plant = ready()
    stop, wrong, read = threading.Event(), [], [0]

    def look() -> None:
        while not stop.is_set():
            tick = int(plant.shared.header[HeaderWords.NEWEST])
            slot = plant.shared.read(tick)
            if slot is not None:
                read[0] += 1
                if slot.view(np.int64)[StateWords.TIME] != tick * 1_000_000:
                    wrong.append(tick)

    reader = threading.Thread(target=look)
    reader.start()
    plant.step(3000)
    stop.set()
    reader.join()
    assert read[0] > 100 and not wrong


_PACE = """
import sys, threading, time
from heptarm.sim.runtime.realtime_loop import RealtimeLoop
from heptarm.sim.plant.plant import Plant
plant = Plant()
began = []
def tick():
    if not began:
        began.append(time.monotonic())
        threading.Timer(0.5, loop.stop).start()
    plant.tick()
loop = RealtimeLoop(plant.shared, tick, speed=float(sys.argv[1]))
loop.run()
report = loop.statistics
print(report.ticks / (time.monotonic() - began[0]), report.tick_us["p50"], report.lateness_us["p50"])
"""


def _pace(speed: float) -> list[float]:
    command = [sys.executable, "-c", _PACE, str(speed)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    return [float(word) for word in done.stdout.split()]


def test_the_loop_keeps_the_requested_speed() -> None:
    per_second, tick, _ = _pace(1.0)
    assert 100 < per_second < 1100 and tick > 0.0  # time that the machine does not provide is given up
    assert 100 < _pace(4.0)[0] < 4400
    assert _pace(0.0)[0] > 100  # as fast as it goes


_STALL = """
import sys, time
from heptarm.sim.runtime.realtime_loop import RealtimeLoop
from heptarm.sim.plant.shared_state import SharedState
began = []
def tick():
    began.append(time.monotonic())
    if len(began) % 50 == 25:
        time.sleep(0.01)
    if len(began) == 300:
        loop.stop()
loop = RealtimeLoop(SharedState(), tick)
loop.answer_gap = float(sys.argv[1])
loop.run()
print(min(later - first for first, later in zip(began, began[1:])))
"""


@pytest.mark.parametrize("room", [0.0, 0.4])
def test_beside_an_fri_session_no_ticks_follow_each_other_without_a_pause(room: float) -> None:
    command = [sys.executable, "-c", _STALL, str(room)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    shortest = float(done.stdout)
    assert shortest >= 0.0004 if room else shortest < 0.0004  # however late the machine wakes the loop


_EARLY = """
import sys, time
from heptarm.sim.plant.shared_state import SharedState
from heptarm.sim.runtime.realtime_loop import RealtimeLoop
from heptarm.planning.seam import TICK_NS, HeaderWords
shared, begun, ended = SharedState(), [], []
shared.header[HeaderWords.WAKE] = int(sys.argv[1])
def tick():
    number = int(shared.header[HeaderWords.NEWEST]) + 1
    due = int(shared.header[HeaderWords.ANCHOR]) + number * TICK_NS
    begun.append(time.monotonic_ns() - due)
    while time.monotonic_ns() < due + begun[-1] + 50_000:  # what a tick computes
        pass
    ended.append(time.monotonic_ns() - due)
    shared.header[HeaderWords.NEWEST] = number
    if len(begun) == 600:
        loop.stop()
loop = RealtimeLoop(shared, tick)
loop.run()
print(min(begun[300:]), sum(one < 0 for one in ended[300:]))
"""


def _early(wake: int) -> list[int]:
    """What _EARLY prints, where somebody waits for each tick from a plant time on [ns]."""
    command = [sys.executable, "-c", _EARLY, str(wake)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    return [int(word) for word in done.stdout.split()]


def test_a_tick_that_somebody_waits_for_begins_and_ends_before_it_is_due() -> None:
    earliest, in_time = _early(0)
    assert -350_000 <= earliest < -50_000  # [ns]
    assert in_time > 0


def test_a_tick_that_nobody_waits_for_begins_when_it_is_due() -> None:
    earliest, in_time = _early(NEVER)
    assert earliest >= 0 and not in_time


_TOGETHER = """
import sys, time
from heptarm.sim.plant.shared_state import SharedState
from heptarm.sim.runtime.realtime_loop import RealtimeLoop
from heptarm.planning.seam import TICK_NS, HeaderWords
shared, ticks, early = SharedState(), [], []
shared.header[HeaderWords.WAKE] = int(sys.argv[1])
def tick():
    shared.header[HeaderWords.NEWEST] += loop.allowed
    newest = int(shared.header[HeaderWords.NEWEST])
    early.append(int(shared.header[HeaderWords.ANCHOR]) + newest * TICK_NS // 10 - time.monotonic_ns())
    ticks.append(loop.allowed)
    loop.answer_gap = float(sys.argv[2])
    if len(ticks) == 100:
        loop.stop()
loop = RealtimeLoop(shared, tick, speed=10.0, at_once=16)
loop.run()
print(max(ticks[1:]), max(early), loop.statistics.ticks - sum(ticks))
"""


@pytest.mark.parametrize(
    ("wake", "gap", "most"), [(NEVER, 0.0, 10), (NEVER, 0.4, 1)], ids=["nobody waits", "FRI session"]
)
def test_faster_than_time_the_ticks_of_a_millisecond_are_one_call_unless_fri_answers_each(
    wake: int, gap: float, most: int
) -> None:
    command = [sys.executable, "-c", _TOGETHER, str(wake), str(gap)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    called, earliest, uncounted = map(int, done.stdout.split())
    assert called == most
    assert earliest <= 0, "no tick runs ahead of time"
    assert uncounted == 0


_COLLECTIONS = """
import gc
from heptarm.sim.plant.shared_state import SharedState
from heptarm.sim.runtime import realtime_loop
from heptarm.planning.seam import HeaderWords
realtime_loop.COLLECT_EVERY, realtime_loop.COLLECT_LATEST = 10_000_000, 20_000_000
shared, found = SharedState(), []
def tick():
    shared.header[HeaderWords.NEWEST] += 1
    number = int(shared.header[HeaderWords.NEWEST])
    if number == 1:
        gc.callbacks.append(lambda phase, facts: found.append(facts["generation"]))
    if number == 400:
        loop.stop()
        gc.callbacks.clear()
class Rest:
    is_due = True
    def begins(self):
        return self.is_due and shared.header[HeaderWords.NEWEST] >= 200
    def pass_time(self):
        shared.header[HeaderWords.NEWEST] += 20
        realtime_loop.time.sleep(0.02)
        self.is_due = shared.header[HeaderWords.NEWEST] < 280
        return not self.is_due
loop = realtime_loop.RealtimeLoop(shared, tick, rest=Rest())
loop.run()
print("".join(map(str, found)))
"""


def test_all_objects_are_collected_while_the_robot_rests() -> None:
    command = [sys.executable, "-c", _COLLECTIONS]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    moving, resting, moving_again = (set(part) for part in re.split("(2+)", done.stdout.strip()))
    assert (moving, resting, moving_again) == ({"1"}, {"2"}, {"1"})


def test_a_plant_needs_no_jvm() -> None:
    code = "import sys; from heptarm.sim.plant.plant import Plant; Plant().step(5); print('jpype' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.strip() == "False"


def test_a_plant_knows_the_title_of_its_robot() -> None:
    assert Plant("iiwa7").robot.title == "LBR iiwa 7 R800"
    assert Plant("iiwa14").robot.title == "LBR iiwa 14 R820"
