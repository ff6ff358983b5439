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


@pytest.fixture(scope="module")
def libiiwa(ros: Ros, spare: Stage) -> Iterator[Client]:
    node = NodeProcess(spare.target, space="/libiiwa", names="libiiwa", speed=0.6, **PATIENT)
    yield Client(ros, "/libiiwa")
    node.finish()


def test_a_program_for_libiiwa(libiiwa: Client) -> None:
    names.a_program_for_libiiwa(libiiwa)


def test_a_stream_for_libiiwa(libiiwa: Client) -> None:
    names.servo_of_libiiwa(libiiwa)


def test_a_program_for_lbr_stack(ros: Ros, spare: Stage) -> None:
    node = NodeProcess(spare.target, space="/other", names="lbr_stack", **PATIENT)
    names.a_program_for_lbr_stack(Client(ros, "/other"))
    node.finish()


def test_types_have_the_fields_of_the_other_drivers() -> None:
    """Every type of a preset is generated, and has a hash by which two machines compare it."""
    share = Path(sys.prefix) / "share"
    for package in ("libiiwa_msgs", "lbr_fri_idl"):
        described = sorted((share / package).rglob("*.json"))
        assert described
        for path in described:
            hashes = yaml.safe_load(path.read_text())["type_hashes"]
            assert all(one["hash_string"].startswith("RIHS01_") for one in hashes), path
