"""The arm's link to a scripted cabinet in memory: loss, heartbeat and use by several threads."""

from __future__ import annotations

import signal
import sys
import threading
import time
from dataclasses import replace

import pytest

import heptarm as ha
from heptarm.arm.link.heartbeat import Heartbeat
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from heptarm.wire.session import Session
from tests.arm.peer import Peer
from tests.arm.standstill import stand_still
from tests.interrupts import ctrl_c_interrupts

HOME = ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0))


def test_a_lost_connection_ends_motions_and_nothing_goes_on_by_itself(peer: Peer) -> None:
    peer.runs(1, wire.MotionStarted(id=1, item=0))
    arm = peer.arm()
    handle = arm.start(HOME)
    peer.drop()
    with pytest.raises(ha.ConnectionLost, match="motion 1"):
        handle.wait(timeout=20.0)
    assert not arm.connected
    with pytest.raises(ha.ConnectionLost):
        arm.move(HOME)
    time.sleep(0.3)
    assert peer.dials == 1
    arm.reconnect()
    assert arm.in_control and arm.state.q is not None
    peer.runs(2, peer.finished(2))
    assert arm.move(HOME).arrived
    arm.close()


def test_stop_gets_through_when_the_connection_is_lost(peer: Peer) -> None:
    arm = peer.arm()
    peer.drop()
    arm.stop()
    assert peer.dials == 2 and any(isinstance(message, wire.Halt) for message in peer.seen)
    arm.close()


@pytest.mark.parametrize("other", [False, True], ids=["the previous session", "another client"])
def test_reconnecting_waits_for_the_end_of_the_previous_session_and_for_no_other(
    peer: Peer, other: bool
) -> None:
    """The cabinet still stops the arm for the session that has ended, which has this client's name."""
    arm = peer.arm()
    name = "somebody" if other else arm.connection.options.name
    taken = wire.Rejected(
        code=int(Code.CONTROL_TAKEN), parameter="controller", text=f"{name} controls", value=name, allowed=""
    )
    peer.changes["controller"] = name
    if other:
        peer.expect(wire.TakeControl, taken)
        with pytest.raises(ha.NotInControl, match="somebody controls"):
            arm.reconnect()
        assert not arm.in_control
    else:
        freed = wire.ControlChanged(controller="", session=0, text=f"{name} was lost: it said goodbye")
        peer.expect(wire.TakeControl, taken).expect(wire.TakeControl, taken, freed)
        arm.reconnect()
        assert arm.in_control
    arm.close()


def test_an_observer_reconnects_and_its_states_go_on(peer: Peer) -> None:
    with peer.arm(control=False) as arm:
        states = arm.states()
        next(states)
        peer.refuses_dials = 2
        peer.drop()
        stamps = [next(states).stamp for _ in range(200)]
        assert stamps == sorted(set(stamps))
        assert peer.dials >= 4 and arm.connected
        states.close()


def test_silence_is_noticed() -> None:
    peer = Peer(heartbeat=0.1)
    arm = peer.arm()
    peer.clients[0].is_mute = True
    with pytest.raises(ha.ConnectionLost, match="nothing received"):
        for _ in arm.states(duration=30.0):
            pass
    arm.close()
    peer.close()


def test_heartbeats_go_both_directions() -> None:
    peer = Peer(heartbeat=0.2)
    with peer.arm(rate=0.0) as arm:
        count = arm.connection.link.offset.count
        peer.tell(wire.Ping(sent=77))
        deadline = time.monotonic() + 20.0
        while arm.connection.link.offset.count < count + 5 or wire.Pong not in {type(m) for m in peer.seen}:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        with pytest.raises(ha.StaleState):
            _ = arm.state
    peer.close()


