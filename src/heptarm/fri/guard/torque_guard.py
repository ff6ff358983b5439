"""Guard of superposed torques and wrenches: no axis passes its speed or a position limit, whatever a law computes.

The algorithm is in native/torque_guard.h; this is its memory and its call.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Sequence

import numpy as np

from heptarm._library import library
from heptarm.fri.guard.joint_guard import AXES, JointReport, Limited, Limits
from heptarm.values.checks import Array

#: Members of `struct torque_guard` and their sizes, all doubles.
MEMBERS: tuple[tuple[str, int], ...] = (
    ("robot", 105),
    ("low", AXES),
    ("high", AXES),
    ("dq_max", AXES),
    ("ddq_max", AXES),
    ("tau_max", AXES),
    ("is_started", 1),
    ("before", AXES),
    ("sent", AXES),
    ("earlier", AXES),
    ("oldest", AXES),
    ("unknown", AXES),
    ("cap", AXES),
    ("asked", AXES),
    ("allowed", AXES),
)
#: First bit of the axes that were limited, by quantity; as in torque_guard.h.
BITS = {Limited.VELOCITY: 0, Limited.POSITION: 8, Limited.TORQUE: 16}


@functools.cache
def _functions() -> ctypes.CDLL:
    made = library(holds_gil=True)
    pointer = ctypes.c_void_p
    made.fri_start_torque_guard.argtypes = (pointer,)
    made.fri_guard_torques.argtypes = (pointer, pointer, pointer, ctypes.c_double, ctypes.c_int, pointer)
    made.fri_guard_wrench.argtypes = (
        pointer,
        pointer,
        pointer,
        ctypes.c_double,
        ctypes.c_int,
        pointer,
        pointer,
    )
    return made


class TorqueGuard:
    """Guard of the torques, or of the wrench, of one client.

    Args:
        limits: the limits; positions, speeds and torques hold for the measured motion, and `ddq_max` is the planned
            deceleration.
        robot: link data, see `heptarm.model.dynamics.rigid_bodies`.
        report: receives what was limited; None creates one.

    Attributes:
        words: `struct torque_guard`, shared with the loop in C.
        was_limited: whether the last torques were limited.

    Raises:
        Unavailable: the compiled part of heptarm is missing.
    """

    def __init__(
        self, limits: Limits, robot: Sequence[float] | Array, *, report: JointReport | None = None
    ) -> None:
        self._functions = _functions()
        self.report = report or JointReport()
        self.words = np.zeros(sum(size for _, size in MEMBERS))
        parts, start = {}, 0
        for name, size in MEMBERS:
            parts[name] = self.words[start : start + size]
            start += size
        parts["robot"][:] = robot
        for name, values in (("low", limits.q_min), ("high", limits.q_max)):
            parts[name][:] = values
        for name in ("dq_max", "ddq_max", "tau_max"):
            parts[name][:] = getattr(limits, name)
        self._asked, self._allowed = parts["asked"], parts["allowed"]
        self._most, self._wrench = np.array(limits.wrench_max, dtype=np.float64), np.zeros(6)
        # of a call: positions, velocities, torques
        self._call = np.zeros((3, AXES))
        self._at = [self._call[i].ctypes.data for i in range(3)]
        self.was_limited = False

    def start(self) -> None:
        """Forget the motion so far: commands become effective."""
        self._functions.fri_start_torque_guard(self.words.ctypes.data)

    def limit(
        self,
        tau: Sequence[float],
        *,
        q: Sequence[float] | Array,
        dq: Sequence[float] | Array,
        period: float,
        is_braking: bool = False,
    ) -> list[float]:
        """Limit torques.

        Args:
            tau: target torques, finite, shape (7,) [Nm].
            q: measured positions, shape (7,) [rad].
            dq: velocities by the difference to the previous message, shape (7,) [rad/s].
            period: command period [s].
            is_braking: bring the arm to rest, whatever the torques are.

        Returns:
            Torques to send [Nm]; zero if q or dq are not finite, or are none that a robot has.
        """
        call = self._call
        call[0], call[1], call[2] = q, dq, tau
        q_at, dq_at, tau_at = self._at
        found = self._functions.fri_guard_torques(
            self.words.ctypes.data, q_at, dq_at, period, is_braking, tau_at
        )
        self._note(found)
        result: list[float] = call[2].tolist()
        return result

    def limit_wrench(
        self,
        wrench: Sequence[float],
        *,
        q: Sequence[float] | Array,
        dq: Sequence[float] | Array,
        period: float,
        is_braking: bool = False,
    ) -> list[float]:
        """Limit a wrench on the flange by the motion that it causes.

        Args:
            wrench: target wrench, base axes, finite, shape (6,) [N, Nm].
            q: as of `limit`, as the other arguments.
            dq: likewise.
            period: likewise.
            is_braking: likewise.

        Returns:
            Wrench to send [N, Nm]; zero if q or dq are not finite, or are none that a robot has.
        """
        call = self._call
        call[0], call[1], self._wrench[:] = q, dq, wrench
        q_at, dq_at, _ = self._at
        most, at = self._most.ctypes.data, self._wrench.ctypes.data
        self._note(
            self._functions.fri_guard_wrench(
                self.words.ctypes.data, q_at, dq_at, period, is_braking, most, at
            )
        )
        result: list[float] = self._wrench.tolist()
        return result

    def _note(self, found: int) -> None:
        self.was_limited = found != 0
        for kind, first in BITS.items() if found else ():
            for axis in range(AXES):
                if found >> (first + axis) & 1:
                    self.report.add(kind, axis, float(self._asked[axis]), float(self._allowed[axis]))
