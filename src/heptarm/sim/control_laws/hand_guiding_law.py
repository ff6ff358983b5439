"""Hand guiding: the arm follows a hand without weight, within joint and speed limits.

The law works on accelerations: excess joint velocities decay with a short time constant, and the inertia matrix turns
that into torques, so that a limit of one axis does not disturb the others. Towards a limit an axis may be only so fast
that it can still stop before it.
"""

from __future__ import annotations

from math import isnan

import numpy as np

from heptarm.planning.seam import HandGuide
from heptarm.sim.control_laws.cartesian_impedance import FlangeKinematics
from heptarm.sim.control_laws.laws import BRAKING, GUIDED, GUIDED_AXIS, MeasuredState
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: Decay rate of allowed velocities, so that the arm does not drift [1/s].
CALM = 5.0
#: Decay rate of excess velocities [1/s].
STRICT = 600.0
#: Highest speed limit of an axis, as a fraction of its maximum.
ROOM = 0.9
#: Fraction of an axis' acceleration assumed for stopping before a limit.
RESERVE = 0.4
#: Distance before its limit at which an axis is held [rad].
MARGIN = 0.02
#: Speed of return of an axis that was pushed beyond that position, and of one that began beyond it [rad/s]; close to
#: the position the speed is proportional to the distance [1/s].
RETURN, PULL, NEARING = 1.0, 0.3, 20.0
#: An axis this close to the position where it is held has reached its limit [rad].
REACHED = 2e-3


class HandGuidingLaw:
    """The law while the enabling switch is held.

    Args:
        guide: the limits.
        robot: the robot.
        flange: of the simulated arm.
        q: joint positions at the start, shape (7,) [rad].
        tcp: flange to tool frame, x y z [m].
        ceiling: largest speed of the tool frame [m/s].

    Attributes:
        is_frozen: an axis has reached its limit, and the guide holds all axes then.
    """

    is_stiff = False
    is_plain = False
    stays = False
    violation = ""

    def __init__(
        self,
        guide: HandGuide,
        robot: RobotModel,
        flange: FlangeKinematics,
        *,
        q: Array,
        tcp: tuple[float, ...],
        ceiling: float,
    ) -> None:
        self._flange = flange
        self._offset = np.array(tcp)
        low = np.fmax(guide.q_min, robot.q_min) + MARGIN
        high = np.fmin(guide.q_max, robot.q_max) - MARGIN
        self._low, self._high = low, high
        speed, along = guide.joint_velocity, guide.cartesian_velocity
        self._fastest = GUIDED_AXIS * robot.dq_max if isnan(speed) else np.minimum(speed, ROOM * robot.dq_max)
        self._ceiling = BRAKING * min(GUIDED[0] if isnan(along) else along, ceiling)
        self._slowing = 2.0 * RESERVE * robot.ddq_max
        self._inside = (low < q) & (q < high)
        pulls = guide.pulls_back
        # the limits of an axis that begins beyond its limit and may stay there follow it inwards
        self._floor: Array = low if pulls else np.minimum(low, q)
        self._roof: Array = high if pulls else np.maximum(high, q)
        self._back = -np.where(self._inside, RETURN, PULL)
        self._freezes = guide.freezes_all
        self.is_frozen = False

    def torque(self, sensed: MeasuredState) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""
        q, dq = sensed.q, sensed.dq
        self._floor = np.minimum(self._low, np.maximum(self._floor, q))
        self._roof = np.maximum(self._high, np.minimum(self._roof, q))
        below, above = q - self._floor, self._roof - q
        if self._freezes and (self._inside & (np.minimum(below, above) < REACHED)).any():
            self.is_frozen = True
        allowed = np.minimum(np.maximum(dq, -self._speed(below)), self._speed(above))
        allowed *= self._slower(allowed)
        acceleration = -CALM * allowed - STRICT * (dq - allowed)
        torque: Array = sensed.mass @ acceleration + sensed.bias - sensed.passive
        return torque

    def _speed(self, room: Array) -> Array:
        """Highest speed towards a limit, shape (7,) [rad/s]; negative: away from it."""
        there = np.sqrt(self._slowing * np.maximum(room, 0.0))
        back = np.maximum(NEARING * room, self._back)
        result: Array = np.minimum(np.where(room > 0.0, there, back), self._fastest)
        return result

    def _slower(self, dq: Array) -> float:
        """Factor that limits the speed of the tool frame."""
        if self._ceiling == np.inf:
            return 1.0
        flange = self._flange
        flange.update()
        twist = flange.jacobian @ dq
        speed = float(np.linalg.norm(twist[:3] + np.cross(twist[3:], flange.rotation @ self._offset)))
        return 1.0 if speed <= self._ceiling else self._ceiling / speed
