"""Calibration: what is on the flange, its tip (TCP) and its load data, and what the arm itself is like.

Poses, joint positions, torques and recordings come in; an estimate goes out, with the standard deviation of each
number. Nothing is changed by measuring: an estimate becomes a `Tool` by `to_tool`, a tool of a saved target or the file
of a fitted arm by `save`.
"""

from heptarm.calibration.arm_fit import ArmFit, Validation, simulator, validate
from heptarm.calibration.arm_samples import ArmSamples
from heptarm.calibration.excitation import ExcitationPlan, excitation, record_excitation
from heptarm.calibration.links import KinematicFit, kinematics
from heptarm.calibration.load_estimate import IdentifiedLoad, LoadSamples, estimate_load
from heptarm.calibration.load_motion import LoadPlan, load, load_plan
from heptarm.calibration.tip import TcpEstimate, record_poses, tcp
from heptarm.values.fitted_arm import FittedArm, FittedNumbers, load_fitted

__all__ = [
    "ArmFit",
    "ArmSamples",
    "ExcitationPlan",
    "FittedArm",
    "FittedNumbers",
    "IdentifiedLoad",
    "KinematicFit",
    "LoadPlan",
    "LoadSamples",
    "TcpEstimate",
    "Validation",
    "estimate_load",
    "excitation",
    "kinematics",
    "load",
    "load_fitted",
    "load_plan",
    "record_excitation",
    "record_poses",
    "simulator",
    "tcp",
    "validate",
]
