"""What commands print and read: JSON, states as plain data, questions, typed lines."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Iterator
from typing import Any, TextIO

from heptarm.values.state import State


def emit(data: dict[str, Any], *, file: TextIO | None = None) -> None:
    """Print one JSON object, None: to standard output; NaN becomes null."""
    print(json.dumps(_plain(data), ensure_ascii=False), file=file, flush=True)


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return value


def state_data(state: State) -> dict[str, Any]:
    """A state as plain data, SI."""
    data: dict[str, Any] = {"stamp_ns": state.stamp, "age_s": round(state.age, 6)}
    if state.joints is not None:
        data |= {"q": state.q.tolist(), "q_cmd": state.q_cmd.tolist(), "dq": state.dq.tolist()}
    if state.torques is not None:
        data |= {"tau": state.tau.tolist(), "tau_ext": state.tau_ext.tolist()}
    if state.groups.pose is not None:
        data |= {"xyz": state.pose.xyz.tolist(), "quat": state.pose.quat.tolist()}
    if state.groups.wrench is not None:
        data |= {"force": state.wrench.force.tolist(), "torque": state.wrench.torque.tolist()}
    if state.motion is not None:
        data |= {"motion": state.motion.id, "progress": state.motion.progress}
    if state.groups.safety is not None:
        data |= {"mode": state.safety.mode.value, "ready_to_move": state.safety.ready_to_move}
        data |= {"stops": list(state.safety.stops)}
    return data


def confirm(question: str) -> bool:
    """Ask a person; no terminal means no, and so does its end."""
    return answer_of(f"{question} [y/N] ").lower() in ("y", "yes")


def answer_of(question: str) -> str:
    """What a person types; "": there is no terminal, or it has ended (Ctrl-D)."""
    if not sys.stdin.isatty():
        return ""
    try:
        return input(question).strip()
    except EOFError:
        print()
        return ""


def is_silent() -> bool:
    """Whether no input can come: reading the terminal in the background would stop the whole process."""
    try:
        return os.isatty(0) and os.tcgetpgrp(0) != os.getpgrp()
    except (OSError, AttributeError):
        return True


def lines() -> Iterator[str]:
    """Every line until the end of standard input."""
    rest = b""
    # unbuffered: a blocked buffered read would keep the interpreter from ending
    while chunk := os.read(0, 4096):
        *whole, rest = (rest + chunk).split(b"\n")
        for line in whole:
            yield line.decode("utf-8", "replace").strip()
