#!/bin/sh
# The arm from a shell, with the tools that every ROS 1 has. Needs roscore and the node: see docs/guide/ros1.md.
set -eu

echo "Where are the joints?"
rostopic echo -n 1 /joint_states/position

echo "Joint 7 to 0.5 rad; the others stay."
rostopic pub -1 /heptarm/command/joint sensor_msgs/JointState "{name: [A7], position: [0.5]}"

echo "Half the speed, whatever moves the arm."
rosservice call /heptarm/set_override 0.5

echo "A way there and back in four seconds: joint 1, as the topic of a trajectory controller."
rostopic pub -1 /heptarm/joint_trajectory trajectory_msgs/JointTrajectory "
joint_names: [A1, A2, A3, A4, A5, A6, A7]
points:
- {positions: [0.2, 0, 0, -1.57, 0, 1.57, 0.5], time_from_start: {secs: 2}}
- {positions: [0, 0, 0, -1.57, 0, 1.57, 0.5], time_from_start: {secs: 4}}"

echo "Enough."
rostopic pub -1 /heptarm/stop std_msgs/Empty
rosservice call /heptarm/set_override 1.0
rostopic echo -n 1 /heptarm/status/text
