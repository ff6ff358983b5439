"""A driver that cannot be made leaves neither a connection nor a thread: nodes try again and again."""

from __future__ import annotations

import threading
from unittest.mock import MagicMock

import pytest

from heptarm.errors import HeptarmError, LimitError
from heptarm.ros.node import driver as module
from heptarm.ros.node.driver import Driver
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values.robot import robot


@pytest.fixture
def arm(monkeypatch: pytest.MonkeyPatch) -> MagicMock:
    made = MagicMock(robot=robot("iiwa14"), speed=1.0)
    monkeypatch.setattr(module, "connect", lambda *_, **__: made)
    return made


def is_left(arm: MagicMock) -> bool:
    threads = {thread.name for thread in threading.enumerate()}
    return not arm.close.called or "heptarm-execution" in threads


def test_a_posture_outside_the_limits(arm: MagicMock) -> None:
    with pytest.raises(LimitError, match="A2"):
        Driver(NodeConfiguration.of({"servo.posture": "0 3 0 0 0 0 0"}), MagicMock())
    assert not is_left(arm)


def test_an_error_at_the_very_end(arm: MagicMock, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise HeptarmError("no states")

    monkeypatch.setattr(module, "ReconnectingStates", fail)
    with pytest.raises(HeptarmError, match="no states"):
        Driver(NodeConfiguration.of({}), MagicMock())
    assert not is_left(arm)