def test_encoding_a_ping_is_no_part_of_its_round_trip(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise a slow program would believe its states to be older than they are."""
    encode, seconds = Session.send, 0.01

    def slow(session: Session, message: wire.Message, *, request: int = 0, time: int = 0) -> bytes:
        if isinstance(message, wire.Ping):
            threading.Event().wait(seconds)
        return encode(session, message, request=request, time=time)

    monkeypatch.setattr(Session, "send", slow)
    with peer.arm() as arm:
        assert arm.connection.link.offset.uncertainty < 0.5 * seconds


def test_a_cabinet_that_ends_reports_it(peer: Peer) -> None:
    arm = peer.arm()
    peer.tell(wire.Goodbye(code=Code.SHUTTING_DOWN, text="bye"))
    with pytest.raises(ha.ConnectionLost, match="bye"):
        for _ in arm.states(duration=30.0):
            pass
    arm.close()


def test_control_that_is_lost_is_noticed(peer: Peer) -> None:
    with peer.arm() as arm:
        peer.tell(wire.ControlChanged(controller="", session=0, text="silent"))
        arm.wait_until(lambda s: not arm.in_control, timeout=20.0)
        arm.take_control()
        assert arm.in_control


def test_a_loop_over_fast_states_reads_the_link_itself_until_it_ends(peer: Peer) -> None:
    with peer.arm(rate=400.0) as arm:
        link, here = arm.connection.link, threading.get_ident()
        take, readers = link._arrivals.on_state, []

        def taken(body: bytes, now: int) -> None:
            readers.append(threading.get_ident())
            take(body, now)

        link._arrivals.on_state = taken
        states, deadline = arm.states(), time.monotonic() + 20.0
        stamps = []
        while readers.count(here) < 50:
            stamps.append(next(states).stamp)
            assert time.monotonic() < deadline
        assert stamps == sorted(set(stamps))
        arm.stop()  # a request in between
        states.close()
        count = len(readers)
        while set(readers[count:]) <= {here}:
            assert time.monotonic() < deadline
            time.sleep(0.01)


def test_such_a_loop_pings_between_two_states_and_the_link_does_while_it_is_elsewhere(peer: Peer) -> None:
    with peer.arm(rate=400.0) as arm:
        link, here, pings = arm.connection.link, threading.get_ident(), []
        ping = link.ping

        def noted() -> None:
            pings.append(threading.get_ident())
            ping()

        link.ping = noted  # type: ignore[method-assign]
        states, deadline = arm.states(), time.monotonic() + 20.0
        while pings.count(here) < 2:
            next(states)
            assert time.monotonic() < deadline
        count = len(pings)
        while len(pings) < count + 2:  # the loop does something else
            assert time.monotonic() < deadline
            time.sleep(0.01)
        assert set(pings[count:]) == {link._thread.ident}


def test_a_loop_that_was_held_up_keeps_its_connection(peer: Peer) -> None:
    """After a standstill of the process the link's own thread may be the first to look: bytes wait to be read."""
    with peer.arm(rate=200.0) as arm:
        link = arm.connection.link
        assert link is not None
        read, held_up = link._read, list[None]()

        def late(*, wait: bool) -> None:
            if threading.current_thread() is threading.main_thread() and len(held_up) < 5:
                time.sleep(0.1)  # until bytes wait
                link._heartbeat.received -= 10_000_000_000
                held_up.append(time.sleep(0.02))
            read(wait=wait)

        link._read = late  # type: ignore[method-assign]
        states = arm.states()
        while len(held_up) < 5:
            next(states)
        next(states)


def test_a_standstill_of_this_process_is_no_silence_of_the_cabinet() -> None:
    second = 1_000_000_000
    heartbeat = Heartbeat(0)
    for now in range(0, 10 * second, second // 10):  # looked after, but nothing is heard
        heartbeat.look(now)
        if now <= 2 * second:
            heartbeat.check(now, "cabinet")
    with pytest.raises(ha.ConnectionLost, match=r"connection to cabinet is lost: nothing received for 9.9 s"):
        heartbeat.check(now, "cabinet")
    heartbeat.received = now
    heartbeat.look(now)
    heartbeat.check(now + 60 * second, "cabinet")  # it stood still for a minute, and hears again from now on
    with pytest.raises(ha.ConnectionLost):
        for later in range(61 * second, 64 * second, second // 10):
            heartbeat.check(now + later, "cabinet")


def test_a_client_that_the_system_stops_for_a_while_keeps_its_connection() -> None:
    program = """if True:
        import sys
        import heptarm as ha
        with ha.connect(sys.argv[1], control=False, timeout=60.0) as arm:
            first = arm.state.stamp
            print("ready", flush=True)
            sys.stdin.readline()
            print("alive" if arm.state.stamp > first else "old")
        """
    done = stand_still([sys.executable, "-c", program])
    assert (done.returncode, done.stdout) == (0, "alive\n"), done.stderr


def test_requests_from_many_threads(peer: Peer) -> None:
    with peer.arm() as arm:
        problems: list[BaseException] = []

        def hammer() -> None:
            try:
                for _ in range(100):
                    arm.stop()
            except BaseException as error:
                problems.append(error)

        threads = [threading.Thread(target=hammer) for _ in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert not problems
        assert sum(isinstance(message, wire.Stop) for message in peer.seen) == 600


def test_an_answer_that_does_not_come(peer: Peer) -> None:
    peer.expect(wire.SetOverride)
    with peer.arm() as arm:
        patient = arm.connection.options
        arm.connection.options = replace(patient, timeout=0.2)
        with pytest.raises(ha.Timeout, match="SetOverride"):
            arm.set_override(0.5)
        arm.connection.options = patient


def test_a_stop_that_is_not_answered_goes_another_way(peer: Peer) -> None:
    peer.expect(wire.Stop)
    with peer.arm() as arm:
        patient = arm.connection.options
        arm.connection.options = replace(patient, timeout=0.5)
        arm.stop()
        arm.connection.options = patient
    assert any(isinstance(message, wire.Halt) for message in peer.seen)


def test_a_cabinet_that_breaks_the_protocol(peer: Peer) -> None:
    arm = peer.arm()
    peer.clients[0].transport.send(bytes(range(100, 120)))
    with pytest.raises(ha.ConnectionLost, match="frame must begin"):
        for _ in arm.states(duration=30.0):
            pass
    arm.close()


def test_an_interrupted_request_leaves_a_sound_link(peer: Peer) -> None:
    timer = threading.Timer(
        0.1, lambda: signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    )
    # the first stop is never answered, so the caller waits in receive_into
    peer.expect(wire.Stop, lambda *_: timer.start())
    with peer.arm() as arm:
        with ctrl_c_interrupts(), pytest.raises(KeyboardInterrupt):
            arm.stop()
        timer.join()
        arm.stop()
        assert arm.connected
