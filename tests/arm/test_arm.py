"""The arm against a scripted cabinet in memory."""

from __future__ import annotations

import asyncio
import signal
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

import heptarm as ha
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.arm.peer import Peer, Served

HOME = ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0))


@pytest.fixture
def peer() -> Iterator[Peer]:
    peer = Peer()
    yield peer
    peer.close()


def later(seconds: float, *messages: wire.Message):
    """Replies that come after a while."""

    def reply(client: Served, _: int) -> None:
        def speak() -> None:
            for message in messages:
                client.say(message)

        timer = threading.Timer(seconds, speak)
        client.peer.threads.append(timer)
        timer.start()

    return reply


# ------------------------------------------------------------------------------------- connecting


def test_connecting_tells_the_robot_and_its_limits(peer: Peer) -> None:
    with peer.arm() as arm:
        assert arm.robot.name == "iiwa14" and arm.robot.q_max[1] == 2.0
        assert arm.capabilities == ("ptp", "lin", "lin_rel", "hold")
        assert arm.is_virtual and arm.in_control and arm.connected
        assert "LBR iiwa 14" in repr(arm)
    assert not arm.connected and "closed" in repr(arm)


def test_a_closed_arm_leaves_no_thread_and_sends_goodbye(peer: Peer) -> None:
    before = set(threading.enumerate())
    arm = peer.arm()
    arm.close()
    arm.close()
    left = {thread.name for thread in set(threading.enumerate()) - before}
    assert "heptarm-link" not in left
    deadline = time.monotonic() + 20.0
    while not peer.seen or not isinstance(peer.seen[-1], wire.Goodbye):  # it may not have read all of it yet
        assert time.monotonic() < deadline, peer.seen
        time.sleep(0.01)
    kinds = [type(message).__name__ for message in peer.seen]
    assert kinds[-3:] == ["Stop", "ReleaseControl", "Goodbye"]


def test_an_observer_neither_takes_control_nor_stops_the_arm(peer: Peer) -> None:
    with peer.arm(control=False) as arm:
        assert not arm.in_control
    kinds = [type(message).__name__ for message in peer.seen]
    assert "TakeControl" not in kinds and "Stop" not in kinds


def test_one_octet_at_a_time() -> None:
    peer = Peer(chunk=1)
    peer.runs(1, peer.finished(1))
    with peer.arm() as arm:
        assert arm.move(HOME).arrived
    peer.close()


def test_a_second_controller_hears_who_controls(peer: Peer) -> None:
    peer.expect(
        wire.TakeControl,
        wire.Rejected(
            code=Code.CONTROL_TAKEN, parameter="controller", value="anna", allowed="", text="anna controls"
        ),
    )
    with pytest.raises(ha.NotInControl, match="anna") as error:
        peer.arm()
    assert error.value.code == Code.CONTROL_TAKEN and error.value.hint


def test_another_version_is_named() -> None:
    peer = Peer()
    peer.expect(wire.Hello, wire.Refusal(code=Code.WRONG_VERSION, text="", major=3, minor=1))
    with pytest.raises(ha.VersionMismatch, match=r"3\.1.*1\.0"):
        peer.arm()
    peer.close()


def test_the_key_is_proved() -> None:
    def challenge(client: Served, _: int) -> None:
        client.say(client.session.challenge())

    def judge(client: Served, _: int) -> None:
        message = peer.seen[-1]
        assert isinstance(message, wire.Proof)
        if client.session.is_proven(message.mac):
            from tests.wire.pairs import welcome

            client.say(welcome(client.session))
        else:
            client.say(wire.Refusal(code=Code.WRONG_KEY, text="wrong key", major=1, minor=0))

    for key, good in ((b"open", True), (b"shut", False), (None, False)):
        peer = Peer(key=b"open")
        peer.expect(wire.Hello, challenge)
        if key is not None:
            peer.expect(wire.Proof, judge)
        if good:
            peer.arm(key=key).close()
        else:
            with pytest.raises(ha.ConnectFailed, match="key"):
                peer.arm(key=key)
        peer.close()


def test_a_cabinet_that_says_nothing() -> None:
    peer = Peer()
    peer.expect(wire.Hello)
    with pytest.raises(ha.ConnectFailed, match="answers nothing"):
        peer.arm(timeout=0.2)
    peer.close()


def test_a_robot_that_is_not_known() -> None:
    from dataclasses import replace

    from tests.wire.pairs import ROBOT

    peer = Peer(robot=replace(ROBOT, model="kr6"))
    with pytest.raises(ha.ConnectFailed, match="kr6"):
        peer.arm()
    peer.close()


