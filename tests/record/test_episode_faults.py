"""Episodes of which something is wrong: sizes that change, pictures that are none, calls after the end, no steps."""

from __future__ import annotations

import io
import logging
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import heptarm as ha
from heptarm.cli import record as command
from heptarm.errors import CommandRejected, ShapeError, StaleState
from heptarm.record.demonstration import Demonstrations
from heptarm.record.mcap_file import RecordingFile
from heptarm.record.recorder import Recorder
from tests.arm.peer import Peer
from tests.record.test_data_sets import demonstration, picture
from tests.record.test_episodes import Camera, passes, until


def test_streams_and_actions_keep_their_length_over_the_whole_set(peer: Peer, tmp_path: Path) -> None:
    with peer.arm() as arm, arm.episodes(tmp_path, rate=25.0, streams={"pushed": None}) as episodes:
        with episodes.episode() as episode:  # its lengths bind no other one
            episodes.push("pushed", [1.0])
            episode.act([1.0])
            episode.discard()
        for _ in range(2):
            with episodes.episode() as episode:
                episodes.push("pushed", [1.0, 2.0])
                episode.act([1.0, 2.0])
                passes(arm, 0.2)
                with pytest.raises(
                    ShapeError, match=r"the stream pushed must have 2 numbers as before in this set, got 1"
                ):
                    episodes.push("pushed", [1.0])
                with pytest.raises(ShapeError, match=r"action must have 2 numbers as before.*, got 3"):
                    episode.act([1.0, 2.0, 3.0])
                episode.succeed()
    found = ha.load_episodes(tmp_path)
    assert found.labels == {"success": 2}
    assert all(episode["pushed"].shape[1] == episode.action.shape[1] == 2 for episode in found)


def test_a_function_that_changes_its_length_makes_a_failure(peer: Peer, tmp_path: Path) -> None:
    lengths = [2]
    with peer.arm() as arm, arm.episodes(tmp_path, streams={"force": lambda: [1.0] * lengths[0]}) as episodes:
        with (
            pytest.raises(StaleState, match="force must have 2 numbers as before, got 3"),
            episodes.episode() as episode,
        ):
            passes(arm, 0.2)
            lengths[0] = 3
            passes(arm, 0.2)
            episode.succeed()
        with episodes.episode() as episode:
            passes(arm, 0.2)
            episode.succeed()
    first, second = ha.load_episodes(tmp_path)
    assert (first.label, second.label) == ("failure", "success") and "got 3" in first.reason
    assert first["force"].shape[1] == 2 and second["force"].shape[1] == 3


