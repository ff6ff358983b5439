"""What both ROS nodes share, free of ROS: goals, trajectories, tolerances, execution, names. Nodes convert messages."""
