"""The ROS interface of both nodes as tables: a row and a function for each topic, service and action.

Handlers convert messages, which have the same fields in both ROS, and call the driver or the public API of the arm.
"""
