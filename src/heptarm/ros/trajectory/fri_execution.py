"""Execution `fri`: streams a trajectory as a position overlay over FRI; the FRI guard enforces the limits.

The process of the FRI loop gets the set-points of the next half second by the controller's time, so delays of this
process do not show in the motion. If this process falls silent, the arm brakes along its path.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.fri.session import Fri
from heptarm.fri.loop.user_api import State
from heptarm.io.clock import Clock
from heptarm.ros.trajectory import fri_law
from heptarm.ros.trajectory.execution import GoalListener
from heptarm.ros.trajectory.runner import ControlStep, ExecutionSettings
from heptarm.ros.trajectory.streamed_execution import CommandStream, StreamedExecution
from heptarm.ros.trajectory.trajectory import Preview
from heptarm.values.checks import Array, within

_log = logging.getLogger("heptarm.ros")

#: How far ahead set-points are sent [s].
_AHEAD = 0.5
#: Least delay of a change [s]: it has to reach the process of the FRI loop first.
_AHEAD_OF_CONTROLLER = 0.015
#: The clocks are compared over this time [s], and their difference is corrected so fast while the arm moves [s/s].
_RECENT, _DRIFT = 0.5, 5e-4


@dataclass(frozen=True, slots=True)
class FriOptions:
    """Options of the execution `fri`.

    Attributes:
        period: send period of the session [ms], 1 to 10.
        host: address of this machine as the cabinet reaches it; empty: that of the connection.
        linger: how long the session stays open after a goal [s]; the next goal starts in it without delay.
    """

    period: int = 5
    host: str = ""
    linger: float = 2.0

    def __post_init__(self) -> None:
        within(self.period, "fri.period", 1, 10, unit="ms")
        within(self.linger, "fri.linger", 0.0, 60.0, unit="s")


class FriExecution(StreamedExecution):
    """Executes goals as a position overlay over FRI; for the other arguments see `StreamedExecution`."""

    def __init__(
        self,
        arm: Arm,
        names: Sequence[str],
        listener: GoalListener,
        *,
        options: FriOptions | None = None,
        settings: ExecutionSettings | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._options = options or FriOptions()
        super().__init__(arm, names, listener, linger=self._options.linger, settings=settings, clock=clock)

    @contextmanager
    def _motion(self) -> Iterator[CommandStream]:
        options = self._options
        rows = round(_AHEAD * 1e3 / options.period)
        deceleration = float(self.settings.deceleration.min())
        with self._arm.fri(
            "position",
            period_ms=options.period,
            host=options.host,
            law=fri_law.follow,
            params={"begin": -1.0, "q": np.zeros((rows, 7)), "deceleration": deceleration},
        ) as session:
            yield _FriStream(session, options.period * 1e-3)
        if session.limited:
            _log.warning("the FRI guard limited commands: %s", "; ".join(session.limited))


class _FriStream:
    """An FRI session as a command stream: keeps the process of the FRI loop supplied with set-points.

    It counts the controller's time by messages and maps it to the clock of the execution, so that late messages do not
    disturb it.
    """

    end_reason = "the cabinet ended the FRI session"

    def __init__(self, session: Fri, period: float) -> None:
        self._session, self._period = session, period
        self._ahead = max(_AHEAD_OF_CONTROLLER, 3.0 * period)
        self._newest = 0.0  # controller time of the newest message
        self._until = -1.0  # controller time of the last set-point
        self._rest: Array | None = None  # the position of all set-points sent last, if they are the same
        self._now = 0.0
        # clock of the execution minus controller time: the offset, the controller time it holds at, and its rate
        self._offset, self._at, self._drift = self._between(session.start), 0.0, 0.0
        self._preview: Preview | None = None
        self._previous: Preview | None = None
        self._since = 0.0

    def tick(self) -> float | None:
        """Wait for a message; set-points before the returned time can no longer change."""
        state = self._session.next()
        if state is None:
            return None
        self._newest = state.t
        self._now = max(self._now, float(self._local(state.t)) + self._ahead)
        return self._now

    def command(self, step: ControlStep) -> None:
        """Send set-points if the preview has changed, or if those sent are about to run out."""
        preview, last = step.preview, self._preview
        is_new = last is None or preview.key != last.key
        if not is_new and self._until - self._newest > _AHEAD / 2:
            return
        if is_new:
            self._previous, self._since = last, self._now
        self._preview = preview
        params = self._session.params
        self._synchronise(preview, rest=None if is_new else self._rest)
        times: Array = self._newest + self._period * np.arange(float(len(params.q)))
        # the arm reaches a command one period after it was sent
        q = self._positions(preview, self._local(times) + self._period)
        params.set(begin=self._newest, q=q)
        self._rest = q[0] if (q == q[0]).all() else None
        self._until = float(times[-1])

    def _positions(self, preview: Preview, local: Array) -> Array:
        """Evaluate a preview at times on the clock of the execution; before it began, the one that it replaced."""
        q = preview.positions(local)
        if self._previous is not None:
            early = local < self._since
            q[early] = self._previous.positions(local[early])
        return q

    def _local(self, t: Any) -> Any:
        """Convert controller time, one or many, to the clock of the execution [s]."""
        return t + self._offset + self._drift * (t - self._at)

    def _synchronise(self, preview: Preview, *, rest: Array | None) -> None:
        """Correct the clock offset: at once while the arm rests, otherwise so slowly that no axis exceeds its limits.

        Args:
            preview: what the arm follows.
            rest: where the arm rests, shape (7,) [rad]; None: it moves, or is about to.
        """
        self._offset, self._at = self._local(self._newest) - self._newest, self._newest
        away = self._between(self._session.state) - self._offset
        self._drift = min(max(away / _AHEAD, -_DRIFT), _DRIFT)
        corrected = np.array([self._newest + self._offset + away + self._period])
        # it has to rest before the correction and after it
        if rest is not None and (self._positions(preview, corrected) == rest).all():
            self._offset, self._drift = self._offset + away, 0.0

    def _between(self, state: State) -> float:
        """Estimate the clock of the execution minus controller time from the least delayed messages [s].

        Those of before the motion do not count: a virtual cabinet may have lost time when it began.
        """
        first, recent = self._session.start.sequence, self._session.history(round(_RECENT / self._period))
        # the message itself may be older than those if this process was held up
        used = (state, *(sample for sample in recent if first <= sample.sequence <= state.sequence))
        fastest = min(
            sample.received * 1e-9 - (sample.sequence - state.sequence) * sample.period for sample in used
        )
        return fastest - state.t
