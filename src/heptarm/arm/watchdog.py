"""Watchdogs: after which silence the cabinet stops the arm.

All defaults are in this table. Ranges, and defaults that the cabinet has, too, come from the schema of the protocol.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from heptarm.errors import LimitError
from heptarm.values.checks import within
from heptarm.wire import messages as wire


@dataclass(frozen=True, slots=True)
class Watchdog:
    """Longest silence that the cabinet accepts from a client or in a stream of targets.

    Attributes:
        default: unless the user gives another [s].
        low: shortest that the cabinet accepts [s].
        high: longest that the cabinet accepts [s].
        periods: the default is at least this many periods of the stream.
    """

    default: float
    low: float
    high: float
    periods: float = 0.0

    def time(self, given: float | None = None, *, period: float = 0.0) -> float:
        """The time to send to the cabinet [s].

        Args:
            given: what the user gave [s]; None: the default.
            period: time between two targets of the stream [s]; 0: no stream.

        Raises:
            LimitError: it is outside the range, or shorter than the period.
        """
        if given is None:
            time = min(max(self.periods * period, self.default), self.high)
        else:
            time = within(given, "watchdog", self.low, self.high, unit="s")
        if time < period:
            raise LimitError(
                f"watchdog must not be shorter than the period of {period:g} s, got {time:g} s",
                code=2,
                parameter="watchdog",
                value=time,
                allowed=f"[{period:g}, {self.high:g}] s",
                hint="give a longer watchdog or a higher rate",
            )
        return time


#: From a client in control.
CONNECTION = Watchdog(wire.TakeControl().watchdog, *wire.TakeControl.RANGES["watchdog"])
#: From a ROS node, which shares its processor with other nodes.
ROS_NODE = replace(CONNECTION, default=1.0)
#: From `heptarm check`, on a machine that may simulate as well.
CHECK = replace(CONNECTION, default=5.0)
#: Between two targets of a servo motion.
TARGETS = Watchdog(wire.ServoOpen().watchdog, *wire.ServoJoints.RANGES["watchdog"], periods=5.0)
#: Before the first target of a servo motion: the program may still prepare it.
FIRST_TARGET = replace(TARGETS, default=TARGETS.high)
#: Between two targets of a replay, each of which is computed.
REPLAY = replace(TARGETS, default=0.3)
