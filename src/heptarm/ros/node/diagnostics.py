"""How the arm is, for diagnostics and for people."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from heptarm.values.state import State


class Level(IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class Report:
    """How the arm is.

    Attributes:
        level: how bad.
        text: the most important thing, in words.
        values: everything, by name.
    """

    level: Level
    text: str
    values: dict[str, str]


def report(state: State | None, *, trouble: str = "", active: bool = True, age: float = 0.0) -> Report:
    """How the arm is.

    Args:
        state: the newest state; None: there is none.
        trouble: why there is no connection; empty: there is one.
        active: whether the node takes goals.
        age: of the state [s].
    """
    values = {"connected": _words(not trouble), "active": _words(active)}
    if trouble:
        return Report(Level.ERROR, f"no connection: {trouble}", values)
    if state is None:
        return Report(Level.STALE, "no state has come yet", values)
    values["state age"] = f"{age:.3f} s"
    if age > 1.0:
        return Report(Level.STALE, f"the newest state is {age:.1f} s old", values)
    if state.motion is not None:
        values["motion"] = str(state.motion.id) if state.motion.active else "none"
        values["override"] = f"{state.motion.override:g}"
    safety = state.status
    if safety is None:
        return Report(Level.OK, "connected", values)
    values["operation mode"] = safety.mode.name
    for name in (
        "ready_to_move",
        "paused",
        "brakes_open",
        "mastered",
        "emergency_stop",
        "protective_stop",
        "operator_safety_open",
        "enabling_switch",
        "torque_referenced",
        "position_referenced",
        "recovery_required",
    ):
        values[name.replace("_", " ")] = _words(getattr(safety, name))
    for bad, text in (
        (safety.emergency_stop, "emergency stop: release it and confirm it at the smartPAD"),
        (safety.protective_stop, "safety stop: clear what caused it and confirm it at the smartPAD"),
        (safety.recovery_required, "the robot has to be recovered at the smartPAD"),
        (not safety.mastered, "not mastered"),
    ):
        if bad:
            return Report(Level.ERROR, text, values)
    if safety.paused:
        return Report(Level.WARN, "paused", values)
    if not safety.ready_to_move:
        return Report(Level.WARN, "not ready to move", values)
    return Report(Level.OK, "ready" if active else "ready, inactive", values)


def _words(value: bool) -> str:
    return "yes" if value else "no"
