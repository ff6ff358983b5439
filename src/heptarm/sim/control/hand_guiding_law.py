"""Hand guiding: the arm gives way to a hand as if it had no weight, and no more than its limits allow.

The law works on accelerations: what is unwanted in the joints' speeds decays with a short time constant, and the
inertia matrix makes torques of it, so that a limit of one axis does not disturb the others. Towards a limit an axis
may be only so fast that it can still stop before it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from heptarm.values.arrays import Array
from heptarm.values.guiding import HandGuide
from heptarm.values.robot import RobotModel
from heptarm.virtual.impedance import Flange
from heptarm.virtual.law import Sensed
from heptarm.virtual.servo import ServoTerms, SmartFollower

#: Speeds that nobody limits decay at this rate, so that the arm does not drift [1/s].
CALM = 5.0
#: Unwanted speed decays at this rate [1/s].
STRICT = 600.0
#: Share of an axis' speed that a hand may use where nobody says less.
ROOM = 0.9
#: Share of an axis' acceleration that is reckoned with for stopping before a limit.
RESERVE = 0.4
#: An axis is held so far before its limit [rad].
MARGIN = 0.02
#: One that was pushed beyond that place returns at this speed [rad/s], one that began beyond it at that speed; near
#: the place at a speed proportional to the distance [1/s].
RETURN, PULL, NEARING = 1.0, 0.3, 20.0
#: An axis that comes so near to the place where it is held has reached its limit [rad].
REACHED = 2e-3

#: Braking may jerk so many times more than a motion.
QUICK = 20.0

_FULL = (1.0,) * 7


class HandLaw:
    """The law while somebody leads.

    Args:
        guide: the limits.
        robot: the robot.
        flange: of the simulated arm.
        q: where it begins, shape (7,) [rad].
        tcp: flange to moved frame, x y z [m].
        ceiling: the moved frame is never led faster [m/s].

    Attributes:
        is_frozen: an axis has reached its limit, and that is to hold all of them.
    """

    is_stiff = False
    stays = False
    violation = ""

    def __init__(
        self,
        guide: HandGuide,
        robot: RobotModel,
        flange: Flange,
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
        self._fastest = np.fmin(guide.joint_velocity, ROOM * robot.dq_max)
        self._ceiling = float(np.fmin(guide.cartesian_velocity, ceiling))
        self._slowing = 2.0 * RESERVE * robot.ddq_max
        self._inside = (low < q) & (q < high)
        pulls = guide.outside == "pull"
        # the walls of an axis that is beyond its limit and may stay there follow it inwards
        self._floor: Array = low if pulls else np.minimum(low, q)
        self._roof: Array = high if pulls else np.maximum(high, q)
        self._back = -np.where(self._inside, RETURN, PULL)
        self._freezes = guide.at_limit == "all"
        self.is_frozen = False

    def torque(self, sensed: Sensed) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""
        q, dq = sensed.q, sensed.dq
        self._floor = np.minimum(self._low, np.maximum(self._floor, q))
        self._roof = np.maximum(self._high, np.minimum(self._roof, q))
        below, above = q - self._floor, self._roof - q
        if self._freezes and (self._inside & (np.minimum(below, above) < REACHED)).any():
            self.is_frozen = True
        allowed = np.minimum(np.maximum(dq, -self._speed(below)), self._speed(above))
        allowed *= self._slower(allowed)
        wanted = -CALM * allowed - STRICT * (dq - allowed)
        torque: Array = sensed.mass @ wanted + sensed.bias - sensed.passive
        return torque

    def _speed(self, room: Array) -> Array:
        """Highest speed towards a limit, shape (7,) [rad/s]; negative: away from it."""
        there = np.sqrt(self._slowing * np.maximum(room, 0.0))
        back = np.maximum(NEARING * room, self._back)
        result: Array = np.minimum(np.where(room > 0.0, there, back), self._fastest)
        return result

    def _slower(self, dq: Array) -> float:
        """Factor that brings the moved frame down to its highest speed."""
        if self._ceiling == np.inf:
            return 1.0
        flange = self._flange
        flange.update()
        twist = flange.jacobian @ dq
        speed = float(np.linalg.norm(twist[:3] + np.cross(twist[3:], flange.rotation @ self._offset)))
        return 1.0 if speed <= self._ceiling else self._ceiling / speed


class Guidance:
    """A hand guiding under way.

    Args:
        law: the law while somebody leads.
        robot: the robot.

    Attributes:
        law: see above.
        has_begun: somebody has led.
        rest: brings an arm to rest that nobody leads any more, and keeps it there; None: it is led, or was not yet.
    """

    def __init__(self, law: HandLaw, robot: RobotModel) -> None:
        self.law = law
        terms = ServoTerms.of(robot, velocity=_FULL, acceleration=_FULL)
        self._terms = replace(terms, jerk=QUICK * terms.jerk)
        self.has_begun = False
        self.rest: SmartFollower | None = None

    def halt(self, q: Array, dq: Array) -> SmartFollower:
        """Come to rest from a position [rad] and a velocity [rad/s], shape (7,) each."""
        if self.rest is None:
            self.rest = SmartFollower(self._terms, q)
            self.rest.brake(scale=1.0, rate=0.0, speed=np.clip(dq, -self._terms.velocity, self._terms.velocity))
        return self.rest
