"""Writes the numbers and views of heptarm_description and heptarm_moveit_config from heptarm's own; a test compares.

ROS 1 has the same files by links; only views differ in the names of their plugins.

.venv/bin/python scripts/ros2_description.py [FOLDER]
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from heptarm.values.checks import Array
from heptarm.values.robot import FLANGE_RADIUS, FLANGES, ROBOTS, RobotModel

ROOT = Path(__file__).parents[1]
#: A cylinder for each link against collisions [m].
RADIUS = (0.105, 0.08, 0.078, 0.07, 0.07, 0.062, 0.055, 0.045)
MESHES = "ros2/heptarm_description/meshes"


def _list(values: Array) -> str:
    return "[" + ", ".join(f"{value:.9g}" for value in np.asarray(values).ravel()) + "]"


def _base(robot: RobotModel) -> tuple[str, Array, Array]:
    """Mass [kg], centre of mass [m] and inertia xx xy xz yy yz zz [kg m²] of the base, as the simulator has them."""
    path = ROOT / "src/heptarm/sim/models" / f"{_shape(robot)}.xml"
    inertial = ET.parse(path).getroot().find(".//body[@name='link_0']/inertial")
    assert inertial is not None
    xx, yy, zz, xy, xz, yz = map(float, inertial.get("fullinertia", "").split())
    return (
        inertial.get("mass", ""),
        np.fromstring(inertial.get("pos", ""), sep=" "),
        np.array([xx, xy, xz, yy, yz, zz]),
    )


def _shape(robot: RobotModel) -> str:
    """Name of the robot whose shapes it has."""
    return robot.name.replace("med", "iiwa")


def _mesh(robot: RobotModel, index: int) -> str:
    """Mesh of a link, from the folder of meshes, without suffix."""
    name = f"{_shape(robot)}/link_{index}"
    return name if (ROOT / MESHES / f"{name}.dae").is_file() else f"lbr/link_{index}"


def model(robot: RobotModel) -> str:
    """Kinematics, limits and inertias of a robot as YAML; angles in rad, lengths in m."""
    links = robot.links
    lines = [
        f"# {robot.title}; written by scripts/ros2_description.py",
        f"title: {robot.title}",
        "joints:",
    ]
    axes = ("0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 1 0", "0 0 1")
    for i in range(7):
        following = links.origin[i + 1] if i < 6 else links.flange
        inertia = links.inertia[i]
        lines += [
            f"  - name: A{i + 1}",
            f"    origin: {_list(links.origin[i])}",
            f"    axis: {axes[i]}",
            f"    lower: {robot.q_min[i]:.9g}",
            f"    upper: {robot.q_max[i]:.9g}",
            f"    velocity: {robot.dq_max[i]:.9g}",
            f"    effort: {robot.tau_max[i]:.9g}",
            f"    mass: {links.mass[i]:.9g}",
            f"    com: {_list(links.com[i])}",
            f"    inertia: {_list(inertia[np.triu_indices(3)])}",
            f"    next: {_list(following)}",
            f"    radius: {RADIUS[i + 1]:g}",
            f"    mesh: {_mesh(robot, i + 1)}",
        ]
    mass, com, inertia = _base(robot)
    lines += [
        "base:",
        f"  mass: {mass}",
        f"  com: {_list(com)}",
        f"  inertia: {_list(inertia)}",
        f"  height: {links.origin[0][2]:.9g}",
        f"  radius: {RADIUS[0]:g}",
        f"  mesh: {_mesh(robot, 0)}",
        "flanges:",
    ]
    for flange in FLANGES.values():
        links = robot.with_flange(flange).links
        lines += [
            f"  {flange.name}:",
            f"    height: {flange.height:g}",
            f"    around: {FLANGE_RADIUS:g}",
            f"    mass: {links.mass[6]:.9g}",
            f"    com: {_list(links.com[6])}",
            f"    inertia: {_list(links.inertia[6][np.triu_indices(3)])}",
            f"    next: {_list(links.flange)}",
        ]
    return "\n".join(lines) + "\n"


def limits(robot: RobotModel) -> str:
    """MoveIt's joint limits; it has the accelerations from here only."""
    lines = [
        f"# {robot.title}; written by scripts/ros2_description.py",
        "default_velocity_scaling_factor: 0.1",
        "default_acceleration_scaling_factor: 0.1",
        "joint_limits:",
    ]
    for i in range(7):
        lines += [
            f"  $(arg prefix)A{i + 1}:",
            "    has_velocity_limits: true",
            f"    max_velocity: {robot.dq_max[i]:.9g}",
            "    has_acceleration_limits: true",
            f"    max_acceleration: {robot.ddq_max[i]:.9g}",
        ]
    return "\n".join(lines) + "\n"


