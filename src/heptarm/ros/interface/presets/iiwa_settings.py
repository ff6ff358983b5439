"""What the services of iiwa_stack have set; see `heptarm.ros.interface.presets.iiwa_stack`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from heptarm.values.frames import TOOL
from heptarm.values.pose import Pose

#: Defaults of straight servo motions of iiwa_stack's command topics [m/s, rad/s], ours for those of servo/lin.
_LINE_SPEED, _TURN_SPEED = 0.25, 0.5


@dataclass(slots=True)
class IiwaStackSettings:
    """Values that services set one by one, for the following commands.

    Attributes:
        servo_speed: of command topics, a fraction in (0, 1]; None: the parameter `speed`.
        servo_acceleration: likewise; None: the parameter `servo.acceleration`.
        line_speed: of straight command topics [m/s].
        turn_speed: likewise, of the orientation [rad/s].
        joints: speed and acceleration of motions in joint space, as keywords of `heptarm.ptp`.
        path: speeds, accelerations and jerks of motions along a path, as keywords of `heptarm.lin`.
        moving: the motion frame of commands.
        offset: its pose in the flange; None: it is that of the arm.
        compliant: whether a mode is set in which the arm is compliant also at rest.
    """

    servo_speed: float | None = None
    servo_acceleration: float | None = None
    line_speed: float = _LINE_SPEED
    turn_speed: float = _TURN_SPEED
    joints: dict[str, Any] = field(default_factory=dict)
    path: dict[str, Any] = field(default_factory=dict)
    moving: str = TOOL
    offset: Pose | None = None
    compliant: bool = False
