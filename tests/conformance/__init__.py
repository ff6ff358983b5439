"""Conformance of a FollowJointTrajectory server, free of ROS: cases, their client, a cabinet with faults."""
