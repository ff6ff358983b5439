"""The heptarm node of ROS 1: it converts messages for `heptarm.ros`, which does the work."""
