"""The action `calibrate` on a virtual cabinet with a load that it does not know, no ROS; pictures of a topic."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

import heptarm as ha
from heptarm import calibration
from heptarm.errors import CommandRejected, ShapeError
from heptarm.io.targets import SavedTarget, add_target, saved_targets
from heptarm.ros.interface.calibration import EYE, LOAD, TCP, calibrate
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.pictures import ImageFeed, pixels_of
from heptarm.ros.interface.topics import camera_image
from heptarm.ros.node.driver import Driver
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.ros.trajectory.goal import GoalOutcome
from tests.simulators import FASTER

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)


class Client:
    """Takes feedback."""

    def __init__(self) -> None:
        self.feedback: list[Mapping[str, Any]] = []

    def publish_feedback(self, fields: Mapping[str, Any]) -> None:
        """Take feedback."""
        self.feedback.append(fields)

    def is_cancel_requested(self) -> bool:
        """Never."""
        return False


@pytest.fixture(scope="module")
def context(tmp_path_factory: pytest.TempPathFactory) -> Iterator[NodeContext]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CONFIG_HOME", str(tmp_path_factory.mktemp("config")))
        add_target(SavedTarget("lab1", f"sim://iiwa14?speed={FASTER:g}&payload=2,0.01,-0.02,0.08"))
        driver = Driver(
            NodeConfiguration.of({"target": "lab1", "speed": 1.0, "state_rate": 200.0, "watchdog": 5.0}),
            MagicMock(),
        )
        driver.activate()
        driver.arm.move(ha.ptp(HOME), speed=1.0)
        yield NodeContext(driver, MagicMock())
        driver.close()


def goal(kind: int, **fields: Any) -> Any:
    """A goal with the defaults of ROS."""
    given: dict[str, Any] = dict.fromkeys(("speed", "radius", "tip_radius", "square"), 0.0)
    given |= dict.fromkeys(("count", "columns", "rows"), 0) | dict.fromkeys(("save", "frame", "board"), "")
    given |= {"dry_run": False, "inertia": False, "lens": [], "surface": SimpleNamespace(x=0.0, y=0.0, z=0.0)}
    return SimpleNamespace(**given | {"kind": kind} | fields)


def message(pixels: np.ndarray, encoding: str, *, padding: int = 0) -> Any:
    """A sensor_msgs/Image."""
    height, width = pixels.shape[:2]
    rows = np.pad(pixels.reshape(height, -1), ((0, 0), (0, padding)))
    return SimpleNamespace(
        encoding=encoding, height=height, width=width, step=rows.shape[1], data=rows.tobytes()
    )


def test_what_moves_is_reported_first_and_a_load_goes_into_the_saved_target(context: NodeContext) -> None:
    client, before = Client(), context.arm.state.q_cmd
    shown = calibrate(context, goal(LOAD, dry_run=True, save="gripper"))(client)
    assert shown.outcome is GoalOutcome.SUCCEEDED and "A1 to A3 stay" in shown.text
    assert client.feedback == [{"plan": shown.text}]
    np.testing.assert_allclose(context.arm.state.q_cmd, before, atol=1e-6)
    assert not saved_targets()["lab1"].tools

    client = Client()
    result = calibrate(context, goal(LOAD, speed=1.0, save="gripper"))(client)
    assert result.outcome is GoalOutcome.SUCCEEDED, result.text
    assert result.fields["mass"] == pytest.approx(2.0, abs=0.04) and result.fields["saved"]
    assert "A1 to A3 stay" in client.feedback[0]["plan"] and client.feedback[-1]["done"] == 9
    (tool,) = saved_targets()["lab1"].tools
    assert tool.name == "gripper" and tool.mass == result.fields["mass"]


def test_a_tip_that_is_not_over_its_surface_moves_nothing(context: NodeContext) -> None:
    client = Client()
    result = calibrate(context, goal(TCP, tip_radius=0.004))(client)
    assert (
        result.outcome is GoalOutcome.ABORTED and "the tip must be 2 to 50 mm over the plane" in result.text
    )
    assert not client.feedback


def test_a_camera_that_does_not_see_the_board_moves_nothing(context: NodeContext) -> None:
    picture = np.full((120, 160, 3), 200, np.uint8)
    done = threading.Event()

    def publish() -> None:
        while not done.wait(0.02):
            camera_image(context, message(picture, "rgb8"))

    publisher = threading.Thread(target=publish, daemon=True)
    publisher.start()
    try:
        result = calibrate(context, goal(EYE, dry_run=True))(Client())
    finally:
        done.set()
        publisher.join()
    assert result.outcome is GoalOutcome.ABORTED and "does not see the board" in result.text


def test_what_makes_no_sense_is_refused_at_once(
    context: NodeContext, monkeypatch: pytest.MonkeyPatch
) -> None:
    for bad, words in (
        (goal(7), "kind must be"),
        (goal(EYE, board="checkers"), "kind must be"),
        (goal(EYE, lens=[1.0]), "lens must be fx fy cx cy"),
        (goal(TCP, radius=-1.0), "radius must be"),
    ):
        with pytest.raises(ha.HeptarmError, match=words):
            calibrate(context, bad)
    monkeypatch.setattr(context.driver, "configuration", NodeConfiguration.of({"target": "172.31.1.147"}))
    with pytest.raises(CommandRejected, match="is no saved target"):
        calibrate(context, goal(LOAD, save="gripper"))


def test_pictures_of_a_topic_are_converted() -> None:
    red = np.zeros((4, 6, 3), np.uint8)
    red[:, :, 0] = 255
    np.testing.assert_array_equal(pixels_of(message(red, "rgb8", padding=2)), red)
    np.testing.assert_array_equal(pixels_of(message(red[:, :, ::-1], "bgr8")), red)
    assert pixels_of(message(red[:, :, :1], "mono8")).shape == (4, 6)
    with pytest.raises(ShapeError, match="encoding must be one of .* got '16UC1'"):
        pixels_of(message(red, "16UC1"))
    broken = message(red, "rgb8")
    broken.data = broken.data[:-1]
    with pytest.raises(ShapeError, match="data must have 4 rows of 6 pixels"):
        pixels_of(broken)
    feed = ImageFeed()
    feed.put(message(red, "rgb8"))
    first = feed.read()
    assert feed.read() is first, "nothing new"
    board = calibration.Board()
    feed.put(message(np.pad(board.picture(pixels=40), 40, constant_values=255), "mono8"))
    sighting = board.find(feed.read())
    assert sighting is not None and len(sighting) == len(board.points)
