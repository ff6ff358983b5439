"""Writes the numbers of heptarm_description and heptarm_moveit_config from heptarm's own; a test holds them together.

.venv/bin/python scripts/ros2_description.py [FOLDER]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from heptarm.values.arrays import Array
from heptarm.values.robot import ROBOTS, RobotModel

ROOT = Path(__file__).parents[1]
#: A cylinder for each link [m]: no meshes.
RADIUS = (0.105, 0.08, 0.078, 0.07, 0.07, 0.062, 0.055, 0.045)
#: Of the base: cast iron that does not move, so its inertia does not matter.
BASE_MASS = 5.0


def _list(values: Array) -> str:
    return "[" + ", ".join(f"{value:.9g}" for value in np.asarray(values).ravel()) + "]"


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
        ]
    lines += [
        f"base: {{mass: {BASE_MASS:g}, height: {links.origin[0][2]:.9g}, radius: {RADIUS[0]:g}}}",
        f"flange: {_list(links.flange)}",
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
            f"  A{i + 1}:",
            "    has_velocity_limits: true",
            f"    max_velocity: {robot.dq_max[i]:.9g}",
            "    has_acceleration_limits: true",
            f"    max_acceleration: {robot.ddq_max[i]:.9g}",
        ]
    return "\n".join(lines) + "\n"


def files() -> dict[str, str]:
    """What there is to write, by the path from the project's folder."""
    found = {}
    for robot in ROBOTS.values():
        found[f"ros2/heptarm_description/config/{robot.name}.yaml"] = model(robot)
        found[f"ros2/heptarm_moveit_config/config/joint_limits_{robot.name}.yaml"] = limits(robot)
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
