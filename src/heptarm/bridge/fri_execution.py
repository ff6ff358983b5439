"""The way `fri` to execute a trajectory: a position overlay over FRI, whose guard keeps the arm's limits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from heptarm.arm.arm import Arm
from heptarm.arm.fri import Fri
from heptarm.bridge.execution import Execution, Follower, Listener
from heptarm.bridge.runner import Settings
from heptarm.bridge.trajectory import Sample
from heptarm.io.clock import Clock, RealClock
from heptarm.values.arrays import within


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


class FriExecution(Execution):
    """Executes goals as a position overlay; `options` say how, for the rest see `Execution`."""

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
        with self._arm.fri("position", period_ms=options.period, host=options.host) as session:
            yield _Overlay(session)


class _Overlay:
    """An FRI session as a follower."""

    why = "the cabinet ended the FRI session"

    def __init__(self, session: Fri) -> None:
        self._session = session
        self._clock: Clock = RealClock()
        self._last = self._clock.nanos()

    def tick(self) -> float | None:
        if self._session.next() is None:
            return None
        now = self._clock.nanos()
        passed, self._last = (now - self._last) * 1e-9, now
        return passed

    def follow(self, command: Sample) -> None:
        self._session.command(q=command.q)
