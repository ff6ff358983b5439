"""A hand guiding motion: the law while a hand guides the arm, and coming to rest afterwards."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from heptarm.sim.control_laws.hand_guiding_law import HandGuidingLaw
from heptarm.sim.controller.servo import ServoLimits, SmartFollower
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: Jerk of braking relative to that of a motion.
QUICK = 20.0

_FULL = (1.0,) * 7


class GuidedMotion:
    """A hand guiding motion that is being executed.

    Args:
        law: the law while the enabling switch is held.
        robot: the robot.

    Attributes:
        law: see above.
        has_begun: the enabling switch was held once.
        rest: trajectory to rest after the switch was released; None: it is held, or was not held yet.
    """

    def __init__(self, law: HandGuidingLaw, robot: RobotModel) -> None:
        self.law = law
        limits = ServoLimits.of(robot, velocity=_FULL, acceleration=_FULL)
        self._limits = replace(limits, jerk=QUICK * limits.jerk)
        self.has_begun = False
        self.rest: SmartFollower | None = None

    def halt(self, q: Array, dq: Array) -> SmartFollower:
        """Come to rest from a position [rad] and a velocity [rad/s], shape (7,) each."""
        if self.rest is None:
            self.rest = SmartFollower(self._limits, q)
            self.rest.brake(
                scale=1.0, rate=0.0, speed=np.clip(dq, -self._limits.velocity, self._limits.velocity)
            )
        return self.rest
