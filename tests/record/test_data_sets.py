"""What is made of episodes besides LeRobot's format: statistics, and HDF5 files in the layout of robomimic."""

from __future__ import annotations

import io
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import heptarm as ha
from heptarm.errors import CommandRejected, MissingExtra
from heptarm.record.demonstration import Demonstration, Demonstrations
from heptarm.record.episodes import Label


def picture(level: int) -> bytes:
    file = io.BytesIO()
    Image.fromarray(np.full((16, 24, 3), level, np.uint8)).save(file, "JPEG")
    return file.getvalue()


def demonstration(number: int, steps: int, label: Label, *, width: int = 8) -> Demonstration:
    t = np.arange(steps) / 20.0
    signals = {"q": number + t[:, None] * np.ones(7), "force": np.full((steps, 1), 3.0)}
    action = np.full((steps, width), 0.5 * number)
    views = {"wrist": tuple(picture(10 * number + step) for step in range(steps))}
    name = Path(f"episode-{number:05d}.mcap")
    return Demonstration(
        *(name, number, "Insert", label, "", "iiwa14", 20.0, t, signals, action, np.zeros(steps, bool)),
        views=views,
        dropped={},
    )


def episodes() -> Demonstrations:
    return Demonstrations(Path("set"), [demonstration(0, 3, "success"), demonstration(1, 5, "failure")])


def test_statistics_are_over_all_steps_and_refuse_episodes_of_another_kind() -> None:
    found = episodes().statistics()
    assert list(found) == ["q", "force", "action"]
    whole = np.concatenate([episode["q"] for episode in episodes()])
    for name in ("min", "max", "mean", "std"):
        np.testing.assert_allclose(getattr(found["q"], name), getattr(whole, name)(axis=0))
    assert found["force"].std.tolist() == [0.0] and found["action"].mean[0] == pytest.approx(5 * 0.5 / 8)
    other = Demonstrations(Path("set"), [*episodes(), demonstration(2, 2, "success", width=7)])
    with pytest.raises(CommandRejected, match="the same numbers of action, got 7 and 8"):
        other.statistics()


def test_hdf5_has_the_layout_of_robomimic(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(CommandRejected, match="there must be episodes with steps, got none"):
        ha.save_hdf5(Demonstrations(Path("set"), ()), tmp_path / "none.hdf5")
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "h5py", None)
        with pytest.raises(MissingExtra, match="h5py") as raised:
            ha.save_hdf5(episodes(), tmp_path / "set.hdf5")
        assert raised.value.hint == "pip install 'heptarm[hdf5]'" and not list(tmp_path.iterdir())
    blind = replace(demonstration(2, 2, "success"), views={})
    for save in (ha.save_hdf5, ha.save_lerobot):
        with pytest.raises(
            CommandRejected, match="00002.mcap and episode-00000.mcap differ in the camera wrist"
        ):
            save(Demonstrations(Path("set"), [*episodes(), blind]), tmp_path / "blind")
    assert not list(tmp_path.iterdir())
    h5py = pytest.importorskip("h5py")
    file = ha.save_hdf5(episodes(), tmp_path / "set.hdf5")
    with pytest.raises(CommandRejected, match="exists"):
        ha.save_hdf5(episodes(), file)
    assert ha.save_hdf5(episodes(), file, overwrite=True) == file
    with h5py.File(file) as found:
        data = found["data"]
        assert list(data) == ["demo_0", "demo_1"] and data.attrs["total"] == 8
        assert json.loads(data.attrs["env_args"])["env_name"] == "Insert"
        for name, episode in zip(data, episodes()):
            group, steps = data[name], len(episode)
            assert group.attrs["num_samples"] == steps and group.attrs["label"] == episode.label
            np.testing.assert_array_equal(group["actions"], episode.action)
            np.testing.assert_array_equal(group["obs/joint_positions"], episode["q"])
            after = np.minimum(np.arange(steps) + 1, steps - 1)
            for signal in group["obs"]:
                np.testing.assert_array_equal(group[f"next_obs/{signal}"], group["obs"][signal][()][after])
            assert group["obs/wrist_image"].shape == (steps, 16, 24, 3)
            assert abs(int(group["obs/wrist_image"][0].mean()) - 10 * episode.number) < 3
            assert group["dones"][()].tolist() == [0] * (steps - 1) + [1]
            assert (
                group["rewards"][-1] == float(episode.label == "success") and not group["rewards"][:-1].any()
            )
        assert found["mask/success"][()].tolist() == [b"demo_0"]
        assert found["mask/failure"][()].tolist() == [b"demo_1"]
