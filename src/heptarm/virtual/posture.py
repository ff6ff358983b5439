"""Arm angle and Status of a joint position in few sums, for the tick.

The same quantities as in heptarm.model.inverse, seen from the frame of A1: there the elbow lies in the x-z
plane and the angle is the one between the elbow's direction and that of the reference arm, about the line
from shoulder to wrist.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, sin, sqrt

from heptarm.model import inverse
from heptarm.values.robot import RobotModel

#: Nearer to the straight arm than this [rad] the elbow does not show the angle well.
_STRAIGHT = 1e-2
_ON_AXIS = 1e-10


def posture(robot: RobotModel, q: Sequence[float]) -> tuple[float, int]:
    """E1 [rad] and Status of joint positions [rad]."""
    q4 = q[3]
    s2, c2, s4, c4 = sin(q[1]), cos(q[1]), sin(q4), cos(q4)
    d_se, d_ew = robot.d_se, robot.d_ew
    # shoulder to wrist: first in the frame of A2, then in the frame of A1
    x, y, z = -d_ew * s4 * cos(q[2]), -d_ew * s4 * sin(q[2]), d_se + d_ew * c4
    x, z = c2 * x + s2 * z, c2 * z - s2 * x
    behind = x < -_ON_AXIS
    status = behind | (q4 < 0) << 1 | (q[5] <= 0) << 2
    if abs(s4) < _STRAIGHT:
        return inverse.arm_angle(robot, q, behind), status
    # elbow of the reference arm (A3 = 0): in the plane of z and w, on the side that A4's sign tells
    radius = sqrt(x * x + y * y)
    if radius < _ON_AXIS:
        return inverse.arm_angle(robot, q, behind), status
    side = -radius if behind else radius
    a2 = atan2(side, z) - atan2(-d_ew * s4, d_se + d_ew * c4)
    sa, ca = sin(a2), cos(a2)
    ux, uy = (x / side) * sa, (y / side) * sa
    # across = w . (reference x elbow) / |w|, along = components across w; the elbow is (s2, 0, c2)
    length = sqrt(x * x + y * y + z * z)
    across = (x * uy * c2 + y * (ca * s2 - ux * c2) - z * uy * s2) / length
    with_w = (x * ux + y * uy + z * ca) * (x * s2 + z * c2) / (length * length)
    return atan2(across, ux * s2 + ca * c2 - with_w), status
