"""Signals, keys, messages and process data through the whole stack; the operator plays the person and the periphery."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

import heptarm as ha
from heptarm.values.condition.signals import io

WORLD = (
    "MediaFlange.UserButton<bool MediaFlange.InputX3Pin3<bool MediaFlange.OutputX3Pin11>bool MediaFlange.LEDBlue>bool "
    "MediaFlange.LEDRed>bool Cell.Part<u8 Cell.Offset>i16 Cell.Level>analog12[-10,10] nonsense Cell.Wide<u99"
)
PROJECT = f"""<persistence><processDataContainer>
<processData dataType="java.lang.String" id="heptarm.io" value="{WORLD.replace("<", "&lt;").replace(">", "&gt;")}"/>
<processData dataType="java.lang.Integer" id="cell.count" value="3"/>
<processData dataType="java.lang.Boolean" id="cell.open" value="true"/>
<processData dataType="java.lang.String" id="cell.part" value="nut"/>
</processDataContainer></persistence>"""


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ha.Arm]:
    project = tmp_path_factory.mktemp("project") / "RoboticsAPI.data.xml"
    project.write_text(PROJECT)
    with ha.connect(f"sim://iiwa14?project={project}", watchdog=5.0, timeout=30.0) as arm:
        arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.7)
        yield arm


def test_the_projects_signals_are_known(arm: ha.Arm) -> None:
    assert list(arm.io) == [word.partition("<")[0].partition(">")[0] for word in WORLD.split()[:-2]]
    offset = arm.io.signals["Cell.Offset"]
    assert offset.is_output and (offset.kind, offset.low, offset.high) == ("integer", -32768, 32767)
    assert not arm.io.signals["Cell.Part"].is_output


def test_outputs_are_written_and_read_back(arm: ha.Arm) -> None:
    arm.io["output_x3_pin_11"] = True
    arm.io.set({"Cell.Offset": -300, "level": 2.5})
    arm.io.wait("offset", -300.0, timeout=20.0)
    assert arm.io["OutputX3Pin11"] is True and arm.io["Cell.Level"] == 2.5
    assert arm.state.io.output_x3_pin_11 is True
    arm.io.led = "blue"
    arm.io.wait("LEDBlue", timeout=20.0)
    assert arm.io.led == "blue"
    arm.io.led = "off"
    arm.io.wait("LEDBlue", False, timeout=20.0)


def test_inputs_come_from_the_world(arm: ha.Arm) -> None:
    assert arm.io["user_button"] is False
    threading.Timer(0.2, arm.operator.set_signal, ("UserButton", True)).start()
    arm.io.wait("user_button", timeout=20.0)
    arm.operator.set_signal("Cell.Part", 7)
    arm.io.wait("part", 7, timeout=20.0)
    arm.operator.set_signal("UserButton", False)
    arm.io.wait("user_button", False, timeout=20.0)


def test_a_signal_ends_a_motion(arm: ha.Arm) -> None:
    button, part = io.user_button, io["Cell.Part"] > 10
    for name, value, wanted in (("UserButton", True, button), ("Cell.Part", 20, part)):
        handle = arm.start(ha.hold(60.0), until=button | part)
        arm.wait_until(lambda state, handle=handle: handle.started, timeout=20.0)  # type: ignore[misc]
        arm.operator.set_signal(name, value)
        result = handle.wait(timeout=20.0)
        assert result.cause is ha.Cause.CONDITION and result.stopped_by == wanted
        arm.operator.set_signal(name, 0)
        arm.io.wait(name, 0, timeout=20.0)


def test_what_cannot_be_written_is_refused(arm: ha.Arm) -> None:
    for name, value, kind, words in (
        ("UserButton", True, ha.CommandRejected, "input"),
        ("lamp", True, ha.CommandRejected, "no signal"),
        ("LEDBlue", 0.5, ha.LimitError, "LEDBlue"),
        ("Cell.Level", 11, ha.LimitError, "10"),
        ("Cell.Offset", 0.5, ha.LimitError, "whole number"),
        ("LEDBlue", "on", ha.ShapeError, "number"),
    ):
        with pytest.raises(kind, match=words):
            arm.io.set({"OutputX3Pin11": True, name: value})  # type: ignore[dict-item]
    assert "Cell.Level" in arm.io and "lamp" not in arm.io
    assert arm.io.get("lamp") is None and arm.io.get("lamp", 0) == 0
    with pytest.raises(ha.ShapeError):
        arm.io.set({})
    with pytest.raises(ha.CommandRejected, match="led must be one of .*got 'green'"):
        arm.io.led = "green"


def test_during_an_emergency_stop_the_cabinet_writes_nothing(arm: ha.Arm) -> None:
    arm.io["LEDRed"] = False
    arm.operator.fault("emergency_stop")
    arm.wait_until(lambda state: state.safety.emergency_stop, timeout=20.0)
    with pytest.raises(ha.HeptarmError, match="emergency stop"):
        arm.io["LEDRed"] = True
    arm.operator.clear()
    arm.operator.start()
    arm.wait_until(lambda state: state.safety.ready_to_move, timeout=20.0)
    assert arm.io["LEDRed"] is False


def test_keys_of_the_smartpad(arm: ha.Arm) -> None:
    heard: list[tuple[int, bool]] = []
    later: list[tuple[int, bool]] = []
    end = arm.pad.on_key(lambda slot, down: heard.append((slot, down)))
    with pytest.raises(ha.CommandRejected, match="disabled"):
        arm.operator.press_key(2)
    arm.pad.set_key(2, "next part", led="green")
    listeners = arm.connection.events.key_listeners

    def press() -> None:
        arm.wait_until(lambda state: len(listeners) == 2, timeout=20.0)  # a call waits for it
        arm.operator.press_key(2)

    person = threading.Thread(target=press)
    person.start()
    assert arm.pad.wait_for_key(2, timeout=20.0) == 2
    person.join()
    arm.wait_until(lambda state: len(heard) == 2, timeout=20.0)
    assert heard == [(2, True), (2, False)]
    end()
    end_later = arm.pad.on_key(lambda slot, down: later.append((slot, down)))
    arm.operator.press_key(2)
    # the key comes on another way than the answer
    arm.wait_until(lambda state: len(later) == 2, timeout=20.0)
    end_later()
    arm.pad.set_key(2, "", enabled=False)
    with pytest.raises(ha.Timeout):
        arm.pad.wait_for_key(timeout=0.1)
    assert len(heard) == 2
    with pytest.raises(ha.LimitError):
        arm.pad.set_key(4, "x")
    with pytest.raises(ha.ShapeError):
        arm.pad.set_key(1, "x", led="pink")  # type: ignore[arg-type]
    arm.pad.show("a program sends hello")
    with pytest.raises(ha.ShapeError):
        arm.pad.show("x" * 600)


def answered(arm: ha.Arm, button: int) -> None:
    """Press a button as soon as a dialog is shown."""

    def press(_: object) -> bool:
        try:
            arm.operator.answer(button)
        except ha.CommandRejected:
            return False
        return True

    arm.wait_until(press, timeout=20.0)


def test_the_operator_answers_a_dialog(arm: ha.Arm) -> None:
    for number, kind in enumerate(("question", "info", "warning", "error")):
        person = threading.Thread(target=answered, args=(arm, number))
        person.start()
        labels = ("Yes", "No", "Perhaps", "Ask Jürgen")
        assert arm.pad.ask("Is the part clamped?", *labels, kind=kind, timeout=20.0) == labels[number]  # type: ignore[arg-type]
        person.join()
    with pytest.raises(ha.CommandRejected, match="no open dialog"):
        arm.operator.answer(0)


def test_a_dialog_stays_until_somebody_answers_it(arm: ha.Arm) -> None:
    with pytest.raises(ha.Timeout, match=r"nobody pressed a button within 0.3 s .*stays on the smartPAD"):
        arm.pad.ask("Still there?", "Yes", timeout=0.3)
    with pytest.raises(
        ha.ModeConflict, match='still shows the dialog "Still there\\?"; press one of its buttons'
    ):
        arm.pad.ask("And now?", "Ok")
    arm.move(ha.lin_rel(z=-0.01))  # the arm moves beneath it
    with pytest.raises(ha.CommandRejected, match="no open dialog has a button 1"):
        arm.operator.answer(1)
    arm.operator.answer(0)
    person = threading.Thread(target=answered, args=(arm, 0))
    person.start()
    arm.wait_until(lambda _: asked(arm), timeout=20.0)
    person.join()


def asked(arm: ha.Arm) -> bool:
    try:
        return arm.pad.ask("Again?", "Ok", timeout=20.0) == "Ok"
    except ha.ModeConflict:  # the smartPAD closes the dialog before
        return False


@pytest.mark.parametrize(
    ("text", "buttons", "words"),
    [
        ("", ("Ok",), "text must have 1 to 512 bytes, got 0"),
        ("x" * 513, ("Ok",), "text must have 1 to 512 bytes, got 513"),
        ("x", (), "buttons must be 1 to 12 different labels"),
        ("x", ("Ok", "Ok"), "buttons must be 1 to 12 different labels"),
        ("x", tuple(map(str, range(13))), "buttons must be 1 to 12 different labels"),
        ("x", ("Ok", ""), r"buttons\[1\] must have 1 to 64 bytes, got 0"),
    ],
)
def test_what_no_dialog_shows_is_refused(
    arm: ha.Arm, text: str, buttons: tuple[str, ...], words: str
) -> None:
    with pytest.raises(ha.ShapeError, match=words):
        arm.pad.ask(text, *buttons)


def test_process_data_keep_their_types(arm: ha.Arm) -> None:
    assert arm.pad.process_data("cell.count") == "3"
    arm.pad.set_process_data("cell.count", 5)
    arm.pad.set_process_data("cell.open", False)
    arm.pad.set_process_data("cell.part", "bolt")
    assert [arm.pad.process_data(f"cell.{one}") for one in ("count", "open", "part")] == [
        "5",
        "false",
        "bolt",
    ]
    for name, value, kind in (
        ("cell.count", 1.5, ha.LimitError),
        ("cell.open", "perhaps", ha.LimitError),
        ("cell.lid", 1, ha.CommandRejected),
        ("heptarm.port", 30002, ha.CommandRejected),
    ):
        with pytest.raises(kind):
            arm.pad.set_process_data(name, value)
    assert arm.pad.process_data("cell.count") == "5"
    with pytest.raises(ha.CommandRejected, match="cannot be read"):
        arm.pad.process_data("heptarm.key")
