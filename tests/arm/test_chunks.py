"""Chunks of actions: late ones replace the rest of the last one without a stop or a jump; a person takes over."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm import devices, skills
from heptarm.arm.motion.chunks import ActionPath, ActionStream, action_times
from heptarm.errors import CollisionForeseen, LimitError, ShapeError
from heptarm.io.clock import RealClock
from heptarm.values.robot import robot
from tests.conftest import RunningCabinet

SPEED = 1.0  # streams by this machine's clock

ROBOT = robot("iiwa14")
HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
LIMITS = {"speed": 0.5 * ROBOT.dq_max, "acceleration": 0.5 * ROBOT.ddq_max, "jerk": 0.5 * ROBOT.dddq_max}
DT = 0.01


def path(**limits: np.ndarray) -> ActionPath:
    return ActionPath(HOME, **LIMITS | limits)


def run(policy: ActionPath, begin: float, end: float) -> np.ndarray:
    """Targets of every period, shape (n, 7)."""
    return np.array([policy.at(t)[0] for t in begin + DT * np.arange(round((end - begin) / DT))])


def excess(targets: np.ndarray) -> tuple[float, ...]:
    """Largest velocity, acceleration and jerk of targets, as multiples of the limits."""
    found, rows = [], targets
    for limit in LIMITS.values():
        rows = np.diff(rows, axis=0) / DT
        found.append(float((np.abs(rows) / limit).max()))
    return tuple(found)


def test_late_noisy_chunks_change_to_each_other_within_all_limits_and_without_a_stop() -> None:
    draw = np.random.default_rng(3)
    policy, targets, t = path(), [], 0.0
    for number in range(
        10
    ):  # 50 actions at 30 Hz, of what was seen 300 ms ago, each with an error of its own
        times = t - 0.3 + np.arange(50) / 30.0
        away = 0.5 * times[:, None] * np.eye(7)[6] + 0.1 * np.sin(2.0 * times)[:, None]
        chunk = HOME + away + draw.normal(0.0, 2e-3, (50, 7)) + draw.normal(0.0, 1e-2, 7)
        taken = policy.take(times, chunk, now=t + 0.02)
        assert taken.late == 10 and taken.begin == t + 0.02 and 0.0 < taken.smoothing < 0.01
        assert taken.blending < 1.0
        assert number == 0 or np.abs(policy.at(t + 0.6)[0] - chunk[27]).max() < 0.02, (
            "the actions are where they were"
        )
        targets.append(run(policy, t, t + 0.8))
        t += 0.8
    found = np.concatenate(targets)
    assert max(excess(found)) <= 1.0
    assert np.diff(found[100:, 6]).min() > 0.0, "A7, which goes on in every chunk, never stopped"


def test_feasible_actions_are_met_at_their_times() -> None:
    policy = path()
    times = np.arange(1, 101) / 20.0
    chunk = HOME + 0.2 * np.sin(times)[:, None]
    taken = policy.take(times, chunk, now=0.0)
    assert (taken.begin, taken.late, taken.smoothing) == (0.05, 0, 0.0)
    for t, q in list(zip(times, chunk))[40:]:
        assert np.abs(policy.at(t)[0] - q).max() < 1e-9
    assert max(excess(run(policy, 0.0, 8.0))) <= 1.0


def test_behind_the_last_action_it_brakes_and_rests_and_a_gap_in_between_is_the_same() -> None:
    policy = path()
    times = np.arange(40) / 20.0
    policy.take(times, HOME + 0.3 * times[:, None], now=0.0)
    targets = run(policy, 0.0, 4.0)
    assert max(excess(targets)) <= 1.0
    assert np.abs(policy.at(4.0)[1]).max() == 0.0 and np.abs(targets[-1] - targets[-50]).max() == 0.0
    assert 0.0 < policy.at(4.0)[0][0] - (HOME[0] + 0.3 * times[-1]) < 0.1, "by the way that braking takes"
    later = policy.take(5.0 + times, HOME - 0.1 * times[:, None], now=4.0)
    assert later.begin == 5.0 and (policy.at(4.99)[0] == policy.at(4.5)[0]).all(), "it rests until it begins"
    assert max(excess(run(policy, 4.0, 8.0))) <= 1.0


def test_a_step_in_the_actions_is_smoothed_and_what_no_joint_can_follow_is_refused() -> None:
    policy, times = path(), np.arange(60) / 30.0
    step = HOME + np.where(times > 1.0, 0.1, 0.0)[:, None]
    taken = policy.take(times, step, now=0.0)
    assert 0.01 < taken.smoothing < 0.08
    assert max(excess(run(policy, 0.0, 4.0))) <= 1.0
    before = run(policy, 0.5, 1.5)
    with pytest.raises(LimitError, match=r"needs 3 rad/s of A4, also smoothed; at most 0\.524"):
        policy.take(times + 0.5, HOME + 3.0 * times[:, None], now=0.6)
    with pytest.raises(LimitError, match=r"must have actions after 9\.000 s, got the last one at 1\.967 s"):
        policy.take(times, step, now=9.0)
    assert (run(policy, 0.5, 1.5) == before).all(), "the last chunk goes on"


def test_one_action_is_a_goal_and_a_restart_brakes() -> None:
    policy = path()
    policy.take(np.array([0.5]), HOME[None] + 0.2, now=0.0)
    targets = run(policy, 0.0, 4.0)
    assert max(excess(targets)) <= 1.0 and np.abs(targets[-1] - HOME - 0.2).max() < 1e-9
    policy.restart(5.0, HOME, 0.3 * np.ones(7))
    assert np.abs(policy.at(5.0)[1] - 0.3).max() < 1e-9 and not policy.at(7.0)[1].any()
    assert max(excess(run(policy, 5.0, 7.0))) <= 1.0


def test_times_of_actions_are_checked() -> None:
    assert np.allclose(action_times(1.0, 3, rate=10.0), [1.0, 1.1, 1.2])
    assert action_times([1.0, 1.5], 2, rate=10.0).tolist() == [1.0, 1.5]
    with pytest.raises(ShapeError, match="one time or one for each of the 3 actions"):
        action_times([1.0, 2.0], 3, rate=10.0)
    with pytest.raises(LimitError, match="must ascend"):
        action_times([1.0, 1.0], 2, rate=10.0)
    with pytest.raises(LimitError, match="at must be finite"):
        action_times(np.nan, 2, rate=10.0)


def test_a_target_that_is_refused_ends_the_chunk_at_the_last_good_one_and_the_next_call_has_the_reason() -> (
    None
):
    sent: list[np.ndarray] = []

    def send(q: np.ndarray, _: np.ndarray) -> None:
        if q[6] > HOME[6] + 0.05:
            raise CollisionForeseen("too near", parameter="q")
        sent.append(q)

    clock = RealClock()
    began = clock.nanos()
    stream = ActionStream(
        path(), send, time=lambda: (clock.nanos() - began) * 1e-9, clock=clock, period=0.005, ahead=0.02
    )
    try:
        times = 0.1 + np.arange(20) / 20.0
        chunk = HOME + 0.3 * (times - 0.1)[:, None] * np.eye(7)[6]
        stream.take(times, chunk, last=(HOME, np.zeros(7)))
        deadline = time.monotonic() + 30.0
        while len(sent) < 3 or (sent[-1] != sent[-3]).any() or sent[-1][6] < HOME[6] + 0.02:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        count = len(sent)
        with pytest.raises(CollisionForeseen, match="too near"):
            stream.take(times + 60.0, chunk, last=(sent[-1], np.zeros(7)))
        while len(sent) < count + 5:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        assert (sent[-1] == sent[count - 1]).all(), "it goes on sending, so that no watchdog stops the arm"
        assert stream.take(times + 60.0, HOME + 0.0 * chunk, last=(sent[-1], np.zeros(7))).late == 0
    finally:
        stream.close()


@pytest.fixture(scope="module")
def arm(cabinet: RunningCabinet) -> Iterator[ha.Arm]:
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        yield arm


@pytest.mark.slow
def test_a_person_takes_over_from_a_policy_and_hands_back_and_the_recording_shows_when(
    arm: ha.Arm, tmp_path: Path
) -> None:
    arm.move(ha.ptp(HOME), speed=1.0)
    is_held = [False]
    person = devices.synthetic(
        lambda _: devices.DeviceInput.of([0, 0, 1.0, 0, 0, 0], ["LEFT"] if is_held[0] else []),
        roles=devices.Roles(dead_man="LEFT"),
    )
    goal, z = HOME + 0.25 * np.eye(7)[6], arm.state.pose.z
    with (
        arm.record(tmp_path / "run.mcap"),
        arm.servo("joint", rate=50, speed=0.5, acceleration=0.5, watchdog=2.0) as sv,
    ):
        takeover = skills.Takeover(arm, sv, person, scale=0.1)
        late: list[tuple[float, int]] = []
        turn = "the policy's"
        while sv.tick() is not None and sv.t < 60.0 and np.abs(arm.state.q - goal).max() > 2e-3:
            if turn == "the policy's" and arm.state.q[6] > 0.05:
                turn, is_held[0] = "the person's", True
            elif turn == "the person's" and arm.state.pose.z > z + 0.02:
                turn, is_held[0] = "the policy's again", False
            if not takeover.corrects() and (not late or sv.t > late[-1][0] + 0.3):
                now = sv.t  # seen 0.1 s ago; from where the arm is commanded, in 0.8 s to the goal
                part = np.clip(np.linspace(0.0, 2.0, 40), 0.0, 1.0)[:, None]
                taken = sv.follow(sv.target[0] + part * (goal - sv.target[0]), at=now - 0.1, rate=25.0)
                late.append((now, taken.late))
        assert np.abs(arm.state.q - goal).max() <= 2e-3, sv.stats
        sv.hold()
    assert turn == "the policy's again"
    assert all(count >= 2 for _, count in late) and sv.stats.refused == 0
    run = ha.load(tmp_path / "run.mcap")
    ((begin, end),) = run.corrections
    assert 0.0 < begin < end < run.duration
    inside = (run.t >= begin) & (run.t <= end)
    assert run["pose"][inside][-1, 2] > run["pose"][inside][0, 2] + 0.01


@pytest.mark.slow
def test_poses_are_followed_and_what_is_no_chunk_is_refused(arm: ha.Arm) -> None:
    arm.move(ha.ptp(HOME), speed=1.0)
    with arm.servo("pose", rate=50, speed=0.5, acceleration=0.5, watchdog=2.0) as sv:
        start = sv.start.pose
        goal = ha.Pose.of(start.xyz + [0.0, 0.06, -0.04], start.quat)
        chunk = [
            ha.Pose.of(start.xyz + part * (goal.xyz - start.xyz), start.quat)
            for part in np.linspace(0, 1, 40)
        ]
        far = [*chunk[:3], ha.Pose.of([3.0, 0, 0], start.quat)]
        with pytest.raises(ha.Unreachable, match=r"chunk\[3\]: "):
            sv.follow(far, at=sv.t, rate=25.0)
        with pytest.raises(ShapeError, match="1 to 10000 poses"):
            sv.follow(goal, at=sv.t)  # type: ignore[arg-type]
        sv.follow(chunk, at=sv.t, rate=25.0)
        arm.wait_until(lambda state: state.pose.distance_to(goal) < 2e-3, timeout=60.0)
    with (
        arm.servo("lin", watchdog=2.0) as line,
        pytest.raises(ha.CommandRejected, match="takes poses by set alone"),
    ):
        line.follow([line.start.pose], at=line.t)
    with arm.servo("joint", watchdog=2.0) as joints:
        with pytest.raises(ShapeError, match=r"chunk must have shape \(n, 7\)"):
            joints.follow([0.0] * 7, at=joints.t)
        with pytest.raises(LimitError, match="finite"):
            joints.follow([[np.nan] * 7], at=joints.t)
