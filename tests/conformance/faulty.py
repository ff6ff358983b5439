"""A virtual cabinet that takes faults as lines on its standard input; its end ends the cabinet.

    .venv/bin/python tests/conformance/faulty.py [options of heptarm.virtual.cabinet]

follows, frozen, lags: how the arm does what a servo motion tells it. press, release: the emergency stop.
Every line is answered by itself on standard output.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections import deque
from dataclasses import replace
from typing import Any

import numpy as np

from heptarm.virtual import cabinet as virtual
from heptarm.virtual import servo
from heptarm.virtual.plant import Plant
from heptarm.virtual.safety import Demand

#: So many targets of a servo motion, or ticks of FRI, late is an arm that lags.
LAG, LAG_TICKS = 40, 400
#: An arm that was frozen catches up no faster [rad per tick].
CATCH_UP = 5e-4

_behaviour = "follows"
_late: deque[tuple[Any, Any]] = deque()
_late_ticks: deque[Any] = deque()
_catching_up = False
_cabinets: list[virtual.VirtualCabinet] = []


class _Cabinet(virtual.VirtualCabinet):
    def __init__(self, *words: Any) -> None:
        super().__init__(*words)
        _cabinets.append(self)


def _falsify(kind: type[Any]) -> None:
    honest = kind.aim

    def aim(self: Any, q: Any, dq: Any = None) -> None:
        if _behaviour == "follows":
            honest(self, q, dq)
        elif _behaviour == "lags":
            _late.append((q.copy(), dq))
            if len(_late) > LAG:
                honest(self, *_late.popleft())

    kind.aim = aim


def _falsify_overlay(kind: type[Any]) -> None:
    honest = kind.overlay

    def overlay(self: Any, action: Any) -> None:
        global _catching_up
        here = self._command[2].copy()
        if action is not None and _behaviour == "frozen":
            action = replace(action, q=here)
        elif action is not None and _behaviour == "lags":
            _late_ticks.append(action.q)
            action = replace(action, q=_late_ticks.popleft() if len(_late_ticks) > LAG_TICKS else here)
        if action is not None and _catching_up and _behaviour != "frozen":
            way = action.q - here
            _catching_up = bool(np.abs(way).max() > 4 * CATCH_UP)
            if _catching_up:
                action = replace(action, q=here + np.clip(way, -CATCH_UP, CATCH_UP))
        honest(self, action)

    kind.overlay = overlay


def _listen() -> None:
    global _behaviour, _catching_up
    for line in sys.stdin:
        word = line.strip()
        if word in ("follows", "frozen", "lags"):
            _late.clear()
            _late_ticks.clear()
            _behaviour, _catching_up = word, True
        elif word == "press":
            _cabinets[0].plant.safety.demand(Demand.EMERGENCY_STOP)
        elif word == "release":
            _cabinets[0].plant.safety.withdraw()
        print(word, flush=True)
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    for follower in (servo.SmartFollower, servo.DirectFollower):
        _falsify(follower)
    virtual.VirtualCabinet = _Cabinet  # type: ignore[misc]
    _falsify_overlay(Plant)
    threading.Thread(target=_listen, daemon=True).start()
    sys.exit(virtual.main())
