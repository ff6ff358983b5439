"""The way `fri` to execute a trajectory: a position overlay over FRI, whose guard keeps the arm's limits.

The loop's process has the set-points of the next half second by the controller's time, so what this process does
meanwhile is not seen in the motion; if it falls silent the arm brakes along its way.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.fri import Fri
from heptarm.bridge import fri_law
from heptarm.bridge.course import Course
from heptarm.bridge.execution import Listener
from heptarm.bridge.following import Follower, Following
from heptarm.bridge.runner import Settings, Step
from heptarm.io.clock import Clock
from heptarm.rt import State
from heptarm.values.arrays import Array, within

_log = logging.getLogger("heptarm.bridge")

#: Set-points are given for so long ahead [s].
_AHEAD = 0.5
#: What changes the course does so after this time, at least: it has to reach the loop's process before [s].
_LEAD = 0.015
#: Messages that tell how the clocks go, and how fast their difference may be corrected [s/s].
_RECENT, _DRIFT = 400, 5e-4


@dataclass(frozen=True, slots=True)
class FriOptions:
    """How the way `fri` commands.

    Attributes:
        period: of the session [ms], 1 to 10.
        host: under which address the cabinet reaches this machine; empty: as the connection does.
        linger: how long the session stays open after a goal [s]; the next goal begins at once in it.
    """

    period: int = 5
    host: str = ""
    linger: float = 2.0

    def __post_init__(self) -> None:
        within(self.period, "fri.period", 1, 10, unit="ms")
        within(self.linger, "fri.linger", 0.0, 60.0, unit="s")


class FriExecution(Following):
    """Executes goals as a position overlay; `options` say how, for the rest see `Following`."""

    def __init__(
        self,
        arm: Arm,
        names: Sequence[str],
        listener: Listener,
        *,
        options: FriOptions | None = None,
        settings: Settings | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._options = options or FriOptions()
        super().__init__(arm, names, listener, linger=self._options.linger, settings=settings, clock=clock)

    @contextmanager
    def _motion(self) -> Iterator[Follower]:
        options = self._options
        rows = round(_AHEAD * 1e3 / options.period)
        slowing = float(self.settings.deceleration.min())
        with self._arm.fri(
            "position",
            period_ms=options.period,
            host=options.host,
            law=fri_law.follow,
            params={"begin": -1.0, "q": np.zeros((rows, 7)), "deceleration": slowing},
        ) as session:
            yield _Overlay(session, options.period * 1e-3)
        if session.limited:
            _log.warning("the guard limited what was commanded: %s", "; ".join(session.limited))


class _Overlay:
    """An FRI session as a follower: it keeps the loop's process in set-points for some time to come.

    Its time is the controller's, which the messages count, beside the clock of the execution: a message that comes late
    does not count.
    """

    why = "the cabinet ended the FRI session"

    def __init__(self, session: Fri, period: float) -> None:
        self._session, self._period = session, period
        self._lead = max(_LEAD, 3.0 * period)
        self._newest = 0.0  # the controller's time
        self._until = -1.0  # and that of the last set-point
        self._now = 0.0
        # the execution's clock minus the controller's time: at a time of the controller, and how it changes
        self._offset, self._at, self._drift = self._between(session.start), 0.0, 0.0
        self._course: Course | None = None
        self._before: Course | None = None
        self._since = 0.0

    def tick(self) -> float | None:
        """Wait for a message. Set-points before the time that is returned are out of reach."""
        state = self._session.next()
        if state is None:
            return None
        self._newest = state.t
        self._now = max(self._now, float(self._ours(state.t)) + self._lead)
        return self._now

    def follow(self, step: Step) -> None:
        """Bring the set-points up to date if there is news, or if they come to their end."""
        course, last = step.course, self._course
        is_new = last is None or course.key != last.key
        if not is_new and self._until - self._newest > _AHEAD / 2:
            return
        if is_new:
            self._before, self._since = last, self._now
        self._course = course
        params = self._session.params
        self._adjust()
        times: Array = self._newest + self._period * np.arange(float(len(params.q)))
        # a command is reached one period after it was asked for
        ours = self._ours(times) + self._period
        q = course.positions(ours)
        if self._before is not None:
            early = ours < self._since
            q[early] = self._before.positions(ours[early])
        params.set(begin=self._newest, q=q)
        self._until = float(times[-1])

    def _ours(self, t: Any) -> Any:
        """The execution's clock at a time of the controller, or at many [s]."""
        return t + self._offset + self._drift * (t - self._at)

    def _adjust(self) -> None:
        """Let the offset follow the clocks evenly, so slowly that no axis' limit is met by that."""
        self._offset, self._at = self._ours(self._newest) - self._newest, self._newest
        away = self._between(self._session.state) - self._offset
        self._drift = min(max(away / _AHEAD, -_DRIFT), _DRIFT)

    def _between(self, state: State) -> float:
        """The execution's clock minus the controller's time, by the messages that came fastest [s]."""
        recent = (one for one in self._session.history(_RECENT) if one.sequence <= state.sequence)
        fastest = min(one.received * 1e-9 - (one.sequence - state.sequence) * one.period for one in recent)
        return fastest - state.t
