"""What became of an attempt to make the robot ready again."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Recovery:
    """What software has done, and what is left to a person.

    Attributes:
        done: the robot is ready to move.
        did: what was done, in words, in that order; empty: nothing had to be done, or nothing could be.
        remaining: steps of the operator, in words, one after the other; empty if done.
    """

    done: bool
    did: tuple[str, ...] = ()
    remaining: tuple[str, ...] = ()

    def __str__(self) -> str:
        """In words."""
        if self.done:
            return f"ready: {', '.join(self.did) or 'nothing had to be done'}"
        return f"not ready: {'; '.join(self.remaining)}"
