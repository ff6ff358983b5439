"""The scenarios, one module per topic; each is a function that measures a property of the robot.

The names of a module and its functions are the scenarios' names, as in `heptarm check motions.ptp_joints`.
"""
