"""An order under way on a simulated controller, and how it comes to rest early."""

from __future__ import annotations

import numpy as np

from heptarm.values.arrays import Array
from heptarm.virtual.condition import Watching
from heptarm.virtual.guiding import Guidance
from heptarm.virtual.path import JointLine, JointPath
from heptarm.virtual.planner import Plan
from heptarm.virtual.profile import Limits, TimeLaw, brake
from heptarm.virtual.servo import Follower


class Run:
    """An order under way.

    Args:
        planned: its plan.
        serial: its number among all accepted orders.
        watches: its conditions.
    """

    __slots__ = (
        "braking",
        "broken",
        "cancelled",
        "ended",
        "failure",
        "follower",
        "guidance",
        "part",
        "path",
        "plan",
        "profile",
        "serial",
        "settling",
        "started",
        "time",
        "watches",
    )

    def __init__(self, planned: Plan, serial: int, watches: tuple[Watching, ...]) -> None:
        self.plan = planned
        self.serial = serial
        self.watches = watches
        self.path: JointPath | None = planned.path
        self.profile: TimeLaw | None = planned.profile
        self.failure = ""
        self.part = 0
        self.time = 0.0
        self.braking = False
        self.cancelled = False
        self.ended = False
        self.settling = 0
        self.started = False
        self.follower: Follower | None = None
        self.guidance: Guidance | None = None
        self.broken = False

    def brake(self, *, scale: float, rate: float) -> None:
        """Come to rest along the path, as fast as its limits allow.

        Args:
            scale: factor on the motion's time so far; from now on it runs at full speed.
            rate: its change per second.
        """
        if self.follower is not None:
            self.follower.brake(scale=scale, rate=rate)
            self.braking = True
            return
        if self.ended or self.profile is None or self.path is None:
            self.ended = self.ended or self.path is None
            return
        halts = self.plan.halts
        if halts is not None:
            self.profile = halts.brake(self.time, scale, rate)
        else:
            s, velocity, acceleration = self.profile.at(self.time)
            state = (s, velocity * scale, acceleration * scale * scale + velocity * rate)
            self.profile = brake(state, self.plan.braking)
        self.time, self.braking = 0.0, True

    def halt(self, here: Array, speed: Array, hardest: tuple[float, float]) -> None:
        """Come to rest off the path: straight on, every axis by itself.

        Args:
            here: where the set-points are, shape (7,) [rad].
            speed: how fast they move, shape (7,) [rad/s].
            hardest: acceleration [rad/s²] and jerk [rad/s³] of the fastest axis.
        """
        self.braking, self.follower, self.guidance = True, None, None
        full = float(np.abs(speed).max())
        self.ended = full < 1e-9
        if self.ended:
            self.path = None
            return
        self.path = JointLine(here.copy(), here + speed)
        limits = Limits(2.0, hardest[0] / full, hardest[1] / full)
        self.profile, self.time = brake((0.0, 1.0, 0.0), limits), 0.0
