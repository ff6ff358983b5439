"""Services of the cabinet's signals and of its smartPAD."""

from __future__ import annotations

from typing import Any, Literal, cast

from heptarm.bridge.service import Offer, Service, Told
from heptarm.errors import ShapeError


class Signals(Offer):
    """Signals, the media flange's lamp, the smartPAD's keys and messages, process data."""

    def signals(self, request: Any) -> Told:
        """The cabinet's signals and their values."""
        known = tuple(self._arm.io.signals.values())
        values = self._arm.io.values_now if known else {}
        fields = {
            "names": [one.name for one in known],
            "outputs": [one.is_output for one in known],
            "kinds": [one.kind for one in known],
            "values": [float(values[one.name]) for one in known],
            "low": [one.low for one in known],
            "high": [one.high for one in known],
        }
        return Told(True, f"{len(known)} signals", fields)

    def set_signals(self, request: Any) -> str:
        """Write outputs, all or none."""
        self._check_active()
        given = list(request.names)
        if len(given) != len(request.values):
            raise ShapeError(f"{len(request.values)} values for {len(given)} names; one for each is wanted")
        self._arm.io.set(dict(zip(given, map(float, request.values))))
        return f"{', '.join(given)} written"

    def led(self, request: Any) -> str:
        """Colour of the media flange's lamp."""
        self._check_active()
        self._arm.io.led = request.value
        return f"the lamp is {request.value}"

    def show(self, request: Any) -> str:
        """A text in the smartPAD's log."""
        severity = cast(Literal["info", "warning", "error"], request.severity or "info")
        self._arm.pad.show(request.text, severity=severity)
        return "shown"

    def set_key(self, request: Any) -> str:
        """Text and lamp of a user key."""
        led = cast(Literal["grey", "green", "yellow", "red"], request.led or "grey")
        self._arm.pad.set_key(request.slot, request.text, led=led, enabled=not request.disabled)
        return f"key {request.slot} is {request.text!r}"

    def process_data(self, request: Any) -> Told:
        """A value of the project's process data."""
        value = self._arm.pad.process_data(request.name)
        return Told(True, f"{request.name} is {value}", {"value": value})

    def set_process_data(self, request: Any) -> str:
        """Change a value of the project's process data."""
        self._arm.pad.set_process_data(request.name, request.value)
        return f"{request.name} is {request.value}"


#: All of them.
SIGNALS = (
    Service("~/signals", "heptarm_msgs/GetSignals", Signals.signals, at_once=True),
    Service("~/set_signals", "heptarm_msgs/SetSignals", Signals.set_signals, at_once=True),
    Service("~/set_led", "heptarm_msgs/SetText", Signals.led, at_once=True),
    Service("~/show", "heptarm_msgs/ShowMessage", Signals.show, at_once=True),
    Service("~/set_key", "heptarm_msgs/SetKey", Signals.set_key, at_once=True),
    Service("~/process_data", "heptarm_msgs/GetText", Signals.process_data, at_once=True),
    Service("~/set_process_data", "heptarm_msgs/SetEntry", Signals.set_process_data, at_once=True),
)