# ------------------------------------------------------------------------------------- state


def test_the_state_is_pushed_and_has_an_age(peer: Peer) -> None:
    with peer.arm() as arm:
        state = arm.state
        assert state.q == pytest.approx(peer.q) and not state.q.flags.writeable
        assert -0.05 < state.age < 5.0
        assert arm.wait_until(lambda s: s.stamp > state.stamp).stamp > state.stamp
        with pytest.raises(ha.StaleState, match="wrench"):
            _ = state.wrench


def test_states_come_once_and_in_order(peer: Peer) -> None:
    with peer.arm() as arm:
        every = arm.states(duration=20.0)
        stamps = [state.stamp for state, _ in zip(every, range(40))]
        assert len(stamps) == 40 and stamps == sorted(set(stamps)) and every.lost == 0
        began = time.monotonic()
        stamps = [state.stamp for state in arm.states(rate=50, duration=0.4)]
        assert time.monotonic() - began > 0.35
        assert 2 <= len(stamps) <= 22 and stamps == sorted(set(stamps))


def test_a_rate_above_the_pushed_one_repeats_nothing(peer: Peer) -> None:
    with peer.arm() as arm:
        stamps = [state.stamp for state in arm.states(rate=5000, duration=0.2)]
        assert stamps == sorted(set(stamps)) and len(stamps) < 60


def test_a_slow_loop_loses_the_oldest_and_knows_it(peer: Peer) -> None:
    with peer.arm() as arm:
        states = arm.states(size=3)
        next(states)
        arm.wait_until(lambda s: states.lost > 5, timeout=20.0)
        states.close()


def test_a_stale_state_is_refused(peer: Peer) -> None:
    with peer.arm(control=False) as arm:
        for client in peer.clients:
            client.rate = 0.0
        assert arm.state.age < 1.0
        time.sleep(1.1)
        with pytest.raises(ha.StaleState, match="old"):
            _ = arm.state


def test_wait_until_gives_up(peer: Peer) -> None:
    with peer.arm() as arm, pytest.raises(ha.Timeout):
        arm.wait_until(lambda s: False, timeout=0.1)


def test_unknown_groups_are_refused_with_the_known_ones(peer: Peer) -> None:
    with peer.arm() as arm, pytest.raises(ha.CommandRejected, match="smell") as error:
        arm.subscribe(groups=("smell",))
    assert "joints" in error.value.hint


# ------------------------------------------------------------------------------------- motion


def test_a_move_returns_its_result(peer: Peer) -> None:
    peer.runs(5, wire.MotionStarted(id=5, item=0), peer.finished(5))
    with peer.arm() as arm:
        result = arm.move(HOME)
    assert result.arrived and result.residual == 1e-5 and result.duration == 1.5
    assert result.state is not None and result.state.q == pytest.approx(peer.q)


def test_events_may_come_before_the_answer(peer: Peer) -> None:
    peer.expect(wire.Run, wire.MotionStarted(id=9, item=0), peer.finished(9), wire.Accepted(id=9))
    with peer.arm() as arm:
        assert arm.move(HOME, timeout=20.0).arrived


def test_events_of_other_clients_motions_change_nothing(peer: Peer) -> None:
    peer.runs(6, later(0.05, peer.finished(6)))
    with peer.arm() as arm:
        handle = arm.start(HOME)
        peer.tell(peer.finished(5, wire.Cause.STOPPED))
        assert handle.wait(timeout=20.0).arrived


def test_a_batch_is_one_program(peer: Peer) -> None:
    sent: list[wire.Run] = []
    peer.runs(1, wire.ItemReached(id=1, item=0), peer.finished(1, item=1), check=sent.append)
    with peer.arm() as arm:
        assert arm.move([HOME, ha.lin_rel(z=0.1)]).item == 1
    (run,) = sent
    assert [type(item.motion).__name__ for item in run.items] == ["Ptp", "LinRel"]


def test_the_ceiling_only_slows_down(peer: Peer) -> None:
    sent: list[wire.Run] = []
    for number in range(1, 4):
        peer.runs(number, peer.finished(number), check=sent.append)
    with peer.arm() as arm:
        arm.speed = 0.5
        arm.move(HOME)
        arm.move(HOME, speed=0.9)
        arm.move(ha.ptp(np.zeros(7), speed=0.1), speed=0.3)
        for wrong in (0.0, 1.5, float("nan")):
            with pytest.raises(ha.LimitError):
                arm.speed = wrong
    assert [run.items[0].motion.dynamics.velocity[0] for run in sent] == [0.5, 0.5, 0.1]  # type: ignore[union-attr]


