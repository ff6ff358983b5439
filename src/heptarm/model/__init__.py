"""Model of the arm: kinematics, inverse kinematics with redundancy, dynamics. Needs no connection.

::

    from heptarm import model
    from heptarm.values.robot import robot

    iiwa = robot("iiwa14")
    pose = model.forward(iiwa, q)
    q = model.solve(iiwa, pose, near=q)
    tau = model.gravity(iiwa, q)

Functions whose names end in `_batch` take the joint positions, or the poses, of many arms at once.
"""

from heptarm.model.batch import (
    RedundancyBatch,
    forward_batch,
    jacobian_batch,
    redundancy_batch,
    solve_batch,
)
from heptarm.model.dynamics import (
    centrifugal_matrix,
    coriolis,
    coriolis_matrix,
    forward_dynamics,
    gravity,
    inverse_dynamics,
    mass_matrix,
)
from heptarm.model.inverse_kinematics import arm_angle, intervals, redundancy, solve, solve_all
from heptarm.model.kinematics import forward, jacobian, jacobian_derivative, manipulability, nullspace

__all__ = [
    "RedundancyBatch",
    "arm_angle",
    "centrifugal_matrix",
    "coriolis",
    "coriolis_matrix",
    "forward",
    "forward_batch",
    "forward_dynamics",
    "gravity",
    "intervals",
    "inverse_dynamics",
    "jacobian",
    "jacobian_batch",
    "jacobian_derivative",
    "manipulability",
    "mass_matrix",
    "nullspace",
    "redundancy",
    "redundancy_batch",
    "solve",
    "solve_all",
    "solve_batch",
]
