"""Recording of an arm: a scripted cabinet in memory, the virtual cabinet, a killed process, a full disk."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm.errors import CommandRejected, HeptarmError, LimitError, LocalProtocolError, ShapeError
from heptarm.fri import Client
from heptarm.record import recorder as recording
from heptarm.record.mcap_file import RecordingFile
from heptarm.wire import messages as wire
from tests.arm.peer import Peer
from tests.arm.test_fri import patient
from tests.conftest import RunningCabinet
from tests.fri_loop.controller import Controller
from tests.simulators import PATIENT

SPEED = 1.0  # rates, and FRI answers by this machine's clock

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_what_happens_is_in_the_file(peer: Peer, tmp_path: Path) -> None:
    peer.runs(11, wire.MotionStarted(id=11, item=0), peer.finished(11))
    with peer.arm() as arm:
        with arm.record(tmp_path / "run.mcap") as rec:
            rec.note("begin here")
            arm.move(ha.ptp(HOME))
            peer.tell(wire.Notice(severity=wire.Severity.WARNING, code=0, text="a word from the cabinet"))
            until(lambda: rec.states > 20)
        arm.wait_until(lambda _: True)
    run = ha.load(tmp_path / "run.mcap")
    assert run.complete and run.lost == 0 and len(run) == rec.states
    assert run.facts["robot"] == "iiwa14" and run.facts["cabinet"] == "test"
    (motion,) = run.motions
    assert (motion.id, motion.text, motion.cause) == (11, "Ptp", "finished")
    texts = [event.text for event in run.events]
    assert "begin here" in texts and any("a word from the cabinet" in text for text in texts)
    np.testing.assert_allclose(run["q"][0], peer.q)


def test_the_rate_is_raised_for_the_block_and_restored(peer: Peer, tmp_path: Path) -> None:
    with peer.arm() as arm:
        with arm.record(tmp_path / "a.mcap", rate=400):
            assert arm.state_rate == 400.0
        assert arm.state_rate == 200.0
        with arm.record(tmp_path / "b.mcap", rate=50):  # never lowered: the program may rely on it
            assert arm.state_rate == 200.0
        with pytest.raises(LimitError, match="rate"):
            arm.record(tmp_path / "c.mcap", rate=5000.0)
        with (
            pytest.raises(CommandRejected, match="cannot be written"),
            arm.record("/proc/nothing/x.mcap", rate=300),
        ):
            pass
        assert arm.state_rate == 200.0


def test_a_recorder_is_used_once_and_checks_its_notes(peer: Peer, tmp_path: Path) -> None:
    with peer.arm() as arm:
        rec = arm.record(tmp_path / "run.mcap")
        assert "not begun" in repr(rec)
        with rec:
            with pytest.raises(CommandRejected, match="1 to 1000 characters"):
                rec.note("")
            for text in ("\ud800", "a\0b", "\x1b[2J"):  # the first one ended the recording
                with pytest.raises(ShapeError, match="printable characters only"):
                    rec.note(text)
            rec.note("two\nlines,\ta tab")
        rec.close()
        with pytest.raises(LocalProtocolError, match="once"):
            rec.start()


def test_a_disk_that_is_full_under_way_ends_the_recording_and_nothing_else(
    peer: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[int] = []
    write = RecordingFile.states

    def states(self: RecordingFile, *arguments: object, **more: object) -> None:
        calls.append(1)
        if len(calls) > 5:
            raise OSError(28, "No space left on device")
        write(self, *arguments, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(RecordingFile, "states", states)
    monkeypatch.setattr(recording, "chunk_size", lambda rate: 2000)
    with peer.arm() as arm:
        rec = arm.record(tmp_path / "run.mcap").start()
        until(lambda: not rec.is_running)
        assert arm.wait_until(lambda _: True).joints is not None
        with pytest.raises(HeptarmError, match="No space left") as raised:
            rec.close()
        assert "free some space" in raised.value.hint
        rec.close()
    run = ha.load(tmp_path / "run.mcap")
    assert not run.complete and len(run) > 0


def test_a_slow_disk_holds_up_no_state_and_what_is_lost_is_counted(
    peer: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    go_on = threading.Event()
    write = RecordingFile.flush
    monkeypatch.setattr(recording, "_WAITING", 50)
    with peer.arm() as arm:
        rec = arm.record(tmp_path / "run.mcap").start()
        monkeypatch.setattr(RecordingFile, "flush", lambda self: (go_on.wait(30.0), write(self))[1])
        seen = [state.stamp for state, _ in zip(arm.states(), range(200))]
        assert len(set(seen)) == 200
        go_on.set()
        rec.close()
    run = ha.load(tmp_path / "run.mcap")
    assert run.complete and run.lost == rec.lost > 0


KILLED = """
import heptarm as ha, os, sys, time
with ha.connect(sys.argv[1], control=False, timeout=30.0) as arm, arm.record(sys.argv[2], rate=200) as rec:
    while rec.states < 400:
        time.sleep(0.01)
    print("enough", flush=True)
    time.sleep(60)
