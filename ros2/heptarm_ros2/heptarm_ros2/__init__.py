"""The heptarm node of ROS 2: it converts messages for `heptarm.ros`, which does the work."""
