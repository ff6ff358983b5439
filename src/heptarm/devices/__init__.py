"""Input devices: keyboard, gamepad, SpaceMouse, poses over UDP, and recorded or synthetic streams.

A device is read without waiting: deflections of six axes in [-1, 1], and the buttons that are held. What the arm does
with that is not decided here; `heptarm.skills.teleoperate` does it. A device's library is imported when it is opened.
"""

from heptarm.devices.device import DeviceInput, InputDevice, Roles
from heptarm.devices.gamepad import Gamepad, gamepad
from heptarm.devices.keyboard import Keyboard, keyboard
from heptarm.devices.pose_stream import PoseDevice, PoseInput, PoseStream, pose_stream
from heptarm.devices.spacemouse import SpaceMouse, spacemouse
from heptarm.devices.virtual import (
    RecordedDevice,
    RecordingDevice,
    SyntheticDevice,
    recorded,
    recording,
    synthetic,
)

__all__ = [
    "DeviceInput",
    "Gamepad",
    "InputDevice",
    "Keyboard",
    "PoseDevice",
    "PoseInput",
    "PoseStream",
    "RecordedDevice",
    "RecordingDevice",
    "Roles",
    "SpaceMouse",
    "SyntheticDevice",
    "gamepad",
    "keyboard",
    "pose_stream",
    "recorded",
    "recording",
    "spacemouse",
    "synthetic",
]