"""


@pytest.mark.slow
def test_a_killed_process_leaves_a_file_that_can_be_read(cabinet: RunningCabinet, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with subprocess.Popen(
        [sys.executable, "-c", PATIENT + KILLED, cabinet.target, str(path)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == "enough\n"
        os.kill(process.pid, signal.SIGKILL)
    run = ha.load(path)
    assert not run.complete and len(run) >= 200
    assert np.diff(run["stamp"]).min() >= 0 and run.facts["robot"] == "iiwa14"


@pytest.mark.slow
def test_a_motion_of_the_virtual_cabinet(arm: ha.Arm, tmp_path: Path) -> None:
    with arm.record(tmp_path / "run.mcap", rate=500) as rec:
        rec.note("third try")
        result = arm.move(ha.ptp(HOME + ha.deg(0, 0, 0, 0, 0, 0, 20), speed=0.5))
        rec.note("back")
        arm.move(ha.ptp(HOME, speed=0.5))
    run = ha.load(tmp_path / "run.mcap")
    assert run.complete and run.lost == rec.lost  # those that a busy cabinet sampled too late
    first, second = run.motions
    assert first.cause == second.cause == "finished" and first.text == "Ptp"
    assert first.end - first.begin == pytest.approx(result.duration, abs=0.1)
    there = run.between("third try", "back")
    assert there["q"][-1, 6] - there["q"][0, 6] == pytest.approx(np.radians(20), abs=1e-3)
    moving = run["motion"] == first.id
    t, q, dq = run.t[moving], run["q"][moving, 6], run["dq"][moving, 6]
    whole = np.diff(t) < 0.01  # a busy cabinet leaves states out
    covered = 0.5 * (dq[1:] + dq[:-1]) * np.diff(t)
    assert covered[whole].sum() == pytest.approx(np.diff(q)[whole].sum(), rel=0.05)


@pytest.mark.slow
@patient
def test_fri_cycles_are_recorded_at_their_own_rate(arm: ha.Arm, tmp_path: Path) -> None:
    with arm.record(tmp_path / "run.mcap"), arm.fri("position", period_ms=10) as session:
        while len(session.history()) < 150 and session.active:
            session.next()
    run = ha.load(tmp_path / "run.mcap")
    assert len(run["fri.t"]) >= 100 and "fri.q_sent" in run
    assert np.diff(run["fri.sequence"]).tolist() == [1] * (len(run["fri.t"]) - 1)
    np.testing.assert_allclose(run["fri.q"][-1], HOME, atol=0.05)
    assert run["fri.t"][0] >= 0.0 and run["fri.t"][-1] <= run.t[-1] + 1.0
    assert any(motion.text == "Fri" for motion in run.motions)


def test_an_fri_client_is_recorded_message_by_message(tmp_path: Path) -> None:
    with Client(0, realtime=False) as client:
        controller = Controller(client.port)
        with controller.running():
            client.wait("MONITORING_WAIT")
            with ha.record_client(client, tmp_path / "fri.mcap") as rec:
                for _ in range(20):  # each has some messages that a held-up client does not miss
                    controller.settle()
                controller.active()
                begin = client.wait("COMMANDING_ACTIVE")
                rec.note("commands are effective")
                for s in client:
                    client.command(q=begin.q_ipo + 0.01)
                    if s.q_sent[0] > begin.q_ipo[0] + 0.005:
                        break
            last = client.state
        assert any("listening to" in event.text for event in client.events()), (
            "the client's own events are left to it"
        )
    run = ha.load(tmp_path / "fri.mcap")
    assert run.complete and run.lost == 0 and len(run) == 0 and run.facts["robot"] == "iiwa14"
    steps = np.diff(run["fri.sequence"])
    assert len(steps) > 50 and (steps == 1).all(), "every message, once"
    assert run["fri.sequence"][-1] <= last.sequence
    assert run["fri.t"][0] == 0.0 and run.duration == pytest.approx(run["fri.t"][-1])
    assert np.nanmax(run["fri.q_sent"][:, 0]) > begin.q_ipo[0] + 0.005
    assert [note.text for note in run.notes] == ["commands are effective"]
    assert any("COMMANDING_ACTIVE" in event.text for event in run.events if event.kind == "fri")
    assert len(run.between("commands are effective", "end")["fri.t"]) < len(run["fri.t"])
    assert "cycles" in str(run) and len(run.to_pandas(fri=True)) == len(run["fri.t"])
    with pytest.raises(HeptarmError), ha.record_client(client, tmp_path / "fri.mcap" / "run.mcap"):
        pass
