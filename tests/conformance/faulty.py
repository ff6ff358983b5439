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
from typing import Any

from heptarm.virtual import cabinet as virtual
from heptarm.virtual import servo
from heptarm.virtual.safety import Demand

#: So many targets late is an arm that lags.
LAG = 40

_behaviour = "follows"
_late: deque[tuple[Any, Any]] = deque()
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


def _listen() -> None:
    global _behaviour
    for line in sys.stdin:
        word = line.strip()
        if word in ("follows", "frozen", "lags"):
            _late.clear()
            _behaviour = word
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
    threading.Thread(target=_listen, daemon=True).start()
    sys.exit(virtual.main())
