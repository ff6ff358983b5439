"""Diagnosis of the arm, for /diagnostics and the status topic."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from heptarm.arm.link.datagrams import DatagramReport
from heptarm.values.state import State


class DiagnosticLevel(IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Condition of the arm.

    Attributes:
        level: severity.
        text: the most important fact.
        values: all facts by name.
    """

    level: DiagnosticLevel
    text: str
    values: dict[str, str]


def diagnose(
    state: State | None,
    *,
    link_error: str = "",
    active: bool = True,
    age: float = 0.0,
    datagrams: DatagramReport | None = None,
) -> Diagnosis:
    """Derive level and text from the newest state.

    Args:
        state: the newest state; None: there is none.
        link_error: why there is no connection; empty: connected.
        active: whether the node accepts goals.
        age: of the state [s].
        datagrams: how they fare; None: there are none.
    """
    values = {"connected": _yes_no(not link_error), "active": _yes_no(active)}
    if link_error:
        return Diagnosis(DiagnosticLevel.ERROR, f"no connection: {link_error}", values)
    if state is None:
        return Diagnosis(DiagnosticLevel.STALE, "no robot state received yet", values)
    values["state age"] = f"{age:.3f} s"
    if datagrams is not None:
        values["datagrams"] = (
            f"round trip {1e3 * datagrams.round_trip:.1f} ms"
            if datagrams.gets_through
            else "do not get through, everything goes over TCP"
        )
    if age > 1.0:
        return Diagnosis(DiagnosticLevel.STALE, f"the newest state is {age:.1f} s old", values)
    if state.motion is not None:
        values["motion"] = str(state.motion.id) if state.motion.active else "none"
        values["override"] = f"{state.motion.override:g}"
    safety = state.groups.safety
    if safety is None:
        return Diagnosis(DiagnosticLevel.OK, "connected", values)
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
        values[name.replace("_", " ")] = _yes_no(getattr(safety, name))
    if not safety.is_known:
        return Diagnosis(
            DiagnosticLevel.WARN, "the safety state is unknown: this cabinet reports none", values
        )
    for active_fault, text in (
        (safety.emergency_stop, "emergency stop: release it and acknowledge it on the smartPAD"),
        (safety.protective_stop, "safety stop: remove its cause and acknowledge it on the smartPAD"),
        (safety.recovery_required, "the robot needs recovery on the smartPAD"),
        (not safety.mastered, "not mastered"),
    ):
        if active_fault:
            return Diagnosis(DiagnosticLevel.ERROR, text, values)
    if safety.paused:
        return Diagnosis(DiagnosticLevel.WARN, "paused", values)
    if not safety.ready_to_move:
        return Diagnosis(DiagnosticLevel.WARN, "not ready to move", values)
    return Diagnosis(DiagnosticLevel.OK, "ready" if active else "ready, inactive", values)


def _yes_no(value: bool | None) -> str:
    return "unknown" if value is None else "yes" if value else "no"
