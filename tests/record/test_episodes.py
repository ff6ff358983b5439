"""Episodes: labelled, in equal steps on one clock, what was dropped counted; crashes; LeRobot's format."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyarrow.parquet as parquet
import pytest

import heptarm as ha
from heptarm.cli import record as command
from heptarm.errors import CommandRejected, LimitError, LocalProtocolError, ShapeError, StaleState
from heptarm.record import episodes as recording
from heptarm.record.demonstration import newest
from heptarm.record.mcap_file import RecordingFile
from heptarm.record.recorded import RecordedNumbers
from tests.arm.peer import Peer
from tests.cli.running import refused

PICTURE: npt.NDArray[np.uint8] = np.full((24, 32, 3), 90, np.uint8)


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def passes(arm: ha.Arm, seconds: float) -> None:
    """Wait for a time of the robot's clock."""
    begin = arm.state.stamp
    until(lambda: (arm.state.stamp - begin) * 1e-9 > seconds)


class Camera:
    """A camera whose pictures become brighter."""

    def __init__(self) -> None:
        self.shots = 0
        self.is_stuck = threading.Event()
        self.ends = threading.Event()

    def __call__(self) -> npt.NDArray[np.uint8]:
        if self.is_stuck.is_set():
            self.ends.wait(60.0)
        time.sleep(0.02)
        self.shots += 1
        return PICTURE + np.uint8(self.shots % 100)


def record(arm: ha.Arm, folder: Path, count: int, camera: Camera, **settings: object) -> list[str]:
    """Record episodes with a camera, a function, a pushed stream and actions; the calls of `reset`."""
    resets: list[str] = []
    with arm.episodes(
        folder,
        rate=25.0,
        cameras={"wrist": camera},
        streams={"force": lambda: [1.0, 2.0, camera.shots], "gripper": None},
        task="Insert the peg",
        reset=lambda: resets.append("reset"),
    ) as episodes:
        for number in range(count):
            with episodes.episode() as episode:
                first = camera.shots
                while camera.shots < first + 8:
                    episodes.push("gripper", 0.01 * number)
                    episode.act([*arm.state.q, 0.01])
                    time.sleep(0.01)
                episode.check()
                if number == 0:
                    episode.fail("it jammed")
                elif number == 3:
                    episode.discard()
                else:
                    episode.succeed()
        assert episodes.count == min(count, 3)
    return resets


