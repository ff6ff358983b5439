"""Laws that a fresh process can import."""

from __future__ import annotations

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
