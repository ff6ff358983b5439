"""A recording's file: what is written is read back, other tools decode it, and a cut file is read to its last chunk."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader

from heptarm import Recording, load
from heptarm.errors import CommandRejected, MissingExtra, require
from heptarm.record.convert import convert
from heptarm.record.journal import JournalEntry
from heptarm.record.layout import STATE
from heptarm.record.mcap_file import RecordingFile
from heptarm.record.samples import RestWatch, state_rows
from heptarm.wire import messages as wire
from tests.record.bodies import BEGIN, EPOCH, PERIOD, RECEIVED, body, fri_words, samples, to_ours

FACTS = {"robot": "iiwa14", "title": "LBR iiwa 14 R820", "clock_rate": "1"}


def written(path: Path, count: int = 2000, *, chunk: int = 100_000, **content: object) -> Path:
    file = RecordingFile(path, FACTS, epoch=EPOCH, chunk=chunk)
    every = samples(count, **content)
    for start in range(0, count, 50):
        file.states(every[start : start + 50], to_ours=to_ours, signals=("A.One", "A.Two"))
    file.entry(JournalEntry(RECEIVED + 500 * PERIOD, "note", "half"))
    run = wire.Run(items=(), when=wire.When.QUEUE)
    file.entry(JournalEntry(RECEIVED + 100 * PERIOD, "request", run, 5))
    nan = float("nan")
    ended = {
        "item": 0,
        "fired": -1,
        "residual": nan,
        "duration": 1.0,
        "q": (0.0,) * 7,
        "code": 9,
        "text": "why",
    }
    finished = wire.MotionFinished(id=5, cause=wire.Cause.STOPPED, **ended)  # type: ignore[arg-type]
    file.entry(JournalEntry(RECEIVED + 900 * PERIOD, "event", finished))
    file.finish({"lost": "3"})
    return path


def test_every_number_of_a_state_is_read_back(tmp_path: Path) -> None:
    run = load(written(tmp_path / "run.mcap", motion=5))
    assert run.complete and run.lost == 3 and len(run) == 2000
    state = wire.State.decode(body(1234))
    assert state.joints is not None and state.wrench is not None and state.pose is not None
    np.testing.assert_array_equal(run["q"][1234], state.joints.q)
    np.testing.assert_array_equal(run["wrench"][1234], (*state.wrench.force, *state.wrench.torque))
    np.testing.assert_array_equal(run["pose"][1234], (*state.pose.xyz, *state.pose.quat))
    assert run["stamp"][1234] == BEGIN + 1234 * PERIOD and run["pose_stamp"][0] == BEGIN - 3
    assert run["status"][0] == 2 and run["queued"][0] == 1 and np.isnan(run["tau_cmd"]).all()
    np.testing.assert_allclose(run.t, np.arange(2000) * 1e-3, atol=1e-12)


def test_groups_that_are_missing_are_nan_and_those_that_come_later_are_there() -> None:
    rows = state_rows([body(0), body(1, has_torques=False), body(2)])
    assert rows["tau"][0, 0] == 1.5 and np.isnan(rows["tau"][1]).all() and rows["tau"][2, 0] == 1.5
    assert rows["torques_stamp"][1] == 0 and rows["stamp"].tolist() == [
        BEGIN,
        BEGIN + PERIOD,
        BEGIN + 2 * PERIOD,
    ]
    with pytest.raises(ValueError, match="bytes"):
        state_rows([body(0)[:100]])


def test_motions_events_and_notes_are_on_the_time_line(tmp_path: Path) -> None:
    run = load(written(tmp_path / "run.mcap", motion=5))
    (motion,) = run.motions
    assert (motion.id, motion.cause, motion.detail) == (5, "stopped", "why")
    assert motion.begin == 0.0 and motion.end == pytest.approx(0.9002, abs=1e-6)
    assert [event.t for event in run.events] == sorted(event.t for event in run.events)
    assert [note.text for note in run.notes] == ["half"] and "motion 5" in str(motion)
    part = run.between("half", "end")
    assert part.t[0] == pytest.approx(0.501) and len(part) == 1499 and len(part["q"]) == 1499
    assert len(run.between(0.1, 0.2)) == pytest.approx(100, abs=1)
    with pytest.raises(CommandRejected, match="there are 'half'"):
        run.between("third", "end")
    with pytest.raises(CommandRejected, match="q_cmd"):
        run["nothing"]
    assert "2000 at 1000 Hz" in str(run)


def test_signals_are_noted_when_they_change(tmp_path: Path) -> None:
    file = RecordingFile(tmp_path / "io.mcap", FACTS, epoch=EPOCH, chunk=50_000)
    every = samples(6)
    for index, button in enumerate((0.0, 0.0, 1.0, 1.0, 1.0, 0.0)):
        every[index] = every[index]._replace(body=body(index, button=button))
    file.states(every, to_ours=to_ours, signals=("A.One", "A.Two"))
    file.finish({})
    texts = [(round(event.t * 1e3), event.text) for event in load(tmp_path / "io.mcap").events]
    assert texts == [(0, "A.Two = 0"), (2, "A.Two = 1"), (5, "A.Two = 0")]


def test_signals_and_mode_are_decoded_only_when_they_change() -> None:
    mode, watch = wire.PositionMode(), RestWatch()

    def change(stamp: int, signals: int | None, tool: str | None, button: float = 0.0) -> wire.State | None:
        io = (
            None
            if signals is None
            else wire.IoState(
                stamp=stamp, values=tuple(wire.SignalValue(index=i, value=button) for i in range(signals))
            )
        )
        group = None if tool is None else wire.ModeState(stamp=stamp + 1, mode=mode, tool=tool)
        joints = wire.State.decode(body(stamp)).joints
        return watch.change(wire.State(joints=joints, io=io, mode=group).encode())

    first = change(0, 2, "drill")
    assert first is not None and first.mode is not None and first.mode.tool == "drill"
    assert change(1, 2, "drill") is None and change(2, 2, "drill") is None  # only their stamps differ
    later = change(3, 2, "drill", button=1.0)
    assert later is not None and later.io is not None and later.io.values[1].value == 1.0
    steps = [
        (2, "drilL"),
        (2, "a longer name"),
        (3, "a longer name"),
        (3, None),
        (None, "drill"),
        (2, "drill"),
    ]
    for number, (signals, tool) in enumerate(steps):
        assert change(10 + number, signals, tool, button=1.0) is not None
        assert change(20 + number, signals, tool, button=1.0) is None
    assert change(30, None, None) is None


def test_fri_cycles_have_their_own_times(tmp_path: Path) -> None:
    file = RecordingFile(tmp_path / "fri.mcap", FACTS, epoch=EPOCH, chunk=50_000)
    file.states(samples(10), to_ours=to_ours)
    file.cycles(fri_words(400))
    file.finish({})
    run = load(tmp_path / "fri.mcap")
    assert run["fri.q"].shape == (400, 7) and run["fri.sequence"].tolist() == list(range(400))
    np.testing.assert_allclose(run["fri.pose"][0], (0.5, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0))
    np.testing.assert_allclose(np.diff(run["fri.t"]), 1e-3, atol=1e-6)
    assert list(run.to_pandas(fri=True).columns[:1]) and len(run.to_pandas(fri=True)) == 400


def test_other_tools_decode_the_messages_by_their_descriptors(tmp_path: Path) -> None:
    path = written(tmp_path / "run.mcap", 200, motion=5)
    decoded: dict[str, list[Any]] = {}
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            assert schema is not None
            if channel.message_encoding == "protobuf":
                decoded.setdefault(channel.topic, []).append(_parsed(schema.name, schema.data, message.data))
    first = decoded["/state"][0]
    state = wire.State.decode(body(0))
    assert state.joints is not None
    assert list(first.q) == list(state.joints.q) and first.stamp == BEGIN and first.motion == 5
    assert len(decoded["/state"]) == 200 and first.progress == 0.25
    pose = decoded["/tcp"][0]
    assert pose.frame_id == "base" and pose.pose.position.x == 0.5 and pose.pose.orientation.y == 1.0
    assert pose.timestamp.seconds == (EPOCH + to_ours(BEGIN)) // 10**9
    assert len(decoded["/tcp"]) == 7  # 30 per second
    log = {one.message: one for one in decoded["/log"]}
    assert log["half"].level == 2 and log["half"].name == "note"
    assert any(one.level == 4 and "why" in one.message for one in decoded["/log"])


def _parsed(name: str, descriptors: bytes, data: bytes) -> Any:
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(descriptors).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(name)).FromString(data)


def test_a_row_has_the_size_of_its_layout() -> None:
    message = _parsed(STATE.full_name, STATE.descriptor, STATE.rows(1).tobytes())
    assert len(message.ListFields()) >= sum(field.size > 1 for field in STATE.fields)


@pytest.mark.parametrize("fraction", [0.02, 0.3, 0.5, 0.77, 0.999])
def test_a_file_that_was_cut_off_is_read_to_its_last_whole_chunk(tmp_path: Path, fraction: float) -> None:
    whole = written(tmp_path / "run.mcap", 4000, chunk=60_000).read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: int(len(whole) * fraction)])
    if fraction == 0.02:
        cut.write_bytes(whole[:30])
        with pytest.raises(CommandRejected, match="recording of heptarm"):
            load(cut)
        return
    run = load(cut)
    assert not run.complete or fraction == 0.999
    assert len(run) > 4000 * fraction * 0.8 - 100
    np.testing.assert_allclose(np.diff(run.t), 1e-3, atol=1e-9)


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.mcap").write_text("hello, this is text")
    with pytest.raises(CommandRejected, match="MCAP"):
        load(tmp_path / "text.mcap")
    with pytest.raises(CommandRejected, match="no such file"):
        load(tmp_path / "nothing.mcap")
    with pytest.raises(CommandRejected, match="cannot be written"):
        RecordingFile(Path("/proc/nothing/run.mcap"), FACTS, epoch=0, chunk=1000)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_full_disk_is_refused_at_once() -> None:
    with pytest.raises(CommandRejected, match="no space left"):
        RecordingFile(Path("/dev/full"), FACTS, epoch=0, chunk=1000)


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".parquet"])
def test_conversion_keeps_every_number(tmp_path: Path, suffix: str) -> None:
    import pandas

    run = load(written(tmp_path / "run.mcap", 300))
    (out,) = convert(run, tmp_path / f"out{suffix}")
    if suffix == ".npz":
        with np.load(out) as found:
            np.testing.assert_array_equal(found["q"], run["q"])
        return
    table = pandas.read_csv(out, index_col="t") if suffix == ".csv" else pandas.read_parquet(out)
    np.testing.assert_allclose(table[[f"q.A{i}" for i in range(1, 8)]].to_numpy(), run["q"], rtol=1e-12)
    np.testing.assert_allclose(table["wrench.fz"].to_numpy(), run["force"][:, 2])


def test_a_wrong_suffix_and_a_missing_package_are_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = load(written(tmp_path / "run.mcap", 10))
    with pytest.raises(CommandRejected, match=r"\.parquet, \.csv, \.npz, got '\.xls'"):
        convert(run, tmp_path / "out.xls")
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(MissingExtra, match="pandas") as raised:
        run.to_pandas()
    assert "heptarm[record]" in raised.value.hint
    with pytest.raises(MissingExtra):
        require("pandas", extra="record")


def test_a_recording_has_a_trajectory_of_its_known_positions() -> None:
    q = np.linspace(0.0, 1.0, 6)[:, None] * np.ones(7)
    q[2] = np.nan  # a state without joints
    signals = {"t": np.array([0.0, 0.1, 0.2, 0.3, 0.3, 0.5]), "q": q}
    run = Recording(Path("run.mcap"), {"robot": "iiwa14"}, signals, (), (), True)
    found = run.trajectory()
    assert found.robot == "iiwa14" and found.times == pytest.approx([0.0, 0.1, 0.3, 0.5])
    assert found.q[:, 3] == pytest.approx([0.0, 0.2, 0.6, 1.0])
    cycles = {"t": np.zeros(0), "q": np.zeros((0, 7)), "fri.t": np.array([0.0, 0.01]), "fri.q": np.eye(7)[:2]}
    assert len(Recording(Path("fri.mcap"), {}, cycles, (), (), True).trajectory()) == 2
    for short in ({}, {"t": np.zeros(1), "q": np.zeros((1, 7))}):
        with pytest.raises(CommandRejected, match=r"run\.mcap has fewer than 2 joint positions"):
            Recording(Path("run.mcap"), {}, {"t": np.zeros(0), **short}, (), (), True).trajectory()
