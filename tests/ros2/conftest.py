"""Tests with real rclpy; in an environment without it they are not there, and `make test-ros2` says so."""

from __future__ import annotations

import importlib.util
import os
import tempfile
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from tests.conformance.stage import Stage

if TYPE_CHECKING:
    from tests.ros2.peer import Client, NodeProcess, Ros

collect_ignore_glob = [] if importlib.util.find_spec("rclpy") else ["test_*.py"]

# a run's own domain on this machine: it neither sees nor disturbs others; children inherit it
os.environ["ROS_DOMAIN_ID"] = str(os.getpid() % 101)
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["ROS_LOG_DIR"] = tempfile.mkdtemp(prefix="ros-log-")
os.environ.pop("HEPTARM_TARGET", None)


def pytest_configure(config: pytest.Config) -> None:
    """Lets the message generators, which rclpy imports, use what Python is about to drop."""
    config.addinivalue_line("filterwarnings", "ignore:module 'sre_:DeprecationWarning")


@pytest.fixture(scope="session")
def stage() -> Iterator[Stage]:
    """A virtual iiwa 14 with a hand on its faults."""
    running = Stage()
    yield running
    running.close()


@pytest.fixture
def own_stage() -> Iterator[Stage]:
    """The same for one test alone."""
    running = Stage()
    yield running
    running.close()


@pytest.fixture(scope="session")
def ros() -> Iterator[Ros]:
    """A node of the tests'."""
    from tests.ros2.peer import Ros

    running = Ros()
    yield running
    running.close()


@pytest.fixture(scope="session")
def node(stage: Stage) -> Iterator[NodeProcess]:
    """The node of ROS 2 for most tests, active."""
    from tests.ros2.peer import NodeProcess

    running = NodeProcess(stage.target)
    yield running
    assert running.end() == 0, running.said


@pytest.fixture(scope="session")
def _client(ros: Ros, stage: Stage, node: NodeProcess) -> Client:
    from tests.ros2.peer import Client

    client = Client(ros, stage)
    client.ready()
    return client


@pytest.fixture
def client(_client: Client) -> Iterator[Client]:
    """A client of the shared node; everything is as at the start afterwards."""
    from tests.conformance.cases import rests

    yield _client
    _client.behave("follows")
    _client.override(1.0)
    assert _client.set(**DEFAULTS)
    rests(_client)


#: What cases change.
DEFAULTS: dict[str, object] = {
    "max_deceleration_on_cancel": 2.0,
    "allow_nonzero_velocity_at_trajectory_end": False,
    "allow_partial_joints_goal": False,
    "constraints__goal_time": 2.0,
    "constraints__stopped_velocity_tolerance": 0.02,
    "constraints__A7__trajectory": 0.0,
}
