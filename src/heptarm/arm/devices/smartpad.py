"""The smartPAD: messages, questions to the operator, user keys for this program, process data."""

from __future__ import annotations

import queue
from collections.abc import Callable
from typing import Literal

from heptarm.arm.link.connection import Connection
from heptarm.errors import CommandRejected, ShapeError, Timeout
from heptarm.values.checks import callback as check_callback
from heptarm.values.checks import finite, flag, instance, integer, shown, within, word
from heptarm.values.frames import check_name, check_printable
from heptarm.values.sealed import Sealed
from heptarm.wire import messages as wire

_SLOTS = 4
#: Most buttons of a dialog of Sunrise.
_MOST_BUTTONS = 12
#: Longest wait for an answer between two checks of the link [s].
_CHECK_INTERVAL = 0.2
_KINDS = {kind.name.lower(): kind for kind in wire.DialogKind}
_SEVERITIES = {severity.name.lower(): severity for severity in wire.Severity}
_LEDS = {led.name.lower(): led for led in wire.KeyLed}


class Pad(Sealed):
    """The part of the smartPAD that a program may use; `arm.pad`. The keys are those of the bar "client"."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def show(self, text: str, *, severity: Literal["info", "warning", "error"] = "info") -> None:
        """Show a text of up to 512 bytes in the smartPAD's log."""
        word(severity, "severity", _SEVERITIES)
        self._connection.request(
            wire.ShowMessage(severity=_SEVERITIES[severity], text=_text(text, "text", 512))
        )

    def ask(
        self,
        text: str,
        *buttons: str,
        kind: Literal["question", "info", "warning", "error"] = "question",
        timeout: float = 600.0,
    ) -> str:
        """Ask the operator: show a dialog on the smartPAD and wait until one of its buttons is pressed.

        A dialog stays on the smartPAD until somebody presses a button, also when this call has ended before: no program
        can close it. Its answer is then dropped, and no other dialog can be shown meanwhile. The arm may move beneath
        it. It is no safety function.

        Args:
            text: the question, 1 to 512 bytes.
            buttons: different labels, 1 to 12 of 1 to 64 bytes.
            kind: what the dialog looks like.
            timeout: longest wait [s].

        Returns:
            The label of the pressed button.

        Raises:
            Timeout: nobody pressed a button in time.
            ModeConflict: the smartPAD still shows another dialog; the text has it.
            ConnectionLost: the connection has ended.
            NotInControl: this client does not control the robot.
            CommandRejected: this cabinet cannot show dialogs.
        """
        labels = _labels(buttons)
        message = wire.AskOperator(
            kind=_KINDS[word(kind, "kind", _KINDS)], text=_text(text, "text", 512, least=1), buttons=labels
        )
        seconds = within(timeout, "timeout", 0.0, 1e9, unit="s")
        self._connection.check_may_wait("arm.pad.ask()")
        closed: queue.SimpleQueue[tuple[int, int, str]] = queue.SimpleQueue()

        def put(number: int, button: int, problem: str) -> None:
            closed.put((number, button, problem))

        listeners = self._connection.events.dialog_listeners
        listeners.append(put)
        try:
            with self._connection.stopping_on_interrupt():
                button, problem = self._answer(message, closed, seconds)
        finally:
            listeners.remove(put)
        if not 0 <= button < len(labels):
            raise CommandRejected(problem or "the smartPAD could not show the dialog", parameter="text")
        return labels[button]

    def _answer(
        self, message: wire.AskOperator, closed: queue.SimpleQueue[tuple[int, int, str]], timeout: float
    ) -> tuple[int, str]:
        """Send a question and wait for its button, or for what went wrong."""
        connection, clock = self._connection, self._connection.clock
        link = connection.link
        asked = link.request(message, wire.Accepted, timeout=connection.options.timeout).id
        deadline = clock.nanos() + round(timeout * 1e9)
        while True:
            rest = max(0.0, (deadline - clock.nanos()) * 1e-9)
            try:
                number, button, problem = closed.get(timeout=min(rest, _CHECK_INTERVAL))
            except queue.Empty:
                if link.error is not None:
                    raise connection.final_error() or link.error from None
                if rest <= 0.0:
                    raise Timeout(
                        f"nobody pressed a button within {timeout:g} s",
                        hint="the dialog stays on the smartPAD until somebody does; that answer is dropped",
                    ) from None
                continue
            if number == asked:
                return button, problem

    def set_key(
        self,
        slot: int,
        text: str,
        *,
        led: Literal["grey", "green", "yellow", "red"] = "grey",
        enabled: bool = True,
    ) -> None:
        """Set the text and the lamp of a user key.

        Args:
            slot: 0 to 3, from the top.
            text: its label, up to 64 bytes.
            led: colour of its lamp.
            enabled: whether it can be pressed.

        Raises:
            LimitError: a slot outside 0 to 3.
            CommandRejected: this cabinet has no user keys.
        """
        message = wire.SetKey(
            slot=integer(slot, "slot", 0, _SLOTS - 1),
            text=_text(text, "text", 64),
            led=_LEDS[word(led, "led", _LEDS)],
            enabled=flag(enabled, "enabled"),
        )
        self._connection.request(message)

    def on_key(self, callback: Callable[[int, bool], None]) -> Callable[[], None]:
        """Call `callback(slot, down)` when a key is pressed or released; from the link's thread, so it must not block.

        Returns:
            A function that removes the callback.
        """
        check_callback(callback, "callback")
        listeners = self._connection.events.key_listeners
        listeners.append(callback)

        def end() -> None:
            if callback in listeners:
                listeners.remove(callback)

        return end

    def wait_for_key(self, *slots: int, timeout: float = 60.0) -> int:
        """Wait until a key is pressed.

        Args:
            slots: the keys to wait for; none: any key.
            timeout: longest wait [s].

        Returns:
            The slot of the pressed key.

        Raises:
            Timeout: no key was pressed in time.
        """
        for slot in slots:
            integer(slot, "slots", 0, _SLOTS - 1)
        seconds = within(timeout, "timeout", 0.0, 1e9, unit="s")
        self._connection.check_may_wait("arm.pad.wait_for_key()")
        pressed: queue.SimpleQueue[int] = queue.SimpleQueue()
        end = self.on_key(lambda slot, down: pressed.put(slot) if down else None)
        try:
            with self._connection.stopping_on_interrupt():
                clock = self._connection.clock
                deadline = clock.nanos() + round(seconds * 1e9)
                while True:
                    slot = pressed.get(timeout=max(0.0, (deadline - clock.nanos()) * 1e-9))
                    if not slots or slot in slots:
                        return slot
        except queue.Empty:
            raise Timeout(f"no key was pressed within {timeout:g} s") from None
        finally:
            end()

    def process_data(self, name: str) -> str:
        """Read a value of the project's process data, as text.

        Raises:
            CommandRejected: the project has no process data of that name.
        """
        check_name(name, "name")
        connection = self._connection
        request = wire.GetProcessData(name=name)
        return connection.link.request(request, wire.ProcessData, timeout=connection.options.timeout).value

    def set_process_data(self, name: str, value: str | bool | float) -> None:
        """Change a value of the project's process data; it keeps its type.

        Raises:
            CommandRejected: the project has no process data of that name, or it is a setting of heptarm.
            ShapeError: a text of more than 1024 bytes, or that cannot be printed.
            LimitError: the value does not fit its type.
        """
        check_name(name, "name")
        if isinstance(value, str):
            text = _text(value, "value", 1024)
        elif isinstance(value, bool):
            text = str(value).lower()
        else:
            text = str(
                value
                if isinstance(value, int) and finite(value, "value") == value
                else finite(value, "value")
            )
        self._connection.request(wire.SetProcessData(name=name, value=text))


def _labels(buttons: tuple[str, ...]) -> tuple[str, ...]:
    """The labels of a dialog's buttons. Raises ShapeError."""
    labels = tuple(_text(label, f"buttons[{index}]", 64, least=1) for index, label in enumerate(buttons))
    if not 1 <= len(labels) <= _MOST_BUTTONS or len(set(labels)) < len(labels):
        raise ShapeError(
            f"buttons must be 1 to {_MOST_BUTTONS} different labels, got {shown(list(labels))}",
            code=3,
            parameter="buttons",
            value=labels,
            hint='for example arm.pad.ask("Is the part clamped?", "Yes", "No")',
        )
    return labels


def _text(text: str, name: str, longest: int, *, least: int = 0) -> str:
    """A text of limited length that can be shown. Raises ShapeError."""
    if not least <= len(instance(text, str, name).encode(errors="replace")) <= longest:
        allowed = f"{least} to {longest}" if least else f"at most {longest}"
        raise ShapeError(
            f"{name} must have {allowed} bytes, got {len(text.encode(errors='replace'))}",
            code=3,
            parameter=name,
            value=text,
        )
    return check_printable(text, name, lines=True)
