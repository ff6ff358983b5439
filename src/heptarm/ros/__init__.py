"""The common part of both ROS nodes, free of ROS: neither rclpy nor rospy is imported here.

`node` is one arm behind a node, `trajectory` executes FollowJointTrajectory, `interface` has the tables of topics,
services and actions. The nodes themselves (ros1/, ros2/) convert messages and register what the tables list.
"""
