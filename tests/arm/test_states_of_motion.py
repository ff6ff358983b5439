"""Every state of a motion: from its first to the first one after its end, however slow or late the loop is."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

import heptarm as ha
from heptarm.arm.link.state_stream import States
from heptarm.errors import CommandRejected, ConnectionLost
from heptarm.values.condition.force import Force
from heptarm.wire import messages as wire
from tests.arm.peer import Peer, Served

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)


def begin(peer: Peer, number: int) -> None:
    """From now on the cabinet's states report this program; 0: none."""
    peer.motion, enough = number, peer.pushed + 21
    deadline = time.monotonic() + 60.0
    while peer.pushed < enough:
        assert time.monotonic() < deadline, "the cabinet pushes no states"
        time.sleep(0.005)


def running(peer: Peer, arm: ha.Arm, number: int) -> ha.MotionHandle:
    def start(client: Served, request: int) -> None:
        client.say(wire.Accepted(id=number), request)
        client.say(wire.MotionStarted(id=number, item=0))

    peer.expect(wire.Run, start)
    handle = arm.start(ha.ptp(HOME))
    begin(peer, number)
    return handle


def test_a_loop_that_begins_after_the_end_still_has_every_state(peer: Peer) -> None:
    with peer.arm() as arm:
        handle = running(peer, arm, 7)
        peer.tell(peer.finished(7))
        handle.wait()
        begin(peer, 0)
        stream = handle.states()
        states = list(stream)
        ids = [state.motion.id for state in states if state.motion is not None]
        assert ids[:-1] == [7] * (len(ids) - 1) and ids[-1] == 0 and len(ids) > 5
        assert stream.lost == 0 and list(stream) == []
        sent = {sample.body for sample in arm.connection.feed.kept()}
        assert len([1 for body in sent if wire.State.decode(body).motion.motion == 7]) == len(ids) - 1


def test_a_slow_loop_has_as_many_as_a_fast_one(peer: Peer) -> None:
    with peer.arm() as arm:
        handle = running(peer, arm, 7)
        found: dict[str, list[int]] = {"fast": [], "slow": []}

        def read(name: str, pause: float) -> None:
            for state in arm.states(until=handle):
                found[name].append(state.stamp)
                time.sleep(pause)

        threads = [threading.Thread(target=read, args=one) for one in (("fast", 0.0), ("slow", 0.02))]
        for thread in threads:
            thread.start()
        begin(peer, 7)
        begin(peer, 0)
        peer.tell(peer.finished(7))
        for thread in threads:
            thread.join(60.0)
        assert len(found["fast"]) > 20 and set(found["fast"]) - set(found["slow"]) <= {found["fast"][-1]}


def test_states_of_the_motion_before_are_not_those_of_a_waiting_one(peer: Peer) -> None:
    with peer.arm() as arm:
        first = running(peer, arm, 7)
        peer.expect(wire.Run, wire.Accepted(id=8))
        second = arm.start(ha.ptp(HOME))
        stream = second.states()
        begin(peer, 7)
        peer.tell(peer.finished(7))
        peer.tell(wire.MotionStarted(id=8, item=0))
        begin(peer, 8)
        peer.tell(peer.finished(8))
        begin(peer, 0)
        ids = [state.motion.id for state in stream if state.motion is not None]
        assert ids[0] == 8 and set(ids[:-1]) == {8}
        assert first.done and second.done


def test_a_full_stream_counts_what_it_drops_and_keeps_the_end(peer: Peer) -> None:
    with peer.arm() as arm:
        handle = running(peer, arm, 7)
        begin(peer, 7)
        peer.tell(peer.finished(7))
        handle.wait()
        begin(peer, 0)
        every = list(handle.states())
        stream = handle.states(size=len(every))
        rest = list(stream)
        assert rest[-1].stamp == every[-1].stamp and stream.lost > 0
        assert len(rest) < len(every)


def test_a_motion_that_never_runs_has_no_state_and_a_lost_link_ends_the_stream(peer: Peer) -> None:
    arm = peer.arm()
    peer.expect(wire.Run, wire.Accepted(id=9))
    dropped = arm.start(ha.ptp(HOME))
    peer.tell(peer.finished(9, wire.Cause.DROPPED))
    assert list(dropped.states()) == []
    handle = running(peer, arm, 7)
    stream = handle.states()
    next(stream)
    peer.drop()
    assert [state.motion.id for state in stream if state.motion is not None].count(7) > 5
    with pytest.raises(ConnectionLost):
        handle.wait()
    arm.close()


def test_arrays_and_tables(peer: Peer) -> None:
    with peer.arm() as arm:
        found = arm.states(duration=1.0).to_numpy()
        assert found["q"].shape == (len(found["t"]), 7) and len(found["t"]) > 5
        assert found["t"][0] == 0.0 and np.isnan(found["tau"]).all()
        table = arm.states(duration=0.2).to_pandas()
        assert "q.A1" in table.columns and table.index.name == "t"
        handle = running(peer, arm, 7)
        peer.tell(peer.finished(7))
        begin(peer, 0)
        motion = handle.states().to_numpy()["motion"]
        assert set(motion[:-1].tolist()) == {7}
        with pytest.raises(CommandRejected, match="without rate and duration"):
            arm.states(rate=10.0, until=handle)


def test_a_slow_loop_that_ends_after_a_time_has_all_states_of_that_time(peer: Peer) -> None:
    with peer.arm() as arm:
        stream = arm.states(duration=0.4)
        stamps = []
        for state in stream:
            stamps.append(state.stamp)
            time.sleep(0.01)
        kept = [wire.State.decode(one.body).joints.stamp for one in arm.connection.feed.kept()]
        inside = [stamp for stamp in kept if stamps[0] <= stamp <= stamps[0] + 350_000_000]
        assert set(inside) <= set(stamps) and stream.lost == 0


@pytest.mark.slow
def test_a_loop_of_4_ms_per_state_sees_the_peak_of_a_contact(arm: ha.Arm) -> None:
    """Down to the table at 500 Hz: the slow loop is still reading when the arm has long stopped."""
    arm.subscribe(rate=500)
    handle = arm.start(
        ha.lin_rel(z=-0.6, frame="base", speed_mps=0.1), until=Force(frame="base").along("z") > 10
    )
    peaks: dict[str, float] = {}
    counts: dict[str, int] = {}
    lost: dict[str, int] = {}

    def read(name: str, stream: States, pause: float) -> None:
        forces = []
        for state in stream:
            forces.append(state.wrench.force[2])
            time.sleep(pause)
        peaks[name], counts[name], lost[name] = float(np.max(forces)), len(forces), stream.lost

    # both begin at once: states that a busy cabinet samples too late count from the begin of a stream
    streams = ("fast", handle.states(), 0.0), ("slow", handle.states(), 0.004)
    threads = [threading.Thread(target=read, args=one) for one in streams]
    for thread in threads:
        thread.start()
    result = handle.wait()
    for thread in threads:
        thread.join(120.0)
    assert result.cause is ha.Cause.CONDITION
    assert peaks["slow"] == peaks["fast"] > 10.0
    assert (
        counts["slow"] == counts["fast"] and lost["slow"] == lost["fast"]
    )  # those that the cabinet sampled too late
    arm.move(ha.lin_rel(z=0.1, frame="base", speed_mps=0.3))
