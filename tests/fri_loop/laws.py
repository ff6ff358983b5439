"""Laws that a fresh process can import."""

from __future__ import annotations

import json
import math
from typing import Any

from heptarm.fri.loop.compiled import law
from heptarm.fri.loop.user_api import Output, Params, State


def offset(state: State, out: Output, params: Params) -> None:
    out.q += params.offset


def torque(state: State, out: Output, params: Params) -> None:
    out.q[:] = state.q
    out.tau[:] = params.gain * state.tau_ext


def lights(state: State, out: Output, params: Params) -> None:
    out.io["lamp"] = state.io["button"]


def lift(state: State, out: Output, params: Params) -> None:
    out.pose[2] += params.height


def fails_later(state: State, out: Output, params: Params) -> None:
    if state.t > 0.05:
        raise RuntimeError("the law has had enough")
    out.q += 0.001


def filtered_slowly(s: Any, out: Any, p: Any, m: Any) -> None:
    m.x = m.x + 20.0 * s.dt * (p.offset - m.x)
    out.q[:] = s.q_ipo + m.x
    m.calls += 1.0


filtered = law(memory={"x": [0.0] * 7, "calls": 0.0})(filtered_slowly)


@law(memory={"dq": [0.0] * 7, "t": 0.0, "dt": 0.0})
def looking(s: Any, out: Any, p: Any, m: Any) -> None:
    m.dq = s.dq
    for i in range(7):
        out.q[i] += 0.01 * math.sin(3.0 * s.t + i) + 0.001 * s.dq[i]
    m.t = s.t
    m.dt = s.dt


@law
def raising(s: Any, out: Any, p: Any) -> None:
    if s.t > 0.02:
        raise ValueError("no path found")


@law
def opens_a_file(s: Any, out: Any, p: Any) -> None:
    out.q[0] = float(json.loads("1.0"))


@law
def forgets_memory(s: Any, out: Any, p: Any, m: Any) -> None:
    out.q[0] += m.x


@law
def wants_signals(s: Any, out: Any, p: Any) -> None:
    out.io["lamp"] = True
