"""Streams of velocities through the whole stack: followed, limited, slowed down for a reason, stopped by silence."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pytest

import heptarm as ha
from heptarm.arm.motion.jog import lag
from heptarm.model import forward
from heptarm.model.inverse_kinematics import arm_angle
from heptarm.model.velocity import VelocityPath
from tests.conftest import RunningCabinet

pytestmark = pytest.mark.slow
SPEED = 1.0  # streams by this machine's clock: what a busy machine is late, the path deviates

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
A7 = np.array([0, 0, 0, 0, 0, 0, 1.0])
#: Longest time of this machine for what takes a second [s].
PATIENCE = 40.0


@pytest.fixture(scope="module")
def arm(cabinet: RunningCabinet) -> Iterator[ha.Arm]:
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        yield arm


@pytest.fixture(autouse=True)
def at_home(arm: ha.Arm) -> None:
    arm.workspace = None
    if np.abs(arm.state.q - HOME).max() > 1e-3:
        arm.move(ha.ptp(HOME), speed=1.0)


def jog(
    arm: ha.Arm, sv: Any, command: np.ndarray, *, until: Callable[[ha.State], object] | float
) -> list[ha.State]:
    """Command a velocity for so many seconds of the robot, or until a state is reached; the states meanwhile."""
    first = arm.state
    seen = [first]
    while sv.tick() is not None and sv.t < PATIENCE:
        sv.set(command)
        if arm.state.stamp != seen[-1].stamp:
            seen.append(arm.state)
        now = seen[-1]
        if until(now) if callable(until) else (now.stamp - first.stamp) * 1e-9 > until:
            return seen
    raise AssertionError(f"not reached: {sv.stats}")


def rests(state: ha.State) -> bool:
    return bool(np.abs(state.dq).max() < 2e-3)


def rest(arm: ha.Arm, sv: Any) -> list[ha.State]:
    """Set nothing until the arm rests; the states meanwhile."""
    seen = [arm.state]
    while not rests(seen[-1]) and sv.t < PATIENCE:
        sv.tick()
        if arm.state.stamp != seen[-1].stamp:
            seen.append(arm.state)
    assert rests(seen[-1])
    return seen


def test_a_joint_velocity_is_followed_and_silence_is_zero_velocity(arm: ha.Arm, sent: list[Target]) -> None:
    with arm.servo("velocity", speed=0.5, watchdog=2.0) as sv:
        seen = jog(arm, sv, 0.3 * A7, until=1.5)
        # the targets are judged, since a busy machine sends some late; the arm is behind the last one
        steady = sent[len(sent) // 2 :]
        passed = np.diff([one.time for one in steady])
        assert np.median(np.diff([one.q[6] for one in steady]) / passed) == pytest.approx(0.3, rel=0.15)
        assert np.median([one.dq[6] for one in steady]) == pytest.approx(0.3, rel=1e-6)
        assert 0.1 < seen[-1].q[6] - seen[0].q[6] < sent[-1].q[6] - seen[0].q[6] + 5e-3
        assert np.abs(seen[-1].q - seen[0].q)[:6].max() < 2e-3
        rest(arm, sv)
        assert sv.active, "the stream goes on"
        jog(arm, sv, -0.3 * A7, until=lambda state: state.dq[6] < -0.2)
    assert sv.result is not None and sv.result.cause is ha.Cause.CANCELLED
    assert sv.stats.refused == 0 and sv.stats.sent > 50


class Target(NamedTuple):
    """A target: time of the robot's clock since the first one [s], joints [rad], their velocities [rad/s].

    The clock is the estimate with which the target was made: a machine that stands still changes its rate.
    """

    time: float
    q: np.ndarray
    dq: np.ndarray


@pytest.fixture
def sent(arm: ha.Arm, monkeypatch: pytest.MonkeyPatch) -> list[Target]:
    """The targets as they are sent."""
    link, targets, last = arm.connection.link, list[Target](), [0]
    send = link.send_target

    def watched(kind: type, numbers: Sequence[float], *, now: int, watchdog: float) -> None:
        passed = (now - last[0]) * 1e-9 * arm.real_time_factor if targets else 0.0
        time = targets[-1].time + passed if targets else 0.0
        last[0] = now
        targets.append(Target(time, np.array(numbers[-14:-7]), np.array(numbers[-7:])))
        send(kind, numbers, now=now, watchdog=watchdog)

    monkeypatch.setattr(link, "send_target", watched)
    return targets


def test_velocities_ramp_up_within_the_acceleration(arm: ha.Arm, sent: list[Target]) -> None:
    with arm.servo("velocity", speed=0.5, acceleration=0.05, watchdog=2.0) as sv:
        jog(arm, sv, 0.4 * A7, until=lambda state: state.dq[6] > 0.36)
    # from a tenth to nine tenths of 0.4 rad/s at 0.05 * 10 rad/s²; an arm whose machine stood still catches up faster
    began, ended = (next(one.time for one in sent if one.dq[6] > limit) for limit in (0.04, 0.36))
    assert ended - began > 0.98 * 0.32 / (0.05 * arm.robot.ddq_max[6])


@pytest.mark.parametrize("frame", ["base", "tool"])
def test_a_twist_moves_the_tool_along_the_axes_of_its_frame(
    arm: ha.Arm, frame: str, sent: list[Target]
) -> None:
    with arm.servo("twist", frame=frame, watchdog=2.0) as sv:
        start = sv.start.pose
        away = start.rotation @ [0, 0, -1.0] if frame == "tool" else np.array([0, 0, 1.0])
        seen = jog(
            arm,
            sv,
            np.array([0, 0, -0.05 if frame == "tool" else 0.05, 0, 0, 0.0]),
            until=lambda state: (state.pose.xyz - start.xyz) @ away > 0.04,
        )
        rest(arm, sv)
    # to a target that comes late each axis goes on its own: at most a tenth of a second of the path beside it
    poses = [(ha.Pose.from_matrix(forward(arm.robot, one.q)), 0.5e-3, 2e-3) for one in sent]
    poses += [(state.pose, 6e-3, 0.03) for state in seen]
    for pose, distance, angle in poses:
        moved = pose.xyz - start.xyz
        assert np.linalg.norm(moved - (moved @ away) * away) < distance
        assert pose.angle_to(start) < angle


def test_a_rotation_turns_about_the_tool_and_axes_may_be_a_pose(arm: ha.Arm, sent: list[Target]) -> None:
    tool = ha.Tool("stick", mass=0.2, com=(0, 0, 0.05), tcp=ha.Pose.at(0.05, 0, 0.15))
    axes = ha.Pose.xyz_abc(0, 0, 0, np.pi / 2, 0, 0)  # its x axis is y of the base
    with arm.tool(tool), arm.servo("twist", frame=axes, watchdog=2.0) as sv:
        start = sv.start.pose
        seen = jog(
            arm, sv, np.array([0, 0, 0, 0.2, 0, 0]), until=lambda state: state.pose.angle_to(start) > 0.15
        )
        rest(arm, sv)
    turned = start.inverse() @ seen[-1].pose
    about = start.rotation @ turned.rotvec / np.linalg.norm(turned.rotvec)
    np.testing.assert_allclose(about, [0, 1, 0], atol=0.02)
    tips = [ha.Pose.from_matrix(forward(arm.robot, one.q)) @ tool.tcp for one in sent]
    assert max(tip.distance_to(start) for tip in tips) < 2e-3
    # to a target that comes late each axis goes on its own
    assert max(state.pose.distance_to(start) for state in seen) < 0.01


def test_a_turn_of_the_tool_turns_a7_only_and_the_elbow_stays(arm: ha.Arm, sent: list[Target]) -> None:
    with arm.servo("twist", frame="tool", speed=0.5, watchdog=2.0) as sv:
        jog(arm, sv, np.array([0, 0, 0, 0, 0, 0.4]), until=lambda state: state.q[6] > np.radians(40))
        # the targets are judged: to one that comes late each axis goes on its own
        others = np.array([one.q for one in sent])[:, :6] - HOME[:6]
        assert np.degrees(np.abs(others).max()) < 0.05
        jog(arm, sv, np.array([0.05, 0.05, 0, 0.2, 0, 0]), until=1.0)
        rest(arm, sv)
    angle = np.degrees([arm_angle(arm.robot, HOME), arm_angle(arm.robot, sent[-1].q)])
    assert abs(angle[1] - angle[0]) < 0.5


def test_the_elbow_follows_a_posture_while_the_tool_stays(arm: ha.Arm, sent: list[Target]) -> None:
    posture = ha.deg(25, 32, -35, -90, 20, 60, -10)
    with arm.servo("twist", posture=posture, speed=0.5, watchdog=2.0) as sv:
        jog(arm, sv, np.zeros(6), until=lambda state: abs(state.q[2] - posture[2]) < np.radians(8))
    # the targets are judged: to one that comes late each axis goes on its own
    places = np.array([forward(arm.robot, one.q)[:3, 3] for one in sent])
    assert np.linalg.norm(places - places[0], axis=1).max() < 4e-3


@pytest.mark.parametrize(
    ("kind", "settings", "word"),
    [
        ("lin", {"elbow": "keep"}, "elbow applies to"),
        ("joint", {"posture": HOME}, "posture applies to"),
        ("velocity", {"elbow": "center"}, "elbow applies to"),
        ("twist", {"elbow": "up"}, "elbow must be"),
        ("pose", {"elbow": "center", "posture": HOME}, "takes the place of elbow"),
        ("twist", {"posture": [0.0] * 6}, "posture must"),
        ("twist", {"posture": [0, 30, 0, -90, 0, 60, 0]}, "A2 must be in"),
    ],
)
def test_what_no_elbow_can_do_is_refused(arm: ha.Arm, kind: Any, settings: dict[str, Any], word: str) -> None:
    with pytest.raises(ha.CommandRejected, match=word):
        arm.servo(kind, **settings)


def test_a_joint_stops_before_its_limit_which_is_never_passed(arm: ha.Arm) -> None:
    limit = arm.robot.q_max[6]
    arm.move(ha.ptp([*HOME[:6], limit - 0.3]), speed=1.0)
    with arm.servo("velocity", speed=0.5, watchdog=2.0) as sv:

        def is_at_its_end(state: ha.State) -> bool:
            # it also rests for a moment where a busy machine sends its targets late
            is_braked = any(one.reason == "limit of A7" and one.factor < 0.1 for one in sv.stats.slowdowns)
            return state.q[6] > limit - 0.04 and rests(state) and is_braked

        seen = jog(arm, sv, 0.6 * A7, until=is_at_its_end)
        assert max(state.q[6] for state in seen) < limit
        assert "limit of A7" in str(sv.stats)
        jog(arm, sv, -0.3 * A7, until=lambda state: state.q[6] < limit - 0.1)


def test_towards_the_stretched_arm_it_slows_down_without_a_jump(arm: ha.Arm) -> None:
    arm.move(ha.ptp(ha.deg(0, 60, 0, -35, 0, 60, 0)), speed=1.0)
    with arm.servo("twist", frame="base", speed=0.3, watchdog=2.0) as sv:
        out = 0.15 * np.array([np.sin(np.radians(65)), 0, np.cos(np.radians(65)), 0, 0, 0])
        seen = jog(
            arm,
            sv,
            out,
            until=lambda state: state.q[3] > -0.25 and sv.stats.slowdown.reason == "singularity",
        )
        assert sv.stats.slowdown.factor < 0.9
        seen += jog(arm, sv, out, until=1.0)
        seen += jog(arm, sv, -out, until=0.5)
    ceiling = 0.3 * arm.robot.dq_max
    for one, other in pairwise(seen):
        assert (np.abs(other.dq) <= 1.1 * ceiling).all()
        before, after = one.groups.joints, other.groups.joints
        assert before is not None and after is not None
        dt = (after.stamp - before.stamp) * 1e-9  # a busy cabinet reads a group less often than it sends it
        # the cabinet's own limit is twice that of the stream, 0.2 * 10 rad/s²
        assert np.abs(other.dq - one.dq).max() <= 1.3 * 4.0 * max(dt, 0.01)


def test_an_arm_that_does_not_follow_has_no_far_target(arm: ha.Arm) -> None:
    arm.set_override(0.05)
    try:
        with arm.servo("velocity", speed=0.5, watchdog=2.0) as sv:
            seen = jog(arm, sv, 0.5 * A7, until=lambda _: sv.stats.slowdown.reason == "A7 does not follow")
            seen += jog(arm, sv, 0.5 * A7, until=1.0)
            assert "A7 does not follow" in {one.reason for one in sv.stats.slowdowns}
    finally:
        arm.set_override(1.0)
    arm.wait_for_rest()
    assert abs(arm.state.q[6] - seen[-1].q[6]) < 0.35


def test_a_state_that_arrives_late_shows_no_arm_that_lags(arm: ha.Arm) -> None:
    sample = arm.connection.feed.newest
    assert sample is not None
    state = arm.connection.build(sample)
    now = state.sampled + 250_000_000
    late = arm.connection.build(sample._replace(received=now))
    ceiling = np.full(7, 10.0)
    path = VelocityPath(
        state.q - A7 * 0.25, speed=ceiling, acceleration=ceiling * 1e6, q_min=-ceiling, q_max=ceiling
    )
    path.advance(A7, 0.5, [])  # at 1 rad/s, where the arm is after the 0.25 s since the state was sampled
    assert path.dq == pytest.approx(A7)
    assert path.q - state.q == pytest.approx(A7 * 0.25, abs=1e-3)
    assert lag(path, A7, late, now=now, rate=1.0) is None
    assert lag(path, A7, state, now=now, rate=1.0) is None
    path.advance(A7, 0.3, [])
    slowdown = lag(path, A7, late, now=now, rate=1.0)
    assert slowdown is not None and slowdown.reason == "A7 does not follow"


def test_bodies_are_kept_clear_of(arm: ha.Arm) -> None:
    model = ha.CollisionModel("iiwa14", boxes=["0.55,0,0.1,0.4,0.4,0.2"], margin=0.02)
    with arm.servo("twist", frame="base", keep_clear_of=model, watchdog=2.0) as sv:
        seen = jog(
            arm,
            sv,
            np.array([0, 0, -0.15, 0, 0, 0]),
            until=lambda state: rests(state) and sv.stats.slowdown.factor < 0.1,
        )
        slowdown = sv.stats.slowdown
    assert "near box" in slowdown.reason
    gap = min(one.distance for one in model.clearances(seen[-1].q))
    assert 0.015 < gap < 0.06


def test_the_attached_tool_is_kept_clear_as_well(arm: ha.Arm) -> None:
    model = ha.CollisionModel("iiwa14", boxes=["0.55,0,0.1,0.4,0.4,0.2"], margin=0.02)
    pen = ha.Tool("pen", shapes=[ha.shapes.capsule(0.02, 0.15, at=ha.Pose.at(0, 0, 0.075))])
    with (
        arm.tool(pen),
        arm.servo("twist", frame="base", keep_clear_of=model, watchdog=2.0) as sv,
    ):
        seen = jog(
            arm,
            sv,
            np.array([0, 0, -0.15, 0, 0, 0]),
            until=lambda state: rests(state) and sv.stats.slowdown.factor < 0.1,
        )
        assert "pen near box" in sv.stats.slowdown.reason
    gap = min(one.distance for one in model.carrying(pen).clearances(seen[-1].q))
    assert 0.015 < gap < 0.06
    assert min(one.distance for one in model.clearances(seen[-1].q, below=0.5)) > 0.1


def test_a_stop_ends_the_stream(arm: ha.Arm) -> None:
    with pytest.raises(ha.MotionAborted, match="stopped"), arm.servo("velocity", watchdog=2.0) as sv:
        jog(arm, sv, 0.2 * A7, until=lambda state: state.dq[6] > 0.1)
        arm.stop()
        while sv.tick() is not None:
            sv.set(0.2 * A7)
        assert not sv.active
        sv.set(0.2 * A7)  # no longer has an effect
    assert rests(arm.wait_for_rest())


@pytest.mark.parametrize(
    ("kind", "settings", "word"),
    [
        ("velocity", {"engine": "direct"}, "engine applies"),
        ("velocity", {"frame": "tool"}, "frame applies"),
        ("velocity", {"speed_mps": 0.1}, "speed_mps applies"),
        ("velocity", {"timeout": 0.0}, "timeout must be"),
        ("velocity", {"keep_clear_of": "table"}, "keep_clear_of must have"),
        ("twist", {"frame": "moon"}, "frame must be one of"),
        ("twist", {"frame": 3}, "frame must be a name"),
        ("twist", {"speed_mps": 0.0}, "speed_mps"),
        ("twist", {"acceleration_radps2": 1e9}, "acceleration_radps2"),
        ("twist", {"speed": 2.0}, "speed"),
        ("joint", {"timeout": 0.1}, "timeout applies"),
        ("pose", {"frame": "tool"}, "frame applies"),
    ],
)
def test_settings_that_do_not_fit_are_refused(
    arm: ha.Arm, kind: Any, settings: dict[str, Any], word: str
) -> None:
    with pytest.raises(ha.CommandRejected, match=word):
        arm.servo(kind, **settings)


@pytest.mark.parametrize("bad", [[0.0] * 5, [np.nan] * 7, "fast", None])
def test_bad_velocities_are_refused_and_change_nothing(arm: ha.Arm, bad: Any) -> None:
    with arm.servo("velocity", watchdog=2.0) as velocity, pytest.raises(ha.CommandRejected, match="dq"):
        velocity.set(bad)
    with arm.servo("twist", watchdog=2.0) as twist, pytest.raises(ha.CommandRejected, match="twist"):
        twist.set(bad)
    with pytest.raises(ha.LocalProtocolError, match="with block"):
        arm.servo("twist").set([0.0] * 6)


_KILLED = """
import sys, heptarm
with heptarm.connect(sys.argv[1], watchdog=5.0) as arm, arm.servo("velocity", watchdog=2.0) as sv:
    while sv.tick() is not None:
        sv.set([0, 0, 0, 0, 0, 0, 0.2])
        if arm.state.dq[6] > 0.1:
            print("moves", flush=True)
