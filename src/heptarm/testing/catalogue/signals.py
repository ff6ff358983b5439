"""Scenarios: signals of the cabinet, the smartPAD, process data."""

from __future__ import annotations

import threading

from heptarm.arm.arm import Arm
from heptarm.errors import HeptarmError
from heptarm.skills.gripper import TwoSignalGripper
from heptarm.testing.measure import holds, near, note
from heptarm.testing.scenario import Risk, scenario

_FLANGE = ("MediaFlange.OutputX3Pin1", "MediaFlange.OutputX3Pin11")
#: Outputs that open and close a gripper, and the switches of its open and its closed end.
_GRIPPER = ("MediaFlange.OutputX3Pin1", "MediaFlange.OutputX3Pin2")
_SWITCHES = ("MediaFlange.InputX3Pin3", "MediaFlange.InputX3Pin4")
_PATIENCE = 20.0


@scenario(line=7, rows="J3 I9", risk=Risk.STILL, virtual=True, needs=("io",), signals=_FLANGE)
def outputs(arm: Arm) -> None:
    """Outputs of the flange are written, all or none, and read back; two of them open and close a gripper."""
    close, open_ = _FLANGE
    for closed in (True, False):
        arm.io.set({close: closed, open_: not closed})
        arm.io.wait(close, closed, timeout=_PATIENCE)
        holds(
            arm.io[close] is closed and arm.io[open_] is not closed,
            f"gripper {'closed' if closed else 'open'}",
        )
    try:
        arm.io.set({close: True, "MediaFlange.UserButton": True})
        holds(False, "an input is not written")
    except HeptarmError as error:
        note(error.text)
    holds(arm.io[close] is False, "and nothing else was")
    arm.io.set({open_: False})


@scenario(line=7, rows="I9", risk=Risk.STILL, operator=True, needs=("io",), signals=(*_GRIPPER, *_SWITCHES))
def gripper(arm: Arm) -> None:
    """A gripper behind two signals: its end switches confirm that it is open, and that it holds something."""
    is_open, is_closed = _SWITCHES
    arm.operator.set_signal(is_closed, False)
    arm.operator.set_signal(is_open, True)
    hand = TwoSignalGripper(
        arm, open=_GRIPPER[0], close=_GRIPPER[1], is_open=is_open, is_closed=is_closed, settle=0.3
    )
    hand.open()
    holds(hand.is_open and not hand.holds_something, "it is open")

    def follow() -> None:
        """Leave the open end once the valve is switched, as the fingers do."""
        arm.io.wait(_GRIPPER[1], timeout=_PATIENCE)
        arm.operator.set_signal(is_open, False)

    fingers = threading.Thread(target=follow, daemon=True)
    fingers.start()
    hand.close()
    fingers.join()
    holds(hand.holds_something, "it is closed on something: neither switch is on")
    arm.operator.set_signal(is_open, True)
    hand.open()
    arm.io.set(dict.fromkeys(_GRIPPER, False))
    arm.operator.set_signal(is_open, False)


@scenario(line=7, rows="J4 J5", risk=Risk.STILL, operator=True, needs=("io",),
          signals=("MediaFlange.UserButton", "MediaFlange.InputX3Pin3"))  # fmt: skip
def inputs(arm: Arm) -> None:
    """The state shows changes of the flange's inputs and its button."""
    for name in ("UserButton", "InputX3Pin3"):
        arm.io.wait(name, False, timeout=_PATIENCE)
        arm.operator.set_signal(name, True)
        arm.io.wait(name, True, timeout=_PATIENCE)
        holds(arm.io[name] is True, f"{name} is seen")
        arm.operator.set_signal(name, False)
        arm.io.wait(name, False, timeout=_PATIENCE)


@scenario(line=7, rows="J1 J2", risk=Risk.STILL, virtual=True, needs=("io",),
          signals=("MediaFlange.LEDBlue", "MediaFlange.LEDRed", "MediaFlange.LEDGreen"))  # fmt: skip
def lamp(arm: Arm) -> None:
    """The flange's lamp: blue, red, green, off."""
    for colour in ("blue", "red", "green", "off"):
        arm.io.led = colour
        if colour == "off":
            arm.io.wait("LEDGreen", False, timeout=_PATIENCE)
        else:
            arm.io.wait(f"LED{colour.capitalize()}", True, timeout=_PATIENCE)
        holds(arm.io.led == colour, colour)


