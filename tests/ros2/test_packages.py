"""Description, launch files, MoveIt's configuration: they expand, agree with heptarm's numbers and with the node."""

from __future__ import annotations

import ast
import importlib.util
import os
import re
import shutil
import signal
import subprocess
import sys
import types
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xacro
import yaml
from sensor_msgs.msg import JointState

from heptarm.model.kinematics import forward
from heptarm.ros.interface.actions import ACTIONS
from heptarm.ros.interface.services import SERVICES
from heptarm.ros.interface.topics import TOPICS
from heptarm.ros.node.parameters import PARAMETERS, NodeConfiguration, joint_parameters
from heptarm.ros.trajectory.goal import TrajectoryGoal, TrajectoryPoint
from heptarm.ros.trajectory.point_stream import is_streamed
from heptarm.values.robot import ROBOTS
from tests.conformance.stage import Stage
from tests.interrupts import ctrl_c_interrupts
from tests.ros2.launching import LaunchedNode, describe, flat, parameters_of
from tests.ros2.peer import NodeProcess, Ros, until

ROOT = Path(__file__).parents[2]
ROS2 = ROOT / "ros2"
URDF = ROS2 / "heptarm_description" / "urdf"
PACKAGES = ("heptarm_bringup", "heptarm_description", "heptarm_moveit_config", "heptarm_msgs", "heptarm_ros2")
CONTROLLERS = ROS2 / "heptarm_bringup" / "config" / "controllers.yaml"
LAUNCHES = sorted(ROS2.glob("*/launch/*.xml"))


def expand(path: Path, **mappings: str) -> ET.Element:
    return ET.fromstring(xacro.process_file(str(path), mappings=mappings).toxml())


def numbers(text: str | None) -> np.ndarray:
    return np.array([float(word) for word in (text or "0 0 0").split()])


def turn(axis: np.ndarray, angle: float) -> np.ndarray:
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k)


def tip(arm: ET.Element, q: np.ndarray, last: str) -> np.ndarray:
    """The pose of a link, shape (4, 4), by following the joints from the root."""
    into = {
        child.get("link"): joint for joint in arm.iter("joint") if (child := joint.find("child")) is not None
    }
    chain = []
    while last in into:
        chain.append(into[last])
        last = into[last].find("parent").get("link")  # type: ignore[assignment]
    pose = np.eye(4)
    values = iter(q)
    for joint in reversed(chain):
        origin = joint.find("origin")
        step = np.eye(4)
        step[:3, 3] = numbers(None if origin is None else origin.get("xyz"))
        if joint.get("type") == "revolute":
            step[:3, :3] = turn(numbers(joint.find("axis").get("xyz")), next(values))
        pose = pose @ step
    return pose


# ------------------------------------------------------------------------------------- description


@pytest.mark.parametrize("model", ROBOTS)
def test_an_arm_expands_with_the_limits_of_its_data_sheet(model: str) -> None:
    arm = expand(URDF / "heptarm.urdf.xacro", model=model)
    robot = ROBOTS[model]
    joints = [joint for joint in arm.findall("joint") if joint.get("type") == "revolute"]
    assert tuple(joint.get("name") for joint in joints) == NodeConfiguration.of({}).joints
    for values, name in (
        (robot.q_min, "lower"),
        (robot.q_max, "upper"),
        (robot.dq_max, "velocity"),
        (robot.tau_max, "effort"),
    ):
        reported = [float(joint.find("limit").get(name)) for joint in joints]  # type: ignore[arg-type]
        np.testing.assert_allclose(reported, values, rtol=1e-7)
    mass = sum(float(m.get("value", "nan")) for m in arm.iter("mass"))
    assert 20.0 < mass < 35.0


