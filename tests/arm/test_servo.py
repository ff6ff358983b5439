"""Servo motions through the whole stack: API, TCP, Java application, doubles, plant."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from typing import Any, Literal

import numpy as np
import pytest

import heptarm as ha
from heptarm.values.condition.force import force
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.mode.mode import Position
from heptarm.wire import messages as wire
from tests.conftest import RunningCabinet

SPEED = 1.0  # streams by this machine's clock

A7 = np.array([0, 0, 0, 0, 0, 0, 1.0])
TOUCH = 2e-3


def follow(sv: ha.JointServo, seconds: float, *, turn: float = 0.2) -> np.ndarray:
    """Swing A7 and return; return the farthest target."""
    farthest = sv.start.q
    while sv.tick() and sv.t < seconds:
        farthest = sv.set(sv.start.q + turn * np.sin(np.pi * min(sv.t / seconds, 1.0)) * A7)
    return farthest


@pytest.mark.parametrize("engine", ["smart", "direct"])
def test_the_arm_follows_a_stream_and_rests_at_its_end(
    arm: ha.Arm, engine: Literal["smart", "direct"]
) -> None:
    seen: list[float] = []
    with arm.servo("joint", rate=100, engine=engine, speed=0.5, acceleration=1.0, watchdog=2.0) as sv:
        start = sv.start.q
        while sv.tick() and sv.t < 20.0 and (sv.t < 1.0 or max(seen) <= 0.15):
            sv.set(start + 0.2 * np.sin(np.pi * sv.t) * A7)
            seen.append(arm.state.q[6] - start[6])
    assert max(seen) > 0.15
    assert sv.result is not None and sv.result.cause is ha.Cause.CANCELLED
    stats = sv.stats
    assert stats.received == stats.sent and stats.refused == stats.late == 0
    assert np.abs(arm.wait_for_rest().dq).max() < 0.01


def test_a_target_is_reached_and_passed_with_a_velocity(arm: ha.Arm) -> None:
    with arm.servo("joint", rate=50, speed=0.5, acceleration=1.0, watchdog=2.0) as sv:
        goal = sv.start.q + 0.1
        while sv.tick() and sv.t < 20.0 and np.abs(arm.state.q - goal).max() > TOUCH:
            sv.set(goal)
        assert np.abs(arm.state.q - goal).max() < TOUCH
        began = sv.t
        while sv.tick() and sv.t < 20.0 and arm.state.q[6] < goal[6] + 5 * TOUCH:
            sv.set(goal + 0.05 * (sv.t - began) * A7, 0.05 * A7)
        assert arm.state.q[6] >= goal[6] + 5 * TOUCH and arm.state.dq[6] > 0.02
    assert sv.stats.refused == 0


def test_poses_are_followed_and_one_out_of_reach_is_not_sent_but_reported(arm: ha.Arm) -> None:
    with arm.servo("pose", rate=50, speed=0.5, acceleration=1.0, watchdog=2.0) as sv:
        start = sv.start.pose
        goal = ha.Pose.of(start.xyz + [0.0, 0.08, -0.05], start.quat)
        while sv.tick() and sv.t < 20.0 and arm.state.pose.distance_to(goal) > 1e-3:
            sv.set(goal)
        assert arm.state.pose.distance_to(goal) < 1e-3
        sv.tick()
        assert sv.set(ha.Pose.of([3.0, 0, 0], start.quat)) == goal, "the last good one is sent again"
        assert sv.stats.slowdown.factor == 0.0 and sv.stats.slowdown.reason
        sv.set(goal)
    assert sv.stats.held == 1 and sv.stats.refused == 0 and sv.stats.slowdown.factor == 1.0


def test_a_stream_whose_targets_are_all_held_warns_once_and_counts_them(
    arm: ha.Arm, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level("WARNING", "heptarm.arm"), arm.servo("pose", rate=100, watchdog=2.0) as sv:
        far = ha.Pose.of([3.0, 0, 0], sv.start.pose.quat)
        for _ in range(5):
            sv.tick()
            sv.set(far)
        assert sv.refused == 5
    warnings = [record.getMessage() for record in caplog.records if "the arm is held" in record.getMessage()]
    assert len(warnings) == 1 and "out of reach" in warnings[0]


def test_a_pose_beyond_a_limit_names_the_axis(arm: ha.Arm) -> None:
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 115, 0)))
    with arm.servo("pose", rate=50, watchdog=2.0) as sv:
        here = sv.start.pose
        angle = 0.0
        while sv.tick() and sv.stats.held == 0 and angle < np.pi:
            angle += np.radians(2)
            sv.set(here @ ha.Pose.xyz_abc(0, 0, 0, 0, angle, 0))
        assert "limit of A" in sv.stats.slowdown.reason


def test_a_target_behind_a_limit_is_brought_back_to_it(arm: ha.Arm) -> None:
    with arm.servo("joint", rate=50, watchdog=2.0) as sv:
        sent = sv.set(sv.start.q + 9.0 * A7)
        assert sent[6] == arm.robot.q_max[6]
        np.testing.assert_array_equal(sent[:6], sv.start.q[:6])
        for far in (np.full(7, 1e308), [1e308] * 7, np.full(7, 1e30, dtype=np.float32)):
            np.testing.assert_array_equal(sv.set(far), arm.robot.q_max)
        sv.set(sv.start.q)


@pytest.mark.parametrize(
    "bad",
    [
        [0.0] * 6,
        [np.nan] * 7,
        [np.inf] + [0.0] * 6,
        "joints",
        None,
        np.zeros(8),
        np.zeros((1, 7)),
        np.array([np.inf, -np.inf, *[0.0] * 5]),
        np.array([*[0.0] * 6, -np.inf]),
        np.array([*[0.0] * 6, np.nan]),
    ],
)
def test_bad_targets_are_refused_here(arm: ha.Arm, bad: object) -> None:
    with arm.servo("joint", watchdog=2.0) as sv, pytest.raises(ha.CommandRejected):
        sv.set(bad)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"rate": 0.0}, "rate"),
        ({"rate": 2000.0}, "rate"),
        ({"watchdog": 0.001}, "watchdog"),
        ({"rate": 1.0, "watchdog": 0.5}, "shorter than the period"),
        ({"engine": "magic"}, "smart"),
        ({"speed": 0.0}, "speed"),
        ({"speed": float("nan")}, "speed"),
        ({"acceleration": 1.5}, "acceleration"),
        ({"min_trajectory_time": 5.0}, "min_trajectory_time"),
        ({"goal_timeout": 0.0}, "goal_timeout"),
        ({"mode": "soft"}, "mode"),
    ],
)
def test_bad_settings_are_refused_before_anything_is_sent(
    arm: ha.Arm, settings: dict[str, Any], word: str
) -> None:
    with pytest.raises(ha.CommandRejected, match=word):
        arm.servo("joint", **settings)
    with pytest.raises(ha.ShapeError, match="kind"):
        arm.servo("wheel")  # type: ignore[call-overload]


def test_a_loop_that_hangs_ends_in_a_stop_and_an_error_that_reports_it(arm: ha.Arm) -> None:
    with (
        pytest.raises(ha.Starved, match="no target arrived within 60 ms"),
        arm.servo("joint", watchdog=0.06, speed=0.5) as sv,
    ):
        sv.set(sv.start.q + 0.5 * A7)
        arm.wait_until(lambda _: not sv.active)
        assert sv.tick() is None
        assert not sv.active
        sv.set(sv.start.q)  # no longer has an effect
    assert np.abs(arm.wait_for_rest().dq).max() < 0.01


@pytest.mark.parametrize("kind", ["joint", "velocity"])
def test_closing_again_raises_the_error_of_the_motion_no_second_time(
    arm: ha.Arm, kind: Literal["joint", "velocity"]
) -> None:
    with arm.servo(kind, watchdog=0.06) as sv:
        if isinstance(sv, ha.JointServo):
            sv.set(sv.start.q)
            until = "no target"
        else:
            arm.stop()
            until = "stopped"
        arm.wait_until(lambda _: not sv.active, timeout=20.0)
        with pytest.raises(ha.HeptarmError, match=until):
            sv.close()
        sv.close()
    assert not sv.active


def test_the_end_of_the_block_ends_a_motion_whose_closing_was_interrupted(
    arm: ha.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    with arm.servo("joint", watchdog=2.0) as sv:
        sv.set(sv.start.q)
        with monkeypatch.context() as patch:
            patch.setattr(arm.connection, "cancel", interrupted)
            with pytest.raises(KeyboardInterrupt):
                sv.close()
    assert sv.result is not None and sv.result.cause is ha.Cause.CANCELLED


def interrupted(handle: object) -> None:
    raise KeyboardInterrupt


def test_an_error_of_the_loop_is_not_hidden_and_the_arm_rests(arm: ha.Arm) -> None:
    with pytest.raises(ZeroDivisionError), arm.servo("joint", watchdog=2.0) as sv:
        sv.set(sv.start.q + 0.3 * A7)
        raise ZeroDivisionError
    arm.wait_for_rest()


def test_a_stop_from_another_thread_ends_the_loop(arm: ha.Arm) -> None:
    with pytest.raises(ha.MotionAborted, match="stopped"), arm.servo("joint", watchdog=2.0, speed=0.3) as sv:
        threading.Timer(0.3, arm.stop).start()
        while sv.tick() and sv.t < 30.0:
            sv.set(sv.start.q + 0.5 * A7)
        assert sv.t < 20.0
    arm.wait_for_rest()


def test_nothing_else_may_run_and_a_servo_is_used_once(arm: ha.Arm) -> None:
    handle = arm.start(ha.hold(5.0))
    with pytest.raises(ha.ModeConflict), arm.servo("joint"):
        pass
    handle.cancel()
    handle.wait()
    with arm.servo("joint", watchdog=2.0) as sv, pytest.raises(ha.ModeConflict):
        arm.start(ha.hold(1.0), when="reject")
    with pytest.raises(ha.LocalProtocolError, match="used once"), sv:
        pass
    with pytest.raises(ha.LocalProtocolError, match="with block"):
        _ = arm.servo("joint").start
    with pytest.raises(ha.LocalProtocolError, match="with block"):
        arm.servo("joint").set(np.zeros(7))
    with pytest.raises(ha.LocalProtocolError, match="with block"):
        arm.servo("joint").change(JointImpedance(300.0))


def test_the_cabinets_own_time_out_is_renewed_with_the_next_target(arm: ha.Arm) -> None:
    with arm.servo("joint", watchdog=2.0, goal_timeout=0.1, speed=0.5, acceleration=1.0) as sv:
        first = sv.start.q + 0.05 * A7
        sv.set(first)
        arm.wait_until(lambda state: np.abs(state.q - first).max() < TOUCH)
        sv.set(first)
        sent = arm.state.stamp
        arm.wait_until(lambda state: state.stamp > sent + 300_000_000)  # timed out
        goal = sv.start.q - 0.05 * A7
        sv.set(goal)
        arm.wait_until(lambda state: np.abs(state.q - goal).max() < TOUCH, timeout=20.0)


def test_an_impedance_servo_is_compliant_and_its_stiffness_can_change(arm: ha.Arm) -> None:
    with arm.servo("joint", watchdog=2.0, mode=JointImpedance(300.0)) as sv:
        sv.set(sv.start.q)
        sv.change(JointImpedance(600.0, damping=1.0))
        sv.set(sv.start.q)
        with pytest.raises(ha.ModeConflict, match="cannot change the kind"):
            sv.change(Position())
    assert sv.stats.refused == 0


def test_the_limits_of_a_running_stream_change(arm: ha.Arm) -> None:
    slow, fast = 0.1 * arm.robot.dq_max[6], 0.25 * arm.robot.dq_max[6]
    with arm.servo("joint", watchdog=2.0, speed=0.1, acceleration=1.0) as sv:
        goal = sv.start.q + 0.8 * A7
        with pytest.raises(ha.LimitError, match="speed must be in"):
            sv.change(speed=1.5)
        with pytest.raises(ha.CommandRejected, match="something to change"):
            sv.change()
        with pytest.raises(ha.CommandRejected, match="speed_mps applies"):
            sv.change(speed_mps=0.1)
        sv.set(goal)
        seen = arm.wait_until(lambda state: state.q[6] > sv.start.q[6] + 0.1)
        assert 0.5 * slow < seen.dq[6] < 1.1 * slow
        sv.change(speed=0.6)
        sv.set(goal)
        arm.wait_until(lambda state: state.dq[6] > fast)
        arm.wait_until(lambda state: np.abs(state.q - goal).max() < TOUCH)
    assert sv.result is not None and sv.result.cause is ha.Cause.CANCELLED
    direct = arm.servo("joint", engine="direct", watchdog=2.0)
    with direct, pytest.raises(ha.CommandRejected, match="cannot brake in between"):
        direct.change(speed=0.5)
    with (
        arm.servo("velocity", watchdog=2.0) as jog,
        pytest.raises(ha.CommandRejected, match="keeps its limits"),
    ):
        jog.change(speed=0.5)


def test_motions_take_a_mode_of_their_own_or_of_a_block(arm: ha.Arm) -> None:
    home = arm.state.q
    assert arm.move(ha.ptp(home + 0.1 * A7), mode=JointImpedance(800.0)).arrived
    with arm.using(JointImpedance(400.0)):
        assert arm.move([ha.ptp(home), ha.lin_rel(z=-0.02), ha.lin_rel(z=0.02)]).arrived
    assert arm.move(ha.ptp(home)).residual < 1e-4


def test_a_servo_does_not_begin_in_impedance_at_a_singularity(arm: ha.Arm) -> None:
    home = arm.state.q
    arm.move(ha.ptp(home * [1, 1, 1, 0, 1, 1, 1]))
    try:
        with (
            pytest.raises(ha.HeptarmError, match="singularity"),
            arm.servo("joint", mode=JointImpedance(300.0)),
        ):
            pass
    finally:
        arm.move(ha.ptp(home))


_KILLED = """
import sys, time, numpy, heptarm
arm = heptarm.connect(sys.argv[1], watchdog=5.0, timeout=30.0)
with arm.servo("joint", rate=100, speed=0.3, watchdog=2.0) as sv:
    while sv.tick():
        sv.set(sv.start.q + [0, 0, 0, 0, 0, 0, 0.5])
        print("on", flush=True)
