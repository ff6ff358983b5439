#!/bin/sh
# The arm from a shell, with the tools that every ROS 2 has. Needs the node: see docs/guide/ros2.md.
set -eu

echo "Where are the joints?"
ros2 topic echo --once /joint_states

echo "Joint 7 to 0.5 rad; the others stay."
ros2 topic pub --once /heptarm/command/joint sensor_msgs/msg/JointState "{name: [A7], position: [0.5]}"

echo "Half the speed, whatever moves the arm."
ros2 service call /heptarm/set_override heptarm_msgs/srv/SetNumber "{value: 0.5}"

echo "A little back: joint 7, as a goal of a trajectory controller."
ros2 action send_goal /heptarm/follow_joint_trajectory control_msgs/action/FollowJointTrajectory "
trajectory:
  joint_names: [A1, A2, A3, A4, A5, A6, A7]
  points:
  - {positions: [0.0, 0.2, 0.0, -1.5, 0.0, 1.4, 0.3], time_from_start: {sec: 2}}
  - {positions: [0.0, 0.0, 0.0, -1.57, 0.0, 1.57, 0.0], time_from_start: {sec: 4}}"

echo "Enough."
ros2 service call /heptarm/stop std_srvs/srv/Trigger "{}"
ros2 service call /heptarm/set_override heptarm_msgs/srv/SetNumber "{value: 1.0}"
