"""The arm against a scripted cabinet in memory: connecting, and its states."""

from __future__ import annotations

import threading
import time

import pytest

import heptarm as ha
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.arm.peer import Peer, Served

HOME = ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0))


# ------------------------------------------------------------------------------------- connecting


def test_connecting_reports_the_robot_and_its_limits(peer: Peer) -> None:
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
    while not peer.seen or not isinstance(peer.seen[-1], wire.Goodbye):  # it may not have read everything yet
        assert time.monotonic() < deadline, peer.seen
        time.sleep(0.01)
    kinds = [type(message).__name__ for message in peer.seen]
    assert kinds[-3:] == ["Stop", "ReleaseControl", "Goodbye"]


def test_an_observer_neither_takes_control_nor_stops_the_arm(peer: Peer) -> None:
    with peer.arm(control=False) as arm:
        assert not arm.in_control
    kinds = [type(message).__name__ for message in peer.seen]
    assert "TakeControl" not in kinds and "Stop" not in kinds


def test_one_byte_at_a_time() -> None:
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
    with pytest.raises(ha.VersionMismatch, match=r"3\.1.*2\.0"):
        peer.arm()
    peer.close()


def test_the_key_is_proved() -> None:
    def challenge(client: Served, _: int) -> None:
        client.say(client.session.challenge())

    def judge(client: Served, _: int) -> None:
        if client.session.is_proven:
            from tests.wire.pairs import welcome

            client.say(welcome())
        else:
            client.say(wire.Refusal(code=Code.WRONG_KEY, text="wrong key", major=wire.MAJOR, minor=0))

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


def test_a_cabinet_that_sends_nothing() -> None:
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
        assert 1 <= len(stamps) <= 22 and stamps == sorted(set(stamps))


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
        with pytest.raises(ha.StaleState, match="old"):
            while arm.state.age < 60.0:  # up to 1 s old it is given out
                time.sleep(0.02)


def test_after_a_standstill_the_states_that_wait_are_read_first(
    peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that was held up looks at its newest state before its link has read those that came meanwhile."""
    monkeypatch.setattr("heptarm.arm.link.connection._CATCH_UP", 20.0)
    with peer.arm(control=False) as arm:
        for client in peer.clients:
            client.rate = 0.0
        last = arm.state
        while last.age < 1.1:
            time.sleep(0.02)
        timer = threading.Timer(0.03, lambda: setattr(peer.clients[0], "rate", 100.0))
        timer.start()
        assert arm.state.stamp > last.stamp
        timer.join()


def test_wait_until_gives_up(peer: Peer) -> None:
    with peer.arm() as arm, pytest.raises(ha.Timeout):
        arm.wait_until(lambda s: False, timeout=0.1)


def test_unknown_groups_are_refused_with_the_known_ones(peer: Peer) -> None:
    with peer.arm() as arm, pytest.raises(ha.CommandRejected, match="smell") as error:
        arm.subscribe(groups=("smell",))
    assert "joints" in error.value.hint
