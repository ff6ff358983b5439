"""Programs: their queue, their events, their ends, and what is refused before anything moves."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer, ptp, run
from tests.values.test_circ import NO_CIRCLES

NAN = math.nan
Connect = Callable[..., Peer]
# positions of A7 at which the fake robot fails, plans slowly, or lacks a class
PLANNING, ON_THE_WAY, SLOWLY, LACKING = 1.25, 1.5, 1.0, 0.75


@pytest.fixture
def peer(connect: Connect) -> Iterator[Peer]:
    peer = connect()
    peer.take_control()
    peer.ask(wire.SetOverride(value=1.0))
    accepted = peer.ask(run(ptp()))
    peer.wait_for(wire.MotionFinished, lambda e: e.id == accepted.id)
    yield peer
    peer.ask(wire.Stop())
    peer.ask(wire.Resume())
    peer.ask(wire.SetOverride(value=1.0))
    peer.ask(wire.ReleaseControl())


def finished(peer: Peer, accepted: wire.Accepted) -> wire.MotionFinished:
    assert isinstance(accepted, wire.Accepted), accepted
    return peer.wait_for(wire.MotionFinished, lambda e: e.id == accepted.id)


def test_events_of_a_program_come_in_order(peer: Peer) -> None:
    accepted = peer.ask(run(ptp(0.02), ptp(0.04), ptp(0.0)))
    end = finished(peer, accepted)
    events = [
        (type(m).__name__, m.item)
        for _, m in peer.seen
        if getattr(m, "id", None) == accepted.id and hasattr(m, "item")
    ]
    order = [e for e in events if e[0] != "ItemReached"]
    assert order == [("MotionStarted", 0), ("MotionStarted", 1), ("MotionStarted", 2), ("MotionFinished", 2)]
    assert [e for e in events if e[0] == "ItemReached"] == [("ItemReached", 0), ("ItemReached", 1)]
    assert (end.cause, end.code, end.fired) == (wire.Cause.FINISHED, 0, -1)
    assert end.q[0] == pytest.approx(0.0)
    assert end.residual == 0.0
    assert 0.06 < end.duration < 10.0


def test_programs_wait_for_each_other(peer: Peer) -> None:
    accepted = [peer.ask(run(ptp(q))) for q in (0.05, 0.1, 0.0)]
    for one in accepted:
        finished(peer, one)
    ids = [e.id for e in peer.all(wire.MotionFinished)]
    assert ids[-3:] == [one.id for one in accepted]
    assert ids == sorted(ids)


def test_replace_ends_what_runs_and_what_waits(peer: Peer) -> None:
    old = [peer.ask(run(ptp(q))) for q in (2.0, -2.0)]
    peer.wait_for(wire.MotionStarted, lambda e: e.id == old[0].id)
    new = peer.ask(run(ptp(0.0), when=wire.When.REPLACE))
    assert finished(peer, new).cause == wire.Cause.FINISHED
    for one in old:
        assert finished(peer, one).cause == wire.Cause.REPLACED
        assert str(new.id) in finished(peer, one).text


def test_reject_while_something_runs(peer: Peer) -> None:
    running = peer.ask(run(ptp(2.0)))
    rejected = peer.ask(run(ptp(0.0), when=wire.When.REJECT))
    assert rejected.code == Code.BUSY
    assert str(running.id) in rejected.text
    peer.ask(wire.Cancel(id=0))
    finished(peer, running)
    assert finished(peer, peer.ask(run(ptp(0.0), when=wire.When.REJECT))).cause == wire.Cause.FINISHED


def test_cancel_of_what_waits_leaves_what_runs(peer: Peer) -> None:
    running, waiting, last = (peer.ask(run(ptp(q))) for q in (1.0, 0.6, 0.9))
    assert isinstance(peer.ask(wire.Cancel(id=waiting.id)), wire.Accepted)
    end = finished(peer, waiting)
    assert (end.cause, end.duration) == (wire.Cause.CANCELLED, 0.0)
    assert math.isnan(end.residual)
    assert finished(peer, running).cause == wire.Cause.FINISHED
    assert finished(peer, last).cause == wire.Cause.FINISHED


def test_cancel_under_way(peer: Peer) -> None:
    accepted = peer.ask(run(ptp(2.0), ptp(-2.0)))
    peer.wait_for(wire.MotionStarted, lambda e: e.id == accepted.id)
    peer.ask(wire.Cancel(id=accepted.id))
    end = finished(peer, accepted)
    assert end.cause == wire.Cause.CANCELLED
    assert 0.0 <= end.q[0] < 1.0
    assert peer.ask(wire.Cancel(id=accepted.id)).code == Code.UNKNOWN_MOTION


def test_stop_does_not_wait_for_the_planning(peer: Peer) -> None:
    accepted = peer.ask(run(ptp(0.0, 0, 0, 0, 0, 0, SLOWLY), ptp(1.0)))
    peer.read_for(0.1)
    try:
        assert isinstance(peer.ask(wire.Stop()), wire.Accepted)  # though the planning goes on
    finally:
        peer.ask(wire.ShowMessage(severity=wire.Severity.INFO, text="planned"))
    end = finished(peer, accepted)
    assert end.cause == wire.Cause.STOPPED
    # the queue takes the planned motion before it can be cancelled: the arm may begin it, and must not finish it
    assert 0.0 <= end.q[6] < SLOWLY
    assert end.q[:6] == (0.0,) * 6
    assert not [e for e in peer.all(wire.MotionStarted) if e.id == accepted.id]


def test_stop_after_motion_lets_the_running_one_finish(peer: Peer) -> None:
    running, waiting = (peer.ask(run(ptp(q))) for q in (1.0, 2.0))
    peer.wait_for(wire.MotionStarted, lambda event: event.id == running.id)
    peer.ask(wire.Stop(kind=wire.StopKind.AFTER_MOTION))
    assert finished(peer, waiting).cause == wire.Cause.STOPPED
    assert finished(peer, running).cause == wire.Cause.FINISHED


@pytest.mark.parametrize(("a7", "code"), [(PLANNING, Code.UNREACHABLE), (ON_THE_WAY, Code.EXECUTION_FAILED)])
def test_a_failure_ends_its_program_and_drops_what_waits(peer: Peer, a7: float, code: int) -> None:
    failing = peer.ask(run(ptp(0.05), ptp(0.05, 0, 0, 0, 0, 0, a7), ptp(0.0)))
    behind = peer.ask(run(ptp(2.0)))
    end = finished(peer, failing)
    assert (end.cause, end.code) == (wire.Cause.FAILED, code)
    assert end.text
    dropped = finished(peer, behind)
    assert dropped.cause == wire.Cause.DROPPED
    assert str(failing.id) in dropped.text
    after = finished(peer, peer.ask(run(ptp(0.0))))
    assert after.cause == wire.Cause.FINISHED


def test_pause_and_override_act_at_once(peer: Peer) -> None:
    accepted = peer.ask(run(ptp(1.0)))
    peer.ask(wire.Pause())
    peer.read_for(0.5)
    assert not [e for e in peer.all(wire.MotionFinished) if e.id == accepted.id]
    peer.ask(wire.Resume())
    assert finished(peer, accepted).duration > 1.4
    assert peer.ask(wire.SetOverride(value=1.5)).code == Code.OUT_OF_RANGE
    assert peer.ask(wire.SetOverride(value=NAN)).code == Code.NOT_FINITE


@pytest.mark.parametrize(
    ("item", "code", "parameter", "expected_text"),
    [
        (ptp(0, 0, 0, NAN), Code.NOT_FINITE, "items[1].motion.q[3]", "NaN"),
        (ptp(0, 0, 0, -math.inf), Code.NOT_FINITE, "items[1].motion.q[3]", "inf"),
        (ptp(0, 0, 0, 0, 0, 2.5), Code.JOINT_LIMIT, "items[1].motion.q[5]", "A6"),
        (wire.Item(motion=wire.Hold(duration=0.0)), Code.OUT_OF_RANGE, "items[1].motion.duration", "0"),
        (
            wire.Item(motion=wire.LinRel(offset=wire.Pose(xyz=(0.1, 0.0, 0.0), quat=(0.0, 0.0, 0.0, 2.0)))),
            Code.NOT_NORMALISED,
            "items[1].motion.offset.quat",
            "norm",
        ),
        (
            wire.Item(motion=wire.LinRel(offset=wire.Pose(xyz=(0.1, NAN, 0.0), quat=(0.0, 0.0, 0.0, 1.0)))),
            Code.NOT_FINITE,
            "items[1].motion.offset.xyz[1]",
            "NaN",
        ),
        (
            wire.Item(motion=wire.LinRel(offset=wire.Pose(xyz=(0.1, 0.0, 0.0), quat=(0.0, 0.0, 0.0, 1.0)))),
            Code.UNSUPPORTED,
            "items[1].motion",
            "",
        ),
        (
            wire.Item(
                motion=wire.Ptp(q=(0.0,) * 7, dynamics=wire.JointDynamics(velocity=(0.5,) * 6 + (1.01,)))
            ),
            Code.OUT_OF_RANGE,
            "items[1].motion.dynamics.velocity[6]",
            "1.01",
        ),
        (
            replace(
                ptp(), until=wire.Condition(nodes=(wire.JointTorqueOutside(joint=7, low=-1.0, high=1.0),))
            ),
            Code.OUT_OF_RANGE,
            "items[1].until.nodes[0].joint",
            "7",
        ),
        (replace(ptp(), frame="x" * 200), Code.BAD_LENGTH, "items[1].frame", "200"),
    ],
    ids=lambda v: v if isinstance(v, str) else "",
)
def test_a_bad_item_is_refused_by_name_and_nothing_moves(
    peer: Peer, item: wire.Item, code: int, parameter: str, expected_text: str
) -> None:
    before = len(peer.all(wire.MotionStarted))
    rejected = peer.ask(run(ptp(1.0), item))
    assert isinstance(rejected, wire.Rejected)
    assert (rejected.code, rejected.parameter[: len(parameter)]) == (code, parameter)
    assert expected_text in rejected.text + rejected.value
    assert finished(peer, peer.ask(run(ptp(0.0)))).q[0] == 0.0
    assert len(peer.all(wire.MotionStarted)) == before + 1


def test_an_empty_program_and_what_is_not_there_are_refused(peer: Peer) -> None:
    assert peer.ask(run()).code == Code.BAD_LENGTH
    assert peer.ask(wire.GetProcessData(name="x")).code == Code.UNKNOWN_NAME
    assert isinstance(peer.ask(wire.Recover()), wire.Accepted)  # nothing to do


def test_so_many_motions_may_wait_and_no_more(peer: Peer) -> None:
    thousand = run(*[ptp(0.1 * (k % 2)) for k in range(1000)])
    answers = [peer.ask(thousand) for _ in range(22)]
    assert isinstance(answers[19], wire.Accepted)
    assert answers[21].code == Code.QUEUE_FULL
    assert "20000" in answers[21].text
    peer.ask(wire.Cancel(id=0))
    for one in answers[:20]:
        finished(peer, one)


def test_an_exception_of_the_robot_is_an_answer(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make()
    with Peer(cabinet.port) as peer:
        peer.take_control()
        rejected = peer.ask(wire.ShowMessage(severity=wire.Severity.INFO, text="crash"))
        assert rejected.code == Code.INTERNAL
        assert "an error of the cabinet's API" in rejected.text
        lacking = peer.ask(wire.ShowMessage(severity=wire.Severity.INFO, text="lacking"))
        assert lacking.code == Code.INTERNAL
        end = finished(peer, peer.ask(run(ptp(0.1, 0, 0, 0, 0, 0, LACKING))))
        assert (end.cause, end.code) == (wire.Cause.FAILED, Code.INTERNAL)
        assert "com/kuka/Option" in end.text
        assert finished(peer, peer.ask(run(ptp(0.1)))).cause == wire.Cause.FINISHED
    assert len(cabinet.errors()) == 3


@pytest.mark.parametrize("fault", ["blind", "outdated"])
def test_readings_that_fail_for_a_while_end_nothing(make: Callable[..., FakeCabinet], fault: str) -> None:
    cabinet = make()
    with Peer(cabinet.port) as peer:
        peer.take_control()
        peer.ask(wire.Subscribe(groups=wire.Groups(63), rate=100.0))
        peer.ask(wire.ShowMessage(severity=wire.Severity.INFO, text=fault))
        end = finished(peer, peer.ask(run(ptp(0.05))))
        assert end.cause == wire.Cause.FINISHED
        assert math.isnan(end.residual)
        count = len(peer.all(wire.State))
        peer.wait(lambda *_: len(peer.all(wire.State)) - count > 20)
        end = finished(peer, peer.ask(run(ptp(0.0))))
        assert (end.cause, end.residual) == (wire.Cause.FINISHED, 0.0)
    assert 1 <= len(cabinet.errors()) <= 4  # sampler, watchdog, end of the motion: once each


def test_control_becomes_free_even_if_the_robot_cannot_be_stopped(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make()
    with Peer(cabinet.port, name="next") as after:
        with Peer(cabinet.port, name="first") as peer:
            peer.take_control()
            accepted = peer.ask(run(ptp(2.0)))
            peer.wait_for(wire.MotionStarted)
            peer.ask(wire.ShowMessage(severity=wire.Severity.INFO, text="jammed"))
            rejected = peer.ask(wire.Stop())
            assert rejected.code == Code.INTERNAL  # the client that stops must learn that it failed
        after.wait_for(wire.ControlChanged, lambda e: e.controller == "" and "lost" in e.text)
        after.take_control()
        deadline = time.monotonic() + 30.0
        while not isinstance(after.ask(wire.Stop()), wire.Accepted):
            assert time.monotonic() < deadline
        assert finished(after, accepted).cause in (wire.Cause.STOPPED, wire.Cause.LOST)


@pytest.mark.parametrize("ending", ["stop", "fast", "lost"])
def test_the_arm_stops_before_what_waits_is_cancelled(make: Callable[..., FakeCabinet], ending: str) -> None:
    """Each cancellation is a call to the robot; a thousand items must not be cancelled before the moving one stops."""
    cabinet = make(getter=0.01)
    with Peer(cabinet.port, name="observer") as observer, Peer(cabinet.port, name="controller") as peer:
        peer.take_control(watchdog=5.0)
        began = time.monotonic()
        accepted = peer.ask(run(ptp(2.9), *(ptp(0.1 * (k % 2)) for k in range(200))))
        peer.wait_for(wire.MotionStarted)
        behind = peer.ask(run(ptp(0.0)))
        time.sleep(0.1)  # all of it has been handed over
        asked = time.monotonic() - began
        if ending == "lost":
            peer.close()
        else:
            observer.send(wire.Stop(kind=wire.StopKind.PATH if ending == "stop" else wire.StopKind.FAST), 1)
        end = finished(observer, accepted)
        assert end.cause == (wire.Cause.LOST if ending == "lost" else wire.Cause.STOPPED)
        assert end.q[0] < min(asked + 1.0, 2.8), "it moved on while the others were cancelled"
        assert finished(observer, behind).cause == end.cause
        assert not observer.all(wire.ItemReached)
        assert len(observer.all(wire.MotionStarted)) == 1


def test_the_end_of_the_server_stops_motion_reports_all_and_leaves_no_thread(
    make: Callable[..., FakeCabinet],
) -> None:
    cabinet = make()
    with Peer(cabinet.port, name="controller") as peer, Peer(cabinet.port, name="observer") as observer:
        peer.take_control()
        observer.ask(wire.Subscribe(groups=wire.Groups(63), rate=1000.0))
        accepted = peer.ask(run(ptp(2.0)))
        peer.wait_for(wire.MotionStarted)
        assert cabinet.close() == []
        assert finished(peer, accepted).cause == wire.Cause.STOPPED
        for one in (peer, observer):
            assert one.wait_for(wire.Goodbye).code == Code.SHUTTING_DOWN
            assert one.is_closed()


def test_home_is_a_motion_of_the_robot(peer: Peer) -> None:
    assert finished(peer, peer.ask(run(ptp(0.1)))).q[0] == 0.1
    assert finished(peer, peer.ask(run(wire.Item(motion=wire.PtpHome())))).q == (0.0,) * 7
    slow = wire.PtpHome(dynamics=wire.JointDynamics(velocity=(0.0,) * 7))
    refused = peer.ask(run(wire.Item(motion=slow)))
    assert (refused.code, refused.parameter) == (Code.OUT_OF_RANGE, "items[0].motion.dynamics.velocity[0]")


@pytest.mark.parametrize("name", NO_CIRCLES)
def test_the_cabinet_refuses_the_arcs_that_the_client_refuses(peer: Peer, name: str) -> None:
    *points, parameter, words = NO_CIRCLES[name]
    start, via, end = (wire.Pose(xyz=xyz, quat=(0.0, 0.0, 0.0, 1.0)) for xyz in points)
    line, arc = wire.Item(motion=wire.Lin(target=start)), wire.Item(motion=wire.Circ(via=via, end=end))
    spline = wire.Spline(segments=(wire.SplSegment(target=start), wire.CircSegment(via=via, end=end)))
    hold = wire.Item(motion=wire.Hold(duration=0.1))
    for items, path in (
        ((line, hold, arc), "items[2].motion."),
        ((wire.Item(motion=spline),), "items[0].motion.segments[1]."),
    ):
        refused = peer.ask(run(*items))
        assert isinstance(refused, wire.Rejected), refused
        assert (refused.code, refused.parameter) == (Code.OUT_OF_RANGE, path + parameter)
        assert re.search(words, refused.text) and refused.allowed, refused.text
    other = replace(arc, frame="flange")  # another motion frame: the cabinet does not know where it starts
    if name != "via and end":
        assert peer.ask(run(line, other)).code == Code.UNSUPPORTED  # the fake robot knows no lines