@pytest.mark.parametrize("model", ROBOTS)
def test_its_flange_is_where_heptarm_reports(model: str) -> None:
    arm = expand(URDF / "heptarm.urdf.xacro", model=model)
    rng = np.random.default_rng(7)
    for _ in range(5):
        q = rng.uniform(ROBOTS[model].q_min, ROBOTS[model].q_max)
        np.testing.assert_allclose(tip(arm, q, "flange"), forward(ROBOTS[model], q), atol=1e-9)


def test_prefix_and_origin() -> None:
    arm = expand(URDF / "heptarm.urdf.xacro", prefix="left_", xyz="1 2 3")
    names = [e.get("name") for e in (*arm.findall("link"), *arm.findall("joint")) if e.get("name") != "world"]
    assert len(names) == len(set(names)) and all(name and name.startswith("left_") for name in names)
    np.testing.assert_allclose(tip(arm, np.zeros(7), "left_link_0")[:3, 3], [1, 2, 3])
    configuration = NodeConfiguration.of({"prefix": "left_"})
    links = {link.get("name") for link in arm.findall("link")}
    assert {configuration.frame("base"), configuration.frame("flange")} <= links


def test_two_arms_share_a_scene() -> None:
    arms = expand(URDF / "two_arms.urdf.xacro", left_model="iiwa7")
    names = [joint.get("name") for joint in arms.findall("joint")]
    assert len(names) == len(set(names)) == 18
    there = [tip(arms, np.zeros(7), f"{side}_link_0")[1, 3] for side in ("left", "right")]
    assert there == [0.5, -0.5]


@pytest.mark.parametrize(
    ("control", "plugin"),
    [
        ("topic", "joint_state_topic_hardware_interface/JointStateTopicSystem"),
        ("mock", "mock_components/GenericSystem"),
    ],
)
def test_ros2_control_over_the_nodes_topics(control: str, plugin: str) -> None:
    block = expand(URDF / "heptarm.urdf.xacro", control=control, prefix="left_", node="/left/heptarm").find(
        "ros2_control"
    )
    assert block is not None and block.findtext("hardware/plugin") == plugin
    assert [joint.get("name") for joint in block.findall("joint")] == [f"left_A{i}" for i in range(1, 8)]
    for joint in block.findall("joint"):
        commands = [e.get("name") for e in joint.findall("command_interface")]
        assert commands == (["position", "velocity"] if control == "mock" else ["position"])
        assert [e.get("name") for e in joint.findall("state_interface")] == ["position", "velocity"]
    topics = {param.get("name"): param.text for param in block.findall("hardware/param")}
    if control == "topic":
        assert topics["joint_commands_topic"] == "/left/heptarm/servo/joint"


def test_the_numbers_are_written_by_their_script() -> None:
    spec = importlib.util.spec_from_file_location("description", ROOT / "scripts" / "ros2_description.py")
    assert spec is not None and spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    for name, text in script.files().items():
        assert (ROOT / name).read_text() == text, f"run scripts/ros2_description.py: {name} is old"


# ---------------------------------------------------------------------------------------- packages


@pytest.mark.parametrize(
    "path", sorted(ROOT.glob("ros[12]/heptarm_*/package.xml")), ids=lambda path: path.parent.name
)
def test_a_package_can_be_released(path: Path) -> None:
    manifest = ET.parse(path).getroot()
    assert {url.get("type") for url in manifest.findall("url")} == {"website", "repository", "bugtracker"}
    version = re.search(r'^version = "(.*)"', (ROOT / "pyproject.toml").read_text(), re.M)
    assert version is None or manifest.findtext("version") == version.group(1)
    log = (path.parent / "CHANGELOG.rst").read_text().splitlines()
    assert log[1] == f"Changelog for package {path.parent.name}" and "Forthcoming" in log


def test_builds_leave_out_the_interfaces_of_others() -> None:
    assert (ROS2 / "interfaces" / "COLCON_IGNORE").is_file()
    assert (ROOT / "ros1" / "interfaces" / "CATKIN_IGNORE").is_file()