def test_episodes_have_labels_and_equal_steps_in_which_everything_is_new_or_counted(
    peer: Peer, tmp_path: Path
) -> None:
    folder, camera = tmp_path / "insert", Camera()
    with peer.arm() as arm:
        assert record(arm, folder, 4, camera) == ["reset"] * 4
    found = ha.load_episodes(folder)
    assert [episode.label for episode in found] == ["failure", "success", "success"]
    assert found.labels == {"success": 2, "failure": 1} and found[0].reason == "it jammed"
    assert [path.name for path in sorted(folder.iterdir())] == [
        f"episode-0000{number}.mcap" for number in range(3)
    ]
    for number, episode in enumerate(found):
        assert (episode.task, episode.robot, episode.rate, episode.number) == (
            "Insert the peg",
            "iiwa14",
            25.0,
            number,
        )
        assert len(episode) >= 2 and np.allclose(np.diff(episode.t), 0.04)
        assert episode["q"].shape == (len(episode), 7) and episode.action.shape == (len(episode), 8)
        assert (episode["gripper"] == 0.01 * number).all() and (episode["force"][:, :2] == [1.0, 2.0]).all()
        run = ha.load(episode.path)
        shots, steps = run.views["wrist"].t, episode.t
        for name, t in (("wrist", shots), ("force", run.streams["force"].t)):
            age = steps - np.array([t[t <= step + 1e-6].max() for step in steps])
            assert episode.dropped[name] == int((age > 0.04 + 1e-6).sum()), (
                "what is older than a step is counted"
            )
        assert len(episode.views["wrist"]) == len(episode)
        shown = run.views["wrist"][0].astype(int)
        assert shown.shape == PICTURE.shape and abs(int(shown.mean()) - 90) < 101
    assert "3 episodes" in str(found) and "2 success, 1 failure" in str(found)
    assert len(ha.load_episodes(folder, labels=["success"])) == 2
    assert len(ha.load_episodes(folder, rate=50.0)[1]) > len(found[1])
    with pytest.raises(CommandRejected, match="labels must be among success, failure"):
        ha.load_episodes(folder, labels=["good"])
    with pytest.raises(CommandRejected, match="has no episodes"):
        ha.load_episodes(tmp_path)

    data = ha.save_lerobot(ha.load_episodes(folder, labels="success"), tmp_path / "data")
    check_data_set(data, found[1:])
    with pytest.raises(CommandRejected, match="folder must be empty or new"):
        ha.save_lerobot(found, data)
    with pytest.MonkeyPatch.context() as full:

        def no_space(*_: object, **__: object) -> None:
            raise OSError(errno.ENOSPC, "No space left on device")

        full.setattr(parquet.ParquetWriter, "write_table", no_space)
        with pytest.raises(CommandRejected, match="no space left"):
            ha.save_lerobot(ha.load_episodes(folder, labels="success"), data, overwrite=True)
    check_data_set(data, found[1:])
    assert sorted(path.name for path in tmp_path.iterdir() if "data" in path.name) == ["data"], (
        "half a data set"
    )
    (folder / "episode-00001.mcap").unlink()
    with peer.arm() as arm, arm.episodes(folder, rate=25.0) as episodes, episodes.episode("Look") as last:
        assert last.path.name == "episode-00003.mcap", "numbers are not used again"
        passes(arm, 0.2)
    odd = ha.load_episodes(folder)[-1]
    assert odd.label == "unlabelled" and not odd.dropped.keys() - {"state"}
    assert odd.action.shape == (len(odd), 7), "without act the actions are the next set-points"
    with pytest.raises(
        CommandRejected, match=r"episode-00003\.mcap and episode-00000\.mcap differ in action"
    ):
        ha.save_lerobot(ha.load_episodes(folder), tmp_path / "other")
    assert not (tmp_path / "other").exists()
    said = refused("convert", str(folder), str(tmp_path / "x"), "--label", "success").stderr
    assert "label and rate are of data sets" in said


