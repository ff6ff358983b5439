"""What a simulated controller knows of an order under way."""

from __future__ import annotations

from heptarm.virtual.condition import Watching
from heptarm.virtual.guiding import Guidance
from heptarm.virtual.path import JointPath
from heptarm.virtual.planner import Plan
from heptarm.virtual.profile import TimeLaw
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
