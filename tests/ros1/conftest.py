"""Tests with a roscore and rospy; without them no test is collected, and `make test-ros1` reports it."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.conformance import logs, parts
from tests.conformance.stage import Stage

if TYPE_CHECKING:
    from tests.ros1.peer import Client, NodeProcess

collect_ignore_glob = [] if importlib.util.find_spec("rospy") else ["test_*.py"]

os.environ.pop("HEPTARM_TARGET", None)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the tests of the other parts; ROS 1 is older than what Python calls deprecated."""
    parts.select(config, items)
    for item in items:
        if item.path.parent == Path(__file__).parent:
            for module in ("rospy", "rosgraph", "actionlib", "genpy", "control_msgs"):
                item.add_marker(pytest.mark.filterwarnings(f"ignore::DeprecationWarning:{module}"))
                item.add_marker(pytest.mark.filterwarnings(f"ignore::ResourceWarning:{module}"))
            # rospy leaves sockets of ended connections to the garbage collector; other leaks fail a test
            unclosed = "ignore:Exception ignored in. <socket.socket:pytest.PytestUnraisableExceptionWarning"
            item.add_marker(pytest.mark.filterwarnings(unclosed))


def pytest_sessionfinish(exitstatus: int) -> None:
    """Delete the logs of nodes."""
    logs.delete(exitstatus)


@pytest.fixture(scope="session")
def stage() -> Iterator[Stage]:
    """A virtual iiwa 14 with injectable faults."""
    running = Stage()
    yield running
    running.close()


@pytest.fixture(scope="session")
def spare(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stage]:
    """A second one, with a workpiece template, for tests that start a node of their own; they release its control."""
    project = tmp_path_factory.mktemp("project") / "RoboticsAPI.data.xml"
    box = '<workpieceTemplate class="" name="Box"><loadData mass="0.3"/></workpieceTemplate>'
    project.write_text(f"<objectTemplates>{box}</objectTemplates>")
    running = Stage("--project", str(project))
    yield running
    running.close()


@pytest.fixture(scope="session")
def ros() -> Iterator[None]:
    """A private roscore, and this process as a node of it."""
    from tests.ros1.peer import Core

    with Core("tester"):
        yield


@pytest.fixture(autouse=True)
def _forget(request: pytest.FixtureRequest) -> Iterator[None]:
    """Subscriptions of a test end with it."""
    from tests.ros1.peer import collected, forget

    before = collected()
    yield
    forget(before)


@pytest.fixture(scope="session")
def node(ros: None, stage: Stage) -> Iterator[NodeProcess]:
    """The node of ROS 1 for most tests, active."""
    from tests.ros1.peer import NodeProcess

    running = NodeProcess(stage.target, execution=os.environ.get("EXECUTION", "servo"))
    yield running
    assert running.end() == 0, running.said


@pytest.fixture(scope="session")
def _client(stage: Stage, node: NodeProcess) -> Client:
    from tests.ros1.peer import Client

    client = Client(stage)
    client.ready()
    return client


@pytest.fixture
def client(_client: Client) -> Iterator[Client]:
    """A client of the shared node; restores everything afterwards."""
    from tests.conformance.case import rests

    yield _client
    _client.behave("follows")
    _client.override(1.0)
    assert _client.reset()
    rests(_client)
