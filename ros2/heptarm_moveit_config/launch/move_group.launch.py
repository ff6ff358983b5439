"""MoveIt's move_group for one arm: ros2 launch heptarm_moveit_config move_group.launch.py model:=iiwa7 rviz:=true.

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

ARGUMENTS = {
    "target": ("sim://iiwa14", "what to connect to"),
    "model": ("iiwa14", "iiwa7, iiwa14, med7 or med14"),
    "flange": (
        "",
        "media flange of the robot: plain, or touch; empty: that of the target, plain in the description",
    ),
    "namespace": ("", "namespace of all nodes and topics"),
    "prefix": ("", "prefix of the names of joints and frames, for several arms in one scene"),
    "xyz": ("0 0 0", "position of the arm in the world [m]"),
    "rpy": ("0 0 0", "orientation of the arm in the world [rad]"),
    "arm": ("true", "start the arm's node as well"),
    "rviz": ("false", "start RViz with MoveIt's displays"),
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
    model, prefix, namespace = given["model"], given["prefix"], given["namespace"]
    description = get_package_share_directory("heptarm_description")
    bringup = get_package_share_directory("heptarm_bringup")
    ours = get_package_share_directory("heptarm_moveit_config")
    place = {name: given[name] for name in ("model", "flange", "prefix", "xyz", "rpy")}
    configuration = (
        MoveItConfigsBuilder("heptarm", package_name="heptarm_moveit_config")
        .robot_description(file_path=os.path.join(description, "urdf", "heptarm.urdf.xacro"), mappings=place)
        .robot_description_semantic(file_path="config/heptarm.srdf.xacro", mappings={"prefix": prefix})
        .robot_description_kinematics(file_path="config/kinematics.yaml")
        .joint_limits(file_path=f"config/joint_limits_{model}.yaml")
        .trajectory_execution(file_path="config/moveit_controllers.yaml")
        .pilz_cartesian_limits(file_path="config/pilz_cartesian_limits.yaml")
        .planning_pipelines(pipelines=["ompl", "pilz_industrial_motion_planner"])
        .to_moveit_configs()
    )
    parameters = _prefixed(configuration.to_dict(), prefix)
    return [
        IncludeLaunchDescription(
            AnyLaunchDescriptionSource(os.path.join(bringup, "launch", "heptarm.launch.xml")),
            launch_arguments={"target": given["target"], "namespace": namespace, **place}.items(),
            condition=IfCondition(LaunchConfiguration("arm")),
        ),
        Node(
            package="moveit_ros_move_group",
            executable="move_group",
            namespace=namespace,
            output="screen",
            parameters=[parameters],
        ),
        Node(
            package="rviz2",
            executable="rviz2",
            namespace=namespace,
            arguments=["-d", os.path.join(ours, "rviz", "moveit.rviz")],
            parameters=[parameters],
            condition=IfCondition(LaunchConfiguration("rviz")),
        ),
    ]
