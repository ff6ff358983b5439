"""The black box: written after an abort, a safety stop and a lost connection, named in the error, bounded, optional."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

import heptarm as ha
from heptarm.errors import ConnectionLost, MotionAborted, SafetyStop
from heptarm.record import black_box
from heptarm.record.journal import Journal, JournalEntry
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.arm.peer import Peer

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HEPTARM_BLACK_BOX", str(tmp_path / "box"))
    return tmp_path / "box"


def test_an_aborted_motion_has_its_black_box(peer: Peer, folder: Path) -> None:
    peer.runs(5, wire.MotionStarted(id=5, item=0), peer.finished(5, wire.Cause.STOPPED, text="somebody"))
    with peer.arm() as arm:
        for _, _ in zip(arm.states(), range(40)):
            pass
        with pytest.raises(MotionAborted) as raised:
            arm.move(ha.ptp(HOME))
        path = raised.value.black_box
        assert path is not None and path.parent == folder and "motion-5-stopped" in path.name
    run = ha.load(path)
    assert run.complete and len(run) >= 40 and run.facts["black_box"] == "motion 5 stopped"
    assert [(motion.id, motion.cause, motion.detail) for motion in run.motions] == [
        (5, "stopped", "somebody")
    ]
    assert path.stat().st_mode & 0o077 == 0
    assert pickle.loads(pickle.dumps(raised.value.black_box)) == path


def test_a_lost_connection_has_its_black_box(peer: Peer, folder: Path) -> None:
    peer.runs(5, wire.MotionStarted(id=5, item=0))
    arm = peer.arm()
    handle = arm.start(ha.ptp(HOME))
    handle.wait_started(10.0)
    peer.drop()
    with pytest.raises(ConnectionLost) as raised:
        handle.wait(timeout=20.0)
    path = raised.value.black_box
    assert path is not None and "connection-lost" in path.name
    with pytest.raises(ConnectionLost) as again:
        arm.move(ha.ptp(HOME))
    assert again.value.black_box == path
    arm.close()
    assert any("the connection to" in event.text for event in ha.load(path).events)
    assert len(list(folder.iterdir())) == 1


def test_a_safety_stop_has_its_black_box(peer: Peer) -> None:
    refusal = wire.Rejected(
        code=int(Code.SAFETY_STOP), parameter="", text="emergency stop", value="", allowed=""
    )
    with peer.arm() as arm:
        stopped = wire.SafetyChanged(
            bits=wire.SafetyBits.EMERGENCY_STOP, mode=wire.OperationMode.AUT, text="emergency stop pressed"
        )
        peer.tell(stopped)
        peer.tell(stopped)  # the same stop once more
        peer.expect(wire.Run, refusal)
        with pytest.raises(SafetyStop) as raised:
            arm.move(ha.ptp(HOME))
    path = raised.value.black_box
    assert path is not None and "safety-stop" in path.name
    texts = [event.text for event in ha.load(path).events]
    assert any("emergency stop pressed" in text for text in texts)


def test_no_more_than_twenty_files_are_kept(
    peer: Peer, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.mkdir()
    for number in range(30):
        (folder / f"20200101-0000{number:02d}-000-1-old.mcap").write_bytes(b"x")
    with peer.arm() as arm:
        newest = arm.connection.capture("by hand")
        assert newest is not None and arm.connection.capture("the same second") is newest
        assert newest() is not None
    names = sorted(path.name for path in folder.iterdir())
    assert len(names) == black_box.MOST_FILES and names[0].startswith("20200101-000011")


def test_two_connections_that_see_the_same_stop_have_files_of_their_own(peer: Peer, folder: Path) -> None:
    other = Peer()
    with peer.arm() as left, other.arm() as right:
        boxes = [arm.connection.capture("stop") for arm in (left, right)]
        assert None not in [box and box() for box in boxes]
    other.close()
    numbers = {
        path.name.split("-")[4] for path in folder.iterdir()
    }  # date, time, millisecond, process, number
    assert len(numbers) == 2


@pytest.mark.parametrize("by", ["option", "environment"])
def test_it_can_be_switched_off(peer: Peer, folder: Path, monkeypatch: pytest.MonkeyPatch, by: str) -> None:
    if by == "environment":
        monkeypatch.setenv("HEPTARM_BLACK_BOX", "off")
    peer.runs(5, peer.finished(5, wire.Cause.STOPPED))
    with peer.arm(black_box=by == "environment") as arm:
        with pytest.raises(MotionAborted) as raised:
            arm.move(ha.ptp(HOME))
        assert raised.value.black_box is None
    assert not folder.exists()


def test_without_the_package_there_is_none_and_the_error_stays(
    peer: Peer, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "mcap.writer", None)
    peer.runs(5, peer.finished(5, wire.Cause.STOPPED))
    with peer.arm() as arm, pytest.raises(MotionAborted, match="stopped") as raised:
        arm.move(ha.ptp(HOME))
    assert raised.value.black_box is None


def test_its_folder_is_that_of_the_users_state(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("HEPTARM_BLACK_BOX")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert black_box.folder() == tmp_path / "heptarm" / "black-box"


def test_the_journal_keeps_no_more_than_it_needs() -> None:
    now = [0]
    journal = Journal(lambda: now[0])
    for second in range(100):
        now[0] = second * 1_000_000_000
        journal.add("note", f"at {second}")
    assert [one.text for one in journal.since(0)] == [f"at {second}" for second in range(68, 100)]
    queue = journal.open()
    journal.add("fri", "earlier", at=90_000_000_000)
    assert [JournalEntry(*one).time for one in queue] == [90_000_000_000]
    journal.close(queue)
    journal.add("note", "late")
    assert len(queue) == 1
