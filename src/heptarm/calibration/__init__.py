"""Calibration: the tip of a tool (TCP), its load data, where a camera is (hand-eye), and what the arm itself is like.

Poses, joint positions, torques, pictures and recordings come in; an estimate goes out, with the standard deviation of
each number. Nothing is changed by measuring: an estimate becomes a `Tool` by `to_tool`, a tool or camera of a saved
target or the file of a fitted arm by `save`.
"""

from heptarm.calibration.arm_fit import ArmFit, Validation, fri_command_delay, simulator, validate
from heptarm.calibration.arm_samples import ArmSamples
from heptarm.calibration.base_parameters import BaseParameters, base_parameters
from heptarm.calibration.board import Board, Sighting
from heptarm.calibration.excitation import ExcitationPlan, excitation, record_excitation
from heptarm.calibration.fri_delay import FriDelay
from heptarm.calibration.hand_eye_estimate import (
    HandEyeEstimate,
    HandEyeView,
    estimate_hand_eye,
    saved_camera,
)
from heptarm.calibration.hand_eye_motion import HandEyePlan, hand_eye
from heptarm.calibration.links import KinematicFit, kinematics
from heptarm.calibration.load_estimate import IdentifiedLoad, LoadSamples, estimate_load
from heptarm.calibration.load_motion import LoadPlan, load, load_plan
from heptarm.calibration.tip import TcpEstimate, record_poses, tcp
from heptarm.calibration.touching import KnownSurface, TouchPlan, estimate_touched_tcp, touch_plan, touch_tcp
from heptarm.values.fitted_arm import FittedArm, FittedNumbers, load_fitted

__all__ = [
    "ArmFit",
    "ArmSamples",
    "BaseParameters",
    "Board",
    "ExcitationPlan",
    "FittedArm",
    "FittedNumbers",
    "FriDelay",
    "HandEyeEstimate",
    "HandEyePlan",
    "HandEyeView",
    "IdentifiedLoad",
    "KinematicFit",
    "KnownSurface",
    "LoadPlan",
    "LoadSamples",
    "Sighting",
    "TcpEstimate",
    "TouchPlan",
    "Validation",
    "base_parameters",
    "estimate_hand_eye",
    "estimate_load",
    "estimate_touched_tcp",
    "excitation",
    "fri_command_delay",
    "hand_eye",
    "kinematics",
    "load",
    "load_fitted",
    "load_plan",
    "record_excitation",
    "record_poses",
    "saved_camera",
    "simulator",
    "tcp",
    "touch_plan",
    "touch_tcp",
    "validate",
]
