"""Ready control laws for FRI, compiled once from C: they run in the native loop without Python.

Each function returns a law for `arm.fri(..., law=...)` or `heptarm.fri.Client`. Its parameters change live through
`rt.params`, within the ranges and at the rates with which they are declared; what it keeps and reports is in
`rt.memory`. The dynamics are those of `heptarm.model`.
"""

from __future__ import annotations

from heptarm.laws.ready import (
    ReadyLaw,
    admittance,
    cartesian_impedance,
    free_guiding,
    hybrid,
    jerk_limited,
    joint_impedance,
    low_pass,
    low_pass_readings,
    minimum_jerk,
    reflected_force,
    search,
)

__all__ = [
    "ReadyLaw",
    "admittance",
    "cartesian_impedance",
    "free_guiding",
    "hybrid",
    "jerk_limited",
    "joint_impedance",
    "low_pass",
    "low_pass_readings",
    "minimum_jerk",
    "reflected_force",
    "search",
]
