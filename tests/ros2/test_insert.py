"""A policy with contacts over ROS 2: the example takes a peg out of its holder, and the node `reach` inserts it."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable, Iterator

import pytest

from tests.conformance import logs
from tests.conformance.stage import ROOT, Stage
from tests.ros2.peer import PATIENCE, Client, NodeProcess, Ros

GRIPPER = {
    "gripper__open": "OutputX3Pin1",
    "gripper__close": "OutputX3Pin2",
    "gripper__is_open": "InputX3Pin3",
    "gripper__is_closed": "InputX3Pin4",
}


@pytest.fixture
def place() -> Iterator[Stage]:
    running = Stage("--scene", "peg-in-hole")
    yield running
    running.close()


@pytest.fixture
def policy() -> Iterator[Callable[[], str]]:
    """The node of the policy; returns its log."""
    log = logs.new()
    command = [sys.executable, "-m", "heptarm_ros2.reach"]
    command += ["--ros-args", "-p", "policy:=peg-in-hole", "-r", "__ns:=/bench"]
    with log.open("w") as file:
        process = subprocess.Popen(command, stdout=file, stderr=subprocess.STDOUT)
    yield log.read_text
    process.terminate()
    process.wait(PATIENCE)


@pytest.mark.long  # what decides is in tests/rl/test_contact_follower.py
def test_the_example_inserts_a_peg(
    place: Stage, ros: Ros, nodes: Callable[..., NodeProcess], policy: Callable[[], str]
) -> None:
    nodes(place.target, space="/bench", **GRIPPER)
    Client(ros, place, "/bench/heptarm").ready()
    done = subprocess.run(
        [sys.executable, str(ROOT / "examples" / "ros2" / "insert.py"), "--ros-args", "-r", "__ns:=/bench"],
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    found = re.search(r"([\d.]+) mm are missing", done.stdout)
    assert found and float(found[1]) < 1.5, done.stdout + policy()
    assert "episode ended by success" in policy()