@scenario(
    line=7, rows="J6", risk=Risk.STILL, virtual=True, needs=("io",), signals=("Cell.Offset", "Cell.Level")
)
def groups(arm: Arm) -> None:
    """Signals of other groups: signed and analog ones; values outside their ranges are refused."""
    arm.io.set({"Cell.Offset": -300, "Cell.Level": 2.5})
    arm.io.wait("Cell.Offset", -300.0, timeout=_PATIENCE)
    near(float(arm.io["Cell.Level"]), 2.5, 0.01, "analog output")
    for value in (0.5, 1e6):
        try:
            arm.io["Cell.Offset"] = value
            holds(False, f"{value} is refused")
        except HeptarmError as error:
            note(error.text)
    near(float(arm.io["Cell.Offset"]), -300.0, 0.0, "it is as it was")


@scenario(line=7, rows="J7", risk=Risk.STILL, operator=True, needs=("user_keys",))
def keys(arm: Arm) -> None:
    """User keys of the smartPAD: configured by the client, pressed by a person, reported to the client."""
    heard: list[tuple[int, bool]] = []
    end = arm.pad.on_key(lambda slot, down: heard.append((slot, down)))
    arm.pad.set_key(2, "next part", led="green")
    listeners = arm.connection.events.key_listeners

    def press() -> None:
        arm.wait_until(lambda _: len(listeners) == 2, timeout=_PATIENCE)  # somebody waits for it
        arm.operator.press_key(2)

    presses = threading.Thread(target=press)
    presses.start()
    holds(arm.pad.wait_for_key(2, timeout=_PATIENCE) == 2, "key 2 was waited for")
    presses.join()
    arm.wait_until(lambda _: len(heard) == 2, timeout=_PATIENCE)
    holds(heard == [(2, True), (2, False)], "pressed and released")
    end()
    arm.pad.set_key(2, "", enabled=False)
    try:
        arm.operator.press_key(2)
        holds(False, "a key that is off cannot be pressed")
    except HeptarmError as error:
        note(error.text)


@scenario(line=7, rows="J9", risk=Risk.STILL, operator=True, needs=("dialogs",))
def dialog(arm: Arm) -> None:
    """A dialog at the smartPAD: the operator's button is the answer; nobody else closes it."""

    def press(_: object) -> bool:
        try:
            arm.operator.answer(1)
        except HeptarmError:
            return False
        return True

    presses = threading.Thread(target=lambda: arm.wait_until(press, timeout=_PATIENCE))
    presses.start()
    holds(
        arm.pad.ask("Is the part clamped?", "Yes", "No", timeout=_PATIENCE) == "No",
        "the second button was pressed",
    )
    presses.join()
    try:
        arm.pad.ask("Is anybody there?", "Yes", "No", timeout=0.1)
        holds(False, "nobody answers")
    except HeptarmError as error:
        note(error.text)
    try:
        arm.pad.ask("And now?", "Yes")
        holds(False, "another dialog is refused meanwhile")
    except HeptarmError as error:
        note(error.text)
    arm.wait_until(press, timeout=_PATIENCE)


@scenario(line=7, rows="J8", risk=Risk.STILL)
def message(arm: Arm) -> None:
    """The smartPAD's log shows a text; a text that is too long is refused."""
    arm.pad.show("heptarm: hello from a scenario")
    try:
        arm.pad.show("x" * 513)
        holds(False, "too long a text is refused")
    except HeptarmError as error:
        note(error.text[:60])


@scenario(line=7, rows="", risk=Risk.STILL, virtual=True, needs=("process_data",))
def process_data(arm: Arm) -> None:
    """Process data of the project can be read and changed, with their types; heptarm's own cannot be changed."""
    name = "cell.count"
    try:
        before = arm.pad.process_data(name)
    except HeptarmError as error:
        from heptarm.testing.measure import Unfit

        raise Unfit(f"the project has no process data {name}") from error
    arm.pad.set_process_data(name, int(before) + 1)
    near(float(arm.pad.process_data(name)), float(before) + 1, 0.0, name)
    for wrong, value in ((name, "many"), ("heptarm.port", 1)):
        try:
            arm.pad.set_process_data(wrong, value)
            holds(False, f"{wrong} = {value} is refused")
        except HeptarmError as error:
            note(error.text)
    arm.pad.set_process_data(name, int(before))
