"""Conditions on signals and on points of the path, and the names that users compare to make them: `io`, `path`."""

from __future__ import annotations

from dataclasses import dataclass

from heptarm.errors import ShapeError
from heptarm.values.checks import finite, shown, within, word
from heptarm.values.condition.condition import Condition, band_text, check_band
from heptarm.values.frames import check_name

#: Longest path [m] and delay [s].
PATH, DELAY = 100.0, 1000.0
#: Represents "no bound" in the band of a signal.
UNBOUNDED = 1e300


@dataclass(frozen=True, slots=True, eq=False)
class SignalIs(Condition):
    """A boolean signal has a value; `>` and `<` make a condition of a number signal.

    Attributes:
        signal: its name, as `arm.io` lists it.
        value: the value.
    """

    signal: str
    value: bool = True

    def __post_init__(self) -> None:
        check_name(self.signal, "signal")
        if not isinstance(self.value, bool):
            raise ShapeError(f"value must be True or False, got {shown(self.value)}", parameter="value")

    def __gt__(self, other: float) -> SignalOutside:
        return SignalOutside(self.signal, -UNBOUNDED, other)

    def __lt__(self, other: float) -> SignalOutside:
        return SignalOutside(self.signal, other, UNBOUNDED)

    def outside(self, low: float, high: float) -> SignalOutside:
        """The number signal is outside [low, high]."""
        return SignalOutside(self.signal, low, high)

    def __invert__(self) -> Condition:
        return SignalIs(self.signal, not self.value)

    def __str__(self) -> str:
        return f"{self.signal} is {str(self.value).lower()}"


@dataclass(frozen=True, slots=True, eq=False)
class SignalOutside(Condition):
    """A number signal is outside a band.

    Attributes:
        signal: its name, as `arm.io` lists it.
        low: lower bound, in the signal's unit.
        high: upper bound.
    """

    signal: str
    low: float
    high: float

    def __post_init__(self) -> None:
        check_name(self.signal, "signal")
        check_band(self.low, self.high, UNBOUNDED, "")

    def __str__(self) -> str:
        return f"{self.signal} {band_text(self.low, self.high, UNBOUNDED, '').rstrip()}"


@dataclass(frozen=True, slots=True, eq=False)
class PathReached(Condition):
    """A point on the path of the motion is reached.

    Attributes:
        distance: from the start, positive, or to the destination, negative [m].
        delay: time after that point, or before it if negative [s].
        reference: "start" or "destination": where the distance counts from.
    """

    distance: float
    delay: float = 0.0
    reference: str = "start"

    def __post_init__(self) -> None:
        word(self.reference, "reference", ("start", "destination"))
        low, high = (0.0, PATH) if self.reference == "start" else (-PATH, 0.0)
        within(self.distance, "distance", low, high, unit="m")
        within(self.delay, "delay", -DELAY, DELAY, unit="s")

    def __str__(self) -> str:
        where = (
            f"{abs(self.distance):g} m {'after the start' if self.reference == 'start' else 'before the end'}"
        )
        return where if self.delay == 0 else f"{where} and {self.delay:+g} s"


class IoSignals:
    """Signals of the cabinet by name: `io["MediaFlange.UserButton"]`, or `io.user_button` where that is unique."""

    __slots__ = ()

    def __getitem__(self, name: str) -> SignalIs:
        """A signal; by itself a condition that it is true."""
        return SignalIs(name)

    def __getattr__(self, name: str) -> SignalIs:
        """A signal."""
        if name.startswith("_"):
            raise AttributeError(name)
        return SignalIs(name)


class Path:
    """Points on the path of a motion; in joint space the path of the motion frame counts."""

    __slots__ = ()

    def after(self, metres: float = 0.0, *, seconds: float = 0.0) -> Condition:
        """A distance after the start, and a time after (or, negative, before) that point."""
        return PathReached(metres, seconds)

    def before_end(self, metres: float = 0.0, *, seconds: float = 0.0) -> Condition:
        """A distance before the destination, and a time before that point.

        Raises:
            ShapeError: negative seconds: after the end there is no motion.
        """
        finite(metres, "metres", unit="m")
        if finite(seconds, "seconds", unit="s") < 0:
            raise ShapeError(
                f"seconds must not be negative before the end, got {seconds:g} s",
                parameter="seconds",
                value=seconds,
                hint="it counts back from the end",
            )
        return PathReached(-metres if metres else 0.0, -seconds if seconds else 0.0, "destination")


io = IoSignals()
path = Path()
