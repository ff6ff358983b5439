"""A call of several motions in a thread: its result, its error, its end by repeated stops."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import pytest

from heptarm.errors import MotionAborted, NoContact, StaleState
from heptarm.ros.interface.action import wait_for_task
from heptarm.ros.node.task import ArmTask


class FakeArm:
    """An arm whose motions end when it is stopped; between them a stop hits none."""

    def __init__(self, deaf: int = 0) -> None:
        self.connected = True
        self.stops = 0
        self._deaf = deaf
        self._stopped = threading.Event()

    def stop(self) -> None:
        self.stops += 1
        if self.stops > self._deaf:
            self._stopped.set()

    def move(self) -> None:
        assert self._stopped.wait(60.0)
        raise MotionAborted("motion 1 was stopped")


def task(arm: Any, work: Any) -> ArmTask:
    return ArmTask(arm, "the touch", work)


def test_what_it_returns_and_what_it_raises() -> None:
    def fail() -> None:
        raise NoContact("nothing was touched")

    arm = FakeArm()
    good, bad = task(arm, lambda: 3), task(arm, fail)
    assert good.wait(60.0) and good.result() == 3 and good.done
    assert bad.wait(60.0)
    with pytest.raises(NoContact, match="nothing"):
        bad.result()
    good.end("too late")
    assert not good.end_reason and not arm.stops


@pytest.mark.parametrize("deaf", [0, 3])
def test_it_is_stopped_until_it_gives_up(deaf: int) -> None:
    arm = FakeArm(deaf)
    long = task(arm, arm.move)
    assert not long.wait(0.05)
    long.end("cancelled")
    long.end("something else")
    assert long.done and long.end_reason == "cancelled" and arm.stops == deaf + 1
    with pytest.raises(MotionAborted):
        long.result()


def test_a_goal_whose_client_fails_leaves_nothing_running() -> None:
    arm = FakeArm()
    long = task(arm, arm.move)
    client: Any = SimpleNamespace(is_cancel_requested=lambda: 1 / 0)

    def stale() -> None:
        raise StaleState("the newest state is 2 s old")  # no reason to end

    with pytest.raises(ZeroDivisionError):
        wait_for_task(long, client, stale)
    assert long.done and long.end_reason


def test_the_reason_is_known_before_another_stop_ends_it() -> None:
    arm = FakeArm()
    long = task(arm, arm.move)
    long.expect_end("stopped")
    arm.stop()
    assert long.wait(60.0) and long.end_reason == "stopped"
    long.expect_end("too late")
    assert long.end_reason == "stopped"
