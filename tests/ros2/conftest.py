"""Tests with real rclpy; in an environment without it they are not there, and `make test-ros2` says so."""

from __future__ import annotations

import importlib.util
import os
import tempfile
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import pytest

from tests.conformance.stage import Stage

if TYPE_CHECKING:
    from tests.ros2.peer import Client, NodeProcess, Ros

#: The machine may be busy.
PATIENT = {"servo__watchdog": 1.0, "watchdog": 5.0}
collect_ignore_glob = [] if importlib.util.find_spec("rclpy") else ["test_*.py"]

# a run's own domain on this machine: it neither sees nor disturbs others; children inherit it
os.environ["ROS_DOMAIN_ID"] = str(os.getpid() % 101)
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["FASTDDS_BUILTIN_TRANSPORTS"] = "UDPv4"  # killed processes leave no shared memory behind
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
def stages() -> Iterator[Callable[..., Stage]]:
    """Starts further cabinets for one test."""
    running: list[Stage] = []

    def start(*options: str) -> Stage:
        running.append(Stage(*options))
        return running[-1]

    yield start
    for one in running:
        one.close()


@pytest.fixture
def own_stage(stages: Callable[..., Stage]) -> Stage:
    """A cabinet for one test alone."""
    return stages()


@pytest.fixture
def nodes() -> Iterator[Callable[..., NodeProcess]]:
    """Starts further nodes for one test; they must end well."""
    from tests.ros2.peer import NodeProcess

    running: list[NodeProcess] = []

    def start(target: str, **words: object) -> NodeProcess:
        running.append(NodeProcess(target, **(PATIENT | words)))  # type: ignore[arg-type]
        return running[-1]

    yield start
    for one in running:
        one.finish()


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

    running = NodeProcess(stage.target, execution=os.environ.get("EXECUTION", "servo"), **PATIENT)
    yield running
    running.finish()


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
    _client.restore()
    rests(_client)
