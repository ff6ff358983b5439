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
