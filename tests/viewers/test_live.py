"""The live view: what rerun's own reader finds in the file; and what is refused in one sentence."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm.cli.record import convert
from heptarm.errors import CommandRejected, LimitError, MissingExtra, ShapeError
from heptarm.record.demonstration import in_steps
from heptarm.viewers.recorded import save_rerun
from heptarm.wire import messages as wire
from tests.arm.peer import Peer

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)


@pytest.fixture
def peer() -> Iterator[Peer]:
    peer = Peer()
    yield peer
    peer.close()


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


class Read:
    """A file of rerun's, read by rerun: a table per entity, those that are logged once apart."""

    def __init__(self, file: Path) -> None:
        chunk = pytest.importorskip("rerun.chunk")
        self.still: dict[str, set[str]] = {}
        self.rows: dict[str, dict[str, list[Any]]] = {}
        for one in chunk.RrdReader(file).stream().to_chunks():
            path, batch = str(one.entity_path), one.to_record_batch()
            columns = {name: batch.column(name).to_pylist() for name in batch.schema.names}
            if one.is_static:
                self.still.setdefault(path, set()).update(columns)
                continue
            table = self.rows.setdefault(path, {})
            for name, values in columns.items():
                table.setdefault(name.rpartition(":")[2], []).extend(values)

    def numbers(self, path: str, component: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Numbers of an entity in the order of their times, shape (n, m)."""
        table = self.rows[path]
        order = np.argsort(table["time"])
        return np.array([np.ravel(table[component][index]) for index in order], float)


def test_states_and_events_are_in_the_file_as_rerun_reads_it(peer: Peer, tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    peer.runs(11, wire.MotionStarted(id=11, item=0), peer.finished(11))
    file = tmp_path / "arm.rrd"
    with peer.arm() as arm:
        with ha.live(arm, save=file) as view:
            view.note("begin here")
            arm.move(ha.ptp(HOME))
            until(lambda: view.states > 20)
            assert view.is_running and "running" in repr(view)
        assert not view.is_running and view.lost == 0
        view.close()
    read = Read(file)
    assert len(read.rows["/arm/q"]["time"]) == view.states
    np.testing.assert_allclose(read.numbers("/arm/q", "scalars")[-1], peer.q)
    links = [path for path in read.rows if "link_" in path]
    assert len(links) == 7
    shapes = [path for path, columns in read.still.items() if "Mesh3D:vertex_positions" in columns]
    assert len({path.rpartition("/")[0] for path in shapes}) == 8, "each link has its shape"
    texts = [text for (text,) in read.rows["/arm/events"]["text"]]
    assert any("begin here" in text for text in texts) and any("motion 11" in text for text in texts)


def test_an_episode_is_a_file_of_rerun_with_its_pictures_streams_and_actions(
    peer: Peer, tmp_path: Path
) -> None:
    folder, file = tmp_path / "set", tmp_path / "episode.rrd"
    taken: list[float] = []

    def camera() -> np.ndarray:
        taken.append(0.0)
        return np.full((8, 12, 3), 90, np.uint8)

    with (
        peer.arm() as arm,
        arm.episodes(folder, cameras=[camera], streams={"force": None}) as episodes,
        episodes.episode() as episode,
    ):
        states, before = arm.state.stamp, len(taken)
        until(
            lambda: (
                episodes.push("force", [1.0, 2.0]) is None
                and arm.state.stamp - states > 200_000_000
                and len(taken) - before > 2
            )
        )
        episode.succeed()
    run = ha.load(folder / "episode-00000.mcap")
    with pytest.raises(CommandRejected, match="no states of a known robot"):
        save_rerun(replace(run, facts={"robot": "iiwa99"}), file)
    pytest.importorskip("rerun")
    assert convert(run.path, file) == 0
    with pytest.raises(CommandRejected, match="exists"):
        save_rerun(run, file)
    read = Read(file)
    np.testing.assert_allclose(read.numbers("/arm/q", "scalars"), run["q"])
    np.testing.assert_allclose(read.numbers("/arm/stream/force", "scalars"), run.streams["force"].values)
    assert len(read.rows["/arm/camera/camera"]["blob"]) == len(run.views["camera"])
    assert read.numbers("/arm/action", "scalars").shape == in_steps(run).action.shape
    assert ["label: success"] in read.rows["/arm/events"]["text"]


def test_the_chain_of_links_ends_at_the_flange() -> None:
    pytest.importorskip("mujoco")
    from heptarm.model.kinematics import forward
    from heptarm.values.robot import robot
    from heptarm.viewers.rerun_stream import JointChain

    generator = np.random.default_rng(7)
    for model in ("iiwa7", "iiwa14", "med14"):
        q = generator.uniform(-1.5, 1.5, (3, 7))
        chain = JointChain(model, "base").transforms(q)
        assert [path.rpartition("/")[2] for path, *_ in chain] == [f"link_{i}" for i in range(1, 8)]
        for row in range(3):
            pose = ha.Pose.of((0, 0, 0), (0, 0, 0, 1))
            for _, place, turns in chain:
                pose = pose @ ha.Pose.of(place, turns[row])
            last = forward(robot(model), q[row], link=7)
            np.testing.assert_allclose(pose.matrix, last, atol=1e-9)


def test_without_rerun_the_command_that_installs_it(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    with peer.arm() as arm, pytest.raises(MissingExtra, match="rerun") as raised:
        ha.live(arm, save="x.rrd")
    assert raised.value.hint == "pip install 'heptarm[rerun]'"


def test_a_file_that_exists_is_kept(peer: Peer, tmp_path: Path) -> None:
    file = tmp_path / "mine.rrd"
    file.write_text("mine")
    with peer.arm() as arm:
        with pytest.raises(CommandRejected, match=r"mine\.rrd exists .*overwrite=True"):
            ha.live(arm, save=file)
        assert file.read_text() == "mine"


def test_a_file_is_replaced_when_asked(peer: Peer, tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    file = tmp_path / "mine.rrd"
    file.write_text("mine")
    with peer.arm() as arm, ha.live(arm, save=file, overwrite=True):
        pass
    assert file.read_bytes() != b"mine"


def test_what_cannot_be_shown_is_refused(peer: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("rerun")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with peer.arm() as arm:
        rate = arm.state_rate
        with pytest.raises(ShapeError, match="arm"):
            ha.live("arm")  # type: ignore[arg-type]
        with pytest.raises(LimitError, match="rate"):
            ha.live(arm, save=tmp_path / "a.rrd", rate=5000.0)
        with pytest.raises(CommandRejected, match="nothing would be shown"):
            ha.live(arm, viewer=False)
        with pytest.raises(CommandRejected, match="cannot be written"):
            ha.live(arm, save="/proc/nothing/a.rrd", rate=500)
        with pytest.raises(CommandRejected, match="must be the address of a rerun viewer"):
            ha.live(arm, to="http://somewhere")
        with pytest.raises(CommandRejected, match="no rerun viewer answers at 127.0.0.1:9"):
            ha.live(arm, to="rerun+http://127.0.0.1:9/proxy")
        if sys.platform == "linux":
            with pytest.raises(CommandRejected, match="no display") as raised:
                ha.live(arm)
            assert "--save" in raised.value.hint
        assert arm.state_rate == rate


def test_a_viewer_elsewhere_receives_the_same(peer: Peer, tmp_path: Path) -> None:
    """Rerun's own server, which writes what it receives."""
    rerun_cli = pytest.importorskip("rerun_cli")
    program = Path(rerun_cli.__file__).with_name("rerun.exe" if sys.platform == "win32" else "rerun")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    file = tmp_path / "received.rrd"
    command = [str(program), "--port", str(port), "--save", str(file)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as server:
        try:
            until(lambda: listens(port))
            with peer.arm() as arm, ha.live(arm, to=f"rerun+http://127.0.0.1:{port}/proxy") as view:
                until(lambda: view.states > 20)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # rerun ends a file only when its server ends
                until(lambda: count(file) == view.states)
        finally:
            server.kill()


def count(file: Path) -> int:
    """States that are in a file so far."""
    table = Read(file).rows.get("/arm/q", {})
    return len(table.get("time", ()))


def listens(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port)).close()
    except OSError:
        return False
    return True