#: Plugins of RViz, in ROS 2 and in ROS 1.
_PLUGINS = {"ros2": "rviz_default_plugins", "ros1": "rviz"}


def view(ros: str, *, moveit: bool) -> str:
    """A configuration of RViz: the arm on a grid, with its frames; with MoveIt: its goals and plans.

    Args:
        ros: "ros2" or "ros1".
        moveit: whether it shows the planner's displays.
    """
    plugin = _PLUGINS[ros]
    source = (
        "      Description Topic: {Value: robot_description, Durability Policy: Transient Local}"
        if ros == "ros2"
        else "      Robot Description: robot_description"
    )
    displays = [
        f"    - Class: {plugin}/Grid",
        "      Name: Grid",
        "      Enabled: true",
        "      Cell Size: 0.25",
        "      Plane Cell Count: 12",
        "      Color: 160; 160; 164",
        f"    - Class: {plugin}/RobotModel",
        "      Name: Arm",
        "      Enabled: true",
        source,
        "      Visual Enabled: true",
        "      Collision Enabled: false",
        f"    - Class: {plugin}/TF",
        "      Name: Frames",
        "      Enabled: false",
    ]
    if moveit:
        displays += [
            "    - Class: moveit_rviz_plugin/MotionPlanning",
            "      Name: Motion planning",
            "      Enabled: true",
            "      Robot Description: robot_description",
            '      Move Group Namespace: ""',
            "      Planned Path: {Show Robot Visual: true, Loop Animation: false}",
            "      Planning Request: {Query Goal State: true, Query Start State: false}",
            "      Scene Robot: {Show Robot Visual: true}",
        ]
    lines = [
        "# written by scripts/ros2_description.py",
        "Panels:",
        f"  - {{Class: {'rviz_common' if ros == 'ros2' else 'rviz'}/Displays, Name: Displays}}",
        "Visualization Manager:",
        '  Class: ""',
        "  Displays:",
        *displays,
        "  Enabled: true",
        "  Global Options: {Background Color: 236; 239; 243, Fixed Frame: world, Frame Rate: 30}",
        "  Tools:",
        f"    - {{Class: {plugin}/MoveCamera}}",
        f"    - {{Class: {plugin}/Select}}",
        "  Views:",
        "    Current:",
        f"      Class: {plugin}/Orbit",
        "      Name: Current View",
        "      Distance: 2.2",
        "      Focal Point: {X: 0.2, Y: 0, Z: 0.5}",
        "      Pitch: 0.3",
        "      Yaw: 5.3",
        "      Target Frame: world",
        "Window Geometry: {Width: 1200, Height: 800}",
    ]
    return "\n".join(lines) + "\n"


def files() -> dict[str, str]:
    """What there is to write, by the path from the project's folder."""
    found = {}
    for robot in ROBOTS.values():
        found[f"ros2/heptarm_description/config/{robot.name}.yaml"] = model(robot)
        found[f"ros2/heptarm_moveit_config/config/joint_limits_{robot.name}.yaml"] = limits(robot)
    for ros in _PLUGINS:
        found[f"{ros}/heptarm_description/rviz/arm.rviz"] = view(ros, moveit=False)
        found[f"{ros}/heptarm_moveit_config/rviz/moveit.rviz"] = view(ros, moveit=True)
    return found


def main() -> int:
    """Writes all files."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT
    for name, text in files().items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
