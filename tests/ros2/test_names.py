"""Programs written for other drivers, with those drivers' own types."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from tests.conformance import names
from tests.conformance.stage import Stage
from tests.ros2.peer import PATIENT, NodeProcess, Ros
from tests.ros2.test_surface import Client


@pytest.fixture
def other(ros: Ros, spare: Stage, request: pytest.FixtureRequest) -> Iterator[Client]:
    """A node with the names of the driver that the test is for."""
    node = NodeProcess(spare.target, space="/other", names=request.param, speed=0.6, **PATIENT)
    yield Client(ros, "/other")
    node.finish()


@pytest.mark.parametrize("other", ["libiiwa"], indirect=True)
def test_a_program_for_libiiwa(other: Client) -> None:
    names.a_program_for_libiiwa(other)
    names.servo_of_libiiwa(other)


@pytest.mark.parametrize("other", ["lbr_stack"], indirect=True)
def test_a_program_for_lbr_stack(other: Client) -> None:
    names.a_program_for_lbr_stack(other)
    names.a_tool_for_controllers(other)


def test_types_have_the_fields_of_the_other_drivers() -> None:
    """Every type of a preset is generated, and has a hash by which two machines compare it."""
    for package in ("libiiwa_msgs", "lbr_fri_idl", "controller_manager_msgs"):
        described = sorted((Path(sys.prefix) / "share" / package).rglob("*.json"))
        assert described
        for path in described:
            hashes = yaml.safe_load(path.read_text())["type_hashes"]
            assert all(one["hash_string"].startswith("RIHS01_") for one in hashes), path
