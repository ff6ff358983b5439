"""A recording on the page: by the slider, in time, with its twin as a ghost."""

from __future__ import annotations

import contextlib
import io
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import heptarm as ha
from heptarm.model.kinematics import forward
from heptarm.panel.player import Player, open_player
from heptarm.panel.process import PanelOptions
from heptarm.record.mcap_file import merge
from heptarm.record.pictures import Pictures
from heptarm.record.recorded import RecordedEvent
from heptarm.record.recording import Recording
from heptarm.values.robot import robot
from tests.arm.peer import Peer

pytest.importorskip("viser")

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)


def recording(offset: float = 0.0) -> Recording:
    """Two seconds of a moving arm."""
    t = np.linspace(0.0, 2.0, 201)
    q = HOME + offset + 0.2 * np.sin(t)[:, None]
    note = RecordedEvent(1.0, "note", "note", "half way", {"text": "half way"})
    facts = {"robot": "iiwa14", "title": "LBR iiwa 14 R820"}
    return Recording(Path("run.mcap"), facts, {"t": t, "q": q}, (), (note,), complete=True)


@contextlib.contextmanager
def played(file: Path) -> Iterator[Player]:
    """The page of a file."""
    player = open_player(file, PanelOptions(port=0))
    try:
        yield player
    finally:
        player.close()


def test_a_twin_plays_with_its_ghost(tmp_path: Path) -> None:
    file = merge(tmp_path / "both.mcap", {"recorded": recording(), "simulated": recording(0.1)})
    with played(file) as player:
        for t in (0.5, 1.5):
            player.slider.value = t
            player.is_playing.value = False
            player.step(1.0)
            q = HOME + 0.2 * np.sin(t)
            assert player._world.flange.xpos == pytest.approx(forward(robot("iiwa14"), q)[:3, 3], abs=1e-5)
            assert ("half way" in player.events.content) is (t > 1.0)
            assert player._ghost._data.qpos[:7] == pytest.approx(q + 0.1, abs=1e-5)
        player.is_playing.value = True
        player.step(0.25)
        assert player.slider.value == pytest.approx(1.75)
        player.step(0.5)
        assert player.slider.value == 0.0, "at its end it begins again"
        assert "token" in player.url


def test_an_episode_shows_what_its_cameras_saw() -> None:
    def picture(level: int) -> bytes:
        data = io.BytesIO()
        Image.fromarray(np.full((8, 8, 3), level, np.uint8)).save(data, "JPEG")
        return data.getvalue()

    view = Pictures(np.array([0.0, 1.0, 2.0]), tuple(picture(level) for level in (10, 100, 200)))
    player = Player(replace(recording(), views={"wrist": view}), PanelOptions(port=0))
    try:
        for t, level in ((0.2, 10), (1.2, 100), (1.9, 200), (0.1, 10)):
            player.show(t)
            assert player.pictures["wrist"].image.mean() == pytest.approx(level, abs=2)
    finally:
        player.close()


def test_the_episodes_of_a_folder_are_chosen_on_the_page(tmp_path: Path) -> None:
    peer, deadline = Peer(), time.monotonic() + 30.0
    with peer.arm() as arm, arm.episodes(tmp_path, task="Look", streams={"force": None}) as episodes:
        for number in range(2):
            with episodes.episode() as episode:
                begin = arm.state.stamp
                while arm.state.stamp - begin < 100_000_000 and time.monotonic() < deadline:
                    episodes.push("force", 4.5 + number)
                    time.sleep(0.01)
                episode.fail("it jammed") if number else episode.succeed()
    peer.close()
    with played(tmp_path) as player:
        assert player.episode is not None and player.episode.options == ("episode-00000", "episode-00001")
        player.step(0.05)
        assert player.about.content == "**success** Look\n\nforce: 4.5"
        player.episode.value = "episode-00001"
        player.step(0.05)
        assert player.about.content == "**failure** (it jammed) Look\n\nforce: 5.5"
        (tmp_path / "episode-00000.mcap").write_bytes(b"cut")
        player.episode.value = "episode-00000"
        player.step(0.05)
        player.step(0.05)
        assert "episode-00000.mcap must be a recording" in player.about.content
        assert player.episode.value == "episode-00001", "what was shown stays"
    with played(tmp_path) as player:  # the first one cannot be read: the next one is shown
        assert player.episode is not None and player.episode.value == "episode-00001"
    with pytest.raises(ha.CommandRejected, match="has no episodes"):
        (tmp_path / "empty").mkdir()
        open_player(tmp_path / "empty", PanelOptions(port=0))


def test_what_cannot_be_played(tmp_path: Path) -> None:
    for broken in (
        replace(recording(), facts={"robot": "iiwa99"}),
        replace(recording(), signals={"t": np.zeros(0), "q": np.zeros((0, 7))}),
    ):
        with pytest.raises(ha.CommandRejected, match="cannot be played"):
            Player(broken, PanelOptions(port=0))
    with pytest.raises(ha.CommandRejected, match="cannot be read"):
        open_player(tmp_path / "none.mcap", PanelOptions(port=0))
