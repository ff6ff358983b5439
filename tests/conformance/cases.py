"""Cases of the action's conformance: what ros2_control's tests require of a server, and what an arm needs beyond that.

`CASES` has them by name, `UNFIT` those that do not apply to an execution.
"""

from __future__ import annotations

import importlib

from tests.conformance.case import CASES, UNFIT

__all__ = ["CASES", "UNFIT"]

for _topic in ("refusals", "arrivals", "interruptions", "deviations", "surroundings", "instants", "streams"):
    importlib.import_module(f"tests.conformance.{_topic}")
