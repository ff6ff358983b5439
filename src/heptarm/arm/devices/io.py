"""Signals of the cabinet, read from the pushed states and written by requests."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.arrays import scalar, within
from heptarm.values.io import Signal, SignalValue, SignalValues, find_name
from heptarm.values.state import State
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code

if TYPE_CHECKING:
    from heptarm.arm.connection import Connection

_GROUP = "io"
#: How long the first state with signals may take [s].
_FIRST = 5.0
#: Lamps of a media flange by the colours of `Io.led`.
_LAMPS = {"red": "LEDRed", "green": "LEDGreen", "blue": "LEDBlue"}
_COLOURS = (*_LAMPS, "off")


class Io(Mapping[str, SignalValue]):
    """The cabinet's signals; `arm.io`.

    A name is "Group.Name", or any part of it behind a point that only one signal has; case and underscores do not
    matter: `arm.io["MediaFlange.UserButton"]`, `arm.io["user_button"]`. The first reading subscribes to the state
    group "io", if nothing else has.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    @property
    def signals(self) -> dict[str, Signal]:
        """All signals by name, as the cabinet's project has them."""
        return {one.name: one for one in self._connection.signals}

    def __iter__(self) -> Iterator[str]:
        """Names of all signals."""
        return iter([one.name for one in self._connection.signals])

    def __len__(self) -> int:
        """How many there are."""
        return len(self._connection.signals)

    def __getitem__(self, name: str) -> SignalValue:
        """Value of a signal, from the newest state: True or False, or a number.

        Raises:
            CommandRejected: there is none of that name, or more than one.
        """
        self._find(name)
        return self.values_now[name]

    @property
    def values_now(self) -> SignalValues:
        """Values of all signals, from the newest state."""
        newest = self._connection.newest()
        if newest is None or newest.signals is None:
            newest = self._wait(lambda state: True, _FIRST)
        assert newest.signals is not None
        return newest.signals

    def __setitem__(self, name: str, value: SignalValue) -> None:
        """Write an output. Raises as `set` does."""
        self.set({name: value})

    def set(self, values: Mapping[str, SignalValue]) -> None:
        """Write outputs, all or none.

        Args:
            values: by name; True or False, or a number.

        Raises:
            CommandRejected: no such output.
            LimitError: a value that it cannot have.
        """
        if not values:
            raise ShapeError("no output is named", code=3, parameter="values", hint='arm.io.set({"LEDBlue": True})')
        wishes = tuple(output(name, value, self._connection.signals) for name, value in values.items())
        self._connection.request(wire.SetSignals(values=wishes))

    def wait(self, name: str, value: SignalValue = True, *, timeout: float = 30.0) -> State:
        """Wait until a signal has a value; looked at here, in the pushed states.

        Raises:
            Timeout: it does not have it in time.
            CommandRejected: there is no such signal.
        """
        full = self._find(name).name
        seconds = within(timeout, "timeout", 0.0, 1e9, unit="s")
        with self._connection.stopping_on_interrupt():
            return self._wait(
                lambda state: state.signals is not None and state.signals[full] == value, seconds
            )

    @property
    def led(self) -> str:
        """Colour of the media flange's lamp: "red", "green", "blue", or "off"; to be set as well."""
        lit = [colour for colour, lamp in self._lamps.items() if self[lamp]]
        return lit[0] if lit else "off"

    @led.setter
    def led(self, colour: str) -> None:
        lamps = self._lamps
        if colour not in (*lamps, "off"):
            known = ", ".join((*lamps, "off")) if colour in _COLOURS else ", ".join(_COLOURS)
            raise CommandRejected(
                f"the lamp of this media flange cannot be {colour!r}; it can be {known}",
                parameter="led",
                value=colour,
                allowed=known,
            )
        self.set({lamp: one == colour for one, lamp in lamps.items()})

    @property
    def _lamps(self) -> dict[str, str]:
        """Full names of the lamps that there are, by colour."""
        names = tuple(self)
        found = {c: n for c, lamp in _LAMPS.items() for n in names if n.rpartition(".")[2] == lamp}
        if not found:
            raise CommandRejected("this cabinet has no media flange with a lamp", parameter="led")
        return found

    def _find(self, name: str) -> Signal:
        return self._connection.signals[find_name(name, tuple(self))]

    def _wait(self, condition: object, timeout: float) -> State:
        connection = self._connection
        if _GROUP not in connection.options.groups:
            connection.subscribe(connection.options.rate, (*connection.options.groups, _GROUP))
        return connection.wait_for(
            lambda state: state.signals is not None and condition(state),  # type: ignore[operator]
            timeout,
        )


def output(name: str, value: SignalValue, signals: Sequence[Signal]) -> wire.SetSignal:
    """The wish that an output has a value.

    Raises:
        CommandRejected: no such output.
        LimitError: a value that it cannot have.
    """
    signal = signals[find_name(name, tuple(one.name for one in signals))]
    if not signal.is_output:
        raise CommandRejected(
            f"{signal.name} is an input of the cabinet",
            code=Code.UNSUPPORTED,
            parameter="signal",
            value=name,
            hint="outputs can be written",
        )
    number = float(value) if isinstance(value, bool) else scalar(value, signal.name)
    if not isfinite(number):
        within(number, signal.name, signal.low, signal.high)
    if isinstance(value, bool) != (signal.kind == "boolean") and number not in (0.0, 1.0):
        raise LimitError(
            f"{signal.name} is {signal.kind}; it cannot be {value!r}",
            code=2,
            parameter=signal.name,
            value=value,
            allowed="True or False" if signal.kind == "boolean" else f"[{signal.low:g}, {signal.high:g}]",
        )
    within(number, signal.name, signal.low, signal.high)
    return wire.SetSignal(signal=signal.name, value=number)
