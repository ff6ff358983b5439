"""Control modes of the API as those of the protocol."""

from __future__ import annotations

from heptarm.errors import ShapeError
from heptarm.values.mode import CartesianImpedance, JointImpedance, Mode, Position, SineImpedance
from heptarm.values.motion import TOOL
from heptarm.wire import messages as wire


def mode_message(mode: Mode | None) -> wire.Mode | None:
    """The message of a mode; None stays None, position control.

    Raises:
        ShapeError: it is no mode.
    """
    if mode is None:
        return None
    if isinstance(mode, Position):
        return wire.PositionMode()
    if isinstance(mode, JointImpedance):
        return wire.JointImpedance(
            stiffness=tuple(mode.stiffness.tolist()), damping=tuple(mode.damping.tolist())
        )
    if isinstance(mode, CartesianImpedance):
        return _cartesian(mode)
    if isinstance(mode, SineImpedance):
        return wire.SineImpedance(
            base=_cartesian(mode.base),
            amplitude=tuple(mode.amplitude.tolist()),
            frequency=tuple(mode.frequency.tolist()),
            phase=tuple(mode.phase.tolist()),
            bias=tuple(mode.bias.tolist()),
            force_limit=tuple(mode.force_limit.tolist()),
            position_limit=tuple(mode.position_limit.tolist()),
            total_time=mode.total_time,
            rise_time=mode.rise_time,
            hold_time=mode.hold_time,
            fall_time=mode.fall_time,
            stay_active=mode.stay_active,
        )
    raise ShapeError(
        f"mode is {mode!r}, which is no control mode",
        parameter="mode",
        value=mode,
        hint="make one with heptarm.modes.JointImpedance(...)",
    )


def read_mode(told: wire.Mode) -> Mode:
    """The mode that a message tells."""
    if isinstance(told, wire.JointImpedance):
        return JointImpedance(told.stiffness, damping=told.damping)
    if isinstance(told, wire.CartesianImpedance):
        return _read_cartesian(told)
    if isinstance(told, wire.SineImpedance):
        return SineImpedance(
            _read_cartesian(told.base),
            amplitude=told.amplitude,
            frequency=told.frequency,
            phase=told.phase,
            bias=told.bias,
            force_limit=told.force_limit,
            position_limit=told.position_limit,
            total_time=told.total_time,
            rise_time=told.rise_time,
            hold_time=told.hold_time,
            fall_time=told.fall_time,
            stay_active=told.stay_active,
        )
    if isinstance(told, wire.SpiralPattern):
        return SineImpedance.spiral(
            told.plane.name.lower(),
            frequency=told.frequency,
            amplitude=told.amplitude,
            stiffness=told.stiffness,
            total_time=told.total_time,
        )
    return Position()


def _read_cartesian(told: wire.CartesianImpedance) -> CartesianImpedance:
    return CartesianImpedance(
        told.stiffness,
        damping=told.damping,
        nullspace_stiffness=told.nullspace_stiffness,
        nullspace_damping=told.nullspace_damping,
        additional_force=told.additional_force,
        max_force=told.max_force,
        max_force_stops=told.max_force_stops,
        max_velocity=told.max_velocity,
        max_deviation=told.max_deviation,
        frame=told.frame or TOOL,
    )


def _cartesian(mode: CartesianImpedance) -> wire.CartesianImpedance:
    return wire.CartesianImpedance(
        stiffness=tuple(mode.stiffness.tolist()),
        damping=tuple(mode.damping.tolist()),
        nullspace_stiffness=mode.nullspace_stiffness,
        nullspace_damping=mode.nullspace_damping,
        additional_force=tuple(mode.additional_force.tolist()),
        max_force=tuple(mode.max_force.tolist()),
        max_force_stops=mode.max_force_stops,
        max_velocity=tuple(mode.max_velocity.tolist()),
        max_deviation=tuple(mode.max_deviation.tolist()),
        frame="" if mode.frame == TOOL else mode.frame,
    )
