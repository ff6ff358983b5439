"""MoveIt Servo for one arm: ros2 launch heptarm_moveit_config servo.launch.py model:=iiwa7.

It needs the arm's node and the planning scene of move_group, which move_group.launch.py starts.
"""

import os

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from moveit_configs_utils import MoveItConfigsBuilder

ARGUMENTS = {
    "model": ("iiwa14", "iiwa7, iiwa14, med7 or med14"),
    "flange": (
        "",
        "media flange of the robot: plain, or touch; empty: that of the target, plain in the description",
    ),
    "namespace": ("", "namespace of the arm's node and of move_group"),
    "prefix": ("", "prefix of the names of joints and frames"),
}


def generate_launch_description():
    """What is started."""
    declared = [
        DeclareLaunchArgument(name, default_value=value, description=text)
        for name, (value, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=_start)])


def _prefixed(value, prefix):
    """A configuration in which the prefix stands for `$(arg prefix)`, as ROS 1 writes it."""
    if isinstance(value, dict):
        return {_prefixed(key, prefix): _prefixed(entry, prefix) for key, entry in value.items()}
    if isinstance(value, list):
        return [_prefixed(entry, prefix) for entry in value]
    return value.replace("$(arg prefix)", prefix) if isinstance(value, str) else value


def _start(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    model, prefix = given["model"], given["prefix"]
    description = get_package_share_directory("heptarm_description")
    ours = get_package_share_directory("heptarm_moveit_config")
    configuration = (
        MoveItConfigsBuilder("heptarm", package_name="heptarm_moveit_config")
        .robot_description(
            file_path=os.path.join(description, "urdf", "heptarm.urdf.xacro"),
            mappings={"model": model, "flange": given["flange"], "prefix": prefix},
        )
        .robot_description_semantic(file_path="config/heptarm.srdf.xacro", mappings={"prefix": prefix})
        .robot_description_kinematics(file_path="config/kinematics.yaml")
        .joint_limits(file_path=f"config/joint_limits_{model}.yaml")
        .to_moveit_configs()
    )
    with open(os.path.join(ours, "config", "servo.yaml"), encoding="utf-8") as file:
        servo = _prefixed(yaml.safe_load(file)["/**"]["ros__parameters"], prefix)
    group = servo["moveit_servo"]["move_group_name"]
    return [
        Node(
            package="moveit_servo",
            executable="servo_node",
            name="servo_node",
            namespace=given["namespace"],
            output="screen",
            parameters=[
                servo,
                {"update_period": servo["moveit_servo"]["publish_period"], "planning_group_name": group},
                configuration.robot_description,
                configuration.robot_description_semantic,
                _prefixed(configuration.robot_description_kinematics, prefix),
                _prefixed(configuration.joint_limits, prefix),
            ],
        ),
    ]