def test_the_commands_list_episodes_and_make_a_data_set(
    peer: Peer, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "insert"
    with peer.arm() as arm, arm.episodes(folder, rate=20.0, task="Look") as episodes:
        for label in ("success", "failure"):
            with episodes.episode() as episode:
                passes(arm, 0.2)
                episode.succeed() if label == "success" else episode.fail("too slow")
    assert command.episodes(folder) == 0
    first, second, *rest = capsys.readouterr().out.splitlines()
    assert first.startswith("episode-00000.mcap  success  0.") and first.endswith("  Look")
    assert "failure (too slow)" in second and "1 success, 1 failure" in " ".join(rest)
    assert command.episodes(folder, statistics=True) == 0
    assert any(line.startswith("action[6] ") for line in capsys.readouterr().out.splitlines())
    assert command.episodes(folder, statistics=True, as_json=True) == 0
    spread = json.loads(capsys.readouterr().out.splitlines()[-1])["statistics"]
    assert len(spread["q"]["mean"]) == 7 and set(spread["q"]) == {"min", "max", "mean", "std"}
    assert command.episodes(folder, as_json=True) == 0
    assert [json.loads(line)["label"] for line in capsys.readouterr().out.splitlines()] == [
        "success",
        "failure",
    ]
    assert command.convert(folder, tmp_path / "data", to="lerobot", rate=40.0) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("1 episode, ") and printed.rstrip().endswith(f"in {tmp_path / 'data'}")
    assert json.loads((tmp_path / "data/meta/info.json").read_text())["fps"] == 40
    assert command.convert(folder, tmp_path / "data", to="lerobot", label=("failure",), overwrite=True) == 0
    with pytest.raises(CommandRejected, match="there must be episodes with steps, got none"):
        command.convert(folder, tmp_path / "other", to="lerobot", label=("unfinished",))


def check_data_set(data: Path, episodes: ha.Demonstrations) -> None:
    """What LeRobot reads, without LeRobot."""
    info = json.loads((data / "meta/info.json").read_text())
    steps = sum(map(len, episodes))
    assert (
        info["codebase_version"] == "v3.0" and info["fps"] == 25 and info["robot_type"] == "kuka_lbr_iiwa14"
    )
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (len(episodes), steps, 1)
    table = parquet.read_table(data / "data/chunk-000/file-000.parquet")
    assert table.column_names == list(info["features"]) and table.num_rows == steps
    assert info["features"]["observation.images.wrist"]["shape"] == [24, 32, 3]
    assert info["features"]["action"]["names"][-1] == "gripper.pos"
    rows = table.to_pylist()
    assert [row["index"] for row in rows] == list(range(steps))
    at = 0
    for number, episode in enumerate(episodes):
        for step in range(len(episode)):
            row = rows[at]
            assert (row["episode_index"], row["frame_index"], row["task_index"]) == (number, step, 0)
            assert row["timestamp"] == pytest.approx(step / 25.0, abs=1e-6)
            np.testing.assert_allclose(row["observation.state"], episode["q"][step], atol=1e-6)
            np.testing.assert_allclose(row["action"], episode.action[step], atol=1e-6)
            assert row["observation.images.wrist"]["bytes"] == episode.views["wrist"][step]
            assert row["next.success"] is (step == len(episode) - 1)
            at += 1
    about = parquet.read_table(data / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [row["length"] for row in about] == [len(episode) for episode in episodes]
    assert [row["dataset_to_index"] for row in about][-1] == steps and about[0]["tasks"] == ["Insert the peg"]
    stats = json.loads((data / "meta/stats.json").read_text())
    whole = np.concatenate([episode.action for episode in episodes])
    np.testing.assert_allclose(stats["action"]["mean"], whole.mean(axis=0), atol=1e-6)
    np.testing.assert_allclose(stats["action"]["std"], whole.std(axis=0), atol=1e-6)
    assert np.shape(stats["observation.images.wrist"]["mean"]) == (3, 1, 1)
    assert 0.3 < stats["observation.images.wrist"]["mean"][0][0][0] < 0.8


def test_an_episode_begins_when_a_camera_that_is_slow_to_start_gives_pictures(
    peer: Peer, tmp_path: Path
) -> None:
    camera = Camera()

    def slow() -> npt.NDArray[np.uint8]:
        time.sleep(0.0 if camera.shots else 0.7)
        return camera()

    with peer.arm() as arm, arm.episodes(tmp_path, cameras=[slow]) as episodes:
        assert camera.shots
        with episodes.episode() as episode:
            begun = camera.shots
            until(lambda: camera.shots > begun + 2)
            episode.succeed()
    assert [episode.label for episode in ha.load_episodes(tmp_path)] == ["success"]


def test_a_camera_that_stalls_and_an_error_make_a_failure_and_the_rest_stays(
    peer: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording, "STALL", 0.3)
    camera = Camera()
    with peer.arm() as arm:
        with arm.episodes(tmp_path, rate=25.0, cameras=[camera]) as episodes:
            with pytest.raises(RuntimeError, match="the policy diverged"), episodes.episode():
                raise RuntimeError("the policy diverged")
            with (
                pytest.raises(StaleState, match=r"episode-00001\.mcap is a failure: camera gave nothing for"),
                episodes.episode() as episode,
            ):
                camera.is_stuck.set()
                time.sleep(0.5)
                with pytest.raises(StaleState, match="camera gave nothing for"):
                    episode.check()
                episode.succeed()
            camera.is_stuck.clear()
            camera.ends.set()
            with pytest.raises(LimitError, match="number must be"):
                episodes.episode(number=-1)
            with pytest.raises(CommandRejected, match="exists"), episodes.episode(number=0):
                raise AssertionError
            with episodes.episode(number=7) as episode:
                with pytest.raises(LocalProtocolError, match="no other episode"), episodes.episode():
                    raise AssertionError
                seen = camera.shots
                until(lambda: camera.shots > seen + 3)
                episode.succeed()
            with pytest.raises(CommandRejected, match="name must be one of none"):
                episodes.push("force", 1.0)
        with pytest.raises(LocalProtocolError, match="with block of its set"), episodes.episode():
            raise AssertionError

        def lost() -> object:
            raise CommandRejected("the start is not reached")

        not_reached = pytest.raises(CommandRejected, match="not reached")
        with arm.episodes(tmp_path, reset=lost) as episodes, not_reached, episodes.episode():
            raise AssertionError
    found = ha.load_episodes(tmp_path)
    assert [episode.label for episode in found] == ["failure", "failure", "success"]
    assert [episode.number for episode in found] == [0, 1, 7]
    assert found[0].reason == "RuntimeError: the policy diverged"
    assert found[1].reason.startswith("camera gave nothing for")


def test_a_crash_keeps_what_is_complete(peer: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with peer.arm() as arm, arm.episodes(tmp_path, rate=25.0) as episodes:
        for label in range(2):
            with episodes.episode() as episode:
                passes(arm, 0.3)
                if label:  # as a killed process leaves the file
                    monkeypatch.setattr(RecordingFile, "finish", lambda file, _: file.abandon())
                episode.succeed()
    found = ha.load_episodes(tmp_path)
    assert [episode.label for episode in found] == ["success", "unfinished"]
    assert len(found[0]) > 2 and len(ha.load_episodes(tmp_path, labels=["success"])) == 1


def test_what_is_refused(peer: Peer, tmp_path: Path) -> None:
    with peer.arm() as arm:
        for settings, error, text in (
            ({"rate": 0.0}, LimitError, "rate must be"),
            ({"cameras": "front"}, ShapeError, "cameras must be a list"),
            ({"cameras": {"front": 3}}, ShapeError, r"cameras\['front'\] must be a Camera or a function"),
            ({"streams": {"Force": None}}, CommandRejected, "names in streams must have lower case"),
            ({"streams": {"action": None}}, CommandRejected, "not be one of action"),
            ({"streams": {"force": 3}}, ShapeError, "must be a function or None"),
            ({"streams": {"a": None}, "cameras": {"a": Camera()}}, CommandRejected, "in both"),
            ({"reset": 3}, ShapeError, "reset must be a function"),
        ):
            with pytest.raises(error, match=text):
                arm.episodes(tmp_path / "x", **settings)
    assert not (tmp_path / "x").exists()


def test_the_newest_sample_counts_and_what_is_older_than_a_step_is_dropped() -> None:
    index, dropped = newest(np.array([0.0, 0.05, 0.1, 0.31]), np.linspace(0.0, 0.35, 8), period=0.05)
    assert index.tolist() == [0, 1, 2, 2, 2, 2, 2, 3] and dropped == 3
    numbers = RecordedNumbers(np.arange(4.0), np.arange(4.0)[:, None])
    assert numbers.between(1.0, 2.0).t.tolist() == [1.0, 2.0]
    assert newest(np.array([1.0]), np.zeros(0), period=0.1)[1] == 0


@pytest.mark.long
def test_lerobot_itself_loads_the_data_set(peer: Peer, tmp_path: Path) -> None:
    python = os.environ.get("LEROBOT_PYTHON", "")
    if not python:
        pytest.skip(
            "LEROBOT_PYTHON names a Python 3.12 with lerobot[dataset]; see docs/guide/learning/lerobot.md"
        )
    with peer.arm() as arm:
        record(arm, tmp_path / "insert", 3, Camera())
    found = ha.load_episodes(tmp_path / "insert")
    ha.save_lerobot(found, tmp_path / "data")
    program = f"""
from lerobot.datasets.lerobot_dataset import LeRobotDataset
root = {str(tmp_path / "data")!r}
data = LeRobotDataset("me/insert", root=root)
print(data.num_episodes, data.num_frames, tuple(data[0]["observation.images.wrist"].shape), data[0]["task"])
chunk = LeRobotDataset("me/insert", root=root, episodes=[1], delta_timestamps={{"action": [0.0, 0.04]}})
print(tuple(chunk[0]["action"].shape), sorted(data.meta.stats["action"])[:3])
"""
    printed = subprocess.run(
        [python, "-c", program],
        check=False,
        capture_output=True,
        text=True,
        timeout=600,
        env=os.environ | {"HF_HUB_OFFLINE": "1", "HF_DATASETS_CACHE": str(tmp_path / "cache")},
    )
    assert printed.returncode == 0, printed.stderr[-3000:]
    first, second = printed.stdout.splitlines()
    assert first == f"3 {sum(map(len, found))} (3, 24, 32) Insert the peg"
    assert second == "(2, 8) ['count', 'max', 'mean']"
