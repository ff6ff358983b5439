"""States: the newest, the last ones, and streams, on a manual clock."""

from __future__ import annotations

import gc
from collections.abc import Iterable

import pytest

from heptarm.arm.link.state_stream import HISTORY, StateFeed, States
from heptarm.arm.translate.state import read_robot, read_state
from heptarm.errors import CommandRejected, ConnectFailed, ConnectionLost, HeptarmError, RemoteProtocolError
from heptarm.io.clock import StepClock
from heptarm.record.samples import SampleQueue, StateSample
from heptarm.values.robot import FLANGES
from heptarm.values.state import State
from heptarm.wire import messages as wire
from heptarm.wire.clock_sync import ClockOffset
from heptarm.wire.messages import RobotInfo
from tests.wire.pairs import ROBOT


def streams(
    feed: StateFeed, clock: StepClock, *, rate: float | None, duration: float | None = None, size: int = 10
) -> States:
    return States(
        feed,
        clock,
        build=lambda sample: State(sampled=sample.number),
        check=lambda: ENDED[0],
        rate=rate,
        duration=duration,
        size=size,
    )


ENDED: list[HeptarmError | None] = [None]


def push(feed: StateFeed, numbers: Iterable[int]) -> None:
    """One state a millisecond; its bytes are its number."""
    for number in numbers:
        feed.push(b"%d" % number, number * 1_000_000)


@pytest.fixture(autouse=True)
def fresh() -> None:
    ENDED[0] = None


def test_the_states_of_the_last_30_seconds_are_kept() -> None:
    feed = StateFeed(StepClock())
    assert feed.kept() == feed.history() == []
    push(feed, range(1, 40_001))
    kept = feed.kept()
    assert [one.number for one in kept] == list(range(10_000, 40_001))
    assert all(one.body == b"%d" % one.number and one.received == one.number * 1_000_000 for one in kept)
    for after, first in ((39_998, 39_999), (10_500, 10_501), (0, 10_000)):
        queue = feed.open(50_000, after=after)
        assert queue.take(1)[0].number == first and len(queue.take(50_000)) == 40_000 - first
        assert queue.lost == max(0, first - after - 1)
    assert feed.open(10, after=40_000).is_empty


def test_states_do_not_bring_about_a_garbage_collection() -> None:
    feed, generations = StateFeed(StepClock()), list[int]()

    def note(phase: str, info: dict[str, int]) -> None:
        generations.append(info["generation"])

    gc.collect()
    gc.callbacks.append(note)
    try:
        push(feed, range(1, 20_001))
    finally:
        gc.callbacks.remove(note)
    assert not generations


def test_history_is_bounded() -> None:
    feed = StateFeed(StepClock())
    for number in range(2 * HISTORY):
        feed.push(b"%d" % number, number)
    assert [sample.number for sample in feed.history()] == list(range(HISTORY + 1, 2 * HISTORY + 1))
    assert feed.newest == StateSample(2 * HISTORY, b"%d" % (2 * HISTORY - 1), 2 * HISTORY - 1)


def test_every_state_in_order() -> None:
    clock, feed = StepClock(), StateFeed(StepClock())
    states = streams(feed, clock, rate=None)
    for number in range(5):
        feed.push(b"", number)
    assert [next(states).sampled for _ in range(5)] == [1, 2, 3, 4, 5] and states.lost == 0
    states.close()
    feed.push(b"", 9)
    assert not feed._queues


def test_a_full_queue_drops_the_oldest() -> None:
    queue = SampleQueue(3)
    for number in range(10):
        queue.put(StateSample(number, b"", 0))
    assert queue.lost == 7
    assert [queue.get(0).number for _ in range(3)] == [7, 8, 9]
    assert queue.get(0) is None
    queue.put(StateSample(11, b"", 0))
    assert queue.get(0) is not None and queue.get(0) is None


def test_states_that_never_came_count_where_the_reader_misses_them() -> None:
    """A slow loop over a motion does not count what was missed after the motion, though it still reads."""
    queue = SampleQueue(10)
    queue.put(StateSample(1, b"", 0))
    queue.skip(5, after=1)
    queue.put(StateSample(2, b"", 0))
    queue.skip(7, after=2)
    assert queue.get(0) is not None and queue.lost == 0
    assert queue.get(0) is not None and queue.lost == 5
    assert queue.get(0) is None and queue.lost == 12
    queue.skip(1, after=2)
    assert queue.take(5) == [] and queue.lost == 13


def test_a_paced_stream_skips_and_never_repeats() -> None:
    clock = StepClock()
    feed = StateFeed(clock)
    feed.push(b"", 0)
    states = streams(feed, clock, rate=10.0)
    assert next(states).sampled == 1
    for _ in range(7):
        feed.push(b"", 0)
    began = clock.nanos()
    assert next(states).sampled == 8  # the newest of seven
    assert clock.nanos() - began == 100_000_000


def test_the_end_of_a_stream() -> None:
    clock = StepClock()
    feed = StateFeed(clock)
    feed.push(b"", 0)
    assert len(list(streams(feed, clock, rate=10.0, duration=0.0))) == 0
    states = streams(feed, clock, rate=10.0)
    next(states)
    ENDED[0] = ConnectionLost("gone")
    with pytest.raises(ConnectionLost, match="gone"):
        for _ in range(100):
            clock.step(0.1)
            next(states)


@pytest.mark.parametrize("rate", [None, 10.0])
def test_a_stream_without_an_end_does_not_become_arrays(rate: float | None) -> None:
    feed = StateFeed(StepClock())
    for take in (States.to_numpy, States.to_pandas):
        with pytest.raises(CommandRejected, match=r"without an end.*arm\.states\(duration=2\.0\)"):
            take(streams(feed, StepClock(), rate=rate))


@pytest.mark.parametrize("body", [b"", b"\xff\xff", b"\x00\x01" + bytes(20), b"\x00\x04" + bytes(200)])
def test_bytes_that_are_no_state(body: bytes) -> None:
    with pytest.raises(RemoteProtocolError, match="state"):
        # bytes are checked at once, numbers when they are used
        str(read_state(body, ClockOffset(), lambda: 0, received=0))


def test_no_state_is_younger_than_its_receipt_though_the_clock_is_not_known_well_yet() -> None:
    offset = ClockOffset()
    offset.feed(0, 10_000_000, 400_000_000)  # a slow ping: both clocks are the same
    joints = wire.JointState(stamp=500_000_000, q=(0.0,) * 7, q_cmd=(0.0,) * 7, dq=(0.0,) * 7)
    state = read_state(wire.State(joints=joints).encode(), offset, lambda: 502_000_000, received=501_000_000)
    assert state.stamp == 500_000_000 and state.age == pytest.approx(0.001)


def test_the_robot_has_the_limits_that_the_cabinet_names() -> None:
    model = read_robot(ROBOT, FLANGES["touch"])
    assert model.flange is FLANGES["touch"]
    assert model.q_max[0] == 2.9 and model.d_se == 0.42 and not model.q_max.flags.writeable
    with pytest.raises(ConnectFailed, match="kr6"):
        read_robot(
            RobotInfo(model="kr6", title="", q_min=(0,), q_max=(0,), dq_max=(0,), tau_max=(0,)),
            FLANGES["plain"],
        )