def test_a_target_outside_the_robot_is_refused_before_it_is_sent(peer: Peer) -> None:
    with peer.arm() as arm:
        with pytest.raises(ha.LimitError, match="A2") as error:
            arm.move(ha.ptp([0, 2.05, 0, 0, 0, 0, 0]))
        assert error.value.parameter == "q[1]" and error.value.value == 2.05 and error.value.hint
        with pytest.raises(ha.LimitError, match=r"motions\[1\]"):
            arm.start([HOME, ha.ptp([0, 2.05, 0, 0, 0, 0, 0])])
        for wrong in ("up", [], [1.0] * 7, None):
            with pytest.raises(ha.ShapeError):
                arm.move(wrong)  # type: ignore[arg-type]
        with pytest.raises(ha.ShapeError, match="when"):
            arm.start(HOME, when="later")  # type: ignore[arg-type]
        with pytest.raises(ha.ShapeError, match="cancelled"):
            arm.move(ha.hold())


@pytest.mark.parametrize(
    ("code", "kind"),
    [
        (Code.UNREACHABLE, ha.LimitError),
        (Code.BUSY, ha.ModeConflict),
        (Code.NOT_IN_CONTROL, ha.NotInControl),
        (Code.NOT_READY, ha.NotReady),
        (Code.NEEDS_OPERATOR, ha.NeedsOperator),
        (999, ha.CommandRejected),
    ],
)
def test_a_rejection_becomes_the_error_of_its_code(
    peer: Peer, code: int, kind: type[ha.HeptarmError]
) -> None:
    peer.expect(
        wire.Run, wire.Rejected(code=code, parameter="items[0]", value="7", allowed="[0, 1]", text="no")
    )
    with peer.arm() as arm, pytest.raises(kind) as error:
        arm.move(HOME)
    assert type(error.value) is kind
    assert (error.value.code, error.value.parameter, error.value.allowed) == (code, "items[0]", "[0, 1]")
    assert "[0, 1]" in str(error.value)


def test_a_stopped_move_carries_its_evidence(peer: Peer) -> None:
    peer.runs(
        1,
        wire.MotionStarted(id=1, item=0),
        later(0.5, peer.finished(1, wire.Cause.STOPPED, text="red button")),
    )
    with peer.arm() as arm, pytest.raises(ha.MotionAborted, match="red button") as error:
        arm.move(HOME)
    assert error.value.cause is ha.Cause.STOPPED
    assert error.value.state is not None and 10 <= len(error.value.history) <= 50
    assert error.value.history[-1].stamp > error.value.history[0].stamp


def test_a_motion_that_cannot_be_planned_is_a_rejection(peer: Peer) -> None:
    failed = peer.finished(1, wire.Cause.FAILED, code=Code.UNREACHABLE, residual=float("nan"), text="too far")
    peer.runs(1, failed)
    with peer.arm() as arm, pytest.raises(ha.LimitError, match="too far"):
        arm.move(HOME)


@pytest.mark.parametrize(
    ("cause", "kind"),
    [
        (wire.Cause.LOST, ha.ConnectionLost),
        (wire.Cause.STARVED, ha.Starved),
        (wire.Cause.SAFETY, ha.MotionAborted),
        (wire.Cause.DROPPED, ha.MotionAborted),
    ],
)
def test_bad_ends_are_errors(peer: Peer, cause: wire.Cause, kind: type[Exception]) -> None:
    peer.runs(1, peer.finished(1, cause))
    with peer.arm() as arm:
        handle = arm.start(HOME)
        with pytest.raises(kind):
            handle.wait(timeout=20.0)
        assert handle.done and handle.result is None


def test_cancelling_is_a_result(peer: Peer) -> None:
    peer.runs(3, wire.MotionStarted(id=3, item=0))
    peer.expect(
        wire.Cancel, wire.Accepted(id=0), peer.finished(3, wire.Cause.CANCELLED), check=lambda m: m.id == 3
    )
    peer.motion = 3
    with peer.arm() as arm:
        handle = arm.start(HOME)
        arm.wait_until(lambda s: handle.started)
        assert not handle.done and handle.progress == 0.5 and handle.id == 3
        handle.cancel()
        assert handle.wait(timeout=20.0).cause is ha.Cause.CANCELLED
        handle.cancel()
        peer.motion = 0


def test_a_move_that_takes_too_long_is_cancelled(peer: Peer) -> None:
    peer.runs(3)
    peer.expect(wire.Cancel, wire.Accepted(id=0), peer.finished(3, wire.Cause.CANCELLED))
    with peer.arm() as arm, pytest.raises(ha.Timeout, match="motion 3"):
        arm.move(HOME, timeout=0.05)


