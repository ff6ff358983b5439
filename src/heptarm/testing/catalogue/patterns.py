"""Scenarios: forces superimposed on impedance control."""

from __future__ import annotations

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.testing.catalogue.modes import bent, held, let_go, settled
from heptarm.testing.measure import above, below, near, record, watch
from heptarm.testing.scenario import scenario
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.motion.motion import hold
from heptarm.values.state import State

_STIFF = 2000.0
_BASE = CartesianImpedance((_STIFF,) * 3 + (200.0,) * 3, frame="base")
_NEEDS = ("sine_impedance",)


def _offsets(states: tuple[State, ...]) -> Array:
    """Deviation of the flange from its set-point, base axes, shape (n, 3) [m]."""
    return np.array([s.pose.xyz - s.pose_cmd.xyz for s in states])


def _times(states: tuple[State, ...]) -> Array:
    stamps = [s.groups.pose.stamp for s in states if s.groups.pose is not None]
    return np.array([(stamp - stamps[0]) * 1e-9 for stamp in stamps])


def _fit(t: Array, x: Array, frequency: float) -> tuple[float, float]:
    """Amplitude of a frequency in a signal, and the signal's mean."""
    w = 2 * np.pi * frequency * t
    c, s, mean = np.linalg.lstsq(np.column_stack([np.cos(w), np.sin(w), np.ones_like(t)]), x, rcond=None)[0]
    return float(np.hypot(c, s)), float(mean)


@scenario(line=3, rows="D12", space=0.1, virtual=True, needs=_NEEDS)
def force(arm: Arm) -> None:
    """A constant force in one direction: force over stiffness there, nothing elsewhere."""
    handle = held(arm, SineImpedance.force(y=20.0, stiffness=800.0, base=_BASE))
    watch(arm, 0.6)
    settled(arm)
    near(bent(arm), (0.0, 20.0 / 800.0, 0.0), 0.02 * 20.0 / 800.0 + 2e-4, "offset", unit="m")
    let_go(arm, handle)


@scenario(line=3, rows="D13 D16", space=0.1, virtual=True, needs=_NEEDS)
def sine(arm: Arm) -> None:
    """A sine force about a bias: amplitude, frequency and bias as requested."""
    handle = held(arm, SineImpedance.sine("y", frequency=1.0, amplitude=30.0, bias=10.0, base=_BASE))
    watch(arm, 0.6)
    states = watch(arm, 2.0)
    let_go(arm, handle)
    amplitude, mean = _fit(_times(states), _offsets(states)[:, 1], 1.0)
    near(amplitude, 30.0 / _STIFF, 0.06 * 30.0 / _STIFF, "amplitude at 1 Hz", unit="m")
    near(mean, 10.0 / _STIFF, 0.06 * 10.0 / _STIFF + 2e-4, "bias", unit="m")


@scenario(line=3, rows="D14", space=0.1, virtual=True, needs=_NEEDS)
def lissajous(arm: Arm) -> None:
    """A Lissajous figure: two frequencies along two axes, 1 to 0.4."""
    handle = held(arm, SineImpedance.lissajous("xy", frequency=1.0, amplitude=25.0, base=_BASE))
    watch(arm, 0.6)
    states = watch(arm, 2.5)
    let_go(arm, handle)
    t, offset = _times(states), _offsets(states)
    near(_fit(t, offset[:, 0], 1.0)[0], 25.0 / _STIFF, 0.15 * 25.0 / _STIFF, "along x at 1 Hz", unit="m")
    near(_fit(t, offset[:, 1], 0.4)[0], 25.0 / _STIFF, 0.15 * 25.0 / _STIFF, "along y at 0.4 Hz", unit="m")


@scenario(line=3, rows="D15 D18 D19", space=0.1, virtual=True, needs=_NEEDS)
def spiral(arm: Arm) -> None:
    """A spiral that rises for half of its time and falls for the other half; the motion waits for its end."""
    pattern = SineImpedance.spiral("xy", frequency=1.25, amplitude=25.0, total_time=1.6, base=_BASE)
    timed = pattern.timed(rise_time=0.8, hold_time=0.0, fall_time=0.8, stay_active=True)
    recording = record(arm, hold(0.3), mode=timed)
    above(recording.result.duration, 1.5, "a hold of 0.3 s lasted", unit="s")
    out = np.linalg.norm(_offsets(recording.states)[:, :2], axis=1)
    largest = int(np.argmax(out))
    near(float(out.max()), 25.0 / _STIFF, 0.25 * 25.0 / _STIFF, "outermost turn", unit="m")
    # half of the pattern's time, and some tenths of a second by which the arm is behind the force
    near(float(recording.t[largest]) - recording.begin, 0.95, 0.25, "reached after", unit="s")
    below(float(out[-3:].min()), 0.3 * float(out.max()), "at the end", unit="m")


@scenario(line=3, rows="D16 D17", space=0.1, virtual=True, needs=_NEEDS)
def limits(arm: Arm) -> None:
    """Amplitude, frequency, phase and bias of each direction, and the limits of force and offset."""
    mode = SineImpedance(
        _BASE,
        amplitude=(20, 0, 20, 0, 0, 0),
        frequency=(0.5, 0, 1.0, 0, 0, 0),
        phase=(0, 0, np.pi / 2, 0, 0, 0),
        bias=(0, 20, 0, 0, 0, 0),
        force_limit=(100, 10, 100, 100, 100, 100),
    )
    handle = held(arm, mode)
    watch(arm, 0.6)
    states = watch(arm, 2.0)
    let_go(arm, handle)
    t, offset = _times(states), _offsets(states)
    near(_fit(t, offset[:, 0], 0.5)[0], 20.0 / _STIFF, 0.12 * 20.0 / _STIFF, "x at 0.5 Hz", unit="m")
    near(_fit(t, offset[:, 2], 1.0)[0], 20.0 / _STIFF, 0.1 * 20.0 / _STIFF, "z at 1 Hz", unit="m")
    near(
        float(offset[:, 1].mean()),
        10.0 / _STIFF,
        0.06 * 10.0 / _STIFF + 2e-4,
        "y, 20 N limited to 10 N",
        unit="m",
    )
    handle = held(arm, SineImpedance(_BASE, bias=(0, 40, 0, 0, 0, 0), position_limit=(1, 0.005, 1, 1, 1, 1)))
    watch(arm, 0.6)
    farthest = float(_offsets(watch(arm, 0.4))[:, 1].max())
    let_go(arm, handle)
    near(farthest, 0.005, 0.002, "y, 20 mm limited to 5 mm", unit="m")
