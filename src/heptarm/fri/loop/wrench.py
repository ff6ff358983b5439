"""Estimate of the external wrench from the torques of the joints, for versions of FRI that send none.

It is the wrench on the flange that explains the external torques best, min |J' F - tau_ext|, damped (Siciliano et
al., "Robotics", 2009, section 3.5), so it is as good as the load data, and assumes a contact at the tool: a push on
the elbow is explained, too. The computation is `map_wrenches` of native/kinematics.h.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from heptarm.fri.loop.native import library
from heptarm.values.robot import RobotModel


def chain_of(arm: RobotModel) -> list[float]:
    """Kinematics of a robot, as `struct chain` of kinematics.h: origin of each joint, flange; 24 numbers [m]."""
    return [*arm.links.origin.reshape(-1).tolist(), *arm.links.flange.tolist()]


def external_wrench(arm: RobotModel, q: npt.ArrayLike, tau_ext: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Estimate the wrench.

    Args:
        arm: the robot.
        q: positions, shape (7,) [rad].
        tau_ext: external torques, shape (7,) [Nm].

    Returns:
        Force and moment on the flange in base axes, shape (6,) [N, Nm].

    Raises:
        Unavailable: the compiled part is missing.
    """
    chain, found = np.array(chain_of(arm)), np.zeros(6)
    places = (np.ascontiguousarray(vector, dtype=np.float64) for vector in (q, tau_ext))
    library().fri_wrench(chain.ctypes.data, *(place.ctypes.data for place in places), found.ctypes.data)
    return found
