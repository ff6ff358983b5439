"""What is sent when the user's commands stay away: the declared policy for missing commands."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass

from heptarm.errors import LimitError
from heptarm.fri.pose_guard import between, moved


class Missing(enum.Enum):
    """What to do without a fresh command.

    HOLD keeps the last one. EXTRAPOLATE lets position or pose move on with its last speed, from the moment it was
    commanded, and keeps torques and elbow; after `over` seconds it ramps down. RAMP_DOWN brakes the axes, or flange and
    elbow, to a stop where they are and lets torques and wrenches fall to zero within `over` seconds.
    """

    HOLD = "hold"
    EXTRAPOLATE = "extrapolate"
    RAMP_DOWN = "ramp down"


@dataclass(frozen=True, slots=True)
class Policy:
    """How long a command counts, and what comes after it.

    Attributes:
        missing: what to do without a fresh command.
        patience: a command is fresh for this long [s].
        over: duration of an extrapolation, and of a ramp of torques to zero [s].

    Raises:
        LimitError: a duration is negative.
    """

    missing: Missing = Missing.RAMP_DOWN
    patience: float = 0.05
    over: float = 0.1

    def __post_init__(self) -> None:
        for name in ("patience", "over"):
            if not getattr(self, name) >= 0.0:
                raise LimitError(f"{name} is {getattr(self, name)}; a duration [s] is wanted", parameter=name)


class Filler:
    """Turns commands that come when they come into one wish for every cycle.

    Args:
        policy: the declared policy.

    Attributes:
        at: when the last command was given [ns]; 0 before the first one.
        q: its position [rad].
        slope: its speed, told from the one before [rad/s].
        tau: its torques [Nm].
        wrench: its wrench [N, Nm].
        pose: its pose [m, x y z w].
        twist: the pose's speed, told from the one before [m/s, rad/s].
        e1: its redundancy angle [rad].
        is_filled: the last wish was made without a fresh command.
        is_braking: the last wish is to brake.
    """

    __slots__ = (
        "at",
        "e1",
        "is_braking",
        "is_filled",
        "policy",
        "pose",
        "q",
        "slope",
        "tau",
        "twist",
        "wrench",
    )

    def __init__(self, policy: Policy) -> None:
        self.policy = policy
        self.start()

    def start(self) -> None:
        """Begin without any command: the interpolator is mirrored until there is one."""
        self.at = 0
        self.q: Sequence[float] | None = None
        self.slope: Sequence[float] | None = None
        self.tau: Sequence[float] | None = None
        self.wrench: Sequence[float] | None = None
        self.pose: Sequence[float] | None = None
        self.twist: Sequence[float] | None = None
        self.e1: float | None = None
        self.is_filled = self.is_braking = False

    def command(
        self,
        at: int,
        *,
        q: Sequence[float] | None = None,
        tau: Sequence[float] | None = None,
        wrench: Sequence[float] | None = None,
        pose: Sequence[float] | None = None,
        e1: float | None = None,
    ) -> None:
        """Take a command of the user; what is None stays as it was.

        Args:
            at: when it was given [ns].
            q: joint position [rad].
            tau: superposed torques [Nm].
            wrench: superposed wrench [N, Nm].
            pose: x y z [m], quaternion x y z w.
            e1: redundancy angle of the pose [rad].
        """
        gap = (at - self.at) * 1e-9
        # two commands of one stream tell its speed, a pause between them does not
        is_stream = 0.0 < gap <= self.policy.patience
        if q is not None:
            if self.q is not None and is_stream:
                self.slope = [(new - old) / gap for new, old in zip(q, self.q, strict=True)]
            else:
                self.slope = None
            self.q = q
        if pose is not None:
            self.twist = None
            if self.pose is not None and is_stream:
                self.twist = [value / gap for value in between(self.pose, pose)]
            self.pose = pose
        self.tau = tau if tau is not None else self.tau
        self.wrench = wrench if wrench is not None else self.wrench
        self.e1 = e1 if e1 is not None else self.e1
        self.at = at

    def wish(self, now: int, ipo: Sequence[float]) -> Sequence[float] | None:
        """The position wanted now; None to brake.

        Args:
            now: the clock of the commands [ns].
            ipo: interpolator's position, which is mirrored until a position was commanded.
        """
        age = self._age(now)
        if self.is_braking:
            return None
        if self.q is None:
            return ipo
        if self.policy.missing is Missing.EXTRAPOLATE and self.slope is not None:
            return [value + slope * age for value, slope in zip(self.q, self.slope, strict=True)]
        return self.q

    def pose_wish(self, now: int, ipo: Sequence[float]) -> Sequence[float] | None:
        """The pose wanted now, x y z [m] and quaternion x y z w; None to brake.

        Args:
            now: the clock of the commands [ns].
            ipo: interpolator's pose, which is mirrored until a pose was commanded.
        """
        age = self._age(now)
        if self.is_braking:
            return None
        if self.pose is None:
            return ipo
        if self.policy.missing is Missing.EXTRAPOLATE and self.twist is not None:
            return moved(self.pose, [value * age for value in self.twist])
        return self.pose

    def elbow_wish(self, now: int, ipo: float) -> float | None:
        """The redundancy angle wanted now [rad]; None to brake.

        Args:
            now: the clock of the commands [ns].
            ipo: interpolator's, which is mirrored until one was commanded.
        """
        self._age(now)
        return None if self.is_braking else ipo if self.e1 is None else self.e1

    def _age(self, now: int) -> float:
        """Age of the last command [s]; says too whether it still counts."""
        self.is_filled = self.is_braking = False
        if not self.at:
            return 0.0
        age = (now - self.at) * 1e-9
        late = age - self.policy.patience
        self.is_filled = late > 0.0
        missing = self.policy.missing
        if missing is not Missing.HOLD and late > (
            self.policy.over if missing is Missing.EXTRAPOLATE else 0.0
        ):
            self.is_braking = True
        return age

    def efforts(self, now: int) -> tuple[Sequence[float] | None, Sequence[float] | None]:
        """Torques and wrench wanted now; None where none was ever commanded."""
        share = self._share((now - self.at) * 1e-9 - self.policy.patience) if self.at else 1.0
        tau, wrench = self.tau, self.wrench
        if share == 1.0:
            return tau, wrench
        return (
            None if tau is None else [share * value for value in tau],
            None if wrench is None else [share * value for value in wrench],
        )

    def _share(self, late: float) -> float:
        """How much of the last torque remains this long after patience has ended."""
        if self.policy.missing is Missing.HOLD:
            return 1.0
        if self.policy.missing is Missing.EXTRAPOLATE:
            late -= self.policy.over
        if late <= 0.0:
            return 1.0
        return max(0.0, 1.0 - late / self.policy.over) if self.policy.over else 0.0
