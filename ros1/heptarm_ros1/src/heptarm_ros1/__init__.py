"""The heptarm node of ROS 1: it converts messages for `heptarm.bridge`, which does the work."""
