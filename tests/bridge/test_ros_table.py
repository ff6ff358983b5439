"""The reference of both nodes is made from their sources; it must not fall behind them."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

from heptarm.arm.arm import Arm
from heptarm.bridge.names import PRESETS
from heptarm.bridge.parameters import PARAMETERS, Configuration

SCRIPT = Path(__file__).parents[2] / "scripts" / "ros_table.py"


@pytest.fixture(scope="module")
def table():
    spec = importlib.util.spec_from_file_location("ros_table", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules["ros_table"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["ros_table"]


@pytest.mark.parametrize("ros", ["ROS 1", "ROS 2"])
def test_everything_a_node_declares_is_on_the_page(table, ros: str) -> None:
    page = table.PAGE.read_text(encoding="utf-8")
    found = table.declared(table.SOURCES[ros])
    assert len(found) >= 15 and ("action", "~/follow_joint_trajectory") in found
    missing = [name for _, name in found if f"`{name}`" not in page]
    missing += [one.name for one in PARAMETERS if f"`{one.name}`" not in page]
    assert not missing, "run .venv/bin/python scripts/ros_table.py"


def test_the_table_knows_only_members_that_there_are(table) -> None:
    assert set(table.API) <= set(dir(Arm))


def test_other_drivers_names_stand_for_ours(table) -> None:
    ours = {name for _, name in table.declared(table.SOURCES["ROS 1"])}
    for preset in PRESETS.values():
        assert {entry.ours for entry in preset.entries} <= ours
        assert Configuration.of(dict(preset.defaults)).joints
