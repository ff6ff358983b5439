"""What an FRI client commanded in a recording, cycle by cycle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from heptarm.fri.loop.shared_memory import ANSWERED
from heptarm.fri.protocol.messages import SessionState
from heptarm.record.recorded import FRI, RecordedData
from heptarm.values.checks import Array, Value, frozen

#: Arrays of a cycle that are taken, without the prefix of their names.
_NAMES = ("q", "q_cmd", "q_sent", "tau_sent", "wrench_sent")
#: So many lost messages end the commands of a session: an overlay that is started again has its own.
_LOST = 100


@dataclass(frozen=True, slots=True, eq=False)
class FriCommands(Value):
    """The cycles of an FRI session in which its client commanded.

    Their times count the controller's messages, so that neither the network nor a busy client moves them.

    Attributes:
        begin: when commands became effective, on the time line of the recording [s].
        period: time between two messages [s].
        t: time of each message since then, ascending, shape (n,) [s].
        is_answered: whether the client answered it, shape (n,).
        q: measured positions, shape (n, 7) [rad].
        q_cmd: positions that the controller commanded, shape (n, 7) [rad]; NaN: this version of FRI sends none.
        q_sent: positions of the answers, shape (n, 7) [rad].
        tau_sent: torques of the answers, shape (n, 7) [Nm].
        wrench_sent: wrenches of the answers, shape (n, 6) [N, Nm].
    """

    begin: float
    period: float
    t: Array
    is_answered: npt.NDArray[np.bool_]
    q: Array
    q_cmd: Array
    q_sent: Array
    tau_sent: Array
    wrench_sent: Array

    @staticmethod
    def of(run: RecordedData) -> tuple[FriCommands, ...]:
        """Those of each session of a recording, in order; none without FRI cycles."""
        if f"{FRI}session" not in run:
            return ()
        active = np.flatnonzero(run[f"{FRI}session"] == SessionState.COMMANDING_ACTIVE)
        if not len(active):
            return ()
        steps = np.diff(run[f"{FRI}sequence"][active])
        parts = np.split(active, np.flatnonzero((steps <= 0) | (steps > _LOST)) + 1)
        return tuple(_commands(run, rows) for rows in parts)


def _commands(run: RecordedData, rows: npt.NDArray[np.intp]) -> FriCommands:
    """The commands of some cycles."""
    period = float(np.median(run[f"{FRI}period"][rows])) * 1e-9
    sequence = run[f"{FRI}sequence"][rows]
    t = (sequence - sequence[0]) * period
    arrays = (frozen(np.asarray(run[f"{FRI}{name}"][rows], dtype=np.float64)) for name in _NAMES)
    is_answered = (run[f"{FRI}flags"][rows] & ANSWERED) != 0
    # a message may arrive late, and never early
    begin = float(np.quantile(run[f"{FRI}t"][rows] - t, 0.1))
    return FriCommands(begin, period, frozen(t), is_answered, *arrays)