def test_the_node_depends_on_every_package_it_imports() -> None:
    for name, folder in (("ros2/heptarm_ros2", "heptarm_ros2"), ("ros1/heptarm_ros1", "src/heptarm_ros1")):
        manifest = ET.parse(ROOT / name / "package.xml").getroot()
        declared = {one.text for one in manifest if one.tag.endswith("depend")}
        text = "\n".join(path.read_text() for path in (ROOT / name / folder).glob("*.py"))
        used = set(re.findall(r"^\s*(?:from|import) (\w+)(?:\.(?:msg|srv|action))? ?", text, re.M))
        used |= {row.type.partition("/")[0] for row in (*SERVICES, *TOPICS, *ACTIONS)}
        ours = {"heptarm", Path(name).name, "__future__", *sys.stdlib_module_names}
        keys = {"numpy": "python3-numpy"}
        assert {keys.get(one, one) for one in used - ours} <= declared


@pytest.mark.parametrize("name", PACKAGES)
def test_a_package_reports_what_it_is_and_installs_what_it_has(name: str) -> None:
    folder = ROS2 / name
    manifest = ET.parse(folder / "package.xml").getroot()
    assert manifest.findtext("name") == name and manifest.findtext("license") == "Apache-2.0"
    if name == "heptarm_ros2":
        assert manifest.findtext("export/build_type") == "ament_python"
        return
    text = (folder / "CMakeLists.txt").read_text()
    assert f"project({name})" in text
    for part in folder.iterdir():
        if part.is_dir() and name != "heptarm_msgs":
            assert re.search(rf"DIRECTORY[^)]*\b{part.name}\b", text), f"{part.name} is not installed"


def test_all_interfaces_are_built() -> None:
    folder = ROS2 / "heptarm_msgs"
    text = (folder / "CMakeLists.txt").read_text()
    for kind in ("msg", "srv", "action"):
        for path in folder.glob(f"{kind}/*.{kind}"):
            assert f'"{kind}/{path.name}"' in text


def test_upstreams_interfaces_are_upstreams() -> None:
    """The hashes of control_msgs, by which two machines find out whether they mean the same."""
    folder = Path(sys.prefix) / "share" / "control_msgs"
    for name, begin in (
        ("action/FollowJointTrajectory", "ff29901b2693f5d"),
        ("msg/JointTolerance", "c254f9cece0f3b7"),
        ("msg/JointComponentTolerance", "739ea7566931944"),
        ("msg/JointTrajectoryControllerState", "51d8dd89cc624cb"),
        ("srv/QueryTrajectoryState", "4a0935dffef18bc"),
    ):
        hashes = yaml.safe_load((folder / f"{name}.json").read_text())["type_hashes"]
        assert hashes[0]["hash_string"] == hashes[0]["hash_string"].replace("RIHS01_", "RIHS01_")
        assert hashes[0]["hash_string"].startswith(f"RIHS01_{begin}"), name


# ------------------------------------------------------------------------------------ launch files


def arguments(path: Path) -> dict[str, tuple[str, str]]:
    """Arguments of a launch file in Python: default and description."""
    for one in ast.parse(path.read_text()).body:
        if isinstance(one, ast.Assign) and getattr(one.targets[0], "id", "") == "ARGUMENTS":
            return dict(ast.literal_eval(one.value))
    raise AssertionError(f"{path.name} has no ARGUMENTS")


