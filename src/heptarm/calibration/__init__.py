"""Calibration with the arm itself: the tip of a tool (TCP), its load data, and where a camera is (hand-eye).

Poses, joint positions, torques and pictures come in; an estimate goes out, with the standard deviation of each
number. Nothing is changed by measuring: an estimate becomes a `Tool` by `to_tool`, and a tool of a saved target by
`save`.
"""

from heptarm.calibration.board import Board, Sighting
from heptarm.calibration.hand_eye_estimate import HandEyeEstimate, HandEyeView, estimate_hand_eye
from heptarm.calibration.hand_eye_motion import HandEyePlan, hand_eye
from heptarm.calibration.load_estimate import IdentifiedLoad, LoadSamples, estimate_load
from heptarm.calibration.load_motion import LoadPlan, load, load_plan
from heptarm.calibration.tip import TcpEstimate, record_poses, tcp

__all__ = [
    "Board",
    "HandEyeEstimate",
    "HandEyePlan",
    "HandEyeView",
    "IdentifiedLoad",
    "LoadPlan",
    "LoadSamples",
    "Sighting",
    "TcpEstimate",
    "estimate_hand_eye",
    "estimate_load",
    "hand_eye",
    "load",
    "load_plan",
    "record_poses",
    "tcp",
]
