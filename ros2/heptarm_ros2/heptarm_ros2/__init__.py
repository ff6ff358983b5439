"""The heptarm node of ROS 2: it converts messages for `heptarm.bridge`, which does the work."""