def test_a_file_that_cannot_be_read_does_not_block_the_others(
    peer: Peer, tmp_path: Path, caplog: pytest.LogCaptureFixture, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "set"
    with peer.arm() as arm, arm.episodes(folder, streams={"pushed": None}) as episodes:
        for number in range(2):
            with episodes.episode() as episode:
                episodes.push("pushed", [1.0, 2.0])
                if not number:  # as an older heptarm wrote it
                    episodes._feeds["pushed"].add(episodes._source.nanos(), [1.0])
                passes(arm, 0.2)
                episode.succeed()
    with caplog.at_level(logging.WARNING, "heptarm.record"):
        found = ha.load_episodes(folder)
    assert [episode.number for episode in found] == [1]
    assert found.unreadable == (folder / "episode-00000.mcap",) == found[:1].unreadable
    assert str(found).startswith("1 episode in ") and "unreadable  1 file: episode-00000.mcap" in str(found)
    assert "episode-00000.mcap cannot be read and is left out" in caplog.text
    assert "the stream pushed must have as many numbers each time, got 2 and 1" in caplog.text
    assert command.episodes(folder) == 0
    assert "unreadable" in capsys.readouterr().out
    assert command.convert(folder, tmp_path / "data", to="lerobot") == 0
    printed = capsys.readouterr().out
    assert printed.startswith("1 episode, ") and "left out, as not readable: 1 file" in printed
    (folder / "episode-00001.mcap").write_bytes(b"no MCAP")
    with pytest.raises(CommandRejected, match="must have episodes that can be read, got none among 2 files"):
        ha.load_episodes(folder)
    (folder / "episode-00001.mcap").unlink()
    with pytest.raises(CommandRejected, match="as many numbers each time"):
        ha.load_episodes(folder)


def test_pictures_of_floats_make_a_failure_whose_reason_is_one_line(peer: Peer, tmp_path: Path) -> None:
    def floats() -> object:
        time.sleep(0.02)
        return np.zeros((48, 48, 3))

    with peer.arm() as arm, arm.episodes(tmp_path, cameras={"wrist": floats}) as episodes:
        with (
            pytest.raises(
                StaleState, match=r"uint8 of shape \(height, width, 3\).*float64 of shape \(48, 48, 3\)"
            ),
            episodes.episode() as episode,
        ):
            passes(arm, 0.2)
            episode.succeed()
        (found,) = ha.load_episodes(tmp_path)
        assert found.label == "failure" and "\n" not in found.reason and "[" not in found.reason
        assert not _grows(episode.path, arm)


def test_whatever_goes_wrong_at_the_end_the_recording_is_closed(
    peer: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("a defect")

    with peer.arm() as arm, arm.episodes(tmp_path) as episodes:
        with monkeypatch.context() as patch:
            patch.setattr(Recorder, "conclude", broken)
            with pytest.raises(RuntimeError, match="a defect"), episodes.episode() as episode:
                passes(arm, 0.2)
                episode.succeed()
        assert not _grows(episode.path, arm)
        with monkeypatch.context() as patch:
            patch.setattr(Recorder, "start", broken)
            with pytest.raises(RuntimeError, match="a defect"), episodes.episode():
                raise AssertionError
        with episodes.episode() as episode:
            passes(arm, 0.2)
            episode.succeed()
        with pytest.raises(ValueError, match="first") as raised, episodes.episode():
            raise ValueError("first\n\x00second")
        assert str(raised.value).startswith("first")
    found = ha.load_episodes(tmp_path)
    assert [episode.label for episode in found] == ["unfinished", "success", "failure"]
    assert found[2].reason == "ValueError: first second"


def _grows(path: Path, arm: ha.Arm) -> bool:
    before = path.stat().st_size
    passes(arm, 0.3)
    return path.stat().st_size != before


def test_a_camera_that_changes_its_size_makes_a_failure(peer: Peer, tmp_path: Path) -> None:
    camera, height = Camera(), [24]

    def read() -> object:
        return camera()[: height[0]]

    def pictures(count: int) -> None:
        seen = camera.shots
        until(lambda: camera.shots > seen + count)

    with peer.arm() as arm, arm.episodes(tmp_path, rate=25.0, cameras={"wrist": read}) as episodes:
        with episodes.episode() as episode:
            pictures(4)
            height[0] = 12
            pictures(8)
            with pytest.raises(
                StaleState,
                match=r"wrist must have pictures of 24 x 32 x 3 pixels as before \(height x width\), got 12 x 32 x 3",
            ):
                episode.check()
            episode.discard()
        with episodes.episode() as episode:
            pictures(4)
            episode.succeed()
        with pytest.raises(StaleState, match="got 24 x 32 x 3"), episodes.episode() as episode:
            pictures(4)
            height[0] = 24
            pictures(8)
            episode.succeed()
    found = ha.load_episodes(tmp_path)
    assert [episode.label for episode in found] == ["success", "failure"]
    assert found[1].reason.startswith("wrist must have pictures of 12 x 32 x 3 pixels as before")


@pytest.mark.parametrize("save", [ha.save_lerobot, ha.save_hdf5])
def test_a_data_set_refuses_an_older_episode_with_pictures_of_two_sizes(save: object, tmp_path: Path) -> None:
    if save is ha.save_hdf5:
        pytest.importorskip("h5py")
    episode = demonstration(0, 2, "success")
    other = Camera()()[:4]
    file = io.BytesIO()
    Image.fromarray(other).save(file, "JPEG")
    odd = replace(episode, views={"wrist": (picture(3), file.getvalue())})
    with pytest.raises(
        CommandRejected,
        match=r"the camera wrist must have pictures of one size .* got 24 x 16 and 32 x 4 pixels",
    ):
        save(Demonstrations(Path("set"), [odd]), tmp_path / "data.hdf5")  # type: ignore[operator]
    assert not list(tmp_path.iterdir())


def test_after_its_block_an_episode_takes_no_calls(peer: Peer, tmp_path: Path) -> None:
    with peer.arm() as arm, arm.episodes(tmp_path) as episodes:
        with episodes.episode() as episode:
            passes(arm, 0.2)
            episode.succeed()
            episode.fail("it slipped")
        for call in (
            episode.succeed,
            episode.fail,
            episode.discard,
            lambda: episode.act([1.0]),
            lambda: episode.note("late"),
        ):
            with pytest.raises(CommandRejected, match=r"the episode has ended, its file episode-00000\.mcap"):
                call()
        assert episode.label == "failure"
    (found,) = ha.load_episodes(tmp_path)
    assert (found.label, found.reason) == ("failure", "it slipped")


def test_a_stream_that_gives_nothing_makes_a_failure(peer: Peer, tmp_path: Path) -> None:
    with peer.arm() as arm:
        with (
            arm.episodes(tmp_path, streams={"p": None}) as episodes,
            pytest.raises(StaleState, match="no value of the stream p arrived"),
            episodes.episode() as episode,
        ):
            passes(arm, 0.2)
            episode.succeed()
        with (
            arm.episodes(tmp_path, streams={"f": lambda: None}) as episodes,
            pytest.raises(StaleState, match="no value of the stream f arrived"),
            episodes.episode() as episode,
        ):
            passes(arm, 0.2)
            episode.succeed()
        camera = Camera()
        camera.is_stuck.set()
        with (
            arm.episodes(tmp_path, cameras={"wrist": camera}) as episodes,
            pytest.raises(StaleState, match="no picture of the camera wrist arrived"),
            episodes.episode() as episode,
        ):
            passes(arm, 0.2)
        camera.ends.set()
    found = ha.load_episodes(tmp_path)
    assert [episode.label for episode in found] == ["failure"] * 3
    assert found[0].reason == "no value of the stream p arrived"


def test_one_wrong_reading_of_a_stream_costs_one_episode(peer: Peer, tmp_path: Path) -> None:
    given = [0.0]
    with peer.arm() as arm, arm.episodes(tmp_path, rate=50.0, streams={"f": lambda: list(given)}) as episodes:
        with (
            pytest.raises(StaleState, match=r"f failed: f\[0\] must be finite"),
            episodes.episode() as episode,
        ):
            given[0] = np.nan
            until(lambda: bool(episode._stalled()))
            given[0] = 1.0
            episode.succeed()
        with episodes.episode() as episode:
            until(lambda: episodes._feeds["f"].count > 2)
            episode.succeed()
    assert [episode.label for episode in ha.load_episodes(tmp_path)] == ["failure", "success"]


def test_a_stream_has_no_name_of_a_column_of_data_sets(peer: Peer, tmp_path: Path) -> None:
    with peer.arm() as arm:
        for name in ("velocity", "joint_positions", "joint_velocities"):
            with pytest.raises(CommandRejected, match=f"not be one of .*got '{name}'"):
                arm.episodes(tmp_path, streams={name: None})


def test_an_episode_without_steps_has_empty_signals(
    peer: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(RecordingFile, "states", lambda *_, **__: None)
    with peer.arm() as arm, arm.episodes(tmp_path) as episodes, episodes.episode() as episode:
        episode.succeed()
    (found,) = ha.load_episodes(tmp_path)
    assert len(found) == 0 and found["q"].shape == (0, 7) and found["wrench"].shape == (0, 6)
    assert found.action.shape == (0, 7) and ", 0 steps" in str(found)
    with pytest.raises(CommandRejected, match=r"episode-00000\.mcap has no steps, .* it has q, dq"):
        found["force"]
