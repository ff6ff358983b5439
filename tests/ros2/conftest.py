"""Tests with rclpy; without it no test is collected, and `make test-ros2` reports it."""

from __future__ import annotations

import importlib.util
import os
import socket
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import pytest

from tests.conformance import logs, parts
from tests.conformance.stage import Stage

if TYPE_CHECKING:
    from tests.ros2.peer import Client, NodeProcess, Ros


def free_domain(first: int) -> tuple[int, socket.socket]:
    """A domain that no other run on this machine uses, and the lock that reserves it until this process ends."""
    for number in range(first, first + 101):
        held = socket.socket(socket.AF_UNIX)
        try:
            held.bind(f"\0heptarm-ros-domain-{number % 101}")
        except OSError:
            held.close()
            continue
        return number % 101, held
    raise OSError("all domains of ROS 2 are taken")


collect_ignore_glob = [] if importlib.util.find_spec("rclpy") else ["test_*.py"]

# a run's own domain on this machine: it neither sees nor disturbs others; children inherit it
_domain, _held = free_domain(os.getpid())
os.environ["ROS_DOMAIN_ID"] = str(_domain)
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["FASTDDS_BUILTIN_TRANSPORTS"] = "UDPv4"  # killed processes leave no shared memory behind
os.environ["ROS_LOG_DIR"] = str(logs.folder())
os.environ.pop("HEPTARM_TARGET", None)


def pytest_configure(config: pytest.Config) -> None:
    """Lets the message generators, which rclpy imports, use deprecated features of Python."""
    config.addinivalue_line("filterwarnings", "ignore:module 'sre_:DeprecationWarning")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the tests of the other parts, where the environment selects one."""
    parts.select(config, items)


def pytest_sessionfinish(exitstatus: int) -> None:
    """Delete the logs of nodes."""
    logs.delete(exitstatus)


def pytest_unconfigure() -> None:
    """Gives the domain back."""
    _held.close()


@pytest.fixture(scope="session")
def stage() -> Iterator[Stage]:
    """A virtual iiwa 14 with injectable faults."""
    running = Stage()
    yield running
    running.close()


@pytest.fixture(scope="session")
def spare() -> Iterator[Stage]:
    """A second one, for tests that start a node of their own; they release its control."""
    running = Stage()
    yield running
    running.close()


@pytest.fixture
def nodes() -> Iterator[Callable[..., NodeProcess]]:
    """Starts further nodes for one test; they must end well."""
    from tests.ros2.peer import PATIENT, NodeProcess

    running: list[NodeProcess] = []

    def start(target: str, **words: object) -> NodeProcess:
        running.append(NodeProcess(target, **(PATIENT | words)))
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


@pytest.fixture(autouse=True)
def _forget(request: pytest.FixtureRequest) -> Iterator[None]:
    """Subscriptions of a test end with it."""
    ros: Ros | None = request.getfixturevalue("ros") if "ros" in request.fixturenames else None
    before = 0 if ros is None else ros.collected
    assert ros is None or ros.serves, "the node of the tests is served no more: an earlier error ended it"
    yield
    if ros is not None:
        ros.forget(before)


@pytest.fixture(scope="session")
def node(stage: Stage) -> Iterator[NodeProcess]:
    """The node of ROS 2 for most tests, active."""
    from tests.ros2.peer import PATIENT, NodeProcess

    execution = os.environ.get("EXECUTION", "servo")
    running = NodeProcess(stage.target, execution=execution, moveit=True, **PATIENT)
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
    """A client of the shared node; restores everything afterwards."""
    from tests.conformance.case import rests

    yield _client
    _client.restore()
    rests(_client)
