"""Services that choose the control mode of the motions that come."""

from __future__ import annotations

from typing import Any

from heptarm.bridge.service import Offer, Service, scalar
from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.impedance import (
    DAMPING,
    NULLSPACE_STIFFNESS,
    STIFFNESS,
    CartesianImpedance,
    JointImpedance,
)
from heptarm.values.mode import Mode, Position
from heptarm.values.sine import SineImpedance

_NONE = (0.0,) * 6


class Modes(Offer):
    """Control modes; the arm has to be at rest."""

    def position(self, request: Any) -> str:
        """Stiff position control for the motions that come."""
        return self._set(Position())

    def joint_impedance(self, request: Any) -> str:
        """Joint impedance for the motions that come."""
        return self._set(
            JointImpedance(scalar(request.stiffness, ()), damping=scalar(request.damping, DAMPING))
        )

    def cartesian_impedance(self, request: Any) -> str:
        """Cartesian impedance for the motions that come."""
        return self._set(_impedance(request))

    def sine(self, request: Any) -> str:
        """A sine of a force over Cartesian impedance for the motions that come."""
        return self._set(
            SineImpedance(
                _impedance(request),
                amplitude=list(request.amplitude) or _NONE,
                frequency=list(request.frequency) or _NONE,
                phase=list(request.phase) or _NONE,
                bias=list(request.bias) or _NONE,
                force_limit=list(request.force_limit) or None,
                position_limit=list(request.position_limit) or None,
                **_times(request),
            )
        )

    def pattern(self, request: Any) -> str:
        """A force by a pattern over Cartesian impedance for the motions that come."""
        return self._set(_pattern(request))

    def _set(self, mode: Mode) -> str:
        self._rest()
        self._mode.close()
        self._mode.enter_context(self._arm.using(mode))
        return f"from the next motion on: {type(mode).__name__}"


def _impedance(request: Any) -> CartesianImpedance:
    nullspace = list(request.nullspace) or [NULLSPACE_STIFFNESS]
    if len(nullspace) > 2:
        raise ShapeError(
            f"nullspace has {len(nullspace)} numbers; stiffness and damping are wanted", parameter="nullspace"
        )
    return CartesianImpedance(
        list(request.stiffness) or STIFFNESS,
        damping=scalar(request.damping, DAMPING),
        nullspace_stiffness=nullspace[0],
        nullspace_damping=nullspace[1] if len(nullspace) > 1 else DAMPING,
        additional_force=list(request.additional_force) or _NONE,
        max_force=list(request.max_force) or None,
        max_force_stops=bool(request.max_force_stops),
        max_velocity=list(request.max_velocity) or None,
        max_deviation=list(request.max_deviation) or None,
        frame=request.frame or "tool",
    )


def _times(request: Any) -> dict[str, Any]:
    return {
        "total_time": scalar(request.total_time, None),
        "rise_time": request.rise_time,
        "hold_time": scalar(request.hold_time, None),
        "fall_time": request.fall_time,
        "stay_active": bool(request.stay_active),
    }


def _pattern(request: Any) -> SineImpedance:
    stiffness = scalar(request.stiffness, None)
    swing = {"frequency": request.frequency, "amplitude": request.amplitude, "stiffness": stiffness}
    if request.pattern == "spiral":
        total = scalar(request.total_time, 0.0)
        return SineImpedance.spiral(request.plane, total_time=total, **swing)
    if request.pattern == "force":
        given = list(request.force)
        if len(given) != 6:
            raise ShapeError(f"force has {len(given)} numbers; 6 are wanted", parameter="force")
        x, y, z, about_x, about_y, about_z = given
        made = SineImpedance.force(x=x, y=y, z=z, a=about_z, b=about_y, c=about_x, stiffness=stiffness)
    elif request.pattern == "sine":
        made = SineImpedance.sine(request.direction, phase=request.phase, bias=request.bias, **swing)
    elif request.pattern == "lissajous":
        made = SineImpedance.lissajous(request.plane, **swing)
    else:
        raise CommandRejected(
            f"there is no pattern {request.pattern!r}",
            parameter="pattern",
            value=request.pattern,
            hint="choose from force, sine, lissajous, spiral",
        )
    return made.timed(**_times(request))


#: All of them.
MODES = (
    Service("~/mode/position", "std_srvs/Trigger", Modes.position),
    Service("~/mode/joint_impedance", "heptarm_msgs/SetJointImpedance", Modes.joint_impedance),
    Service("~/mode/cartesian_impedance", "heptarm_msgs/SetCartesianImpedance", Modes.cartesian_impedance),
    Service("~/mode/sine_impedance", "heptarm_msgs/SetSineImpedance", Modes.sine),
    Service("~/mode/force_pattern", "heptarm_msgs/SetForcePattern", Modes.pattern),
)
