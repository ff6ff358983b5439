"""The state table of a session, one test for each transition."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from heptarm.errors import CommandRejected, LimitError, ModeConflict
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version
from heptarm.sim.fri import cartesian
from heptarm.sim.fri.overlay import CONTROLS, MotionOverlay
from heptarm.sim.fri.settings import QualityChanged, SessionConfiguration
from tests.sim_fri.rig import Rig, State, mirror

MODES = [(mode, control) for mode, controls in CONTROLS.items() for control in controls]


def test_a_session_that_is_not_open_is_silent() -> None:
    rig = Rig()
    rig.run(50)
    assert not rig.client.seen and rig.events == []


def test_idle_to_waiting_to_ready_as_the_client_answers() -> None:
    rig = Rig().ready()
    assert rig.states == [State.MONITORING_WAIT, State.MONITORING_READY]
    qualities = [event.quality for event in rig.events if isinstance(event, QualityChanged)]
    assert qualities == [m.Quality.FAIR, m.Quality.GOOD]
    first, last = rig.client.seen[0], rig.client.seen[-1]
    assert first.connection == m.ConnectionInfo(State.MONITORING_WAIT, m.Quality.POOR, 1, 1)
    assert last.connection is not None and last.connection.state is State.MONITORING_READY
    assert last.ipo == m.IpoData(command_mode=m.CommandMode.NO_COMMAND, overlay=m.Overlay.NONE)


def test_nobody_answers_and_the_session_waits_for_ever() -> None:
    rig = Rig(silent=True)
    rig.controller.open()
    rig.run(3000)
    assert rig.controller.state is State.MONITORING_WAIT and len(rig.client.seen) == 3000
    assert rig.controller.meter.counts.on_time == 0 and rig.controller.meter.counts.lost > 2900


def test_ready_to_waiting_and_back_as_the_answers_stop_and_come() -> None:
    rig = Rig().ready()
    rig.silent = True
    rig.until(State.MONITORING_WAIT, most=40)
    rig.silent = False
    rig.until(State.MONITORING_READY, most=150)


@pytest.mark.parametrize(("mode", "control"), MODES)
def test_ready_to_commanding_wait_to_active(mode: m.CommandMode, control: m.ControlMode) -> None:
    rig = Rig(Version.V2_7).active(MotionOverlay(mode, control))
    assert rig.states[-2:] == [State.COMMANDING_WAIT, State.COMMANDING_ACTIVE]
    rig.run(2)
    ipo = rig.client.seen[-1].ipo
    assert ipo is not None and ipo.command_mode is mode and ipo.tracking is not None
    assert ipo.overlay is (m.Overlay.CARTESIAN if mode is m.CommandMode.CARTESIAN_POSE else m.Overlay.JOINT)
    waits = [s for s in rig.client.seen if s.connection and s.connection.state is State.COMMANDING_WAIT]
    assert waits and all(s.ipo is not None and s.ipo.q is not None and s.ipo.tracking is None for s in waits)


@pytest.mark.parametrize("version", Version)
@pytest.mark.parametrize(("period", "multiplier"), [(1, 1), (2, 1), (5, 1), (10, 1), (100, 1), (5, 4)])
def test_a_client_sees_every_state_in_several_messages(
    version: Version, period: int, multiplier: int
) -> None:
    """Public clients set themselves up when MONITORING_READY begins, whenever the application starts its motion."""
    rig = Rig(configuration=SessionConfiguration(version, period, multiplier))
    rig.controller.open()
    while rig.controller.state is not State.MONITORING_READY:
        rig.run(1)
    rig.controller.start(MotionOverlay())  # in the tick in which the session becomes ready
    rig.until(State.COMMANDING_ACTIVE)
    rig.run(period)
    seen = [one.connection.state for one in rig.client.seen if one.connection is not None]
    assert seen.count(State.MONITORING_READY) > 4 * multiplier
    assert seen.count(State.COMMANDING_WAIT) > 9 * multiplier
    assert seen == sorted(seen)
    ready = [
        one for one in rig.client.seen if one.connection and one.connection.state is State.MONITORING_READY
    ]
    assert all(
        one.ipo == m.IpoData(command_mode=m.CommandMode.NO_COMMAND, overlay=m.Overlay.NONE) for one in ready
    )


def test_an_overlay_that_is_stopped_before_it_waits_has_ended() -> None:
    rig = Rig().ready()
    rig.controller.start(MotionOverlay())
    rig.controller.stop()
    rig.run(100)
    assert rig.end.cause == "cancelled" and rig.states[-1] is State.MONITORING_READY


@pytest.mark.parametrize("mode", [m.CommandMode.POSITION, m.CommandMode.WRENCH, m.CommandMode.CARTESIAN_POSE])
def test_a_client_may_mirror_the_measured_position_of_a_compliant_arm(mode: m.CommandMode) -> None:
    rig = Rig(Version.V2_5)
    rig.arm.q = sagged = rig.arm.q_ipo + 0.02
    pose = cartesian.transformation(rig.arm.robot, tuple(sagged.tolist()))

    def measured(message: m.Monitoring) -> m.Command:
        if mode is m.CommandMode.CARTESIAN_POSE:
            return replace(
                mirror(message), pose=pose, redundancy=m.Redundancy(m.RedundancyStrategy.E1, sagged[2])
            )
        return replace(mirror(message), q=tuple(sagged.tolist()))

    rig.client.waiting = rig.client.law = measured
    rig.active(MotionOverlay(mode, m.ControlMode.CARTESIAN_IMPEDANCE))
    rig.run(1)
    assert np.abs(rig.arm.q - rig.arm.q_ipo).max() < 0.003  # the set-point begins at the interpolator's ...
    rig.run(50)
    assert rig.controller.state is State.COMMANDING_ACTIVE, rig.reported
    assert rig.arm.q == pytest.approx(sagged, abs=1e-6)  # ... and goes where the client needs it


def test_commanding_wait_to_ready_when_the_application_stops() -> None:
    rig = Rig().waiting()
    rig.run(3)
    rig.controller.stop()
    rig.run(1)
    assert rig.controller.state is State.MONITORING_READY
    assert rig.end.cause == "cancelled" and not rig.end.is_error


def test_active_to_ready_when_the_application_stops_and_active_again() -> None:
    rig = Rig().active()
    rig.controller.stop()
    rig.run(5)
    assert rig.controller.state is State.MONITORING_READY and rig.controller.superposition is None
    rig.controller.start(MotionOverlay())
    rig.until(State.COMMANDING_ACTIVE)


@pytest.mark.parametrize("state", [State.COMMANDING_WAIT, State.COMMANDING_ACTIVE])
def test_commanding_to_monitoring_wait_when_the_quality_falls(state: m.SessionState) -> None:
    rig = Rig().waiting()
    rig.until(state)
    rig.silent = True
    rig.until(State.MONITORING_WAIT, most=40)
    assert rig.end.cause == "quality" and rig.end.is_error
    assert "FAIR" in rig.end.text and "possible connection problem" in rig.end.text


@pytest.mark.parametrize("safety", [m.Safety.STOP_0, m.Safety.STOP_1, m.Safety.STOP_2])
@pytest.mark.parametrize("state", [State.COMMANDING_WAIT, State.COMMANDING_ACTIVE])
def test_commanding_to_ready_by_a_safety_stop(state: m.SessionState, safety: m.Safety) -> None:
    rig = Rig().waiting().until(state)
    rig.arm.safety = safety
    rig.run(2)
    assert rig.controller.state is State.MONITORING_READY and rig.end.cause == "safety"
    robot = rig.client.seen[-1].robot
    assert robot is not None and robot.safety is safety and set(robot.drives) == {m.DriveState.OFF}


def test_commanding_wait_to_ready_when_the_client_does_not_synchronise() -> None:
    rig = Rig()
    rig.client.waiting = lambda message: m.Command(message.header)
    rig.waiting().until(State.MONITORING_READY)
    assert rig.end.cause == "synchronisation" and "no joint position" in rig.end.text


@pytest.mark.parametrize("version", Version)
def test_any_to_idle_with_a_last_word(version: Version) -> None:
    for state in (
        State.MONITORING_WAIT,
        State.MONITORING_READY,
        State.COMMANDING_WAIT,
        State.COMMANDING_ACTIVE,
    ):
        rig = Rig(version)
        rig.controller.open()
        if state > State.MONITORING_READY:
            rig.until(State.MONITORING_READY)
            rig.controller.start(MotionOverlay())
        rig.until(state)
        rig.controller.close()
        rig.run(20)
        states = [s.connection.state for s in rig.client.seen if s.connection is not None]
        assert states[-1] is State.IDLE and states.count(State.IDLE) == 1
        assert rig.controller.superposition is None and rig.controller.state is State.IDLE
        if state > State.MONITORING_READY:
            assert rig.end.cause == "closed" and not rig.end.is_error


def test_a_session_is_opened_once_and_closed_as_often_as_one_likes() -> None:
    rig = Rig().ready()
    rig.controller.close()
    rig.controller.close()
    with pytest.raises(ModeConflict, match="opened only once"):
        rig.controller.open()


# ------------------------------------------------------------------------------ what an overlay needs


def test_an_overlay_needs_a_ready_session() -> None:
    rig = Rig()
    for text in ("IDLE", "MONITORING_WAIT"):
        with pytest.raises(ModeConflict, match=text):
            rig.controller.start(MotionOverlay())
        if rig.controller.state is State.IDLE:
            rig.controller.open()
    rig.until(State.MONITORING_READY)
    rig.controller.start(MotionOverlay())
    with pytest.raises(ModeConflict, match="one overlay at a time"):
        rig.controller.start(MotionOverlay())


@pytest.mark.parametrize("mode", m.CommandMode)
@pytest.mark.parametrize("control", m.ControlMode)
def test_a_command_mode_needs_its_control_mode(mode: m.CommandMode, control: m.ControlMode) -> None:
    rig = Rig(Version.V2_5).ready()
    if control in CONTROLS.get(mode, ()):
        rig.controller.start(MotionOverlay(mode, control))
        return
    with pytest.raises(CommandRejected, match=mode.name):
        rig.controller.start(MotionOverlay(mode, control))
    assert rig.controller.state is State.MONITORING_READY


@pytest.mark.parametrize("version", [Version.V1_11, Version.V1_15])
def test_a_pose_overlay_came_with_version_2(version: Version) -> None:
    rig = Rig(version).ready()
    with pytest.raises(CommandRejected, match=r"no command mode CARTESIAN_POSE.*2\.5"):
        rig.controller.start(MotionOverlay(m.CommandMode.CARTESIAN_POSE))


def test_a_torque_overlay_needs_an_answer_every_5_ms() -> None:
    torque = MotionOverlay(m.CommandMode.TORQUE, m.ControlMode.JOINT_IMPEDANCE)
    Rig(configuration=SessionConfiguration(Version.V1_15, 5)).active(torque)
    with pytest.raises(CommandRejected, match="got 6 ms"):
        Rig(configuration=SessionConfiguration(Version.V1_15, 2, 3)).active(torque)


@pytest.mark.parametrize(
    ("period", "multiplier", "text"),
    [
        (0, 1, "period_ms must be in .*, got 0"),
        (101, 1, "got 101"),
        (1, 0, "multiplier must be in .*, got 0"),
        (1, 101, "101 ms"),
        (50, 3, "150 ms"),
    ],
)
def test_periods_have_limits(period: int, multiplier: int, text: str) -> None:
    with pytest.raises(LimitError, match=text):
        SessionConfiguration(Version.V1_15, period, multiplier)


@pytest.mark.parametrize(
    ("period", "multiplier"), [(1, 1), (1, 2), (2, 5), (5, 1), (10, 1), (10, 10), (100, 1)]
)
def test_every_period_and_multiplier_reaches_active(period: int, multiplier: int) -> None:
    rig = Rig(configuration=SessionConfiguration(Version.V1_15, period, multiplier)).active()
    rig.run(500)
    assert rig.controller.state is State.COMMANDING_ACTIVE
    assert rig.controller.quality is m.Quality.EXCELLENT and rig.controller.meter.counts.lost == 0
    assert len(rig.client.seen) == -(-rig.now // (period * 1_000_000))
