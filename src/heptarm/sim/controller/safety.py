"""The safety controller of the virtual cabinet: stop requests, enabling switches, operation mode.

A stop holds execution. Execution continues only when no stop is requested any more and the operator's Start key or
the application resumes it. The plant reads the state in every tick; all methods may be called from any thread.
"""

from __future__ import annotations

import threading
from enum import Enum

from heptarm.planning.seam import OperationMode, SafetyFlags


class StopRequest(Enum):
    """Source of a stop request."""

    EMERGENCY_STOP = "emergency_stop"  # the button of the smartPAD
    EXTERNAL_EMERGENCY_STOP = "external_emergency_stop"  # a button beside the robot
    OPERATOR_SAFETY = "operator_safety"  # the safeguard is open
    PROTECTIVE_STOP = "protective_stop"  # a safety function, such as a monitored speed or a collision
    DRIVE_ERROR = "drive_error"  # the drives are off until the error is acknowledged


#: Flag of each stop request beside `SafetyFlags.PROTECTIVE_STOP`, which all of them set.
_FLAGS = {
    StopRequest.EMERGENCY_STOP: SafetyFlags.EMERGENCY_STOP,
    StopRequest.EXTERNAL_EMERGENCY_STOP: SafetyFlags.EXTERNAL_STOP,
    StopRequest.OPERATOR_SAFETY: SafetyFlags.SAFEGUARD_OPEN,
    StopRequest.PROTECTIVE_STOP: SafetyFlags.PROTECTIVE_STOP,
    StopRequest.DRIVE_ERROR: SafetyFlags.DRIVE_ERROR,
}


class SafetyController:
    """State of the safety controller.

    Attributes:
        mode: operation mode.
        manual: override at the smartPAD, a factor on every speed, 0 to 1.
        stop_requested: a stop is requested now.
        latched: execution is held by a stop that is or was requested.
        flags: of `SafetyFlags` those that the safety controller decides about, as a plain integer for the tick.
    """

    def __init__(self) -> None:
        self.mode = OperationMode.AUT
        self.manual = 1.0
        self.stop_requested = False
        self.latched = False
        self._enabled = False
        self._guides = False
        self._requests: frozenset[StopRequest] = frozenset()
        self._lock = threading.Lock()
        self._settle()

    @property
    def stop_requests(self) -> frozenset[StopRequest]:
        """The stop requests in force; a released enabling switch is not among them."""
        return self._requests

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
        """Whether the operation mode needs an enabling switch and none is held."""
        return self.mode is not OperationMode.AUT and not (self._enabled or self._guides)

    def request_stop(self, what: StopRequest) -> None:
        """Request a stop until `withdraw`."""
        with self._lock:
            self._requests |= {what}
            self._settle()

    def withdraw(self, *what: StopRequest) -> None:
        """Withdraw stop requests; without a name all of them."""
        with self._lock:
            self._requests = self._requests - set(what) if what else frozenset()
            self._settle()

    def enable(self) -> None:
        """Hold the enabling switch."""
        with self._lock:
            self._enabled = True
            self._settle()

    def release(self) -> None:
        """Release the enabling switch."""
        with self._lock:
            self._enabled = False
            self._settle()

    def guide(self) -> None:
        """Hold the enabling switch of the hand guiding device."""
        with self._lock:
            self._guides = True
            self._settle()

    def let_go(self) -> None:
        """Release the enabling switch of the hand guiding device."""
        with self._lock:
            self._guides = False
            self._settle()

    def choose(self, mode: OperationMode) -> None:
        """Choose the operation mode; a change holds execution, as on the cabinet."""
        with self._lock:
            self.latched = self.latched or mode is not self.mode
            self.mode = mode
            self._settle()

    def resume(self) -> None:
        """Continue execution, unless a stop is requested."""
        with self._lock:
            self.latched = self.stop_requested

    def _settle(self) -> None:
        """Update stop state and flags; called with the lock held."""
        self.stop_requested = bool(self._requests) or self.lacks_enabling
        self.latched = self.latched or self.stop_requested
        flags = SafetyFlags.MASTERED
        if self._enabled:
            flags |= SafetyFlags.ENABLED
        if self._guides:
            flags |= SafetyFlags.HAND_GUIDING
        flags |= SafetyFlags.PROTECTIVE_STOP if self.stop_requested else SafetyFlags.READY
        for request in self._requests:
            flags |= _FLAGS[request]
        self.flags = int(flags)
