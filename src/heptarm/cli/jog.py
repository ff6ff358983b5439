"""`heptarm jog`: an input device moves the arm."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import asdict
from time import monotonic
from typing import Annotated, Literal

from cyclopts import Parameter

from heptarm.arm.arm import Arm
from heptarm.cli.options import Access
from heptarm.cli.output import emit
from heptarm.devices.device import DeviceInput, InputDevice
from heptarm.devices.gamepad import gamepad
from heptarm.devices.keyboard import HELP, keyboard
from heptarm.devices.spacemouse import spacemouse
from heptarm.errors import HeptarmError
from heptarm.model.velocity import Elbow
from heptarm.skills.teleoperation import RATE, SCALE, TURN_SCALE, teleoperate
from heptarm.values.checks import within

_ACCESS = Access()
#: What opens each device, by its name.
DEVICES: dict[str, Callable[[], InputDevice]] = {
    "keyboard": keyboard,
    "gamepad": gamepad,
    "spacemouse": spacemouse,
}
#: Time between two lines of the display [s].
_INTERVAL = 0.2
_CLEAR = "\r\x1b[K"


def jog(
    *,
    device: Annotated[
        Literal["keyboard", "gamepad", "spacemouse"],
        Parameter(help="What moves the arm. The last two need pip install 'heptarm[devices]'."),
    ] = "keyboard",
    frame: Annotated[
        str, Parameter(help="Axes of the motion: base, tool, flange or a taught frame.")
    ] = "base",
    scale: Annotated[float, Parameter(help="Speed at full deflection [m/s].")] = SCALE,
    turn_scale: Annotated[float, Parameter(help="Angular speed at full deflection [rad/s].")] = TURN_SCALE,
    dead_man: Annotated[
        str | None, Parameter(help="Button to hold while the arm moves. Default: that of the device.")
    ] = None,
    elbow: Annotated[
        Elbow,
        Parameter(help="What the elbow does: keep its angle, or keep the joints away from their limits."),
    ] = "keep",
    seconds: Annotated[
        float | None, Parameter(name="--for", help="How long [s]. Default: until its quit button.")
    ] = None,
    access: Access = _ACCESS,
) -> int:
    """Move the arm with the keyboard, a gamepad or a SpaceMouse, slowly unless you say otherwise.

    For example:

        heptarm jog --device keyboard --target sim://iiwa14

        heptarm jog --device gamepad --scale 0.1 --frame tool --target lab1
    """
    limit = None if seconds is None else within(seconds, "seconds", 0.0, 86400.0, above=True, unit="s")
    with access.target.connect() as arm:
        access.ask_first(arm, f"Jog the real {arm.robot.title}?")
        opened = DEVICES[device]()
        try:
            if not access.as_json:
                print(_help(opened, opened.roles.dead_man if dead_man is None else dead_man), flush=True)
            stats = teleoperate(
                arm,
                opened,
                scale=scale,
                turn_scale=turn_scale,
                dead_man=dead_man,
                frame=frame,
                duration=limit,
                rate=RATE,
                elbow=elbow,
                while_true=_display(arm) if sys.stderr.isatty() else None,
            )
        finally:
            opened.close()
    emit(asdict(stats)) if access.as_json else print(stats)
    return 0


def _help(device: InputDevice, dead_man: str) -> str:
    if device.name == "keyboard":
        return HELP
    hold = f"hold {dead_man} to move" if dead_man else "there is no dead-man button"
    end = f"{device.roles.quit} ends" if device.roles.quit else "Ctrl-C ends"
    return f"{device.name}: {hold}, {end}"


def _display(arm: Arm) -> Callable[[DeviceInput], bool]:
    """A function that shows where the tool is, at most five times a second; always true."""
    last = 0.0

    def show(_: DeviceInput) -> bool:
        nonlocal last
        now = monotonic()
        if now - last >= _INTERVAL:
            last = now
            try:
                x, y, z = arm.state.pose.xyz.tolist()
                print(f"{_CLEAR}x {x:.3f}  y {y:.3f}  z {z:.3f} m", end="", file=sys.stderr, flush=True)
            except HeptarmError:
                pass  # the stream itself reports a lost connection
        return True

    return show