@pytest.mark.parametrize("path", LAUNCHES, ids=lambda path: path.name)
def test_a_launch_file_declares_what_it_uses_and_starts_what_there_is(path: Path) -> None:
    launch = ET.parse(path).getroot()
    declared = {arg.get("name") for arg in (*launch.findall("arg"), *launch.findall("let"))}
    assert all(arg.get("description") for arg in launch.findall("arg"))
    assert set(re.findall(r"\$\(var (\w+)\)", path.read_text())) <= declared
    known = {one.name for one in (*PARAMETERS, *joint_parameters([f"A{i}" for i in range(1, 8)]))}
    for node in launch.iter("node"):
        if node.get("pkg") == "heptarm_ros2":
            assert (
                f"{node.get('exec')} = heptarm_ros2.main:main"
                in (ROS2 / "heptarm_ros2" / "setup.py").read_text()
            )
            assert {param.get("name") for param in node.findall("param") if param.get("name")} <= known
    for package, rest in re.findall(r"\$\(find-pkg-share (\w+)\)(/[\w/.]+)", path.read_text()):
        assert (ROS2 / package / rest[1:]).is_file(), rest
    for include in launch.iter("include"):
        (inner,) = ROS2.glob(f"*/launch/{Path(include.get('file', '')).name}")
        given = {arg.get("name") for arg in include.findall("arg")}
        if inner.suffix == ".py":
            assert given <= arguments(inner).keys()
        else:
            found = ET.parse(inner).getroot()
            assert given <= {arg.get("name") for arg in found.findall("arg")}


def test_the_nodes_parameter_file_has_its_defaults() -> None:
    given = flat(
        yaml.safe_load((ROS2 / "heptarm_bringup/config/heptarm.yaml").read_text())["/**"]["ros__parameters"]
    )
    NodeConfiguration.of(given)
    defaults = {one.name: one.default for one in PARAMETERS}
    assert given == {name: defaults[name] for name in given}


def test_controllers_and_moveit_have_the_nodes_joints_and_action() -> None:
    joints = list(NodeConfiguration.of({}).joints)
    moveit = yaml.safe_load((ROS2 / "heptarm_moveit_config/config/moveit_controllers.yaml").read_text())
    ours = moveit["moveit_simple_controller_manager"]
    named = [name.replace("$(arg prefix)", "") for name in ours["heptarm"]["joints"]]
    assert ours["controller_names"] == ["heptarm"] and named == joints
    assert ours["heptarm"]["action_ns"] == "follow_joint_trajectory"


def test_moveits_semantic_description_names_what_there_is() -> None:
    arm = expand(URDF / "heptarm.urdf.xacro")
    semantic = expand(ROS2 / "heptarm_moveit_config/config/heptarm.srdf.xacro")
    links = {link.get("name") for link in arm.findall("link")}
    joints = {joint.get("name") for joint in arm.findall("joint")}
    chain = semantic.find("group/chain")
    assert chain is not None and {chain.get("base_link"), chain.get("tip_link")} <= links
    pairs = semantic.findall("disable_collisions")
    assert len(pairs) == 13 and all({p.get("link1"), p.get("link2")} <= links for p in pairs)
    home = {
        joint.get("name"): float(joint.get("value", "nan")) for joint in semantic.findall("group_state/joint")
    }
    assert home.keys() <= joints
    ROBOTS["iiwa14"].check(np.array(list(home.values())))


# --------------------------------------------------------------------------- descriptions, really built


def by_executable(nodes: list[LaunchedNode]) -> dict[str, LaunchedNode]:
    return {node.name or node.executable: node for node in nodes}


