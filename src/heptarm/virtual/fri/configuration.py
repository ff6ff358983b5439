"""What an FRI session is opened with: version, timing, the signals and frames that the client may touch."""

from __future__ import annotations

from dataclasses import dataclass

from heptarm.errors import CommandRejected, LimitError
from heptarm.fri.messages import MAX_IO, MAX_NAME, MAX_TRANSFORMATIONS, IoValue
from heptarm.fri.version import Version

#: Legal periods [ms], of sending and of receiving.
PERIODS = (1, 100)


@dataclass(frozen=True, slots=True)
class Configuration:
    """Configuration of one session, as the application sets it up.

    Args:
        version: wire format.
        period_ms: time between two monitoring messages [ms], 1 to 100.
        multiplier: the client answers every n-th message; period times multiplier is at most 100 ms.
        signals: inputs and outputs that the client sees, with their first values; from 1.14 on, at most 10.
        transformations: names of the frames that the client provides, at most 5.

    Raises:
        LimitError: a period or a multiplier is out of range.
        CommandRejected: too many signals or frames, a name that FRI cannot carry, or one twice.
    """

    version: Version
    period_ms: int = 1
    multiplier: int = 1
    signals: tuple[IoValue, ...] = ()
    transformations: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        low, high = PERIODS
        if not low <= self.period_ms <= high:
            raise LimitError(
                f"period_ms is {self.period_ms}; FRI sends every {low} to {high} ms",
                parameter="period_ms",
                value=self.period_ms,
                allowed=f"[{low}, {high}] ms",
            )
        if self.multiplier < 1 or self.receive_ms > high:
            raise LimitError(
                f"multiplier is {self.multiplier} with a period of {self.period_ms} ms: the client would answer "
                f"every {self.receive_ms} ms; {low} to {high} ms are legal",
                parameter="multiplier",
                value=self.multiplier,
                allowed=f"[1, {high // self.period_ms}]",
            )
        self._check_names()

    def _check_names(self) -> None:
        if self.signals and not self.version.traits.io:
            raise CommandRejected(
                f"FRI {self.version.value} has no signals",
                parameter="signals",
                hint="they came with FRI 1.14",
            )
        names = [signal.name for signal in self.signals]
        for what, found, most in (
            ("signals", names, MAX_IO),
            ("transformations", list(self.transformations), MAX_TRANSFORMATIONS),
        ):
            if len(found) > most:
                raise CommandRejected(f"{len(found)} {what}; FRI carries at most {most}", parameter=what)
            for name in found:
                if not 0 < len(name.encode()) <= MAX_NAME or found.count(name) > 1:
                    raise CommandRejected(
                        f"{what} name {name!r}: 1 to {MAX_NAME} octets are legal, each name once",
                        parameter=what,
                        value=name,
                    )

    @property
    def receive_ms(self) -> int:
        """Time between two answers of the client [ms]."""
        return self.period_ms * self.multiplier