"""


def test_a_killed_program_leaves_an_arm_at_rest(cabinet: RunningCabinet) -> None:
    child = subprocess.Popen(
        [sys.executable, "-c", _KILLED, cabinet.target], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    for _ in range(20):
        assert child.stdout.readline()
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    child.stdout.close()
    with ha.connect(cabinet.target, control=False) as watching:
        watching.wait_for_rest(timeout=20.0)


def test_a_move_inside_the_block_is_refused_at_once_and_the_stream_goes_on(arm: ha.Arm) -> None:
    home = arm.state.q
    with arm.servo("joint", rate=50, watchdog=2.0) as sv:
        sv.set(sv.start.q)
        with pytest.raises(ha.ModeConflict, match=r"inside the block of arm.servo\(\).*leave the with block"):
            arm.move(ha.ptp(home))
        assert sv.active  # it did not wait for the servo motion to end
        sv.set(sv.start.q)
    assert sv.result is not None and sv.result.cause is ha.Cause.CANCELLED
    with arm.servo("joint", watchdog=2.0, until=force < 999) as sv:
        while sv.tick():
            sv.set(sv.start.q)
        assert arm.move(ha.ptp(home)).arrived  # the servo motion has ended, so this does not wait


def test_a_block_whose_end_got_no_answer_is_left_all_the_same(
    arm: ha.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The motion of the block runs on until the watchdog time ends it; `move` is not refused as inside the block."""
    home, request = arm.state.q, arm.connection.request

    def unanswered(message: Any, *rest: Any) -> Any:
        if isinstance(message, wire.Cancel):
            raise ha.Timeout("no answer")
        return request(message, *rest)

    with (
        monkeypatch.context() as patch,
        pytest.raises(ha.Timeout, match="no answer"),
        arm.servo("joint", watchdog=1.0) as sv,
    ):
        sv.set(sv.start.q)
        patch.setattr(arm.connection, "request", unanswered)
    assert not sv.active
    assert arm.move(ha.ptp(home)).arrived
