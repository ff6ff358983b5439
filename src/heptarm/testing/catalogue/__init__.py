"""The scenarios: what a robot can do, one module per topic, each a function that measures what it shows.

The names of a module and its functions are the scenarios' names, as in `heptarm check motions.ptp_joints`.
"""