"""


def test_the_arm_of_a_killed_process_comes_to_rest(arm: ha.Arm, cabinet: RunningCabinet) -> None:
    arm.release_control()
    try:
        child = subprocess.Popen(
            [sys.executable, "-c", _KILLED, cabinet.target], stdout=subprocess.PIPE, text=True
        )
        assert child.stdout is not None and child.stdout.readline()
        os.kill(child.pid, signal.SIGKILL)
        child.wait()
        child.stdout.close()
        arm.wait_until(rests, timeout=20.0)
        q = arm.state.q
        later = arm.state.stamp + 500_000_000
        arm.wait_until(lambda state: state.stamp > later)
        np.testing.assert_allclose(arm.state.q, q, atol=1e-3)
    finally:
        arm.take_control()


# -------------------------------------------------------------------------------------- the workspace

BOX = ((0.4, -0.1, 0.3), (0.62, 0.1, 0.7))


def outside(state: ha.State) -> float:
    """How far the tool is outside of the box [m]."""
    low, high = np.array(BOX)
    return float(np.maximum(low - state.pose.xyz, state.pose.xyz - high).max())


def allowed(sent: list[Target]) -> float:
    """How far outside the tool may come [m].

    Where this machine sends targets late, the arm goes on along the last one for a moment: 10 mm at 0.25 m/s.
    """
    return 4e-3 if np.diff([one.time for one in sent]).max() < 0.05 else 12e-3


def test_a_twist_brakes_before_a_wall_and_slides_along_it(arm: ha.Arm, sent: list[Target]) -> None:
    arm.workspace = ha.Workspace(BOX)
    with arm.servo("twist", frame="base", speed=0.5, watchdog=2.0) as sv:
        seen = jog(arm, sv, np.array([0.15, 0.03, 0, 0, 0, 0]), until=lambda state: state.pose.y > 0.06)
        assert seen[-1].pose.x > 0.61 and max(map(outside, seen)) < allowed(sent)
        assert "workspace" in {one.reason for one in sv.stats.slowdowns}
        seen = jog(arm, sv, np.array([-0.1, 0, 0, 0, 0, 0]), until=lambda state: state.pose.x < 0.57)


def test_joint_velocities_brake_before_a_wall_and_joints_have_limits_of_their_own(
    arm: ha.Arm, sent: list[Target]
) -> None:
    arm.workspace = ha.Workspace(BOX)
    swing = np.array([0.4, 0, 0, 0, 0, 0, 0])
    with arm.servo("velocity", speed=0.5, watchdog=2.0) as sv:
        seen = jog(arm, sv, swing, until=lambda s: s.pose.y > 0.09 and rests(s))
        assert max(map(outside, seen)) < allowed(sent)
        assert sv.stats.slowdown.reason == "workspace"
    arm.workspace = ha.Workspace(joints=(HOME - 0.2, HOME + 0.2))
    with arm.servo("velocity", speed=0.5, watchdog=2.0) as sv:
        seen = jog(arm, sv, -0.4 * A7, until=lambda s: s.q[6] < HOME[6] - 0.18 and rests(s))
        assert min(one.q[6] for one in seen) > HOME[6] - 0.203


def test_targets_of_servo_motions_are_clamped(arm: ha.Arm) -> None:
    arm.workspace = ha.Workspace(BOX)
    with arm.servo("joint", watchdog=2.0) as sv:
        sent = sv.set(HOME + 0.5 * np.eye(7)[0])
        y = forward(arm.robot, sent)[1, 3]
        assert 0.09 < y <= 0.1 + 1.5e-3 and sent[0] < HOME[0] + 0.4
        np.testing.assert_array_equal(sv.set(HOME), HOME)
        assert sv.stats.clamped == 1 and "1 targets, to the limits of the joints or the workspace" in str(
            sv.stats
        )
        sv.set(np.full(7, 3.0))  # beyond the limits of the joints as well: one target
        assert sv.stats.clamped == 2
        sv.set(HOME)
    for kind in ("pose", "lin"):
        with arm.servo(kind, watchdog=2.0) as poses:
            start = poses.start.pose
            went = poses.set(start.shifted(x=0.5, y=0.02))
            np.testing.assert_allclose(went.xyz, [0.62, start.y + 0.02, start.z], atol=1e-9)
            poses.set(start)
            assert poses.stats.clamped == 1
    arm.workspace = ha.Workspace(joints=(HOME - 0.2, HOME + 0.2))
    with arm.servo("joint", watchdog=2.0) as sv:
        np.testing.assert_allclose(sv.set(HOME + 0.5 * A7), HOME + 0.2 * A7)
    with arm.servo("pose", watchdog=2.0) as poses:
        start = poses.start.pose
        near = start.shifted(y=0.02)
        assert poses.set(near).distance_to(near) < 1e-9
        assert poses.set(start.shifted(y=0.4)) == poses.set(near), "the last pose inside stays the target"
        assert poses.stats.clamped == 1


def test_targets_are_refused_if_the_workspace_refuses(arm: ha.Arm) -> None:
    arm.workspace = ha.Workspace(BOX, mode="refuse")
    with (
        arm.servo("joint", watchdog=2.0) as sv,
        pytest.raises(
            ha.OutsideWorkspace, match=r"y in the base must be in \[-0.1, 0.1\] m, got 0.*no safety function"
        ),
    ):
        sv.set(HOME + 0.5 * np.eye(7)[0])
    with arm.servo("pose", watchdog=2.0) as poses, pytest.raises(ha.OutsideWorkspace, match="z in the base"):
        poses.set(poses.start.pose.shifted(z=0.5))
    with arm.servo("twist", frame="base", watchdog=2.0) as twist:
        with pytest.raises(ha.OutsideWorkspace, match="the velocity leaves arm.workspace"):
            jog(arm, twist, np.array([0, 0.1, 0, 0, 0, 0]), until=lambda s: s.pose.y > 0.2)
        rest(arm, twist)
        assert outside(arm.state) < 4e-3
        jog(arm, twist, np.array([0, -0.1, 0, 0, 0, 0]), until=lambda s: s.pose.y < 0.05)


@pytest.mark.parametrize(
    ("motion", "word"),
    [
        (ha.lin_rel(y=0.3, frame="base"), "motion leaves .* y in the base"),
        ([ha.lin_rel(y=0.05, frame="base"), ha.lin_rel(y=0.2, frame="base")], r"motions\[1\] leaves"),
        (ha.ptp(HOME + 0.6 * np.eye(7)[0]), "y in the base"),
        (
            ha.circ(ha.Pose.of((0.7, 0.05, 0.4), (0, 1, 0, 0)), ha.Pose.of((0.55, 0.09, 0.4), (0, 1, 0, 0))),
            "x in the base",
        ),
        (
            ha.spline([ha.Pose.of((0.5, 0.0, 0.2), (0, 1, 0, 0)), ha.Pose.of((0.5, 0.0, 0.5), (0, 1, 0, 0))]),
            "z in the base",
        ),
    ],
    ids=["line", "second", "joints", "arc through the wall", "spline through the wall"],
)
def test_motions_that_leave_it_are_refused_before_anything_is_sent(
    arm: ha.Arm, motion: Any, word: str
) -> None:
    for mode in ("clamp", "refuse"):
        arm.workspace = ha.Workspace(BOX, mode=mode)
        before = arm.state.q
        with pytest.raises(ha.OutsideWorkspace, match=word):
            arm.move(motion)
        np.testing.assert_allclose(arm.state.q, before, atol=1e-4)
    arm.workspace = None
    arm.start(motion).cancel()
    arm.wait_for_rest()


def test_motions_inside_are_sent_and_from_outside_the_way_in_is_open(arm: ha.Arm) -> None:
    arm.workspace = ha.Workspace(BOX)
    assert arm.move(ha.lin_rel(y=0.05, frame="base"), speed=1.0).arrived
    arm.workspace = None
    arm.move(ha.lin_rel(y=0.15, frame="base"), speed=1.0)
    arm.workspace = ha.Workspace(BOX)
    with pytest.raises(ha.OutsideWorkspace):
        arm.move(ha.lin_rel(y=0.02, frame="base"))
    with pytest.raises(ha.OutsideWorkspace, match="the end of motion"):
        arm.move(ha.lin_rel(y=-0.02, frame="base"))
    assert arm.move(ha.hold(0.05)).arrived
    with arm.servo("twist", frame="base", speed=0.5, watchdog=2.0) as sv:
        jog(arm, sv, np.array([0, -0.15, 0, 0, 0, 0]), until=lambda s: s.pose.y < 0.15)
    assert arm.move(ha.ptp(HOME), speed=1.0).arrived


def test_it_is_set_and_shown_as_a_value(arm: ha.Arm) -> None:
    space = ha.Workspace(BOX, mode="refuse")
    arm.workspace = space
    assert arm.workspace == ha.Workspace(BOX, mode="refuse") and "refuse" in str(space)
    with pytest.raises(ha.ShapeError, match="workspace must be a Workspace"):
        arm.workspace = BOX  # type: ignore[assignment]
    with pytest.raises(ha.CommandRejected, match="frame must be one of base"):
        arm.workspace = ha.Workspace(BOX, frame="moon")
    assert arm.workspace == space
