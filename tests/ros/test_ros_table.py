"""The reference of both nodes is generated from their sources; it must be up to date."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from heptarm.ros.interface.names import PRESETS
from heptarm.ros.node.parameters import PARAMETERS, NodeConfiguration

SCRIPT = Path(__file__).parents[2] / "scripts" / "ros_table.py"


@pytest.fixture(scope="module")
def table() -> Iterator[Any]:
    spec = importlib.util.spec_from_file_location("ros_table", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["ros_table"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["ros_table"]


@pytest.mark.parametrize("ros", ["ROS 1", "ROS 2"])
def test_everything_a_node_declares_is_on_the_page(table: Any, ros: str) -> None:
    page = table.PAGE.read_text(encoding="utf-8")
    found = table.declared(table.SOURCES[ros])
    assert len(found) >= 15 and ("action", "~/follow_joint_trajectory") in found
    missing = [name for _, name in found if f"`{name}`" not in page]
    missing += [one.name for one in PARAMETERS if f"`{one.name}`" not in page]
    assert not missing, "run .venv/bin/python scripts/ros_table.py"


def test_every_public_member_of_the_api_has_a_row_and_every_row_a_member(table: Any) -> None:
    assert set(table.API) == set(table.PARTS)
    for part in table.PARTS:
        there, reported = set(table.members(part)), set(table.API[part])
        assert there, part
        assert not there - reported, f"{part}: say in scripts/ros_api.py what these are in ROS, or why not"
        assert not reported - there, f"{part}: scripts/ros_api.py reports members that there are not"


@pytest.mark.parametrize("ros", ["ROS 1", "ROS 2"])
def test_what_the_rows_name_is_declared_by_both_nodes(table: Any, ros: str) -> None:
    declared = {name for _, name in table.declared(table.SOURCES[ros])}
    for part, rows in table.API.items():
        for member, entry in rows.items():
            assert entry, f"{part}.{member} has neither a name nor a reason"
            assert set(table.names_of(entry)) <= declared, f"{part}.{member}"


def test_every_service_topic_and_action_of_ours_is_reported_in_a_row(table: Any) -> None:
    reported = {
        name for rows in table.API.values() for entry in rows.values() for name in table.names_of(entry)
    }
    ours = {name for _, name in table.declared(table.SOURCES["ROS 2"])}
    assert ours - reported <= {
        "~/joint_trajectory",
        "~/query_state",
        "~/controller_state",
        "~/gripper_cmd",  # of the class TwoSignalGripper, which is no member of the arm
        "~/points",  # of CollisionModel, likewise
        "planning_scene",
        "collision_object",
        "attached_collision_object",
        "forward_position_controller/commands",
        "forward_velocity_controller/commands",
        "/tf",
    }  # ROS' own, and what Python does not need


def test_other_drivers_names_stand_for_ours(table: Any) -> None:
    ours = {name for _, name in table.declared(table.SOURCES["ROS 1"])}
    for preset in PRESETS.values():
        assert {entry.native for entry in preset.entries} <= ours
        assert NodeConfiguration.of(dict(preset.defaults)).joints