def test_stop_from_another_thread_ends_a_blocking_move(peer: Peer) -> None:
    arms: list[ha.Arm] = []

    def stop() -> None:
        arms[0].stop()

    timer = threading.Timer(0.05, stop)
    peer.runs(1, wire.MotionStarted(id=1, item=0), lambda *_: timer.start())
    peer.expect(wire.Stop, wire.Accepted(id=0), peer.finished(1, wire.Cause.STOPPED))
    with peer.arm() as arm:
        arms.append(arm)
        with pytest.raises(ha.MotionAborted):
            arm.move(HOME, timeout=20.0)
        timer.join()
        arm.stop()
        arm.stop(kind="fast")
        with pytest.raises(ha.ShapeError):
            arm.stop(kind="now")  # type: ignore[arg-type]


def test_handles_can_be_awaited(peer: Peer) -> None:
    peer.runs(1, later(0.05, peer.finished(1)))

    async def program(arm: ha.Arm) -> ha.Result:
        return await arm.start(HOME)

    with peer.arm() as arm:
        assert asyncio.run(program(arm)).arrived


def test_a_callback_hears_of_the_end(peer: Peer) -> None:
    heard = threading.Event()
    peer.runs(1, peer.finished(1))
    with peer.arm() as arm:
        arm.start(HOME).add_done_callback(lambda handle: heard.set() if handle.done else None)
        assert heard.wait(20.0)


def test_a_callback_may_talk_to_the_cabinet(peer: Peer) -> None:
    done = threading.Event()
    peer.runs(1, later(0.05, peer.finished(1)))
    with peer.arm() as arm:

        def stop(_: ha.MotionHandle) -> None:
            arm.stop()
            done.set()

        arm.start(HOME).add_done_callback(stop)
        assert done.wait(20.0)
        assert arm.connected


def test_ctrl_c_stops_the_arm_and_goes_on(peer: Peer) -> None:
    timer = threading.Timer(0.05, lambda: signal.pthread_kill(threading.main_thread().ident, signal.SIGINT))
    peer.runs(1, wire.MotionStarted(id=1, item=0), lambda *_: timer.start())
    peer.expect(wire.Stop, wire.Accepted(id=0), peer.finished(1, wire.Cause.STOPPED))
    with peer.arm() as arm:
        with pytest.raises(KeyboardInterrupt):
            arm.move(HOME, timeout=20.0)
        timer.join()


# ------------------------------------------------------------------------------------- the link


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


def test_stop_finds_its_way_when_the_connection_is_lost(peer: Peer) -> None:
    arm = peer.arm()
    peer.drop()
    arm.stop()
    assert peer.dials == 2 and any(isinstance(message, wire.Stop) for message in peer.seen)
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
    with pytest.raises(ha.ConnectionLost, match="nothing heard"):
        for _ in arm.states(duration=30.0):
            pass
    arm.close()
    peer.close()


def test_heartbeats_go_both_ways() -> None:
    peer = Peer(heartbeat=0.2)
    with peer.arm(rate=0.0) as arm:
        count = arm._connection.link.offset.count  # type: ignore[union-attr]
        peer.tell(wire.Ping(sent=77))
        deadline = time.monotonic() + 20.0
        while arm._connection.link.offset.count < count + 5 or wire.Pong not in {type(m) for m in peer.seen}:  # type: ignore[union-attr]
            assert time.monotonic() < deadline
            time.sleep(0.01)
        with pytest.raises(ha.StaleState):
            _ = arm.state
    peer.close()


def test_a_cabinet_that_ends_says_so(peer: Peer) -> None:
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
    peer.expect(wire.Stop)
    with peer.arm(timeout=0.2) as arm, pytest.raises(ha.Timeout, match="Stop"):
        arm.stop()


def test_a_cabinet_that_breaks_the_protocol(peer: Peer) -> None:
    arm = peer.arm()
    peer.clients[0].transport.send(b"GET / HTTP/1.1\r\n")
    with pytest.raises(ha.ConnectionLost, match="frame begins"):
        for _ in arm.states(duration=30.0):
            pass
    arm.close()


def test_an_interrupted_request_leaves_a_sound_link(peer: Peer) -> None:
    peer.expect(wire.Stop)  # the first stop is never answered, so the caller waits in receive_into
    with peer.arm() as arm:
        timer = threading.Timer(
            0.1, lambda: signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
        )
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            arm.stop()
        timer.join()
        arm.stop()
        assert arm.connected
