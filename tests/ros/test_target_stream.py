"""Servo topics with an arm that only takes note of its targets: what is followed, and how far ahead of the arm."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from heptarm.errors import NotReady
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.ros.node.target_stream import TargetStream
from heptarm.values.checks import Array
from heptarm.values.robot import robot

HOME = np.array([0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0])
TIMEOUT = 0.1


class NotedServo:
    """A servo motion that takes note of its targets."""

    def __init__(self, arm: NotedArm) -> None:
        self._arm, self.active, self.result = arm, True, None
        self.start = SimpleNamespace(q=arm.q)

    def __enter__(self) -> NotedServo:
        self._arm.on_open()
        return self

    def set(self, q: Array, dq: Array | None = None) -> Array:
        self._arm.targets.append(q)
        return q

    def close(self) -> None:
        self.active = False
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
