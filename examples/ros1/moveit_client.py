#!/usr/bin/env python3
"""Execute a plan as MoveIt does, without MoveIt: check the start, send the goal, monitor its duration, cancel it.

A straight line in joint space stands in for a planner. Everything else is what MoveIt's execution manager and its
simple controller manager do with a controller of the type FollowJointTrajectory.
"""

import sys

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

#: MoveIt's parameters and their defaults.
ALLOWED_START_TOLERANCE = 0.01  # rad
ALLOWED_DURATION_SCALING, ALLOWED_DURATION_MARGIN = 1.1, 0.5  # 1, s
if len(sys.argv) > 1:  # more for a busy machine
    ALLOWED_DURATION_MARGIN = float(sys.argv[1])
STATUS = {
    GoalStatus.SUCCEEDED: "SUCCEEDED",
    GoalStatus.ABORTED: "ABORTED",
    GoalStatus.REJECTED: "ABORTED",
    GoalStatus.PREEMPTED: "PREEMPTED",
}


class Execution:
    """Executes trajectories as MoveIt does."""

    def __init__(self, controller: str, topic: str) -> None:
        self.state = JointState()
        rospy.Subscriber(topic, JointState, self.on_state, queue_size=1, tcp_nodelay=True)
        self.client = actionlib.SimpleActionClient(controller, FollowJointTrajectoryAction)
        self.client.wait_for_server()

    def on_state(self, message: JointState) -> None:
        self.state = message

    def current(self) -> JointState:
        """A state measured after the call."""
        now = rospy.Time.now()
        while self.state.header.stamp <= now:
            rospy.sleep(0.005)
        return self.state

    def execute(self, trajectory: JointTrajectory, *, stop_after: float = 0.0) -> str:
        """Return MoveIt's result code; `stop_after` simulates the user's stop button [s]."""
        state = self.current()
        place = dict(zip(state.name, state.position))
        for name, value in zip(trajectory.joint_names, trajectory.points[0].positions):
            if abs(place[name] - value) > ALLOWED_START_TOLERANCE:
                raise SystemExit(f"{name} is not where the plan begins")
        self.client.send_goal(FollowJointTrajectoryGoal(trajectory=trajectory))
        planned = trajectory.points[-1].time_from_start.to_sec()
        allowed = planned * ALLOWED_DURATION_SCALING + ALLOWED_DURATION_MARGIN
        if not self.client.wait_for_result(rospy.Duration.from_sec(stop_after or allowed)):
            self.client.cancel_goal()
            return "PREEMPTED" if stop_after else "TIMED_OUT"
        status = STATUS[self.client.get_state()]
        if status == "ABORTED":
            rospy.logerr(self.client.get_result().error_string)
        return status

    def wait_for_rest(self) -> JointState:
        """Wait for three equal states in a row."""
        before, alike = self.current(), 0
        while alike < 3:
            now = self.current()
            still = max(abs(a - b) for a, b in zip(now.position, before.position)) < 1e-4
            before, alike = now, alike + 1 if still else 0
        return before


def plan(start: JointState, seconds: float, **target: float) -> JointTrajectory:
    """A plan from the current state in 20 segments, at rest at both ends, with all fields that a planner sets."""
    goal = [target.get(name, value) for name, value in zip(start.name, start.position)]
    trajectory = JointTrajectory(joint_names=list(start.name))
    for number in range(21):
        x = number / 20
        fraction = x**3 * (10 - 15 * x + 6 * x**2)
        speed = 30 * x**2 * (1 - x) ** 2 / seconds
        change = 60 * x * (1 - x) * (1 - 2 * x) / seconds**2
        offsets = [b - a for a, b in zip(start.position, goal)]
        trajectory.points.append(
            JointTrajectoryPoint(
                positions=[a + fraction * d for a, d in zip(start.position, offsets)],
                velocities=[speed * d for d in offsets],
                accelerations=[change * d for d in offsets],
                time_from_start=rospy.Duration.from_sec(x * seconds),
            )
        )
    return trajectory


rospy.init_node("moveit_client")
execution = Execution("/heptarm/follow_joint_trajectory", "/joint_states")
here = execution.wait_for_rest()
begin = dict(zip(here.name, here.position))

print("plan and execute:", execution.execute(plan(here, 2.0, A2=begin["A2"] + 0.3, A7=begin["A7"] - 0.4)))
here = execution.wait_for_rest()
print("stop in mid-air: ", execution.execute(plan(here, 6.0, A2=begin["A2"], A7=begin["A7"]), stop_after=1.0))
here = execution.wait_for_rest()
print("and home again:  ", execution.execute(plan(here, 2.0, **begin)))
