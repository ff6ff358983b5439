"""Control laws of the FRI benchmarks; the process of the realtime loop imports them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

import heptarm as ha
from heptarm.fri.loop.user_api import Output, Params, State

Floats = npt.NDArray[np.float64]

#: Gains of `balance`, by joint [Nm/rad], [Nm s/rad]; and its largest torque [Nm].
STIFFNESS = np.array([300.0, 300.0, 200.0, 200.0, 100.0, 100.0, 50.0])
DAMPING = np.array([45.0, 45.0, 25.0, 25.0, 8.0, 8.0, 4.0])
STRONGEST = 30.0

_before: Floats = np.zeros(7)


def fade(t: float, over: float) -> float:
    """Rise smoothly from 0 to 1 within `over` seconds."""
    s = min(max(t / over, 0.0), 1.0)
    return s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)


def swing(t: float, amplitude: float, frequency: float) -> float:
    """A sine whose amplitude rises smoothly [rad]."""
    return amplitude * fade(t, 2.0) * math.sin(2.0 * math.pi * frequency * t)


def sine(s: State, out: Output, p: Params) -> None:
    """Move every joint on a sine around its start."""
    out.q[:] += swing(s.t, p.amplitude, p.frequency)


def balance(s: State, out: Output, p: Params) -> None:
    """Move compliant joints to `goal` by torques alone and hold them there."""
    q = s.q
    speed = (q - _before) / s.period if s.t > 0.0 else np.zeros(7)
    _before[:] = q
    goal = p.start + fade(s.t, 2.0) * (p.goal - p.start)
    out.tau[:] = np.clip(STIFFNESS * (goal - q) - DAMPING * speed, -STRONGEST, STRONGEST)


def press(s: State, out: Output, p: Params) -> None:
    """A force along the z axis of the base that rises smoothly."""
    out.wrench[2] = -p.force * fade(s.t, 1.0)


@ha.law(params={"goal": [0.0] * 7, "tau": 0.1}, memory={"x": [0.0] * 7, "calls": 0.0})
def drift(s: State, out: Output, p: Params, m: Any) -> None:
    """Follow a small offset through a low pass; drift.c is the same in C."""
    m.x = m.x + s.dt * (p.goal - m.x) / p.tau
    out.q[:] = s.q_ipo + m.x
    m.calls += 1.0
