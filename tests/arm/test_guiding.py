"""Guiding, touching, guarding and teaching: API, TCP, the Java application, the doubles and the plant together."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from queue import SimpleQueue
from threading import Event, Thread

import numpy as np
import pytest

import heptarm as ha
from heptarm.values.condition.force import force
from heptarm.values.condition.signals import path
from heptarm.values.mode.compliance import compliance
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import HandGuiding, Position
from heptarm.wire import messages as wire
from tests.long import few
from tests.retry import answers_late, retry, starved

TABLE = 0.3
HOME = ha.deg(0, 35, 0, -80, 0, 65, 0)


@pytest.fixture(scope="module")
def table() -> Iterator[ha.Arm]:
    """An arm above a table."""
    target = f"sim://iiwa14?speed=2&box=0.6,0,{TABLE / 2},0.4,0.6,{TABLE}"
    with ha.connect(target, watchdog=10.0, timeout=20.0) as arm:
        yield arm


@pytest.fixture
def arm(table: ha.Arm) -> Iterator[ha.Arm]:
    table.operator.let_go()
    if np.abs(table.wait_for_rest().q - HOME).max() > 1e-3:
        table.move(ha.ptp(HOME), speed=0.7)
    yield table
    table.operator.start_push([0, 0, 0], duration=0.0)


def push_along(arm: ha.Arm, push: list[float], covered: float) -> None:
    """Push until a joint has turned by this angle [rad]."""
    before = arm.state.q
    arm.operator.start_push(push, duration=300.0)
    try:
        arm.wait_until(lambda state: np.abs(state.q - before).max() > covered, timeout=120.0)
    finally:
        arm.operator.start_push([0, 0, 0], duration=0.0)
    arm.wait_until(lambda state: np.abs(state.wrench.force).max() < 1.0)


# ------------------------------------------------------------------------------------------ hand guiding


def test_led_by_hand_until_the_switch_is_let_go(arm: ha.Arm) -> None:
    assert "hand_guide" in arm.capabilities
    handle = arm.start(ha.hand_guide(cartesian_velocity=0.3))
    assert handle.wait_started(20.0)
    arm.wait_until(lambda state: state.mode == HandGuiding())
    arm.operator.guide()
    assert arm.wait_until(lambda state: state.safety.hand_guiding_switch).safety.enabling_switch
    push_along(arm, [0, 15, 15], 0.2)
    assert not handle.done
    arm.operator.let_go()
    result = handle.wait(timeout=20.0)
    assert result.arrived and np.isfinite(result.residual)
    assert np.abs(arm.wait_for_rest().q - HOME).max() > 0.03
    assert not arm.wait_until(lambda state: not state.safety.hand_guiding_switch).safety.enabling_switch
    assert arm.wait_until(lambda state: state.motion.id == 0).mode == Position()
    with pytest.raises(ha.ShapeError, match="mode must be a control mode"):
        arm.move(ha.hold(0.1), mode=HandGuiding())  # type: ignore[arg-type]


def test_a_condition_ends_it(arm: ha.Arm) -> None:
    arm.operator.guide()
    handle = arm.start(ha.hand_guide(), until=force > 30)
    assert handle.wait_started(20.0)
    arm.wait_until(lambda state: np.abs(state.q_cmd - state.q).max() < 1.0)
    arm.operator.start_push([0, 0, 40], duration=0.4)
    result = handle.wait(timeout=20.0)
    assert result.cause is ha.Cause.CONDITION and result.stopped_by == (force > 30)


def test_cancelling_and_an_emergency_stop_end_it(arm: ha.Arm) -> None:
    arm.operator.guide()
    handle = arm.start(ha.hand_guide())
    assert handle.wait_started(20.0)
    handle.cancel()
    assert handle.wait(timeout=20.0).cause is ha.Cause.CANCELLED
    handle = arm.start(ha.hand_guide())
    assert handle.wait_started(20.0)
    arm.operator.fault("emergency_stop")
    with pytest.raises(ha.MotionAborted, match="emergency"):
        handle.wait(timeout=20.0)
    arm.operator.clear()
    assert arm.recover(timeout=10.0).done


def test_what_makes_no_sense_is_refused(arm: ha.Arm) -> None:
    with pytest.raises(ha.ShapeError, match="only when it is cancelled"):
        arm.move(ha.hand_guide())
    with pytest.raises(ha.ModeConflict, match="control mode itself"):
        arm.start(ha.hand_guide(), mode=JointImpedance(300.0))
    with pytest.raises(ha.CommandRejected, match="no path"):
        arm.start(ha.hand_guide(), until=path.after(0.1))
    with pytest.raises(ha.LimitError, match="A1"):
        arm.start(ha.hand_guide(q_max=[9.0] + [np.nan] * 6))
    low = wire.HandGuide(q_min=(-9.0,) * 7)  # bypassing the checks of the client
    with pytest.raises(ha.LimitError, match="joint limit of hand guiding must be in"):
        arm.connection.request(wire.Run(items=(wire.Item(motion=low),)))


def test_led_precisely_along_one_axis(arm: ha.Arm) -> None:
    start = arm.wait_for_rest().pose
    handle = arm.start(ha.hold(30.0), mode=compliance("y", frame="base"))
    assert handle.wait_started(20.0)
    push_along(arm, [10, 10, 10], 0.1)
    handle.cancel()
    handle.wait(timeout=20.0)
    end = arm.wait_for_rest().pose
    assert end.xyz[1] - start.xyz[1] > 0.01
    assert np.abs((end.xyz - start.xyz)[[0, 2]]).max() < 5e-3 and end.angle_to(start) < 0.02
    result = arm.guide_precisely("xy", frame="base", seconds=30.0, until=~(force > 1))
    assert result.cause is ha.Cause.CONDITION


@pytest.mark.parametrize(
    "mode",
    [compliance("xyzabc"), CartesianImpedance(0.0, damping=0.1, nullspace_stiffness=0.0), None],
    ids=["compliance", "raw", "hand_guide"],
)
def test_a_push_moves_a_guided_arm_within_bounds(arm: ha.Arm, mode: CartesianImpedance | None) -> None:
    handle = arm.start(ha.hand_guide() if mode is None else ha.hold(60.0), mode=mode)
    assert handle.wait_started(20.0)
    if mode is None:
        arm.operator.guide()
    before = arm.wait_until(lambda state: state.motion.active).stamp
    arm.operator.start_push([0, 0, 15], duration=2.0)
    seen = [arm.wait_until(lambda state: np.abs(state.dq).max() > 0.05, timeout=30.0)]
    for state in arm.states():
        seen.append(state)
        if (state.stamp - before) * 1e-9 > 2.5 or handle.done:
            break
    assert not handle.done
    handle.cancel()
    assert handle.wait(timeout=20.0).cause is ha.Cause.CANCELLED  # no drive error
    fractions = np.array([np.abs(state.dq) / arm.robot.dq_max for state in seen])
    moved = np.diff([state.pose.xyz for state in seen], axis=0)
    passed = np.diff([state.stamp for state in seen]) * 1e-9
    speed = np.linalg.norm(moved, axis=1)[passed > 0] / passed[passed > 0]
    assert fractions.max() <= 0.55 and 0.1 < speed.max() <= 0.27


# ------------------------------------------------------------------------------------------ contacts


def test_touching_and_retreating(arm: ha.Arm) -> None:
    contact = arm.touch("-z", frame="base", distance=0.4, force=10.0, speed_mps=0.04, retreat=0.02)
    assert abs(contact.pose.xyz[2] - TABLE) < 0.01
    assert contact.force[2] > 8.0 and contact.result.cause is ha.Cause.CONDITION
    assert 0.05 < contact.travel < 0.4 and np.isnan(contact.spread)
    assert abs(arm.wait_for_rest().pose.xyz[2] - contact.pose.xyz[2] - 0.02) < 2e-3


def test_the_second_touch_is_the_precise_one(arm: ha.Arm) -> None:
    contact = arm.touch_twice([0, 0, -1], frame="base", distance=0.4, force=8.0, retreat=0.02)
    assert contact.first is not None
    assert abs(contact.pose.xyz[2] - TABLE) < 1e-3
    assert 0.0 < contact.spread < 0.01
    assert contact.force[2] < contact.first.force[2] + 1.0


def test_nothing_to_touch(arm: ha.Arm) -> None:
    with pytest.raises(ha.NoContact, match="nothing was touched within 20 mm") as error:
        arm.touch("z", frame="base", distance=0.02, force=10.0, speed_mps=0.1)
    assert error.value.cause is ha.Cause.FINISHED
    for wrong in (
        {"direction": "w"},
        {"distance": 0.0},
        {"force": -1.0},
        {"frame": "nowhere"},
        {"baseline": "none"},
        {"retreat": -1.0},
    ):
        with pytest.raises(ha.CommandRejected):
            arm.touch(**{"direction": "z", "distance": 0.1, "force": 5.0} | wrong)  # type: ignore[arg-type]
    with pytest.raises(ha.LimitError, match="slower"):
        arm.touch_twice(distance=0.1, force=5.0, fast_mps=0.01, slow_mps=0.02)


def test_a_push_that_was_there_before_is_no_contact(arm: ha.Arm) -> None:
    arm.operator.start_push([0, 0, 15], duration=60.0)
    arm.wait_until(lambda state: state.wrench.force[2] > 12.0)
    with pytest.raises(ha.NoContact):
        arm.touch("z", frame="base", distance=0.02, force=10.0, speed_mps=0.1)
    assert arm.touch("z", frame="base", distance=0.02, force=10.0, baseline="zero").travel < 5e-3


def test_taps(arm: ha.Arm) -> None:
    done = Event()

    def tap() -> None:
        while not done.wait(0.5):
            arm.operator.start_push([0, 0, 30], duration=0.1)

    hand = Thread(target=tap)
    hand.start()
    try:
        assert arm.wait_for_taps(2, force=8.0, gap=10.0, timeout=60.0).wrench is not None
    finally:
        done.set()
        hand.join()
    arm.wait_until(lambda state: np.abs(state.wrench.force).max() < 1.0)

    tapped: SimpleQueue[ha.State] = SimpleQueue()
    end = arm.on_taps(tapped.put, 1, gap=10.0)
    arm.move(ha.lin_rel(z=0.02, frame="base", speed_mps=0.2))  # no tap
    assert tapped.empty()
    while tapped.empty():
        arm.operator.start_push([0, 0, 30], duration=0.1)
        arm.wait_until(lambda state: state.wrench.force[2] > 20.0)
        arm.wait_until(lambda state: state.wrench.force[2] < 1.0)
    assert tapped.get().wrench is not None
    end()

    with pytest.raises(ha.Timeout, match="not tapped 2 times"):
        arm.wait_for_taps(2, timeout=0.3)
    with pytest.raises(ha.LimitError, match="count"):
        arm.wait_for_taps(0)


# ------------------------------------------------------------------------------------------ the guard


def test_a_guard_stops_at_a_collision_and_reports_which_joint(arm: ha.Arm) -> None:
    met: list[ha.Collision] = []
    with arm.guarded(arm.collision_guard(10.0), on_collision=met.append):
        assert arm.move(ha.lin_rel(z=0.02, frame="base", speed_mps=0.1)).arrived
        with pytest.raises(ha.CollisionDetected, match="A[24]: .* allowed are 10.0 Nm") as error:
            arm.move(ha.lin_rel(z=-0.4, frame="base", speed_mps=0.05))
        with pytest.raises(ha.ModeConflict), arm.guarded():
            pass
    found = error.value.collision
    assert met == [found]
    assert found.joint in (1, 3) and abs(found.torque) > 10.0 and found.state is not None
    assert error.value.cause is ha.Cause.CONDITION
    assert arm.wait_for_rest().pose.xyz[2] > TABLE - 0.02
    assert arm.move(ha.lin_rel(z=0.05, frame="base", speed_mps=0.1)).arrived


def test_ones_own_condition_goes_on_to_count(arm: ha.Arm) -> None:
    with arm.guarded(arm.collision_guard(100.0)) as guard:
        result = arm.move(ha.lin_rel(z=0.05, frame="base", speed_mps=0.1), until=path.after(0.02))
    assert result.stopped_by == path.after(0.02) and guard.threshold[0] == 100.0


def test_a_guard_watches_a_servo_motion(arm: ha.Arm) -> None:
    guard = arm.collision_guard(10.0)
    with (
        pytest.raises(ha.CollisionDetected),
        arm.guarded(guard),
        arm.servo("pose", rate=50, speed=0.3, acceleration=0.5, watchdog=2.0) as sv,
    ):
        start = sv.start.pose
        while sv.tick() and sv.t < 30.0:
            sv.set(ha.Pose.of(start.xyz - [0, 0, min(0.05 * sv.t, 0.3)], start.quat))
    arm.wait_for_rest()


@pytest.mark.parametrize("margin", few([5.0, 0.0]))
def test_a_guard_watches_an_fri_session(arm: ha.Arm, margin: float) -> None:
    retry(lambda: _pushed_in_a_session(arm, margin), answers_late)


def _pushed_in_a_session(arm: ha.Arm, margin: float) -> None:
    met: list[ha.Collision] = []
    guard = arm.collision_guard(10.0, margin=margin)
    try:
        with (
            pytest.raises(ha.CollisionDetected, match="collision at A1: .* allowed are 10") as error,
            arm.guarded(guard, on_collision=met.append),
            arm.fri("position", period_ms=10) as rt,
        ):
            assert rt.wait(0.2), "nothing touches it"
            arm.operator.start_push([0.0, 40.0, 0.0], duration=60.0)
            assert not rt.wait(20.0) and not rt.active
    finally:
        arm.operator.start_push([0.0, 0.0, 0.0], duration=0.0)
    found = error.value.collision
    assert found.joint == 0 and abs(found.torque) > 10.0 and error.value.history
    assert found in met and rt.client.collision is not None
    assert arm.wait_for_rest() is not None
    with arm.fri("position", period_ms=10) as rt:  # outside of the block, nothing is watched
        assert rt.wait(0.05)


def test_a_guard_with_a_margin_is_watched_here(arm: ha.Arm) -> None:
    guard = arm.collision_guard(10.0, margin=5.0)
    assert guard.is_moving
    met: list[ha.Collision] = []
    with pytest.raises(ha.CollisionDetected) as error, arm.guarded(guard, on_collision=met.append):
        for _ in range(2):  # it continues to monitor
            with contextlib.suppress(ha.MotionAborted):
                arm.move(ha.lin_rel(z=-0.4, frame="base", speed_mps=0.05))
            arm.wait_for_rest()
        arm.move(ha.lin_rel(z=-0.1, frame="base", speed_mps=0.05))
    assert len(met) == 3 and error.value.collision == met[0]
    assert error.value.collision.joint in (1, 3) and error.value.cause is ha.Cause.STOPPED
    arm.wait_for_rest()
    handle = arm.start(ha.lin_rel(z=0.1, frame="base", speed_mps=0.05))
    arm.wait_until(lambda state: np.abs(state.dq).max() > 0.02)
    with pytest.raises(ha.NotReady, match="at rest"):
        arm.collision_guard()
    handle.wait(timeout=60.0)


# ------------------------------------------------------------------------------------------ teaching


def test_taught_by_hand_and_replayed(arm: ha.Arm) -> None:
    def hand() -> None:
        arm.operator.guide()
        arm.wait_until(lambda state: state.motion is not None and state.motion.active)
        push_along(arm, [0, 6, 6], 0.1)
        arm.operator.let_go()

    arm.wait_for_rest()
    person = Thread(target=hand)
    person.start()
    whole = arm.teach(ha.hand_guide(joint_velocity=0.5), timeout=60.0)
    person.join()
    assert whole.robot == "iiwa14" and np.ptp(whole.q, axis=0).max() > 0.05
    covered = whole.trimmed().thinned()
    assert len(covered) < len(whole)
    fractions: list[float] = []
    replay = arm.replay(covered, by="spline", speed_scaling=0.3, on_progress=fractions.append)
    assert fractions == sorted(fractions) and fractions[-1] == 1.0
    assert replay.result.arrived and replay.deviation < 0.05
    assert replay.result.duration == pytest.approx(covered.duration / 0.3, abs=0.3), "in the taught time"
    assert np.abs(arm.wait_for_rest().q - covered.q[-1]).max() < 2e-3
    replay = retry(lambda: arm.replay(covered, speed_scaling=0.5), starved)
    assert replay.result.arrived and replay.deviation < 0.02
    assert np.abs(arm.wait_for_rest().q - covered.q[-1]).max() < 0.01


def test_what_cannot_be_replayed(arm: ha.Arm) -> None:
    there = arm.wait_for_rest().q
    away = there + [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5]
    with pytest.raises(ha.LimitError, match="speed_scaling"):
        arm.replay(ha.Trajectory.of([0.0, 0.1], [there, away]))
    with pytest.raises(ha.CommandRejected, match="iiwa7"):
        arm.replay(ha.Trajectory.of([0.0, 1.0], [there, away], robot="iiwa7"))
    with pytest.raises(ha.LimitError, match="A7"):
        arm.replay(ha.Trajectory.of([0.0, 9.0], [there, there + [0, 0, 0, 0, 0, 0, 9.0]]))
    with pytest.raises(ha.ShapeError, match="by must be"):
        arm.replay(ha.Trajectory.of([0.0, 1.0], [there, away]), by="foot")  # type: ignore[arg-type]
    with pytest.raises(ha.ShapeError, match="trajectory must be a Trajectory"):
        arm.replay("path.npz")  # type: ignore[arg-type]