@pytest.mark.parametrize("control", ["mock", "topics"])
def test_ros2_control_starts_with_all_its_controllers(control: str) -> None:
    found = by_executable(
        describe(
            "heptarm_bringup",
            "control.launch.xml",
            control=control,
            namespace="left",
            prefix="l_",
            model="med7",
        )
    )
    assert ("heptarm" in found) == (control == "topics")
    assert {node.namespace for node in found.values()} == {"/left"}
    joints = [f"l_A{i}" for i in range(1, 8)]
    arm = ET.fromstring(found["robot_state_publisher"].parameters["robot_description"])
    system = arm.find("ros2_control")
    assert system is not None and [joint.get("name") for joint in system.findall("joint")] == joints
    manager = found["ros2_control_node"]
    values = yaml.safe_load(CONTROLLERS.read_text().replace("$(var prefix)", "l_"))
    names = {"joint_state_broadcaster", "joint_trajectory_controller", "forward_position_controller"}
    names |= {"forward_velocity_controller"}
    manager.name = "controller_manager"
    types = parameters_of(values, manager)
    assert {name.removesuffix(".type") for name in types} == names | {"update_rate"}
    for name in names - {"joint_state_broadcaster"}:
        controller = LaunchedNode("", "", name, "/left")
        assert parameters_of(values, controller)["joints"] == joints
    active, inactive = (found[f"spawner_of_{which}_ones"].arguments for which in ("active", "inactive"))
    assert active == ["joint_state_broadcaster", "joint_trajectory_controller"]
    commanded = {e.get("name") for e in system.findall("joint/command_interface")}
    others = ["forward_position_controller"] + ["forward_velocity_controller"] * (control == "mock")
    assert inactive == ["--inactive", *others] and ("velocity" in commanded) == (control == "mock")
    if control == "topics":
        topics = {param.get("name"): param.text for param in system.findall("hardware/param")}
        assert topics["joint_states_topic"] == "/left/heptarm/joint_states"
        assert topics["joint_commands_topic"] == "/left/heptarm/servo/joint"
        # the broadcaster alone publishes joint_states
        assert found["heptarm"].remaps == {"joint_states": "heptarm/joint_states"}
        assert found["heptarm"].parameters["forward_controllers"] is False


@pytest.mark.parametrize("name", ["forward_position_controller", "forward_velocity_controller"])
def test_another_controller_may_be_the_active_one(name: str) -> None:
    found = by_executable(describe("heptarm_bringup", "control.launch.xml", control="mock", controller=name))
    active, inactive = (found[f"spawner_of_{which}_ones"].arguments for which in ("active", "inactive"))
    assert active == ["joint_state_broadcaster", name]
    assert name not in inactive and len(inactive) == 3


def test_two_arms_are_two_nodes_with_their_descriptions() -> None:
    nodes = describe("heptarm_bringup", "two_arms.launch.xml", left="sim://a", right="sim://b")
    arms = {node.namespace: node for node in nodes if node.executable == "heptarm_node"}
    assert {space: node.parameters["target"] for space, node in arms.items()} == {
        "/left": "sim://a",
        "/right": "sim://b",
    }
    for node in nodes:
        if node.executable == "robot_state_publisher":
            arm = ET.fromstring(node.parameters["robot_description"])
            assert f"{node.namespace[1:]}_A1" in {joint.get("name") for joint in arm.findall("joint")}


def test_the_node_runs_as_its_launch_file_starts_it(spare: Stage, ros: Ros) -> None:
    given = {"target": spare.target, "namespace": "launched", "prefix": "l_", "description": "false"}
    (node,) = describe("heptarm_bringup", "heptarm.launch.xml", **given, joint_states="heptarm/joint_states")
    process = NodeProcess(spare.target, words=node.command())
    try:
        states = ros.collect(JointState, "/launched/heptarm/joint_states")
        until(lambda: states, "the node does not start")
        assert list(states[-1].name) == [f"l_A{i}" for i in range(1, 8)]
    finally:
        process.finish()


class Anything:
    """A substitute for what a launch file uses of missing packages; records its arguments."""

    made: list[tuple[str, tuple[Any, ...], dict[str, Any]]] = []  # noqa: RUF012  one list for all

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> Anything:
        return Anything(f"{self._name}.{name}")

    def __call__(self, *given: Any, **named: Any) -> Any:
        Anything.made.append((self._name, given, named))
        if self._name == "get_package_share_directory":
            return str(ROS2 / given[0])
        if self._name.endswith(".perform"):
            return {"model": "iiwa14"}.get(Anything.made[-2][1][0], "")
        return self


