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


def generate_launch_description():
    """What is started."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "model", default_value="iiwa14", description="iiwa7, iiwa14, med7 or med14"
            ),
            OpaqueFunction(function=_start),
        ]
    )


def _start(context):
    model = LaunchConfiguration("model").perform(context)
    description = get_package_share_directory("heptarm_description")
    ours = get_package_share_directory("heptarm_moveit_config")
    configuration = (
        MoveItConfigsBuilder("heptarm", package_name="heptarm_moveit_config")
        .robot_description(
            file_path=os.path.join(description, "urdf", "heptarm.urdf.xacro"), mappings={"model": model}
        )
        .robot_description_semantic(file_path="config/heptarm.srdf.xacro")
        .robot_description_kinematics(file_path="config/kinematics.yaml")
        .joint_limits(file_path=f"config/joint_limits_{model}.yaml")
        .to_moveit_configs()
    )
    with open(os.path.join(ours, "config", "servo.yaml"), encoding="utf-8") as file:
        servo = yaml.safe_load(file)["/**"]["ros__parameters"]
    return [
        Node(
            package="moveit_servo",
            executable="servo_node",
            name="servo_node",
            output="screen",
            parameters=[
                servo,
                {"update_period": servo["moveit_servo"]["publish_period"], "planning_group_name": "arm"},
                configuration.robot_description,
                configuration.robot_description_semantic,
                configuration.robot_description_kinematics,
                configuration.joint_limits,
            ],
        ),
    ]
