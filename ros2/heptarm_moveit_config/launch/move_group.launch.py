"""MoveIt's move_group for one arm: ros2 launch heptarm_moveit_config move_group.launch.py model:=iiwa7.

The arm's node is started by heptarm_bringup; arm:=false leaves it out.
"""

import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.conditions import IfCondition
from launch.launch_description_sources import AnyLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from moveit_configs_utils import MoveItConfigsBuilder


def generate_launch_description():
    """What is started."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("target", default_value="sim://iiwa14", description="what to connect to"),
            DeclareLaunchArgument(
                "model", default_value="iiwa14", description="iiwa7, iiwa14, med7 or med14"
            ),
            DeclareLaunchArgument("arm", default_value="true", description="start the arm's node as well"),
            OpaqueFunction(function=_start),
        ]
    )


def _start(context):
    model = LaunchConfiguration("model").perform(context)
    description = get_package_share_directory("heptarm_description")
    bringup = get_package_share_directory("heptarm_bringup")
    configuration = (
        MoveItConfigsBuilder("heptarm", package_name="heptarm_moveit_config")
        .robot_description(
            file_path=os.path.join(description, "urdf", "heptarm.urdf.xacro"), mappings={"model": model}
        )
        .robot_description_semantic(file_path="config/heptarm.srdf.xacro")
        .robot_description_kinematics(file_path="config/kinematics.yaml")
        .joint_limits(file_path=f"config/joint_limits_{model}.yaml")
        .trajectory_execution(file_path="config/moveit_controllers.yaml")
        .pilz_cartesian_limits(file_path="config/pilz_cartesian_limits.yaml")
        .planning_pipelines(pipelines=["ompl", "pilz_industrial_motion_planner"])
        .to_moveit_configs()
    )
    return [
        IncludeLaunchDescription(
            AnyLaunchDescriptionSource(os.path.join(bringup, "launch", "heptarm.launch.xml")),
            launch_arguments={"target": LaunchConfiguration("target"), "model": model}.items(),
            condition=IfCondition(LaunchConfiguration("arm")),
        ),
        Node(
            package="moveit_ros_move_group",
            executable="move_group",
            output="screen",
            parameters=[configuration.to_dict()],
        ),
    ]
