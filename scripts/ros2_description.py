"""Writes the numbers and views of heptarm_description and heptarm_moveit_config from heptarm's own; a test compares.

ROS 1 has the same files by links; only views differ in the names of their plugins.

.venv/bin/python scripts/ros2_description.py [FOLDER]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from heptarm.export.tree import FLANGE, TreeBody, tree_of
from heptarm.values.checks import Array
from heptarm.values.robot import FLANGE_RADIUS, FLANGES, ROBOTS, RobotModel

ROOT = Path(__file__).parents[1]
#: A cylinder for each link against collisions [m].
RADIUS = (0.105, 0.08, 0.078, 0.07, 0.07, 0.062, 0.055, 0.045)
MESHES = "ros2/heptarm_description/meshes"


def _list(values: Array) -> str:
    # what MuJoCo has computed is rounded to where the numbers of the model end
    numbers = np.round(np.asarray(values).ravel(), 15) + 0.0
    return "[" + ", ".join(f"{value:.9g}" for value in numbers) + "]"


def _shape(robot: RobotModel) -> str:
    """Name of the robot whose shapes it has."""
    return robot.name.replace("med", "iiwa")


def _mesh(robot: RobotModel, index: int) -> str:
    """Mesh of a link, from the folder of meshes, without suffix."""
    name = f"{_shape(robot)}/link_{index}"
    return name if (ROOT / MESHES / f"{name}.dae").is_file() else f"lbr/link_{index}"


def model(robot: RobotModel) -> str:
    """Kinematics, limits and inertias of a robot as YAML, from the tree that `heptarm export` writes; rad, m."""
    bodies = {body.name: body for body in tree_of(robot, tool=None, scene="")}
    arm = [bodies[f"link_{index}"] for index in range(8)]
    ends = [*(body.pose.xyz for body in arm[2:]), bodies[FLANGE].pose.xyz]
    lines = [
        f"# {robot.title}; written by scripts/ros2_description.py",
        f"title: {robot.title}",
        "joints:",
    ]
    for index, (body, following) in enumerate(zip(arm[1:], ends, strict=True), 1):
        joint = body.joint
        assert joint is not None
        lines += [
            f"  - name: {joint.name}",
            f"    origin: {_list(body.pose.xyz)}",
            f"    axis: {' '.join(f'{part:g}' for part in joint.axis)}",
            f"    lower: {joint.low:.9g}",
            f"    upper: {joint.high:.9g}",
            f"    velocity: {joint.speed:.9g}",
            f"    effort: {joint.effort:.9g}",
            f"    damping: {joint.damping:.9g}",
            f"    friction: {joint.friction:.9g}",
            *_inertial(body, "    "),
            f"    next: {_list(following)}",
            f"    radius: {RADIUS[index]:g}",
            f"    mesh: {_mesh(robot, index)}",
        ]
    lines += [
        "base:",
        *_inertial(arm[0], "  "),
        f"  height: {arm[1].pose.z:.9g}",
        f"  radius: {RADIUS[0]:g}",
        f"  mesh: {_mesh(robot, 0)}",
        "flanges:",
    ]
    for flange in FLANGES.values():
        of_flange = {body.name: body for body in tree_of(robot.with_flange(flange), tool=None, scene="")}
        lines += [
            f"  {flange.name}:",
            f"    height: {flange.height:g}",
            f"    around: {FLANGE_RADIUS:g}",
            *_inertial(of_flange["link_7"], "    "),
            f"    next: {_list(of_flange[FLANGE].pose.xyz)}",
        ]
    return "\n".join(lines) + "\n"


def _inertial(body: TreeBody, indent: str) -> list[str]:
    """Mass, centre of mass, and inertia xx xy xz yy yz zz of a body."""
    inertia = body.inertia[np.triu_indices(3)]
    rows = (f"mass: {body.mass:.9g}", f"com: {_list(body.com)}", f"inertia: {_list(inertia)}")
    return [indent + row for row in rows]


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
