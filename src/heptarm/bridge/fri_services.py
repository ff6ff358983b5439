"""Services that open and close an FRI session."""

from __future__ import annotations

from typing import Any

from heptarm.bridge.service import Offer, Service
from heptarm.errors import ShapeError


class FriServices(Offer):
    """FRI beside the rest of the node; its commands come by topics."""

    def open_fri(self, request: Any) -> str:
        """Open a session; one that commands needs an arm at rest."""
        if request.kind == "monitor":
            self._check_active()
        else:
            self._rest()
        settings: dict[str, Any] = {
            "multiplier": request.multiplier or 1,
            "io": tuple(request.io),
            "host": request.host or self._driver.configuration.values["fri.host"],
        }
        if request.period_ms:
            settings["period_ms"] = request.period_ms
        if request.version:
            settings["version"] = request.version
        if request.port:
            settings["port"] = request.port
        return self._driver.fri.open(request.kind, **settings)

    def close_fri(self, request: Any) -> str:
        """End it."""
        return self._driver.fri.close() or "no FRI session"

    def set_outputs(self, request: Any) -> str:
        """Set outputs that the session offers."""
        given = list(request.names)
        if len(given) != len(request.values):
            raise ShapeError(f"{len(request.values)} values for {len(given)} names; one for each is wanted")
        for name, value in zip(given, request.values):
            self._driver.fri.output(name, value)
        return f"{', '.join(given)} set"


#: All of them.
FRI = (
    Service("~/fri/open", "heptarm_msgs/OpenFri", FriServices.open_fri),
    Service("~/fri/close", "std_srvs/Trigger", FriServices.close_fri),
    Service("~/fri/set_outputs", "heptarm_msgs/SetSignals", FriServices.set_outputs, at_once=True),
)
