"""A policy with contacts behind messages: zeroing, an episode by the robot's clock, and what ends it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from heptarm.errors import CommandRejected, LimitError, NotReady
from heptarm.rl.contact.follower import ContactFollower
from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.contact.pick_place import PickPlace
from heptarm.rl.contact.pilot import ContactPilot
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.deploy_contact import ContactSettings
from heptarm.rl.policy import Policy, shipped, shipped_contact
from heptarm.values.pose import Pose

HOLE = Pose.of((0.6, 0.1, 0.24), (0.0, 1.0, 0.0, 0.0))
START = HOLE.shifted(z=-0.004, frame="tool")
TICK = 10_000_000
#: What the torque sensors show of an arm that touches nothing.
OFFSET = np.array([1.0, -2.0, 3.0, 0.1, 0.0, -0.1])


class Bench:
    """An arm that goes where it is sent, its states 100 times a second."""

    def __init__(self, follower: ContactFollower) -> None:
        self.follower, self.tip, self.stamp = follower, START, 0
        self.sent: list[Pose] = []
        self.state()

    def state(self, load: Any = OFFSET) -> None:
        self.follower.on_state(self.tip, load, self.stamp, self.stamp * 1e-9)

    def tick(self, load: Any = OFFSET) -> Pose | None:
        self.stamp += TICK
        self.state(load)
        pose = self.follower.command(self.stamp * 1e-9)
        if pose is not None:
            self.sent.append(pose)
            self.tip = pose
        return pose


@pytest.fixture
def bench() -> Bench:
    return Bench(ContactFollower(shipped_contact(PegInHole)))


def test_it_waits_for_the_zero_and_goes_to_the_depth_where_nothing_is_met(bench: Bench) -> None:
    assert np.isnan(bench.follower.distance) and bench.tick() is None
    bench.follower.on_target(HOLE)
    assert [bench.tick() for _ in range(49)] == [None] * 49  # half a second
    while not bench.follower.ended:
        bench.tick()
    steps = [a.distance_to(b) for a, b in zip(bench.sent, bench.sent[1:], strict=False)]
    assert bench.follower.ended == "success" and bench.follower.distance < bench.follower.task.radius
    assert max(steps) <= bench.follower.task.step * 3**0.5 / 5 + 1e-9  # evenly between two decisions
    assert bench.tick() is None


def test_an_arm_that_moves_is_not_zeroed(bench: Bench) -> None:
    bench.follower.on_target(HOLE)
    for index in range(120):
        bench.tip = START.shifted(z=-0.002 * (index % 2), frame="tool")
        assert bench.tick() is None


def test_a_force_silence_and_a_hold_end_it(bench: Bench) -> None:
    def begun() -> None:
        bench.tip = START
        bench.state()
        bench.follower.on_target(HOLE)
        while bench.tick() is None:
            pass

    begun()
    bench.tick(OFFSET + [0.0, 0.0, 61.0, 0.0, 0.0, 0.0])
    assert bench.follower.ended == "force" and bench.tick() is None
    begun()
    now = bench.stamp * 1e-9
    assert bench.follower.command(now + 0.3) is None and bench.follower.ended == ""
    assert bench.tick() is not None  # it goes on
    assert bench.follower.command(now + 2.5) is None and bench.follower.ended == "stale"
    begun()
    bench.follower.on_target(None)
    assert bench.tick() is None and bench.follower.ended == ""


def test_what_cannot_begin_is_refused(bench: Bench) -> None:
    with pytest.raises(LimitError, match="the tip must be in the box"):
        bench.follower.on_target(HOLE.shifted(z=0.1))
    with pytest.raises(NotReady, match="no robot state"):
        ContactFollower(shipped_contact(PegInHole)).check(HOLE)
    with pytest.raises(CommandRejected, match="of a task with contacts, got one of reach"):
        ContactFollower(shipped())
    with pytest.raises(CommandRejected, match="must need neither gripper"):
        ContactFollower(constant(PickPlace(), 0.0))


def test_nothing_is_kept_while_it_waits_for_a_target(bench: Bench) -> None:
    for _ in range(1000):
        bench.tick()
    assert not bench.follower._loads
    bench.follower.on_target(HOLE)
    assert [bench.tick() for _ in range(49)] == [None] * 49 and bench.tick() is not None


def test_a_policy_that_diverges_ends_its_episode() -> None:
    bench = Bench(ContactFollower(constant(shipped_contact(PegInHole).task, np.nan)))
    bench.follower.on_target(HOLE)
    with pytest.raises(CommandRejected, match="finite"):
        for _ in range(60):
            bench.tick()
    assert bench.follower.ended == "failure" and bench.tick() is None


def test_an_episode_may_take_longer_than_in_training() -> None:
    still = constant(PegInHole(), 0.0)

    def lasts(settings: ContactSettings) -> float:
        bench = Bench(ContactFollower(still, settings=settings))
        bench.follower.on_target(HOLE)
        while not bench.follower.ended:
            bench.tick()
        assert bench.follower.ended == "time"
        return len(bench.sent) * TICK * 1e-9

    assert lasts(ContactSettings()) == pytest.approx(2 * PegInHole().steps / PegInHole().rate, abs=0.02)
    assert lasts(ContactSettings(seconds=4.0)) == pytest.approx(4.0, abs=0.02)
    with pytest.raises(LimitError, match=r"seconds must be in \[0.5, 600\] s, got 1000 s"):
        ContactSettings(seconds=1000.0)


def constant(task: ContactTask, action: float) -> Policy[Any]:
    """A policy that always returns the same."""
    ins, outs = task.observation_size, task.action_size
    layers: Any = [(np.zeros((ins, outs)), np.full(outs, action))]
    return Policy(task, layers=layers, mean=np.zeros(ins), std=np.ones(ins))


def test_on_an_arm_a_policy_sees_its_joint_positions() -> None:
    task = PegInHole(observation=("joints", "pose"), history=(0, 1))
    pilot = ContactPilot(constant(task, 0.0))
    model, first, second = task.model, np.full(7, 0.1), np.full(7, 0.2)
    pilot.begin(np.zeros(6), np.zeros(6), {}, q=first)
    pilot.measure(np.zeros(6), np.zeros(6), {}, q=second)
    seen = task.observe(np.array(pilot._frames)).reshape(2, task.frame_size)[:, :7]
    scaled = [(q - model.q_min) / (model.q_max - model.q_min) * 2.0 - 1.0 for q in (second, first)]
    assert seen == pytest.approx(np.array(scaled))
    with pytest.raises(CommandRejected, match="joint positions"):
        ContactFollower(constant(task, 0.0))
