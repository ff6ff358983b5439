"""Policy for missing commands, in Python: what native/fri_commands.c has to do."""

from __future__ import annotations

from collections.abc import Sequence

from heptarm.fri.guard.fallback import Missing, Policy

from .pose_guard import between, moved


class CommandFallback:
    """Source of one target per cycle from commands at irregular times.

    Args:
        policy: the policy.

    Attributes:
        at: time of the last command [ns]; 0 before the first one.
        q: its position [rad].
        slope: its velocity, from the last two commands [rad/s].
        tau: its torques [Nm].
        wrench: its wrench [N, Nm].
        pose: its pose [m, x y z w].
        twist: velocity of the pose, from the last two commands [m/s, rad/s].
        e1: its redundancy angle [rad].
        is_filled: whether the last target was made without a fresh command.
        is_braking: whether the last target is to brake.
    """

    __slots__ = (
        "at",
        "e1",
        "is_braking",
        "is_filled",
        "period",
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
        self.period = 0.0  # between two commands that the cabinet takes [s]
        self.start()

    def start(self) -> None:
        """Start without a command; the interpolator is mirrored until the first one."""
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
        """Take a command of the user; parts that are None keep their values.

        Args:
            at: time of the command [ns].
            q: joint position [rad].
            tau: superposed torques [Nm].
            wrench: superposed wrench [N, Nm].
            pose: x y z [m], quaternion x y z w.
            e1: redundancy angle of the pose [rad].
        """
        gap = (at - self.at) * 1e-9
        # only two commands of one stream give its velocity, not two with a pause between them
        is_stream = 0.0 < gap <= self.patience
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

    def position_target(self, now: int, ipo: Sequence[float]) -> Sequence[float] | None:
        """Target position of this cycle; None to brake.

        Args:
            now: time of the cycle [ns].
            ipo: position of the interpolator, the target until a position is commanded.
        """
        age = self._age(now)
        if self.is_braking:
            return None
        if self.q is None:
            return ipo
        if self.policy.missing is Missing.EXTRAPOLATE and self.slope is not None:
            return [value + slope * age for value, slope in zip(self.q, self.slope, strict=True)]
        return self.q

    def pose_target(self, now: int, ipo: Sequence[float]) -> Sequence[float] | None:
        """Target pose of this cycle, x y z [m] and quaternion x y z w; None to brake.

        Args:
            now: time of the cycle [ns].
            ipo: pose of the interpolator, the target until a pose is commanded.
        """
        age = self._age(now)
        if self.is_braking:
            return None
        if self.pose is None:
            return ipo
        if self.policy.missing is Missing.EXTRAPOLATE and self.twist is not None:
            return moved(self.pose, [value * age for value in self.twist])
        return self.pose

    def elbow_target(self, now: int, ipo: float) -> float | None:
        """Target redundancy angle of this cycle [rad]; None to brake.

        Args:
            now: time of the cycle [ns].
            ipo: angle of the interpolator, the target until an angle is commanded.
        """
        self._age(now)
        return None if self.is_braking else ipo if self.e1 is None else self.e1

    @property
    def patience(self) -> float:
        """Time for which a command is fresh [s]."""
        return max(self.policy.patience, 1.5 * self.period)

    def _age(self, now: int) -> float:
        """Age of the last command [s]; update `is_filled` and `is_braking`."""
        self.is_filled = self.is_braking = False
        if not self.at:
            return 0.0
        age = (now - self.at) * 1e-9
        late = age - self.patience
        self.is_filled = late > 0.0
        missing = self.policy.missing
        if missing is not Missing.HOLD and late > (
            self.policy.over if missing is Missing.EXTRAPOLATE else 0.0
        ):
            self.is_braking = True
        return age

    def efforts(self, now: int) -> tuple[Sequence[float] | None, Sequence[float] | None]:
        """Target torques and wrench of this cycle; None where none was ever commanded."""
        fraction = self._fraction((now - self.at) * 1e-9 - self.patience) if self.at else 1.0
        tau, wrench = self.tau, self.wrench
        if fraction == 1.0:
            return tau, wrench
        return (
            None if tau is None else [fraction * value for value in tau],
            None if wrench is None else [fraction * value for value in wrench],
        )

    def _fraction(self, late: float) -> float:
        """Fraction of the last torque that remains this long after the command has expired."""
        if self.policy.missing is Missing.HOLD:
            return 1.0
        if self.policy.missing is Missing.EXTRAPOLATE:
            late -= self.policy.over
        if late <= 0.0:
            return 1.0
        return max(0.0, 1.0 - late / self.policy.over) if self.policy.over else 0.0
