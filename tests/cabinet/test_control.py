"""One controller, many observers: who may do what, and what happens when the controller is lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.fake import ROOT, FakeCabinet
from tests.cabinet.peer import Peer, is_of, ptp, run

Connect = Callable[..., Peer]
#: A7 of a target whose check by the fake takes 0.6 s [rad].
CHECKED_SLOWLY = 0.875


@pytest.fixture
def controller(connect: Connect) -> Iterator[Peer]:
    peer = connect(name="first")
    peer.take_control()
    yield peer
    peer.ask(wire.Stop())
    peer.ask(wire.ReleaseControl())


def test_second_controller_receives_who_holds_control(connect: Connect, controller: Peer) -> None:
    second = connect(name="second")
    assert second.welcome.controller == "first"
    rejected = second.ask(wire.TakeControl())
    assert rejected.code == Code.CONTROL_TAKEN
    assert rejected.value == "first"
    assert "first" in rejected.text
    controller.ask(wire.ReleaseControl())
    assert second.wait_for(wire.ControlChanged).controller == ""
    second.take_control()
    assert (
        controller.wait_for(wire.ControlChanged, lambda e: e.controller == "second").session
        == second.welcome.session
    )
    assert controller.ask(run(ptp(0.1))).code == Code.NOT_IN_CONTROL
    second.ask(wire.ReleaseControl())
    controller.take_control()


@pytest.mark.parametrize(
    "request_",
    [
        run(ptp(0.1)),
        wire.Cancel(id=0),
        wire.Pause(),
        wire.Resume(),
        wire.SetOverride(value=0.5),
        wire.ReleaseControl(),
        wire.Recover(),
    ],
    ids=lambda m: type(m).__name__,
)
def test_an_observer_may_not_command(connect: Connect, controller: Peer, request_: object) -> None:
    rejected = connect(name="observer").ask(request_)
    assert rejected.code == Code.NOT_IN_CONTROL
    assert "first" in rejected.text


def test_nobody_in_control_is_said_so(connect: Connect) -> None:
    assert "nobody" in connect().ask(run(ptp(0.1))).text


def test_an_observer_may_stop(connect: Connect, controller: Peer) -> None:
    controller.ask(run(ptp(2.0)))
    controller.wait_for(wire.MotionStarted)
    observer = connect(name="observer")
    assert isinstance(observer.ask(wire.Stop()), wire.Accepted)
    finished = controller.wait_for(wire.MotionFinished)
    assert finished.cause == wire.Cause.STOPPED
    assert 0.0 < abs(finished.q[0]) < 2.0 or finished.duration < 0.5
    assert observer.wait_for(wire.MotionFinished).id == finished.id


def test_release_stops_what_runs_and_what_waits(connect: Connect) -> None:
    peer = connect()
    peer.take_control()
    ids = [peer.ask(run(ptp(q))).id for q in (2.0, -2.0)]
    peer.wait_for(wire.MotionStarted)
    peer.ask(wire.ReleaseControl())
    for number in ids:
        assert peer.wait_for(wire.MotionFinished, is_of(number)).cause == wire.Cause.STOPPED


@pytest.mark.parametrize("rate", [1.0, 10.0])
def test_a_silent_controller_loses_control_in_its_watchdog_time(
    make: Callable[..., FakeCabinet], rate: float
) -> None:
    """The watchdog counts the client's seconds, however fast the cabinet's clock runs."""
    cabinet = make(rate=rate)
    with Peer(cabinet.port, name="observer") as observer, Peer(cabinet.port, name="silent") as silent:
        silent.ask(wire.TakeControl(watchdog=1.0))
        silent.ask(wire.SetOverride(value=0.5 / rate))
        began = time.monotonic()  # before its last message
        silent.ask(run(ptp(2.5)))
        observer.wait_for(wire.MotionStarted)
        finished = observer.wait_for(wire.MotionFinished)
        assert time.monotonic() - began > 0.95
        assert finished.cause == wire.Cause.LOST
        assert "silent" in finished.text
        assert observer.wait_for(wire.ControlChanged, lambda e: e.controller == "").session == 0
        # the silent client is still connected; it receives the event and can take control again
        assert silent.wait_for(wire.MotionFinished).cause == wire.Cause.LOST
        assert silent.ask(run(ptp(0.0))).code == Code.NOT_IN_CONTROL
        assert isinstance(silent.ask(wire.TakeControl()), wire.Accepted)


def test_a_method_that_the_cabinet_lacks_does_not_end_the_watch_for_silent_clients(
    make: Callable[..., FakeCabinet],
) -> None:
    cabinet = make()
    with Peer(cabinet.port, name="observer") as observer, Peer(cabinet.port, name="silent") as silent:
        silent.take_control(watchdog=1.0)
        silent.ask(wire.SetOverride(value=0.5))
        silent.ask(wire.ShowMessage(severity=wire.Severity.INFO, text="lacks safety"))
        silent.ask(run(ptp(2.5)))
        assert observer.wait_for(wire.MotionFinished).cause == wire.Cause.LOST
    assert len(cabinet.errors()) == 1


def test_words_that_came_while_the_cabinet_was_held_up_count(make: Callable[..., FakeCabinet]) -> None:
    """A machine that was suspended for longer than the watchdog time does not count its clients as lost."""
    cabinet = make()
    with Peer(cabinet.port) as peer:
        for _ in range(2):
            peer.take_control(watchdog=1.0)
            cabinet.process.send_signal(signal.SIGSTOP)
            time.sleep(1.1)
            peer.send(wire.Pong(sent=0, received=0))
            cabinet.process.send_signal(signal.SIGCONT)
            assert isinstance(peer.ask(run(ptp(0.0))), wire.Accepted)


def test_finish_on_loss_lets_the_program_end(connect: Connect) -> None:
    observer = connect(name="observer")
    with Peer(observer.socket.getpeername()[1], name="leaver") as leaver:
        leaver.ask(wire.TakeControl(watchdog=10.0, on_lost=wire.OnLost.FINISH))
        leaver.ask(run(ptp(0.2), ptp(0.0)))
        leaver.wait_for(wire.MotionStarted)
    observer.wait_for(wire.ControlChanged, lambda e: e.controller == "")
    assert observer.wait_for(wire.MotionFinished).cause == wire.Cause.FINISHED
    assert isinstance(observer.ask(wire.TakeControl()), wire.Accepted)
    observer.ask(wire.ReleaseControl())


_VICTIM = """
import sys, time
from heptarm.wire import messages as wire
from tests.cabinet.peer import Peer, ptp, run
peer = Peer(int(sys.argv[1]), name="victim")
peer.take_control()
peer.ask(wire.SetOverride(value=0.2))
peer.ask(run(ptp(2.5)))
peer.wait_for(wire.MotionStarted)
print("moving", flush=True)
time.sleep(60)
"""


def test_a_killed_controller_is_lost_at_once(connect: Connect) -> None:
    observer = connect(name="observer")
    port = observer.socket.getpeername()[1]
    victim = subprocess.Popen(
        [sys.executable, "-c", _VICTIM, str(port)], stdout=subprocess.PIPE, cwd=ROOT, text=True
    )
    assert victim.stdout is not None
    assert victim.stdout.readline() == "moving\n"
    os.kill(victim.pid, signal.SIGKILL)
    victim.wait()
    victim.stdout.close()
    finished = observer.wait_for(wire.MotionFinished, timeout=8.0)  # its watchdog time is longer
    assert finished.cause == wire.Cause.LOST
    observer.wait_for(wire.ControlChanged, lambda e: e.controller == "")
    assert isinstance(observer.ask(wire.TakeControl()), wire.Accepted)
    observer.ask(wire.ReleaseControl())


def test_heartbeat_goes_both_directions(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make(heartbeat=0.3)
    with Peer(cabinet.port) as peer:
        assert peer.wait_for(wire.Goodbye).code == Code.SILENT
        assert 1 <= len(peer.all(wire.Ping)) <= 30
        assert peer.is_closed()


def test_a_motion_whose_client_loses_control_while_it_is_checked_ends(
    make: Callable[..., FakeCabinet],
) -> None:
    cabinet = make()
    with Peer(cabinet.port, name="observer") as observer, Peer(cabinet.port, name="first") as peer:
        peer.take_control()
        peer.send(run(ptp(2.0, 0, 0, 0, 0, 0, CHECKED_SLOWLY)), 99)
        time.sleep(0.1)
        cabinet.revoke_control()
        assert observer.wait_for(wire.ControlChanged, lambda event: "revoked" in event.text).session == 0
        rejected = peer.answer(99)
        assert isinstance(rejected, wire.Rejected) and rejected.code == Code.NOT_IN_CONTROL
        end = observer.wait_for(wire.MotionFinished)
        assert end.cause == wire.Cause.CANCELLED and end.q[0] < 0.5
        observer.take_control()
        number = observer.ask(run(ptp(0.1))).id
        assert observer.wait_for(wire.MotionFinished, is_of(number)).cause == wire.Cause.FINISHED


def test_an_fri_session_whose_client_loses_control_while_it_is_checked_is_closed(
    make: Callable[..., FakeCabinet],
) -> None:
    cabinet = make()
    with Peer(cabinet.port, name="observer") as observer, Peer(cabinet.port, name="first") as peer:
        peer.take_control()
        session = wire.FriOpen(host="127.0.0.1", port=2, period=0.005, command=wire.FriCommandMode.MONITOR)
        peer.send(session, 99)
        time.sleep(0.1)
        cabinet.revoke_control()
        assert peer.answer(99).code == Code.NOT_IN_CONTROL
        observer.wait_for(wire.FriChanged, lambda event: event.state == wire.FriSessionState.IDLE)


def test_control_changes_hands_a_hundred_times(connect: Connect) -> None:
    """A client that takes control right after another was lost keeps it, and its motion."""
    observer = connect(name="observer")
    port = observer.socket.getpeername()[1]
    for turn in range(100):
        with Peer(port, name=f"turn {turn}") as peer:
            while not isinstance(answer := peer.ask(wire.TakeControl(watchdog=5.0)), wire.Accepted):
                assert answer.code == Code.CONTROL_TAKEN
                time.sleep(0.001)
            number = peer.ask(run(ptp(0.001 * (turn % 2)))).id
            if turn % 3:
                finished = peer.wait_for(wire.MotionFinished, is_of(number))
                assert finished.cause == wire.Cause.FINISHED
    observer.wait_for(wire.ControlChanged, lambda e: e.text.startswith("turn 99 was lost"))
