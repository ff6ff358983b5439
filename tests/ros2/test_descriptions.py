"""The arm as ROS sees it: meshes, inertias, MoveIt's files with a prefix; ROS 1 has the same as ROS 2."""

from __future__ import annotations

import ast
import importlib.util
import os
import re
import types
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest
import xacro
import yaml

from heptarm.values.robot import ROBOTS

ROOT = Path(__file__).parents[2]
ROS1, ROS2 = ROOT / "ros1", ROOT / "ros2"
MOVEIT = ROS2 / "heptarm_moveit_config"
#: Files of MoveIt that name joints or groups.
NAMING = ("kinematics", "moveit_controllers", "servo", *(f"joint_limits_{name}" for name in ROBOTS))


def expand(path: Path, **mappings: str) -> ET.Element:
    return ET.fromstring(xacro.process_file(str(path), mappings=mappings).toxml())


def script() -> types.ModuleType:
    spec = importlib.util.spec_from_file_location("description", ROOT / "scripts" / "ros2_description.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("packages", [ROS1, ROS2], ids=["ros1", "ros2"])
@pytest.mark.parametrize("model", ROBOTS)
def test_every_link_has_a_mesh_and_an_inertia(model: str, packages: Path) -> None:
    arm = expand(packages / "heptarm_description/urdf/heptarm.urdf.xacro", model=model, prefix="l_")
    for index in range(8):
        link = arm.find(f"link[@name='l_link_{index}']")
        assert link is not None
        mesh = link.find("visual/geometry/mesh")
        assert mesh is not None and link.find("collision/geometry/cylinder") is not None
        package, _, rest = mesh.get("filename", "").removeprefix("package://").partition("/")
        assert ET.parse(packages / package / rest).getroot().tag.endswith("COLLADA")
    base = arm.find("link[@name='l_link_0']/inertial")
    assert base is not None
    shape = ET.parse(ROOT / f"src/heptarm/sim/models/{model.replace('med', 'iiwa')}.xml").getroot()
    inertial = shape.find(".//body[@name='link_0']/inertial")
    assert inertial is not None
    assert float(base.find("mass").get("value")) == float(inertial.get("mass", ""))  # type: ignore[arg-type]
    values = [float(base.find("inertia").get(name)) for name in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]  # type: ignore[arg-type]
    assert values == pytest.approx([float(one) for one in inertial.get("fullinertia", "").split()])


@pytest.mark.parametrize("prefix", ["", "left_"])
def test_moveits_files_name_the_joints_of_the_description(prefix: str) -> None:
    arm = expand(ROS2 / "heptarm_description/urdf/heptarm.urdf.xacro", prefix=prefix)
    names = {one.get("name") for one in (*arm.findall("joint"), *arm.findall("link"))}
    semantic = expand(MOVEIT / "config/heptarm.srdf.xacro", prefix=prefix)
    assert semantic.find("virtual_joint") is None, "the description fixes the arm to the world already"
    assert [one.get("name") for one in semantic.findall("group")] == [f"{prefix}arm"]
    used = {one.get("name") for one in semantic.iter("joint")}
    used |= {one.get(key) for one in semantic.iter("disable_collisions") for key in ("link1", "link2")}
    assert used <= names
    for file in NAMING:
        text = (MOVEIT / f"config/{file}.yaml").read_text().replace("$(arg prefix)", prefix)
        there = set(re.findall(r"\b(?:left_)?(?:A[1-7]|arm)\b", str(yaml.safe_load(text))))
        assert there and there <= {f"{prefix}A{i}" for i in range(1, 8)} | {f"{prefix}arm"}, file


def test_the_semantic_description_of_two_arms() -> None:
    arms = expand(ROS2 / "heptarm_description/urdf/two_arms.urdf.xacro")
    semantic = expand(MOVEIT / "config/two_arms.srdf.xacro")
    joints = {one.get("name") for one in arms.findall("joint")}
    assert {one.get("name") for one in semantic.iter("joint")} <= joints
    assert [one.get("name") for one in semantic.findall("group")] == ["left_arm", "right_arm", "both_arms"]


@pytest.mark.parametrize("name", ["move_group", "servo"])
def test_the_launch_files_put_the_prefix_everywhere(name: str) -> None:
    tree = ast.parse((MOVEIT / f"launch/{name}.launch.py").read_text())
    (function,) = (one for one in tree.body if isinstance(one, ast.FunctionDef) and one.name == "_prefixed")
    space: dict[str, Any] = {}
    exec(compile(ast.Module([function], []), "launch", "exec"), space)
    values = {"$(arg prefix)A1": {"joints": ["$(arg prefix)A1"], "rate": 0.5, "on": True}}
    assert space["_prefixed"](values, "l_") == {"l_A1": {"joints": ["l_A1"], "rate": 0.5, "on": True}}


# ------------------------------------------------------------------------------- ROS 1 and ROS 2


def test_ros1_has_the_description_and_the_configuration_of_ros2() -> None:
    for part in ("heptarm_description/config", "heptarm_description/urdf", "heptarm_description/meshes"):
        assert os.path.samefile(ROS1 / part, ROS2 / part)
    assert os.path.samefile(ROS1 / "heptarm_moveit_config/config", MOVEIT / "config")


def test_controllers_of_moveit_are_equal_in_both() -> None:
    one = yaml.safe_load((ROS1 / "heptarm_moveit_config/planning/controllers.yaml").read_text())
    two = yaml.safe_load((MOVEIT / "config/moveit_controllers.yaml").read_text())
    assert one["trajectory_execution"] == two["trajectory_execution"]
    assert one["moveit_controller_manager"] == two["moveit_controller_manager"]
    (entry,) = one["controller_list"]
    listed = two["moveit_simple_controller_manager"]
    assert [entry.pop("name")] == listed["controller_names"] and entry == listed["heptarm"]


@pytest.mark.parametrize("moveit", [False, True])
def test_views_differ_in_the_names_of_plugins_only(moveit: bool) -> None:
    one, two = (yaml.safe_load(script().view(ros, moveit=moveit)) for ros in ("ros1", "ros2"))
    displays = [view["Visualization Manager"]["Displays"] for view in (one, two)]
    assert [entry["Name"] for entry in displays[0]] == [entry["Name"] for entry in displays[1]]
    classes = [[entry["Class"].partition("/")[2] for entry in view] for view in displays]
    assert classes[0] == classes[1] and ("MotionPlanning" in classes[0]) == moveit
    for key in ("Views", "Global Options"):
        shown = [str(view["Visualization Manager"][key]) for view in (one, two)]
        assert shown[0] == shown[1].replace("rviz_default_plugins", "rviz")


def declared(path: Path) -> dict[str | None, str | None]:
    if path.suffix == ".py":
        for one in ast.parse(path.read_text()).body:
            if isinstance(one, ast.Assign) and getattr(one.targets[0], "id", "") == "ARGUMENTS":
                return {name: value for name, (value, _) in ast.literal_eval(one.value).items()}
    return {arg.get("name"): arg.get("default") for arg in ET.parse(path).getroot().findall("arg")}


@pytest.mark.parametrize(
    ("one", "two", "apart"),
    [
        ("heptarm_description/launch/display.launch", "heptarm_description/launch/display.launch.xml", set()),
        # ROS 1 sets a namespace outside of the file
        (
            "heptarm_moveit_config/launch/move_group.launch",
            "heptarm_moveit_config/launch/move_group.launch.py",
            {"namespace"},
        ),
        (
            "heptarm_moveit_config/launch/two_arms.launch",
            "heptarm_moveit_config/launch/two_arms.launch.xml",
            set(),
        ),
        ("heptarm_ros1/launch/two_arms.launch", "heptarm_bringup/launch/two_arms.launch.xml", set()),
        (
            "heptarm_ros1/launch/heptarm.launch",
            "heptarm_bringup/launch/heptarm.launch.xml",
            {"name", "namespace", "params", "forward_controllers", "joint_states"},
        ),
    ],
)
def test_launch_files_have_the_same_arguments(one: str, two: str, apart: set[str]) -> None:
    first, second = declared(ROS1 / one), declared(ROS2 / two)
    assert set(first) ^ set(second) <= apart
    for name in (set(first) & set(second)) - apart:
        assert first[name] == second[name], name


@pytest.mark.parametrize("path", sorted(ROS1.glob("*/launch/*.launch")), ids=lambda path: path.name)
def test_a_launch_file_of_ros1_uses_what_there_is(path: Path) -> None:
    text = path.read_text()
    launch = ET.fromstring(text)
    assert set(re.findall(r"\$\(arg (\w+)\)", text)) <= {arg.get("name") for arg in launch.findall("arg")}
    for package, rest in re.findall(r"\$\(find (\w+)\)(/[\w/.$() ]+?\.(?:yaml|launch|rviz|xacro))", text):
        for file in ROBOTS if "$(arg model)" in rest else ("",):
            assert (ROS1 / package / rest[1:].replace("$(arg model)", file)).is_file(), rest
    manifest = ET.parse(path.parents[1] / "package.xml").getroot()
    needed = {manifest.findtext("name")} | {one.text for one in manifest.findall("exec_depend")}
    used = {one.get("pkg") for one in launch.iter("node")} | set(re.findall(r"\$\(find (\w+)\)", text))
    if manifest.findtext("name") == "heptarm_moveit_config":
        assert used <= needed
