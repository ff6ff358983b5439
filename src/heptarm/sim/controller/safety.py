"""The safety controller of the virtual cabinet: who demands a stop, and what it tells of it.

A stop holds execution; it goes on only when nobody demands a stop any more and somebody, the operator's Start key or
the application, resumes it. The plant looks at it in every tick; everybody else may call it from any thread.
"""

from __future__ import annotations

import threading
from enum import Enum, IntEnum


class Mode(IntEnum):
    """Operation mode, as the cabinet numbers it."""

    T1 = 0
    T2 = 1
    AUT = 2


class Demand(Enum):
    """Who demands a stop."""

    EMERGENCY_STOP = "emergency_stop"  # the button of the smartPAD
    EXTERNAL_EMERGENCY_STOP = "external_emergency_stop"  # a button beside the robot
    OPERATOR_SAFETY = "operator_safety"  # the safeguard is open
    PROTECTIVE_STOP = "protective_stop"  # a safety function, such as a monitored speed or a collision
    DRIVE_ERROR = "drive_error"  # the drives are off until the error is acknowledged


class Safety:
    """What the safety controller knows.

    Attributes:
        mode: operation mode.
        manual: override at the smartPAD, a factor on every speed, 0 to 1.
        halts: a stop is demanded now.
        latched: execution is held by a stop that was or is demanded.
    """

    def __init__(self) -> None:
        self.mode = Mode.AUT
        self.manual = 1.0
        self.halts = False
        self.latched = False
        self._enabled = False
        self._guides = False
        self._demands: frozenset[Demand] = frozenset()
        self._lock = threading.Lock()

    @property
    def demands(self) -> frozenset[Demand]:
        """Who demands a stop now; the enabling switch is not among them."""
        return self._demands

    @property
    def enabled(self) -> bool:
        """Whether the enabling switch is held."""
        return self._enabled

    @property
    def guides(self) -> bool:
        """Whether the enabling switch of the hand guiding device is held."""
        return self._guides

    @property
    def lacks_enabling(self) -> bool:
        """Whether an enabling switch would have to be held."""
        return self.mode is not Mode.AUT and not (self._enabled or self._guides)

    def demand(self, what: Demand) -> None:
        """Demand a stop until `withdraw`."""
        with self._lock:
            self._demands |= {what}
            self._settle()

    def withdraw(self, *what: Demand) -> None:
        """Demand a stop no more; without a name: nobody does."""
        with self._lock:
            self._demands = self._demands - set(what) if what else frozenset()
            self._settle()

    def enable(self) -> None:
        """Hold the enabling switch."""
        with self._lock:
            self._enabled = True
            self._settle()

    def release(self) -> None:
        """Let the enabling switch go."""
        with self._lock:
            self._enabled = False
            self._settle()

    def guide(self) -> None:
        """Hold the enabling switch of the hand guiding device."""
        with self._lock:
            self._guides = True
            self._settle()

    def let_go(self) -> None:
        """Let the enabling switch of the hand guiding device go."""
        with self._lock:
            self._guides = False
            self._settle()

    def choose(self, mode: Mode) -> None:
        """Choose the operation mode; a change holds execution, as on the cabinet."""
        with self._lock:
            self.latched = self.latched or mode is not self.mode
            self.mode = mode
            self._settle()

    def resume(self) -> None:
        """Let execution go on, unless a stop is demanded."""
        with self._lock:
            self.latched = self.halts

    def _settle(self) -> None:
        """Under the lock: draw the conclusions."""
        self.halts = bool(self._demands) or self.lacks_enabling
        self.latched = self.latched or self.halts
