"""Bodies of states as a cabinet sends them, and samples of them."""

from __future__ import annotations

import math

import numpy as np

from heptarm.record.samples import StateSample
from heptarm.wire import messages as wire

#: Cabinet time of the first state, our clock at its receipt, and the epoch of our clock [ns].
BEGIN, RECEIVED, EPOCH = 7_000_000_000, 3_000_000_000, 1_700_000_000_000_000_000
PERIOD = 1_000_000


def body(index: int, *, has_torques: bool = True, motion: int = 0, button: float | None = None) -> bytes:
    """The state number `index`, one millisecond after the one before."""
    stamp = BEGIN + index * PERIOD
    q = tuple(0.001 * index + 0.1 * axis for axis in range(7))
    torques = wire.TorqueState(stamp=stamp, tau=(1.5,) * 7, tau_ext=(0.5,) * 7, tau_cmd=(math.nan,) * 7)
    io = None
    if button is not None:
        io = wire.IoState(stamp=stamp, values=(wire.SignalValue(index=1, value=button),))
    return wire.State(
        joints=wire.JointState(stamp=stamp, q=q, q_cmd=q, dq=(0.01,) * 7),
        torques=torques if has_torques else None,
        pose=wire.PoseState(
            stamp=stamp - 3,
            xyz=(0.5, 0.0, 0.001 * index),
            quat=(0.0, 1.0, 0.0, 0.0),
            xyz_cmd=(0.5, 0.0, 0.4),
            quat_cmd=(0.0, 1.0, 0.0, 0.0),
            redundancy=wire.Redundancy(e1=0.2, status=2, turn=40),
        ),
        wrench=wire.WrenchState(
            stamp=stamp,
            force=(1.0, 2.0, float(index)),
            torque=(0.1, 0.2, 0.3),
            force_inaccuracy=(0.5,) * 3,
            torque_inaccuracy=(0.5,) * 3,
        ),
        motion=wire.MotionState(
            stamp=stamp, motion=motion, item=0, queued=1, progress=0.25, remaining=math.nan, override=1.0
        ),
        safety=wire.SafetyState(stamp=stamp, bits=wire.SafetyBits.READY_TO_MOVE, mode=wire.OperationMode.AUT),
        io=io,
    ).encode()


def samples(count: int, **content: object) -> list[StateSample]:
    """States of a kHz, from number 1 on."""
    return [StateSample(i + 1, body(i, **content), RECEIVED + i * PERIOD) for i in range(count)]  # type: ignore[arg-type]


def to_ours(stamp: int) -> int:
    """Our clock at a time of the cabinet's: a state arrives 0.2 ms after its sampling."""
    return stamp - BEGIN + RECEIVED - 200_000


def fri_words(count: int) -> np.ndarray:
    """Slots of the ring of FRI states, shape (n, 123)."""
    from heptarm.fri.loop import shared_memory as at

    words = np.full((count, at.STATE_WORDS), np.nan)
    ints = words.view(np.int64)
    ints[:, : at.S_TRACKING] = 0
    ints[:, at.S_RECEIVED] = RECEIVED + PERIOD * np.arange(count)
    ints[:, at.S_SEQUENCE] = np.arange(count)
    words[:, at.ARRAYS["q"]] = np.arange(7.0)
    words[:, at.S_POSE : at.S_POSE + 7] = (500.0, 0.0, 300.0, 1.0, 0.0, 0.0, 0.0)
    return words
