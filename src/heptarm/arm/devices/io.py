"""Signals of the cabinet: read from the pushed states, written by requests."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from heptarm.arm.link.connection import Connection
from heptarm.arm.translate.triggers import output_message
from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.checks import finite, shown, within, word
from heptarm.values.io import BySignalName, Signal, SignalValue, SignalValues, find_name
from heptarm.values.sealed import Sealed
from heptarm.values.state import State
from heptarm.wire import messages as wire

_GROUP = "io"
#: Longest wait for the first state with signals [s].
_FIRST_STATE = 5.0
#: Lamps of a media flange by the colours of `Io.led`.
_LAMPS = {"red": "LEDRed", "green": "LEDGreen", "blue": "LEDBlue"}
_COLOURS = (*_LAMPS, "off")


class Io(Sealed, BySignalName):
    """The cabinet's signals; `arm.io`.

    A name is "Group.Name", or the part after a point if only one signal has it; case and underscores do not matter:
    `arm.io["MediaFlange.UserButton"]`, `arm.io["user_button"]`. The first reading subscribes to the state group "io".
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    @property
    def signals(self) -> dict[str, Signal]:
        """All signals of the cabinet's project by name."""
        return {signal.name: signal for signal in self._connection.signals}

    def __iter__(self) -> Iterator[str]:
        """Names of all signals."""
        return iter([signal.name for signal in self._connection.signals])

    def __len__(self) -> int:
        """Number of signals."""
        return len(self._connection.signals)

    def __repr__(self) -> str:
        """Short form: the names of the signals; `print(arm.io.values_now)` shows their values."""
        return f"<Io {', '.join(self) or 'without signals'}>"

    def __getitem__(self, name: str) -> SignalValue:
        """Value of a signal in the newest state: True or False, or a number.

        Raises:
            CommandRejected: no signal, or more than one, has that name.
        """
        self._find(name)
        return self.values_now[name]

    @property
    def values_now(self) -> SignalValues:
        """Values of all signals in the newest state."""
        newest = self._connection.newest()
        if newest is None or newest.groups.io is None:
            newest = self._wait(lambda _: True, _FIRST_STATE)
        assert newest.groups.io is not None
        return newest.groups.io

    def __setitem__(self, name: str, value: SignalValue) -> None:
        """Write an output; raises as `set` does."""
        self.set({name: value})

    def set(self, values: Mapping[str, SignalValue]) -> None:
        """Write outputs: all of them, or none if one is refused.

        Args:
            values: True or False, or a number, by name.

        Raises:
            CommandRejected: no such output.
            LimitError: a value outside the range of the output.
        """
        if not isinstance(values, Mapping):
            raise ShapeError(
                f"values must be values by name, got {shown(values)}",
                parameter="values",
                value=values,
                hint='arm.io.set({"LEDBlue": True})',
            )
        if not values:
            raise ShapeError(
                "values must name at least one output",
                code=3,
                parameter="values",
                hint='arm.io.set({"LEDBlue": True})',
            )
        commands = tuple(
            output_message(name, value, self._connection.signals) for name, value in values.items()
        )
        self._connection.request(wire.SetSignals(values=commands))

    def wait(self, name: str, value: SignalValue = True, *, timeout: float = 30.0) -> State:
        """Wait until a signal has a value; checked by this program in the pushed states.

        Raises:
            Timeout: it does not get the value in time.
            CommandRejected: there is no such signal.
        """
        full = self._find(name).name
        wanted = value if isinstance(value, bool) else finite(value, "value")
        seconds = within(timeout, "timeout", 0.0, 1e9, unit="s")
        with self._connection.stopping_on_interrupt():
            return self._wait(
                lambda state: state.groups.io is not None and state.groups.io[full] == wanted, seconds
            )

    @property
    def led(self) -> str:
        """Colour of the media flange's lamp: "red", "green", "blue" or "off"; assign to change it."""
        lit = [colour for colour, lamp in self._lamps.items() if self[lamp]]
        return lit[0] if lit else "off"

    @led.setter
    def led(self, colour: str) -> None:
        lamps = self._lamps
        word(colour, "led", _COLOURS)
        if colour not in (*lamps, "off"):
            known = ", ".join((*lamps, "off"))
            raise CommandRejected(
                f"led must be one of {known} on this media flange, got {shown(colour)}",
                parameter="led",
                value=colour,
                allowed=known,
            )
        self.set({lamp: key == colour for key, lamp in lamps.items()})

    @property
    def _lamps(self) -> dict[str, str]:
        """Full names of the existing lamps by colour."""
        names = tuple(self)
        found = {c: n for c, lamp in _LAMPS.items() for n in names if n.rpartition(".")[2] == lamp}
        if not found:
            raise CommandRejected("this cabinet has no media flange with a lamp", parameter="led")
        return found

    def _find(self, name: str) -> Signal:
        return self._connection.signals[find_name(name, tuple(self))]

    def _wait(self, condition: Callable[[State], bool], timeout: float) -> State:
        """Wait for a state with signals that meets a condition; subscribes to the signals if necessary."""
        connection = self._connection
        if _GROUP not in connection.options.groups:
            connection.subscribe(connection.options.rate, (*connection.options.groups, _GROUP))
        return connection.wait_for(lambda state: state.groups.io is not None and condition(state), timeout)
