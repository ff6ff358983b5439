"""The smartPAD: messages, user keys for this program, process data."""

from __future__ import annotations

import queue
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from heptarm.errors import RemoteProtocolError, ShapeError, Timeout
from heptarm.values.arrays import within
from heptarm.wire import messages as wire

if TYPE_CHECKING:
    from heptarm.arm.connection import Connection

_SLOTS = 4


class Pad:
    """The smartPAD as far as a program may use it; `arm.pad`. The keys are those of the bar "client"."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def show(self, text: str, *, severity: Literal["info", "warning", "error"] = "info") -> None:
        """Show a text in the smartPAD's log, up to 512 octets."""
        self._connection.request(wire.ShowMessage(severity=_severity(severity), text=text))

    def set_key(
        self,
        slot: int,
        text: str,
        *,
        led: Literal["grey", "green", "yellow", "red"] = "grey",
        enabled: bool = True,
    ) -> None:
        """Text and lamp of a user key.

        Args:
            slot: 0 to 3, from the top.
            text: what stands on it, up to 64 octets.
            led: colour of its lamp.
            enabled: whether it can be pressed.

        Raises:
            LimitError: another slot.
            CommandRejected: this cabinet has no user keys.
        """
        within(slot, "slot", 0, _SLOTS - 1)
        if led.upper() not in wire.KeyLed.__members__:
            raise ShapeError(
                f"led is {led!r}; allowed are {', '.join(map(repr, map(str.lower, wire.KeyLed.__members__)))}",
                parameter="led",
            )
        lamp = wire.KeyLed[led.upper()]
        self._connection.request(wire.SetKey(slot=int(slot), text=text, led=lamp, enabled=enabled))

    def on_key(self, callback: Callable[[int, bool], None]) -> Callable[[], None]:
        """Call `callback(slot, down)` when a key is pressed or released; from the link's thread, so it must not block.

        Returns:
            What ends it.
        """
        listeners = self._connection.events.key_listeners
        listeners.append(callback)

        def end() -> None:
            if callback in listeners:
                listeners.remove(callback)

        return end

    def wait_for_key(self, *slots: int, timeout: float = 60.0) -> int:
        """Wait until a key is pressed.

        Args:
            slots: which ones; none: any.
            timeout: how long to wait [s].

        Returns:
            Its slot.

        Raises:
            Timeout: nobody pressed one in time.
        """
        pressed: queue.SimpleQueue[int] = queue.SimpleQueue()
        end = self.on_key(lambda slot, down: pressed.put(slot) if down else None)
        try:
            with self._connection.stopping_on_interrupt():
                clock = self._connection.clock
                deadline = clock.nanos() + round(within(timeout, "timeout", 0.0, 1e9, unit="s") * 1e9)
                while True:
                    slot = pressed.get(timeout=max(0.0, (deadline - clock.nanos()) * 1e-9))
                    if not slots or slot in slots:
                        return slot
        except queue.Empty:
            raise Timeout(f"no key was pressed within {timeout:g} s") from None
        finally:
            end()

    def process_data(self, name: str) -> str:
        """A value of the project's process data, as text.

        Raises:
            CommandRejected: the project has none of that name.
        """
        connection = self._connection
        answer = connection.link.request(wire.GetProcessData(name=name), timeout=connection.options.timeout)
        if not isinstance(answer, wire.ProcessData):
            raise RemoteProtocolError(f"a {type(answer).__name__} answers a GetProcessData")
        return answer.value

    def set_process_data(self, name: str, value: str | float) -> None:
        """Change a value of the project's process data; it keeps its type.

        Raises:
            CommandRejected: the project has none of that name, or it is a setting of heptarm's.
            LimitError: the value is none of its type.
        """
        text = str(value).lower() if isinstance(value, bool) else str(value)
        self._connection.request(wire.SetProcessData(name=name, value=text))


def _severity(name: str) -> wire.Severity:
    if name.upper() not in wire.Severity.__members__:
        raise ShapeError(
            f"severity is {name!r}; allowed are 'info', 'warning', 'error'", parameter="severity"
        )
    return wire.Severity[name.upper()]
