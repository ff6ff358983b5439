"""Calibration: what is on the flange, measured with the arm itself: its tip (TCP) and its load data.

Poses, joint positions and torques come in; an estimate goes out, with the standard deviation of each number. Nothing
is changed by measuring: an estimate becomes a `Tool` by `to_tool`, and a tool of a saved target by `save`.
"""

from heptarm.calibration.load_estimate import IdentifiedLoad, LoadSamples, estimate_load
from heptarm.calibration.load_motion import LoadPlan, load, load_plan
from heptarm.calibration.tip import TcpEstimate, record_poses, tcp

__all__ = [
    "IdentifiedLoad",
    "LoadPlan",
    "LoadSamples",
    "TcpEstimate",
    "estimate_load",
    "load",
    "load_plan",
    "record_poses",
    "tcp",
]