def started(path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What a launch file starts; the packages that it needs are replaced by `Anything`."""
    tree = ast.parse(path.read_text())
    for one in ast.walk(tree):
        if isinstance(one, ast.ImportFrom) and one.module:
            module = types.ModuleType(one.module)
            for name in one.names:
                setattr(module, name.name, Anything(name.name))
            monkeypatch.setitem(sys.modules, one.module, module)
    space: dict[str, Any] = {}
    exec(compile(tree, str(path), "exec"), space)
    Anything.made.clear()
    space["generate_launch_description"]()
    found: list[Any] = space["_start"](None)
    for _, _, named in Anything.made:
        if "file_path" in named:
            assert (ROS2 / "heptarm_moveit_config" / named["file_path"]).is_file(), named["file_path"]
    return found


def test_moveits_launch_file_uses_files_that_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    path = ROS2 / "heptarm_moveit_config/launch/move_group.launch.py"
    assert len(started(path, monkeypatch)) == 3
    assert sum("file_path" in named for _, _, named in Anything.made) == 6


def test_moveit_servo_is_started_with_its_configuration(monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(started(ROS2 / "heptarm_moveit_config/launch/servo.launch.py", monkeypatch)) == 1
    nodes = [named for name, _, named in Anything.made if name == "Node"]
    assert nodes[0]["package"] == "moveit_servo"
    servo = nodes[0]["parameters"][0]["moveit_servo"]
    assert servo["command_out_topic"] == "heptarm/joint_trajectory"
    assert servo["command_out_type"] == "trajectory_msgs/JointTrajectory"
    semantic = expand(ROS2 / "heptarm_moveit_config/config/heptarm.srdf.xacro")
    assert [group.get("name") for group in semantic.findall("group")] == [servo["move_group_name"]]
    # a window has at least three points, and is short enough to be a stream for the node
    assert 3 * servo["publish_period"] < servo["max_expected_latency"]
    names = NodeConfiguration.of({}).joints
    points = round(2.0 * servo["max_expected_latency"] / servo["publish_period"])
    times = tuple(TrajectoryPoint(servo["publish_period"] * k, (0.0,) * 7) for k in range(points))
    window = TrajectoryGoal(names, times, 100.0 - servo["max_expected_latency"], from_topic=True)
    assert is_streamed(window, 100.0)


@pytest.mark.parametrize("path", sorted(ROOT.glob("ros[12]/**/launch/*.*")), ids=lambda path: path.name)
def test_every_launch_file_can_be_read(path: Path) -> None:
    if path.suffix == ".py":
        tree = ast.parse(path.read_text())
        assert any(
            isinstance(one, ast.FunctionDef) and one.name == "generate_launch_description"
            for one in tree.body
        )
    else:
        assert ET.parse(path).getroot().tag == "launch"


@pytest.mark.skipif(
    importlib.util.find_spec("launch_xml") is None, reason="upstream's launch is not installed"
)
@pytest.mark.parametrize("path", LAUNCHES, ids=lambda path: path.name)
def test_upstreams_launch_reads_them(path: Path) -> None:
    from launch.frontend import Parser

    root, parser = Parser.load(str(path))
    assert parser.parse_description(root).entities


@pytest.mark.skipif(
    shutil.which("ros2") is None,
    reason="upstream's launch is in no wheel: this needs an installation of ROS 2",
)
def test_upstreams_launch_starts_the_node(spare: Stage, ros: Ros) -> None:
    if subprocess.run(["ros2", "pkg", "prefix", "heptarm_bringup"], check=False).returncode:
        pytest.skip("heptarm_bringup is in no workspace that is sourced")
    command = ["ros2", "launch", "heptarm_bringup", "heptarm.launch.xml", f"target:={spare.target}"]
    command += ["namespace:=launched", "prefix:=l_", "description:=false"]
    with ctrl_c_interrupts():
        process = subprocess.Popen(command, start_new_session=True)
    try:
        states = ros.collect(JointState, "/launched/joint_states")
        until(lambda: states, "the node does not start")
        assert list(states[-1].name) == [f"l_A{i}" for i in range(1, 8)]
    finally:
        os.killpg(process.pid, signal.SIGINT)  # its children outlive it otherwise
        process.wait(60)
