#!/usr/bin/env python3
"""Send trajectories as goals of FollowJointTrajectory: feedback, result, and a goal that is rejected."""

import math

import rclpy
from control_msgs.action import FollowJointTrajectory
from rcl_interfaces.srv import GetParameters
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.duration import Duration
from rclpy.task import Future
from rclpy.wait_for_message import wait_for_message
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectoryPoint

rclpy.init()
node = rclpy.create_node("trajectory")
client = ActionClient(node, FollowJointTrajectory, "/heptarm/follow_joint_trajectory")
client.wait_for_server()

# until the node has discovered this one, its answers are lost: ask for nothing, and again after a second
probe, answer = node.create_client(GetParameters, "/heptarm/get_parameters"), Future()
while not answer.done():
    answer = probe.call_async(GetParameters.Request())
    rclpy.spin_until_future_complete(node, answer, timeout_sec=1.0)
found, here = wait_for_message(JointState, node, "/joint_states", time_to_wait=10.0)
assert found

# a wave of joint 6 and back, with velocities, so that the pieces between the points are smooth
goal = FollowJointTrajectory.Goal()
goal.trajectory.joint_names = here.name
for number in range(1, 21):
    phase = 2 * math.pi * number / 20
    positions, velocities = list(here.position), [0.0] * 7
    positions[5] += 0.1 * (1 - math.cos(phase))
    velocities[5] = 0.0 if number == 20 else 0.1 * math.sin(phase) * 2 * math.pi / 2.0
    goal.trajectory.points.append(
        JointTrajectoryPoint(
            positions=positions,
            velocities=velocities,
            time_from_start=Duration(seconds=number * 0.1).to_msg(),
        )
    )

worst = [0.0]


def on_feedback(message: FollowJointTrajectory.Impl.FeedbackMessage) -> None:
    worst[0] = max(worst[0], *(abs(error) for error in message.feedback.error.positions))


def send(wanted: FollowJointTrajectory.Goal) -> ClientGoalHandle:
    """The handle of a goal that is accepted or rejected."""
    future = client.send_goal_async(wanted, feedback_callback=on_feedback)
    rclpy.spin_until_future_complete(node, future)
    return future.result()


handle = send(goal)
ended = handle.get_result_async()
rclpy.spin_until_future_complete(node, ended)
result = ended.result().result
print(f"{result.error_string}; code {result.error_code}, worst error {worst[0]:.4f} rad")

goal.trajectory.joint_names = ["elbow", *here.name[1:]]
print("accepted" if send(goal).accepted else "rejected: see the node's log")
node.destroy_node()
rclpy.shutdown()
