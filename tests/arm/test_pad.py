"""Questions to the operator against a scripted cabinet in memory: answers, and what ends the wait for one."""

from __future__ import annotations

from typing import Any

import pytest

import heptarm as ha
from heptarm.arm.devices.operator import Operator
from heptarm.errors import ShapeError
from heptarm.wire import messages as wire
from tests.arm.peer import Peer


def closed(number: int, button: int, text: str = "") -> wire.DialogClosed:
    return wire.DialogClosed(dialog=number, button=button, text=text)


def test_the_answer_is_that_of_the_own_dialog(peer: Peer) -> None:
    sent: list[wire.AskOperator] = []
    peer.expect(wire.AskOperator, closed(3, 0), closed(4, 1), wire.Accepted(id=4), check=sent.append)
    with peer.arm() as arm:
        assert arm.pad.ask("Ready?", "Yes", "No", kind="warning") == "No"  # the events came before the number
        assert arm.connection.events.dialog_listeners == []
    assert sent == [wire.AskOperator(kind=wire.DialogKind.WARNING, text="Ready?", buttons=("Yes", "No"))]


def test_a_dialog_that_is_not_shown_is_an_error(peer: Peer) -> None:
    peer.expect(wire.AskOperator, wire.Accepted(id=1), closed(1, -1, "this cabinet has no dialogs"))
    with peer.arm() as arm, pytest.raises(ha.CommandRejected, match="this cabinet has no dialogs"):
        arm.pad.ask("Ready?", "Yes")


def test_a_lost_connection_ends_the_wait(peer: Peer) -> None:
    peer.expect(wire.AskOperator, wire.Accepted(id=1), lambda client, _: client.peer.drop())
    arm = peer.arm()
    with pytest.raises(ha.ConnectionLost):
        arm.pad.ask("Ready?", "Yes")
    assert arm.connection.events.dialog_listeners == []
    arm.close()


@pytest.mark.parametrize("text", ["\ud800", "a\0b"])
def test_a_text_that_no_pad_can_show_is_refused(peer: Peer, text: str) -> None:
    with peer.arm() as arm:
        with pytest.raises(ShapeError, match="text must have printable characters only"):
            arm.pad.show(text)
        with pytest.raises(ShapeError, match="text must have printable characters only"):
            arm.pad.ask(text, "Yes")


@pytest.mark.parametrize("text", ["\ud800", "a\0b", "a\x1b[2Jb"])
def test_what_no_message_can_carry_is_refused_before_it_is_sent(peer: Peer, text: str) -> None:
    """Half of a surrogate pair ended in a UnicodeEncodeError, or in 20 s of waiting for the simulator."""
    with peer.arm() as arm:
        with pytest.raises(ShapeError, match="value must have printable characters only"):
            arm.pad.set_process_data("app.text", text)
        with pytest.raises(ShapeError, match="tool must have printable characters only"):
            arm.attach_tool(text)
    cabinet: Any = None  # it is not asked
    with pytest.raises(ShapeError, match="words must have printable characters only"):
        Operator(cabinet).do(f"push {text}")


def test_an_empty_name_is_no_tool(peer: Peer) -> None:
    """It detached the tool."""
    with peer.arm() as arm, pytest.raises(ShapeError, match="tool must be a name of 1 to 128 bytes"):
        arm.attach_tool("")


def test_a_text_with_half_of_a_surrogate_pair_is_no_message() -> None:
    with pytest.raises(ShapeError, match="a text that is sent must have printable characters only"):
        wire.SetProcessData(name="app.text", value="\ud800").encode()
