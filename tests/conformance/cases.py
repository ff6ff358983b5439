"""Cases of the action's conformance: what upstream's suites ask of a server, in our words, and what an arm's should.

`CASES` has them by name, `UNFIT` those that a way of execution cannot be asked.
"""

from __future__ import annotations

import importlib

from tests.conformance.case import CASES, UNFIT

__all__ = ["CASES", "UNFIT"]

for _topic in ("refusals", "arrivals", "interruptions", "deviations", "surroundings"):
    importlib.import_module(f"tests.conformance.{_topic}")
