"""A virtual cabinet that reads faults as lines from its standard input; end of file ends it.

    .venv/bin/python tests/conformance/faulty.py [options of heptarm.sim.runtime.cabinet]

follows, frozen, lags: how the arm follows its set-points, from any source. press, release: the emergency stop.
Everything else is what the operator does, as in `heptarm sim`.
It answers every line on standard output.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections import deque
from typing import Any

import numpy as np

from heptarm.sim.control_laws.active_law import ActiveLaw
from heptarm.sim.control_laws.laws import MeasuredState
from heptarm.sim.runtime import cabinet as virtual

#: Delay of an arm that lags, in ticks.
LAG = 400
#: Speed limit of an arm that catches up [rad per tick].
CATCH_UP = 5e-4

_behaviour = "follows"
_cabinets: list[virtual.VirtualCabinet] = []


class _Cabinet(virtual.VirtualCabinet):
    def __init__(self, *words: Any) -> None:
        super().__init__(*words)
        _cabinets.append(self)


class _Unruly:
    """Set-points of an arm that does not follow its commands."""

    def __init__(self, honest: Any) -> None:
        self._honest = honest
        self._late: deque[Any] = deque()
        self._taken: list[
            Any
        ] = []  # instead of those of the last, this and the next tick; empty: as they are

    def torque(self, control: Any, sensed: Any) -> Any:
        reported, how = sensed.after, _behaviour
        if how == "follows" and not self._taken:
            return self._honest(control, sensed)
        self._taken = self._taken or [sensed.before, sensed.now, sensed.now]
        here = self._taken[2]
        self._late.append(reported)
        late = self._late.popleft() if len(self._late) > LAG else here
        there = {
            "frozen": here,
            "lags": late,
            "follows": here + np.clip(reported - here, -CATCH_UP, CATCH_UP),
        }[how]
        self._taken = [*self._taken[1:], there]
        sensed.before, sensed.now, sensed.after = self._taken
        if how == "follows" and (there == reported).all():
            self._taken, self._late = [], deque()
        return self._honest(control, sensed)


def _listen() -> None:
    global _behaviour
    for line in sys.stdin:
        word = line.strip()
        if word in ("follows", "frozen", "lags"):
            _behaviour = word
            _cabinets[0].operator.on_action()  # an arm that stands still rests, and simulates nothing
        elif word in ("press", "release"):
            _cabinets[0].operator.do({"press": "emergency_stop", "release": "clear"}[word])
        elif word.startswith("answer"):
            with contextlib.suppress(ValueError):  # no dialog is shown yet
                _cabinets[0].operator.do(word)
        else:
            _cabinets[0].operator.do(word)
        print(word, flush=True)
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    ActiveLaw.is_plain = property(lambda control: False)  # type: ignore[assignment]  # every tick asks for its torque
    unruly = _Unruly(ActiveLaw.torque)

    def torque(control: ActiveLaw, sensed: MeasuredState) -> Any:
        """Torque of the law for the modified set-points."""
        return unruly.torque(control, sensed)

    ActiveLaw.torque = torque  # type: ignore[method-assign, assignment]
    virtual.VirtualCabinet = _Cabinet  # type: ignore[misc, assignment]
    threading.Thread(target=_listen, daemon=True).start()
    sys.exit(virtual.main())
