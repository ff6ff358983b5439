#!/usr/bin/env python3
"""Send trajectories as goals of FollowJointTrajectory: feedback, result, and a goal that is rejected with a reason."""

import math

import actionlib
import rospy
from control_msgs.msg import (
    FollowJointTrajectoryAction,
    FollowJointTrajectoryFeedback,
    FollowJointTrajectoryGoal,
)
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectoryPoint

rospy.init_node("trajectory")
client = actionlib.SimpleActionClient("/heptarm/follow_joint_trajectory", FollowJointTrajectoryAction)
client.wait_for_server()
here = rospy.wait_for_message("/joint_states", JointState)

# a wave of joint 6 and back, with velocities, so that the pieces between the points are smooth
goal = FollowJointTrajectoryGoal()
goal.trajectory.joint_names = here.name
for number in range(1, 21):
    phase = 2 * math.pi * number / 20
    positions, velocities = list(here.position), [0.0] * 7
    positions[5] += 0.1 * (1 - math.cos(phase))
    velocities[5] = 0.0 if number == 20 else 0.1 * math.sin(phase) * 2 * math.pi / 2.0
    goal.trajectory.points.append(
        JointTrajectoryPoint(
            positions=positions, velocities=velocities, time_from_start=rospy.Duration.from_sec(number * 0.1)
        )
    )

worst = [0.0]


def on_feedback(feedback: FollowJointTrajectoryFeedback) -> None:
    worst[0] = max(worst[0], *(abs(error) for error in feedback.error.positions))


client.send_goal(goal, feedback_cb=on_feedback)
client.wait_for_result()
result = client.get_result()
print(f"{client.get_goal_status_text()}; code {result.error_code}, worst error {worst[0]:.4f} rad")

goal.trajectory.joint_names = ["elbow", *here.name[1:]]
client.send_goal(goal)
client.wait_for_result()
print(f"code {client.get_result().error_code}: {client.get_result().error_string}")
