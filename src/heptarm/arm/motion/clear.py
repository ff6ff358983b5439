"""Targets that keep clear of bodies: what a stream of joint positions or poses asks before it sends one."""

from __future__ import annotations

import numpy as np

from heptarm.errors import CollisionForeseen
from heptarm.model.velocity import FREE, Slowdown
from heptarm.values.checks import Array
from heptarm.values.clearance import Clearance, ClearanceModel, TouchOnPath

#: Largest movement of a joint between two checks on the way from one target to the next [rad].
_STEP = 0.05
#: A pair that was too near when the stream began may get nearer by so much: noise of the sensors [m].
_NEARER = 0.5e-3

#: Two bodies, by their names.
_Pair = tuple[str, str]


class ClearTargets:
    """The last target that kept clear of bodies, and whether the next one does.

    A target is too near if two bodies are nearer than the model's margin there, or on the straight joint path from the
    last good target. Pairs that are nearer when the stream begins do not count while they do not get nearer, so that
    the arm can leave them.

    Args:
        model: of arm, tool and scene.
        q: joint positions at which the stream begins, shape (7,) [rad].

    Attributes:
        q: the last good target, shape (7,) [rad].
        held: targets that were not sent.
        slowdown: why the newest target was not sent; `FREE` if it was.
    """

    def __init__(self, model: ClearanceModel, q: Array) -> None:
        self._model = model
        self._known = self._near(q)
        self.q = q
        self.held = 0
        self.slowdown = FREE
        self._reasons: dict[str, Slowdown] = {}

    @property
    def slowdowns(self) -> tuple[Slowdown, ...]:
        """Every reason for which a target was not sent so far."""
        return tuple(self._reasons.values())

    def check(self, q: Array, *, parameter: str) -> None:
        """Take joint positions as the last good target if no bodies are too near there, or on the way.

        Args:
            q: joint positions of a target, shape (7,) [rad].
            parameter: the parameter that has the target.

        Raises:
            CollisionForeseen: bodies are too near; the last good target stays.
        """
        move = q - self.q
        count = max(1, int(np.ceil(float(np.abs(move).max()) / _STEP)))
        known = dict(self._known)
        for number in range(1, count + 1):
            there = q if number == count else self.q + number / count * move
            near = self._near(there)
            for pair, distance in near.items():
                if distance < known.get(pair, np.inf) - _NEARER:
                    self.held += 1
                    why = self.slowdown = Slowdown("{} near {}".format(*pair), 0.0)
                    self._reasons[why.reason] = why
                    raise self._refusal(Clearance(*pair, distance), number / count, there, parameter)
            known = {pair: distance for pair, distance in known.items() if pair in near}
        self.q, self._known, self.slowdown = q, known, FREE

    def _near(self, q: Array) -> dict[_Pair, float]:
        """Distances of the pairs that are nearer than the margin and not allowed to touch [m]."""
        model = self._model
        return {
            (clearance.first, clearance.second): clearance.distance
            for clearance in model.clearances(q, below=model.margin)
            if frozenset((clearance.first, clearance.second)) not in model.allowed
        }

    def _refusal(self, clearance: Clearance, at: float, q: Array, parameter: str) -> CollisionForeseen:
        return CollisionForeseen(
            f"the target is too near for keep_clear_of: {clearance}, which must be at least "
            f"{self._model.margin * 1e3:g} mm",
            touch=TouchOnPath(clearance, at, q),
            parameter=parameter,
            value=round(clearance.distance, 4),
            allowed=f"at least {self._model.margin:g} m",
            hint="the last good target was sent again, so the stream continues; send one that is farther away, or "
            "correct the model of the scene: keep_clear_of is an aid, no safety function",
        )
