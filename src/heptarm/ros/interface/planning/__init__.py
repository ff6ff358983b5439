"""Paths around bodies: the world of a node, the requests for paths, and MoveIt's own interface to both.

Messages come in from the tables of `heptarm.ros.interface`; paths go out to `Arm.find_path` and to the driver. The
search itself is in `heptarm.planning`.
"""
