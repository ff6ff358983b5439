"""Teleoperation: an input device moves the arm, and its buttons open and close a gripper."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from heptarm.arm.verbs import ArmVerbs
from heptarm.devices.device import DeviceInput, InputDevice
from heptarm.errors import OutsideWorkspace, ShapeError
from heptarm.skills.gripper import Gripper
from heptarm.values.checks import shown, within
from heptarm.values.frames import BASE

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from heptarm.arm.motion.servo import ServoStats
    from heptarm.model.velocity import Elbow
    from heptarm.values.clearance import ClearanceModel
    from heptarm.values.pose import Pose

#: Defaults of the speeds at full deflection [m/s], [rad/s].
SCALE, TURN_SCALE = 0.05, 0.2
#: Default of the readings per second [Hz].
RATE = 50.0
#: Default of the ceiling of the joints' speeds, a fraction of their maxima.
JOINT_SPEED = 0.5
#: How much faster a diagonal is than one axis.
_DIAGONAL = 3.0**0.5


def check_device(device: InputDevice) -> InputDevice:
    """The device.

    Raises:
        ShapeError: it is none.
    """
    if not callable(getattr(device, "read", None)):
        raise ShapeError(
            f"device must be an input device, got {shown(device)}",
            parameter="device",
            value=device,
            hint="for example heptarm.devices.gamepad()",
        )
    return device


def teleoperate(
    arm: ArmVerbs,
    device: InputDevice,
    *,
    gripper: Gripper | None = None,
    scale: float = SCALE,
    turn_scale: float = TURN_SCALE,
    dead_man: str | None = None,
    frame: str | Pose = BASE,
    duration: float | None = None,
    while_true: Callable[[DeviceInput], bool] | None = None,
    rate: float = RATE,
    speed: float = JOINT_SPEED,
    watchdog: float | None = None,
    keep_clear_of: ClearanceModel | None = None,
    elbow: Elbow | None = None,
    posture: npt.ArrayLike | None = None,
) -> ServoStats:
    """Let an input device move the arm until its quit button is pressed.

    While the gripper moves, the arm rests. A dead-man button that is held at the beginning counts only after it was
    released. The dead-man button of an input device is a convenience; it replaces no enabling switch.

    Args:
        arm: in control.
        device: a device of `heptarm.devices`, or your own.
        gripper: that the device's gripper button opens and closes; None: there is none.
        scale: speed at full deflection of one axis [m/s], up to 1.
        turn_scale: angular speed at full deflection of one axis [rad/s], up to 2.
        dead_man: button that has to be held; None: that of the device; "": none.
        frame: axes of the motion: "base", "tool", the name of a frame, or its pose in the base.
        duration: end after this time [s]; None: never.
        while_true: called with each reading; the arm is moved as long as it returns something true. None: always.
        rate: readings per second [Hz].
        speed: ceiling of the joints' speeds, a fraction of their maxima, (0, 1].
        watchdog: silence of this program after which the cabinet stops the arm [s]; None: that of `Arm.servo`.
        keep_clear_of: model of bodies to brake before; see `Arm.servo`.
        elbow: what the redundant joint does, "keep" or "center"; see `Arm.servo`. None: "keep".
        posture: joint positions that it follows instead, shape (7,) [rad].

    Returns:
        Statistics of the stream of velocities.

    Raises:
        ShapeError: no device.
        LimitError: a value outside its range.
        NotReady: the device is gone; the arm was brought to rest.
        Timeout: the gripper did not confirm; the arm was brought to rest.
        MotionAborted: the motion ended early, as by a stop.
    """
    check_device(device)
    straight = within(scale, "scale", 0.0, 1.0, above=True, unit="m/s")
    turn = within(turn_scale, "turn_scale", 0.0, 2.0, above=True, unit="rad/s")
    limit = None if duration is None else within(duration, "duration", 0.0, 1e6, above=True, unit="s")
    roles = device.roles
    button = roles.dead_man if dead_man is None else dead_man
    factors = np.repeat([straight, turn], 3)
    released, pressed = not button, False
    with arm.servo(
        "twist",
        frame=frame,
        rate=rate,
        watchdog=watchdog,
        speed=speed,
        speed_mps=_DIAGONAL * straight,
        speed_radps=_DIAGONAL * turn,
        keep_clear_of=keep_clear_of,
        elbow=elbow,
        posture=posture,
    ) as sv:
        while sv.tick() is not None and (limit is None or sv.t < limit):
            seen = device.read()
            if roles.quit in seen.buttons or (while_true is not None and not while_true(seen)):
                break
            released = released or button not in seen.buttons
            moves = released and (not button or button in seen.buttons)
            try:
                sv.set(factors * seen.twist if moves else np.zeros(6))
            except OutsideWorkspace:
                pass  # the stream comes to rest at the wall
            grips = bool(roles.gripper) and roles.gripper in seen.buttons
            if gripper is not None and grips and not pressed:
                sv.set(np.zeros(6))
                if gripper.is_open:
                    gripper.close()
                else:
                    gripper.open()
            pressed = grips
    return sv.stats
