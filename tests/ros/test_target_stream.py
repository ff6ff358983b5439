"""Servo topics with an arm that only takes note of its targets: what is followed, and how far ahead of the arm."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from heptarm.arm.motion.servo import JointServo
from heptarm.errors import NotReady
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.ros.node.target_stream import TargetStream
from heptarm.values.checks import Array
from heptarm.values.robot import robot

HOME = np.array([0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0])
TIMEOUT = 0.1


class NotedServo(JointServo):
    """A servo motion that takes note of its targets."""

    def __init__(self, arm: NotedArm) -> None:
        self._arm, self._active, self._result = arm, True, None
        self._start = cast(Any, arm.state)

    def __enter__(self) -> NotedServo:
        self._arm.on_open()
        return self

    def set(self, q: Any, dq: Any = None) -> Array:
        self._arm.targets.append(q)
        return cast(Array, q)

    def close(self) -> None:
        self._active = False
        self._arm.closed += 1


class NotedArm:
    """An arm that stays where a test puts it."""

    def __init__(self) -> None:
        self.robot, self.q, self.speed = robot("iiwa14"), HOME, 1.0
        self.targets: list[Array] = []
        self.closed = 0
        self.on_open: Any = lambda: None
        self.connection = SimpleNamespace(newest=lambda: self.state, real_time_factor=1.0)

    @property
    def state(self) -> Any:
        groups = SimpleNamespace(joints=SimpleNamespace())
        return SimpleNamespace(q=self.q, sampled=time.monotonic_ns(), groups=groups)

    def servo(self, kind: str, **settings: Any) -> NotedServo:
        return NotedServo(self)


@pytest.fixture
def arm() -> NotedArm:
    return NotedArm()


@pytest.fixture
def stream(arm: NotedArm) -> TargetStream:
    options = NodeConfiguration.of({}).servo
    return TargetStream(cast(Any, arm), timeout=TIMEOUT, options=options, shortest=0.1)


def test_messages_that_go_on_after_a_stop_are_followed_after_a_silence(
    arm: NotedArm, stream: TargetStream
) -> None:
    stream.joints(HOME)
    stream.hold_off()
    assert not stream.repeat()
    for _ in range(5):
        for send in (
            lambda: stream.joints(HOME),
            lambda: stream.velocity(np.zeros(7)),
            lambda: stream.twist(np.zeros(6)),
            stream.admit,
        ):
            with pytest.raises(NotReady, match="stopped"):
                send()
        time.sleep(0.4 * TIMEOUT)
    assert len(arm.targets) == 1
    time.sleep(1.5 * TIMEOUT)
    stream.joints(HOME)
    stream.velocity(np.zeros(7))
    assert len(arm.targets) == 3


def test_a_stop_while_a_servo_motion_opens_ends_it(arm: NotedArm, stream: TargetStream) -> None:
    arm.on_open = stream.hold_off
    with pytest.raises(NotReady, match="stopped"):
        stream.joints(HOME)
    assert not arm.targets and arm.closed == 1 and not stream.active


def test_velocities_stay_below_the_ceiling_of_the_arm(arm: NotedArm, stream: TargetStream) -> None:
    arm.speed = 0.25

    def follow() -> Any:
        if stream._path is not None:
            arm.q = stream._path.q
        return arm.state

    arm.connection.newest = follow
    fastest, end = 0.0, time.monotonic() + 0.5
    while time.monotonic() < end:
        stream.velocity(np.array([0, 0, 0, 0, 0, 0, 2.0]))
        assert stream._path is not None
        fastest = max(fastest, float(stream._path.dq[6]))
        time.sleep(5e-3)
    assert 0.2 * arm.robot.dq_max[6] < fastest < 0.25 * arm.robot.dq_max[6]


@pytest.mark.parametrize("kind", ["velocity", "twist"])
def test_an_arm_that_does_not_follow_has_no_far_target(
    arm: NotedArm, stream: TargetStream, kind: str
) -> None:
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        if kind == "velocity":
            stream.velocity(np.array([0, 0, 0, 0, 0, 0, 1.0]))
        else:
            stream.twist(np.array([0.0, 0.25, 0.0, 0.0, 0.0, 0.0]))
        time.sleep(5e-3)
    far = max(float(np.abs(q - HOME).max()) for q in arm.targets)
    assert 0.01 < far < 0.35
