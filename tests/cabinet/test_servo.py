"""Servo streams in the core: the newest target counts, each has its own watchdog, nothing is lost silently."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from math import nan
from typing import Any

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer, ptp, run


def controller(port: int) -> Peer:
    peer = Peer(port)
    peer.take_control()
    return peer


def opened(peer: Peer, **fields: Any) -> int:
    answer = peer.ask(wire.ServoOpen(**{"watchdog": 2.0, **fields}))
    assert isinstance(answer, wire.Accepted), answer
    peer.wait_for(wire.MotionStarted, lambda event: event.id == answer.id)
    return int(answer.id)


def target(servo: int, a7: float, *, watchdog: float = 2.0) -> wire.ServoJoints:
    return wire.ServoJoints(servo=servo, watchdog=watchdog, q=(0.0,) * 6 + (a7,))


def finish(peer: Peer, servo: int) -> wire.MotionFinished:
    return peer.wait_for(wire.MotionFinished, lambda event: event.id == servo)


def reached(peer: Peer, a7: float) -> None:
    """Waits until A7 of the fake robot has reached a position."""
    peer.ask(wire.Subscribe(groups=wire.Groups.JOINTS, rate=100.0))
    since = len(peer.seen)
    peer.wait(
        lambda _, m: isinstance(m, wire.State) and m.joints is not None and m.joints.q[6] == a7, since=since
    )
    peer.ask(wire.Subscribe(groups=wire.Groups.JOINTS, rate=0.0))


def reported(peer: Peer, servo: int) -> None:
    """Waits until the cabinet reports a refused target."""
    peer.wait_for(wire.ServoStatus, lambda event: event.servo == servo and event.refused > 0)


def status(peer: Peer, servo: int) -> wire.ServoStatus:
    finish(peer, servo)
    return [one for one in peer.all(wire.ServoStatus) if one.servo == servo][-1]


def test_targets_are_followed_and_counted_and_the_stream_closes_at_rest(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        servo = opened(peer)
        for step in range(50):
            peer.send(target(servo, 0.01 * step))
            time.sleep(0.002)
        reached(peer, 0.49)  # closing drops a target that waits
        assert isinstance(peer.ask(wire.ServoClose(servo=servo)), wire.Accepted)
        end = finish(peer, servo)
        assert (end.cause, end.q[6]) == (wire.Cause.CANCELLED, 0.49)
        seen = status(peer, servo)
        assert (seen.targets, seen.refused, seen.late) == (50, 0, 0)
        assert 1 <= seen.applied <= 50


def test_of_targets_that_come_together_the_newest_wins(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        servo = opened(peer)
        peer.socket.sendall(b"".join(peer.pack(target(servo, 0.001 * k)) for k in range(1000)))
        reached(peer, 0.999)
        peer.ask(wire.ServoClose(servo=servo))
        assert finish(peer, servo).q[6] == 0.999
        assert status(peer, servo).targets == 1000


def test_without_a_target_in_time_the_arm_stops_and_reports_why(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        servo = opened(peer)
        peer.send(target(servo, 0.3, watchdog=0.05))
        end = finish(peer, servo)
        assert end.cause is wire.Cause.STARVED
        assert "50 ms" in end.text
        assert status(peer, servo).late == 1
        assert isinstance(peer.ask(run(ptp(0.1))), wire.Accepted)  # and everything continues


def test_a_target_that_came_while_the_cabinet_stood_still_counts(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make()
    with controller(cabinet.port) as peer:
        servo = opened(peer)
        peer.send(target(servo, 0.3))
        reached(peer, 0.3)
        peer.send(target(servo, 0.3, watchdog=0.5))
        peer.ask(
            wire.Subscribe(groups=wire.Groups.JOINTS, rate=0.0)
        )  # its answer shows that the target is there
        cabinet.process.send_signal(signal.SIGSTOP)
        time.sleep(0.7)
        peer.send(target(servo, 0.4))
        cabinet.process.send_signal(signal.SIGCONT)
        reached(peer, 0.4)
        peer.ask(wire.ServoClose(servo=servo))
        assert finish(peer, servo).cause is wire.Cause.CANCELLED


def test_the_first_target_has_a_watchdog_too(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        servo = opened(peer, watchdog=0.1)
        assert finish(peer, servo).cause is wire.Cause.STARVED


def test_bad_targets_are_refused_reported_and_no_sign_of_life(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        servo = opened(peer)
        peer.send(target(servo, 0.2, watchdog=1.0))
        bad = (
            (target(servo, nan), Code.NOT_FINITE, "q[6]"),
            (target(servo, 3.5), Code.JOINT_LIMIT, "A7"),
            (target(servo, 0.1, watchdog=9.0), Code.OUT_OF_RANGE, "watchdog"),
            (target(servo, 2.5), Code.EXECUTION_FAILED, "refuses this target"),
        )
        for message, _, _ in bad:
            peer.send(message)
            time.sleep(0.02)
        end = finish(peer, servo)
        assert (end.cause, end.q[6]) == (wire.Cause.STARVED, 0.2)
        seen = status(peer, servo)
        assert seen.refused == len(bad)
        assert seen.code == bad[-1][1] and bad[-1][2] in seen.text


def test_each_kind_of_bad_target_bears_its_code(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        for message, code in (
            (wire.ServoJoints(servo=0, watchdog=0.1, q=(nan,) * 7), Code.NOT_FINITE),
            (wire.ServoJoints(servo=0, watchdog=0.1, q=(0.0, 2.2) + (0.0,) * 5), Code.JOINT_LIMIT),
            (wire.ServoJointsVelocity(servo=0, watchdog=0.1, q=(0.0,) * 7, dq=(nan,) * 7), Code.NOT_FINITE),
            (wire.ServoPose(servo=0, watchdog=0.1, xyz=(0, 0, 1), quat=(0, 0, 0, 2)), Code.NOT_NORMALISED),
            (wire.ServoPose(servo=0, watchdog=0.1, xyz=(9, 0, 1), quat=(0, 0, 0, 1)), Code.UNREACHABLE),
        ):
            servo = opened(peer)
            fields = {name: getattr(message, name) for name in message.__slots__}
            peer.send(type(message)(**{**fields, "servo": servo, "watchdog": 2.0}))
            if code is Code.UNREACHABLE:  # checked only when it is applied, and closing drops waiting targets
                reported(peer, servo)
            peer.ask(wire.ServoClose(servo=servo))
            assert status(peer, servo).code == code


def test_a_servo_motion_begins_only_when_nothing_else_runs(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        peer.ask(run(ptp(1.0)))
        answer = peer.ask(wire.ServoOpen())
        assert isinstance(answer, wire.Rejected) and answer.code == Code.BUSY
        peer.ask(wire.Stop())


def test_one_that_ended_by_itself_is_begun_again_with_the_next_target(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        servo = opened(peer, watchdog=2.0)
        peer.send(target(servo, 0.1, watchdog=2.0))
        reached(peer, 0.1)
        time.sleep(0.6)  # the fake's servo motions end after 0.3 s without a target
        peer.send(target(servo, 0.4, watchdog=2.0))
        reached(peer, 0.4)
        peer.ask(wire.ServoClose(servo=servo))
        end = finish(peer, servo)
        assert (end.cause, end.q[6]) == (wire.Cause.CANCELLED, 0.4)


def test_one_that_is_begun_again_has_the_changed_mode(cabinet: FakeCabinet) -> None:
    stiff, compliant = (
        wire.JointImpedance(stiffness=(value,) * 7, damping=(0.7,) * 7) for value in (1000.0, 50.0)
    )
    with controller(cabinet.port) as peer:
        servo = opened(peer, watchdog=2.0, mode=stiff)
        assert peer.ask(wire.GetProcessData(name="servo")).value == "1000.0"
        peer.send(target(servo, 0.1))
        assert isinstance(peer.ask(wire.ServoSettings(servo=servo, mode=compliant)), wire.Accepted)
        reached(peer, 0.1)
        time.sleep(0.6)  # the fake's servo motions end after 0.3 s without a target
        peer.send(target(servo, 0.4))
        reached(peer, 0.4)
        assert peer.ask(wire.GetProcessData(name="servo")).value == "50.0"
        peer.ask(wire.ServoClose(servo=servo))
        assert finish(peer, servo).cause is wire.Cause.CANCELLED


def test_only_the_controller_steers(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer, Peer(cabinet.port) as stranger:
        servo = opened(peer)
        stranger.send(target(servo, 0.3))
        refused = stranger.wait_for(wire.Rejected)
        assert refused.code == Code.NOT_IN_CONTROL
        peer.ask(wire.ServoClose(servo=servo))
        assert status(peer, servo).targets == 0


def test_a_stop_and_a_lost_controller_end_it(cabinet: FakeCabinet) -> None:
    with Peer(cabinet.port) as watching:
        peer = controller(cabinet.port)
        servo = opened(peer)
        watching.ask(wire.Stop())
        assert finish(peer, servo).cause is wire.Cause.STOPPED
        servo = opened(peer)
        peer.close()
        assert finish(watching, servo).cause is wire.Cause.LOST


def test_settings_keep_the_kind_of_the_mode(cabinet: FakeCabinet) -> None:
    compliant = wire.JointImpedance(stiffness=(300.0,) * 7, damping=(0.7,) * 7)
    with controller(cabinet.port) as peer:
        servo = opened(peer, mode=compliant)
        assert isinstance(peer.ask(wire.ServoSettings(servo=servo, mode=compliant)), wire.Accepted)
        other = peer.ask(wire.ServoSettings(servo=servo, mode=wire.PositionMode()))
        assert isinstance(other, wire.Rejected) and other.code == Code.MODE_CONFLICT
        peer.ask(wire.ServoClose(servo=servo))
        finish(peer, servo)
        gone = peer.ask(wire.ServoSettings(servo=servo, mode=compliant))
        assert isinstance(gone, wire.Rejected) and gone.code == Code.UNKNOWN_MOTION


LINE = {"engine": wire.ServoEngine.LIN, "velocity": 1.0, "acceleration": 1.0}


def test_the_straight_engine_follows_poses_and_no_joints(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        servo = opened(
            peer, linear=wire.CartesianDynamics(velocity=0.1, orientation_acceleration=2.0), **LINE
        )
        peer.send(wire.ServoPose(servo=servo, watchdog=2.0, xyz=(0.3, 0.0, 0.5), quat=(0.0, 0.0, 0.0, 1.0)))
        peer.send(target(servo, 0.7))
        peer.ask(wire.Subscribe(groups=wire.Groups.JOINTS, rate=100.0))
        peer.wait_for(wire.State, lambda state: state.joints is not None and state.joints.q[6] == 0.3)
        peer.ask(wire.ServoClose(servo=servo))
        assert finish(peer, servo).q[6] == 0.3
        seen = status(peer, servo)
        assert (seen.applied, seen.refused, seen.code) == (1, 1, Code.UNSUPPORTED)
        assert "poses" in seen.text


@pytest.mark.parametrize(
    ("fields", "parameter"),
    [
        (LINE | {"velocity": 0.5}, "velocity"),
        (LINE | {"acceleration": 0.5}, "acceleration"),
        (LINE | {"linear": wire.CartesianDynamics(jerk=10.0)}, "linear.jerk"),
        (LINE | {"linear": wire.CartesianDynamics(orientation_jerk=10.0)}, "linear.orientation_jerk"),
        ({"linear": wire.CartesianDynamics(velocity=0.1)}, "linear"),
        (LINE | {"timing": wire.ServoTiming(speed_timeout=0.5)}, "timing.speed_timeout"),
    ],
)
def test_limits_that_an_engine_does_not_obey_are_refused(
    cabinet: FakeCabinet, fields: Any, parameter: str
) -> None:
    with controller(cabinet.port) as peer:
        refused = peer.ask(wire.ServoOpen(**fields))
        assert isinstance(refused, wire.Rejected)
        assert (refused.code, refused.parameter) == (Code.UNSUPPORTED, parameter)


def test_the_direct_engine_refuses_a_velocity_that_it_would_not_obey(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        servo = opened(peer, engine=wire.ServoEngine.DIRECT)
        peer.send(wire.ServoJointsVelocity(servo=servo, watchdog=2.0, q=(0.0,) * 7, dq=(0.1,) * 7))
        reported(peer, servo)
        peer.ask(wire.ServoClose(servo=servo))
        seen = status(peer, servo)
        assert (seen.refused, seen.applied, seen.code) == (1, 0, Code.UNSUPPORTED)
