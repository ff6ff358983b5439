"""Collision watch of a session: the external torques of every message against the bands of a collision guard."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from heptarm.values.condition.collision import Collision, CollisionGuard


class CollisionWatch:
    """Detects the torque of a joint outside its band.

    Args:
        threshold: allowed deviation from the baseline, 7 numbers [Nm].
        baseline: external torques at rest, 7 numbers [Nm].
        margin: added to a threshold per speed of the joint, 7 numbers [Nm s/rad].

    Attributes:
        threshold, baseline, margin: likewise.
    """

    def __init__(
        self, threshold: Sequence[float], baseline: Sequence[float], margin: Sequence[float]
    ) -> None:
        self.threshold, self.baseline, self.margin = tuple(threshold), tuple(baseline), tuple(margin)

    def collision(self, tau_ext: Sequence[float] | None, dq: Sequence[float]) -> Collision | None:
        """The joint farthest beyond its band; None: all are within.

        Args:
            tau_ext: external torques [Nm]; None: the controller sends none, which counts as a collision of A1, since
                nothing is watched then.
            dq: velocities, 7 numbers [rad/s]; NaN counts as zero.
        """
        if tau_ext is None:
            return Collision(0, math.nan, self.threshold[0])
        worst = 0.0
        found: Collision | None = None
        for joint, (torque, rest, threshold, margin, speed) in enumerate(
            zip(tau_ext, self.baseline, self.threshold, self.margin, dq, strict=True)
        ):
            allowed = threshold + (0.0 if math.isnan(speed) else margin * abs(speed))
            excess = abs(torque - rest) - allowed
            if not excess <= worst:  # also a torque that is not a number
                worst, found = excess, Collision(joint, torque - rest, allowed)
                if math.isnan(excess):
                    break
        return found


def as_numbers(guard: CollisionGuard) -> dict[str, list[float]]:
    """The bands of a guard as plain numbers, by the names of `CollisionWatch`."""
    return {name: getattr(guard, name).tolist() for name in ("threshold", "baseline", "margin")}


def watch_of(numbers: Mapping[str, Sequence[float]] | None) -> CollisionWatch | None:
    """The watch of such numbers."""
    return None if numbers is None else CollisionWatch(**numbers)
