"""Signals of the cabinet: their description, and their values at one moment."""

from __future__ import annotations

from collections.abc import ItemsView, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.checks import Value, shown
from heptarm.values.text import lines

#: Value of a signal: boolean or number.
SignalValue: TypeAlias = bool | float


@dataclass(frozen=True, slots=True, eq=False)
class Signal(Value):
    """A signal of an IO group.

    Attributes:
        name: "Group.Name".
        is_output: whether the cabinet can write it.
        kind: "boolean", "integer", "unsigned" or "analog".
        low: its lowest value.
        high: its highest value.
    """

    name: str
    is_output: bool
    kind: str
    low: float = 0.0
    high: float = 1.0

    def value(self, number: float) -> SignalValue:
        """A number as the value of this signal."""
        return bool(number) if self.kind == "boolean" else float(number)


def find_name(name: str, names: Sequence[str]) -> int:
    """Index of a name: the full name, or the unique part after a dot; case and underscores are ignored.

    Raises:
        CommandRejected: there is none of that name, or more than one.
        ShapeError: it is no name.
    """
    if not isinstance(name, str):
        raise ShapeError(
            f"name must be the name of a signal, got {shown(name)}", parameter="name", value=name
        )
    if name in names:
        return names.index(name)
    plain = _plain(name)
    found = [
        place
        for place, known in enumerate(names)
        if plain in (_plain(known), _plain(known.rpartition(".")[2]))
    ]
    if len(found) == 1:
        return found[0]
    listed = ", ".join(names[place] for place in found) if found else ", ".join(names)
    raise CommandRejected(
        f"the name {name!r} matches several signals" if found else f"no signal {name!r}",
        code=42,
        parameter="signal",
        value=name,
        allowed=listed,
        hint=f"this cabinet has {listed or 'none'}",
    )


def find_signal(name: str, signals: Sequence[Signal]) -> Signal:
    """A signal by its name, as `find_name` finds it.

    Raises:
        CommandRejected: there is none of that name, or more than one.
    """
    return signals[find_name(name, tuple(signal.name for signal in signals))]


def _plain(name: str) -> str:
    return name.replace("_", "").casefold()


class BySignalName(Mapping[str, SignalValue]):
    """A mapping whose names are found as `find_name` finds them, so that `[]` refuses an unknown one with advice."""

    __slots__ = ()

    def __contains__(self, name: object) -> bool:
        """Whether one signal has that name."""
        try:
            return isinstance(name, str) and find_name(name, tuple(self)) >= 0
        except CommandRejected:
            return False

    def get(self, name: str, default: Any = None, /) -> Any:
        """Value of a signal, or the default where none has that name."""
        is_known = name in self
        return self[name] if is_known else default


class SignalValues(BySignalName):
    """Values of all signals: `values["MediaFlange.UserButton"]`, or `values.user_button` where that is unique.

    Args:
        stamp: cabinet time of the oldest of them [ns].
        values: by full names, in the cabinet's order.
    """

    __slots__ = ("_values", "stamp")

    def __init__(self, stamp: int, values: Mapping[str, SignalValue]) -> None:
        self.stamp = stamp
        self._values = dict(values)

    def __getitem__(self, name: str) -> SignalValue:
        """Value of a signal. Raises CommandRejected as `find_name` does."""
        names = tuple(self._values)
        return self._values[names[find_name(name, names)]]

    def __getattr__(self, name: str) -> SignalValue:
        """Value of a signal."""
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __iter__(self) -> Iterator[str]:
        """Full names."""
        return iter(self._values)

    def items(self) -> ItemsView[str, SignalValue]:
        """Full names with values."""
        return self._values.items()

    def __len__(self) -> int:
        """Number of signals."""
        return len(self._values)

    def __eq__(self, other: object) -> bool:
        """Equal names, values and time."""
        if not isinstance(other, SignalValues):
            return NotImplemented
        return self.stamp == other.stamp and self._values == other._values

    def __hash__(self) -> int:
        """Hash of names, values and time."""
        return hash((self.stamp, tuple(self._values.items())))

    def __str__(self) -> str:
        """A line for each signal."""
        rows = {
            name: ("on" if value else "off") if isinstance(value, bool) else f"{value:g}"
            for name, value in self._values.items()
        }
        return lines(f"{len(rows)} signals at {self.stamp * 1e-9:.3f} s of the cabinet", rows)

    def __repr__(self) -> str:
        """Short form."""
        return f"SignalValues({self._values})"


@dataclass(frozen=True, slots=True)
class GripperWiring:
    """Signals of a gripper by their names in the IO image, "Group.Name".

    Attributes:
        open: output that opens it.
        close: output that closes it.
        is_open: input of the switch at the open end.
        is_closed: input of the switch at the closed end: it is closed, with nothing between the fingers.
    """

    open: str = "MediaFlange.OutputX3Pin1"
    close: str = "MediaFlange.OutputX3Pin2"
    is_open: str = "MediaFlange.InputX3Pin3"
    is_closed: str = "MediaFlange.InputX3Pin4"

    @staticmethod
    def of(text: str) -> GripperWiring:
        """A wiring from "open=Group.Name close=Group.Name ..."; signals that are not named keep their default.

        "scene" is the gripper of the ready scenes, which is wired by default.

        Raises:
            CommandRejected: the text names something else.
        """
        pairs = [part.partition("=") for part in text.split() if text != "scene"]
        if not all(name in GripperWiring.__slots__ and signal for name, _, signal in pairs):
            names = ", ".join(GripperWiring.__slots__)
            raise CommandRejected(
                f"signals of a gripper must be NAME=Group.Signal with the names {names}, got {text!r}",
                parameter="gripper",
                value=text,
                hint='for example "open=Cell.Open close=Cell.Close", or "scene"',
            )
        return GripperWiring(**{name: signal for name, _, signal in pairs})
