"""Orders as Java describes them, heptarm.doubles.MotionOrder, made the plant's."""

from __future__ import annotations

from functools import partial
from math import isnan
from typing import Any

import numpy as np

from heptarm.values.arrays import Array
from heptarm.values.guiding import HandGuide
from heptarm.values.mode import CartesianImpedance, JointImpedance, Mode, SineImpedance
from heptarm.values.motion import TOOL
from heptarm.values.orientation import REFERENCES, TYPES, Orientation
from heptarm.virtual.order import Order, Watch


class JavaListener:
    """A listener in Java as the plant's; see `heptarm.virtual.order.PartListener`."""

    __slots__ = ("_java",)

    def __init__(self, java: Any) -> None:
        self._java = java

    def started(self) -> None:
        """The motion begins."""
        self._java.started()

    def finished(self, cause: str, text: str) -> None:
        """It has ended."""
        self._java.finished(cause, text)

    def reached(self, part: int) -> None:
        """A part of it begins."""
        self._java.reached(part)


def numbers(values: Any) -> tuple[float, ...]:
    """A Java array of numbers."""
    return tuple(float(v) for v in values[:])


def _numbers_if(values: Any) -> tuple[float, ...] | None:
    return None if values is None else numbers(values)


def mode_of(values: Any) -> tuple[Mode | None, tuple[float, ...] | None]:
    """A control mode as heptarm.doubles.MotionOrder describes it, and the quaternion of its axes if they are fixed."""
    if values is None:
        return None, None
    left = np.array(numbers(values))
    kind = int(left[0])
    left = left[1:]

    def take(count: int) -> Array:
        nonlocal left
        taken, left = left[:count], left[count:]
        return taken

    if kind == 1:
        return JointImpedance(take(7), damping=take(7)), None
    stiffness, damping, elbow, added = take(6), take(6), take(2), take(6)
    force, stops, velocity, deviation, turn = take(6), bool(take(1)[0]), take(6), take(6), take(4)
    axes = None if np.isnan(turn).any() else tuple(turn.tolist())
    base = CartesianImpedance(
        stiffness,
        damping=damping,
        nullspace_stiffness=float(elbow[0]),
        nullspace_damping=float(elbow[1]),
        additional_force=added,
        max_force=force,
        max_force_stops=stops and not np.isnan(force).all(),
        max_velocity=velocity,
        max_deviation=deviation,
        frame=TOOL if axes is None else "reference",
    )
    if kind == 2:
        return base, axes
    amplitude, frequency, phase, bias, force_limit, position_limit = (take(6) for _ in range(6))
    total, rise, hold, fall, stays = take(5).tolist()
    pattern = SineImpedance(
        base,
        amplitude=amplitude,
        frequency=frequency,
        phase=phase,
        bias=bias,
        force_limit=force_limit,
        position_limit=position_limit,
        total_time=total,
        rise_time=rise,
        hold_time=hold,
        fall_time=fall,
        stay_active=bool(stays),
    )
    return pattern, axes


def _filled(values: Any, default: float) -> tuple[float, ...]:
    """Numbers with a default where nothing was said."""
    return tuple(default if isnan(value) else value for value in numbers(values))


def _watches(java: Any) -> tuple[Watch, ...]:
    """Triggers, then break conditions: one that is both is told of before it ends the motion."""
    found = []
    lists = [(-1, False, java.triggers), (-1, True, java.breaks)]
    lists[1:1] = [(part, False, java.parts[part].triggers) for part in range(len(java.parts))]
    for part, breaks, conditions in lists:
        for index in range(len(conditions)):
            fired = partial(java.listener.fired, part, breaks, index)
            found.append(Watch(numbers(conditions[index]), fired, breaks, part))
    return tuple(found)


def _orientation(java: Any) -> Orientation:
    kind, reference = (max(0, int(value)) for value in java[:])
    return Orientation(TYPES[kind], REFERENCES[reference])


def _guide(java: Any) -> HandGuide | None:
    """Limits of a hand guiding as heptarm.doubles.MotionOrder describes them."""
    if java is None:
        return None
    *limits, joint_velocity, cartesian_velocity, freezes, pulls = numbers(java)
    return HandGuide(
        np.array(limits[:7]),
        np.array(limits[7:]),
        joint_velocity,
        cartesian_velocity,
        "all" if freezes else "axis",
        "pull" if pulls else "free",
    )


def order_of(java: Any, *, is_part: bool = False) -> Order:
    """The order that a heptarm.doubles.MotionOrder describes.

    Args:
        java: it.
        is_part: whether it belongs to a batch, which has the conditions of its parts.
    """
    relative, cartesian = _filled(java.relative, 1.0), numbers(java.cartesian)
    relative_blending, distance, turn_blending = _filled(java.blending, 0.0)
    listener = None if java.listener is None else JavaListener(java.listener)
    e1, status, turn = numbers(java.redundancy)
    minimum_time, goal_timeout, speed_timeout = numbers(java.timing)
    mode, axes = mode_of(java.mode)
    return Order(
        int(java.id),
        str(java.kind),
        joints=_numbers_if(java.joints),
        pose=_numbers_if(java.pose),
        via=_numbers_if(java.via),
        orientation=_orientation(java.orientation),
        redundancy=(e1, int(status), int(turn)),
        tcp=numbers(java.tcp),
        offset=_numbers_if(java.offset),
        reference=_numbers_if(java.reference),
        joint_velocity=relative[:7],
        joint_acceleration=relative[7:14],
        joint_jerk=relative[14:21],
        cart_velocity=cartesian[0],
        cart_acceleration=cartesian[1],
        cart_jerk=cartesian[2],
        ori_velocity=cartesian[3],
        ori_acceleration=cartesian[4],
        ori_jerk=cartesian[5],
        blending=(relative_blending, distance, turn_blending),
        parts=tuple(order_of(part, is_part=True) for part in java.parts[:]),
        guide=_guide(java.guiding),
        duration=float(java.duration),
        mode=mode,
        axes=axes,
        minimum_time=minimum_time,
        goal_timeout=goal_timeout,
        speed_timeout=speed_timeout,
        straight=_numbers_if(java.straight),
        listener=listener,
        watches=() if is_part else _watches(java),
        part_listener=listener,
    )
