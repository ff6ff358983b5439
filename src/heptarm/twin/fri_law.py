"""The law by which the FRI client of a twin sends what the recorded client sent.

A file of its own: the process of the loop imports it, and nothing else of the twin.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from heptarm.fri.loop.user_api import Output, Params, State
from heptarm.record.fri_commands import FriCommands


class RecordedLaw:
    """Answers each message as the recorded client answered that of the same time since commands became effective.

    Where no answer was recorded it repeats the last one; behind the last one, too.

    Args:
        commands: what the client sent.
        load: what it superposed: "tau" or "wrench".
        speed: what if: a factor on the speed of its time, (0, 1].
    """

    def __init__(self, commands: FriCommands, load: Literal["tau", "wrench"], *, speed: float) -> None:
        answered = np.flatnonzero(commands.is_answered)
        ticks = np.round(commands.t[answered] / commands.period).astype(np.intp)
        last = np.searchsorted(ticks, np.arange(ticks[-1] + 1), side="right") - 1
        rows = answered[last.clip(0)]
        self._rate = speed / commands.period
        sent = commands.tau_sent if load == "tau" else commands.wrench_sent
        self._load, self._q, self._sent = load, commands.q_sent[rows], sent[rows]

    def __call__(self, state: State, out: Output, params: Params) -> None:
        """Command what was commanded at this time."""
        row = min(round(state.t * self._rate), len(self._q) - 1)
        out.q = self._q[row]
        setattr(out, self._load, self._sent[row])
