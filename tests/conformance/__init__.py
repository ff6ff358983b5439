"""Conformance of a FollowJointTrajectory server, independent of ROS: cases, their client, a cabinet with faults."""
