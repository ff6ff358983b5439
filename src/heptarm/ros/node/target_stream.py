"""Targets that come one by one as messages: the first one opens a servo motion, silence ends it."""

from __future__ import annotations

import logging
import threading
from typing import Any, Literal

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.servo import JointServo, PoseServo
from heptarm.bridge.servo_execution import ServoOptions
from heptarm.errors import HeptarmError, NotReady
from heptarm.io.clock import RealClock
from heptarm.values.arrays import Array, array
from heptarm.values.condition import Condition
from heptarm.values.pose import Pose
from heptarm.values.result import Cause

_log = logging.getLogger("heptarm.bridge")

#: A velocity is turned into a target so far ahead [s]; the cabinet keeps a target's velocity longer than that.
_AHEAD = 0.05


class Stream:
    """Targets that come one by one; the cabinet's own watchdog brakes the arm when they stay away.

    Args:
        arm: in control.
        timeout: within this time after a target the next one has to come [s].
        options: ceilings.
        line_speed: along each axis of the base, of straight lines [m/s].
    """

    def __init__(
        self, arm: Arm, *, timeout: float, options: ServoOptions, line_speed: float = 0.25
    ) -> None:
        self._arm = arm
        self._timeout = timeout
        self._options = options
        self._line_speed = line_speed
        self._clock = RealClock()
        self._lock = threading.RLock()
        self._servo: JointServo | PoseServo | None = None
        self._q = np.zeros(7)
        self._last = 0
        self._guard: Condition | None = None
        self._fired = ""
        self._kind = ""  # of poses

    @property
    def guard(self) -> Condition | None:
        """Condition that ends what comes next; setting one lets the arm follow again after it has fired."""
        return self._guard

    @guard.setter
    def guard(self, value: Condition | None) -> None:
        with self._lock:
            self._guard, self._fired = value, ""

    def latch(self, why: str) -> None:
        """Follow no more until somebody sets the guard anew; it waits for nothing."""
        self._fired = why

    @property
    def active(self) -> bool:
        """Whether the arm follows."""
        servo = self._servo
        return servo is not None and servo.active

    def joints(self, q: Array, dq: Array | None = None) -> None:
        """Follow joint positions, shape (7,) [rad], passed at `dq` [rad/s]."""
        with self._lock:
            wanted = array(q, 7, "position")
            self._q = self._joint_servo().set(wanted, None if dq is None else array(dq, 7, "velocity"))

    def velocity(self, dq: Array) -> None:
        """Move at joint velocities, shape (7,) [rad/s], at most the robot's."""
        with self._lock:
            robot = self._arm.robot
            wanted = np.clip(array(dq, 7, "velocity"), -robot.dq_max, robot.dq_max)
            was_active = self.active
            servo = self._joint_servo()
            now = self._clock.nanos()
            if not was_active:
                self._q, self._last = servo.start.q.copy(), now
            passed = min((now - self._last) * 1e-9, self._timeout)
            self._last = now
            self._q = np.clip(self._q + wanted * passed, robot.q_min, robot.q_max)
            servo.set(self._q + wanted * _AHEAD, wanted)

    def pose(self, pose: Pose, *, straight: bool = False) -> None:
        """Follow a pose of the flange in the base, on straight lines or as the joints go."""
        kind: Literal["pose", "lin"] = "lin" if straight else "pose"
        with self._lock:
            servo = self._servo
            if not isinstance(servo, PoseServo) or not servo.active or self._kind != kind:
                self._prepare()
                servo = self._servo = self._arm.servo(kind, **self._of(kind)).__enter__()
                self._kind = kind
            servo.set(pose)

    def close(self) -> None:
        """End it at rest; what ended it earlier is told to the log."""
        with self._lock:
            servo, self._servo = self._servo, None
            if servo is not None:
                try:
                    servo.close()
                except HeptarmError as error:
                    _log.info("the stream of targets ended: %s", error)
                result = servo.result
                if result is not None and result.cause is Cause.CONDITION:
                    self._fired = "the guard" if result.stopped_by is None else str(result.stopped_by)

    def _joint_servo(self) -> JointServo:
        servo = self._servo
        if not isinstance(servo, JointServo) or not servo.active:
            self._prepare()
            servo = self._servo = self._arm.servo("joint", **self._settings).__enter__()
        return servo

    def _prepare(self) -> None:
        """End the last one; after the guard has fired the arm follows no more, until somebody sets a guard anew.

        Raises:
            NotReady: the guard has fired.
        """
        self.close()
        if self._fired:
            raise NotReady(f"ended by {self._fired}", hint="set the guard anew, or none")

    def _of(self, kind: str) -> dict[str, Any]:
        """Settings of a servo motion of poses: a straight one has limits along its path."""
        settings = self._settings
        if kind == "lin":
            for name in ("speed", "acceleration", "engine"):
                del settings[name]
            settings["speed_mps"] = self._line_speed
        return settings

    @property
    def _settings(self) -> dict[str, Any]:
        options = self._options
        return {
            "rate": max(options.rate, 1.0 / self._timeout),
            "watchdog": self._timeout,
            "engine": "smart",
            "speed": options.speed,
            "acceleration": options.acceleration,
            "mode": options.mode,
            "until": self._guard,
        }
