"""Pictures in a recording, drawn by the real process: of an arm that moves, of a scene, and when things go wrong."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

import heptarm as ha
from heptarm.errors import CommandRejected, ShapeError
from heptarm.record.camera import CameraFeed, CameraSubject, DrawnPicture
from heptarm.record.convert import convert
from heptarm.sim.plant.scene import Scene
from heptarm.sim.plant.shared_state import PositionsFile
from heptarm.sim.plant.world import compiled
from tests.arm.peer import Peer
from tests.conftest import RunningCabinet
from tests.drawing import cannot_draw, changed, until
from tests.processes import running
from tests.simulators import PATIENT

SMALL = ha.Camera(size=(160, 120), rate=20.0)
#: Positions of the joints in which the arm looks different.
UPRIGHT, BENT = (0.1,) * 7, (0.5, 0.9, 0.0, -1.2, 0.0, 0.8, 0.0)


@pytest.fixture(scope="module", autouse=True)
def can_draw() -> None:
    """Skips where the machine has neither EGL nor OSMesa."""
    if why := cannot_draw():
        pytest.skip(why)


def taken(feed: CameraFeed) -> list[DrawnPicture]:
    """The pictures that are finished, as soon as there are any."""
    found: list[DrawnPicture] = []
    until(lambda: bool(found.extend(feed.take()) or found))
    return found


def drawn(feed: CameraFeed, q: tuple[float, ...], number: int = 1) -> np.ndarray:
    """A picture of joint positions."""
    feed.settle()  # the one before may have been taken a moment ago
    feed.offer(number, number * 10**9, number * 10**9, q)
    (picture,) = taken(feed)
    assert picture.number == number
    return ha.Pictures(np.zeros(1), (picture.data,))[0]


def test_a_recording_has_pictures_of_the_arm_that_moves(peer: Peer, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    peer.q = UPRIGHT
    with peer.arm() as arm, arm.record(path, camera=SMALL) as rec:
        until(lambda: rec.pictures >= 3)
        rec.note("bent")
        peer.q = BENT
        until(lambda: arm.state.q[1] > 0.5)
        shown = rec.pictures, rec.states
        until(lambda: rec.pictures >= shown[0] + 6 and rec.states > shown[1] + 100)
        assert rec.is_running
    run = ha.load(path)
    pictures = run.pictures
    assert run.complete and len(pictures) == rec.pictures and pictures.dropped == rec.pictures_dropped
    assert all(picture.shape == (120, 160, 3) and picture.dtype == np.uint8 for picture in pictures)
    assert changed(pictures[0], pictures[-1]) > 300 and changed(pictures[-2], pictures[-1]) == 0
    assert (np.diff(pictures.t) > 0).all()
    distance = np.abs(pictures.t[:, None] - run.t[None, :]).min(axis=1)
    assert distance.max() == 0.0, "every picture is that of a state"
    bent = np.interp(pictures.t, run.t, run["q"][:, 1]) > 0.5
    assert not bent[0] and bent[-1] and bent.tolist() == sorted(bent.tolist())
    for one, is_bent in zip(pictures, bent.tolist(), strict=True):
        assert changed(one, pictures[-1 if is_bent else 0]) == 0, "it shows the state that it belongs to"
    assert changed(pictures.at(run.t[-1]), pictures[-1]) == 0
    part = run.between("bent", "end").pictures
    assert 3 <= len(part) < len(pictures) and part.t[0] >= run.notes[0].t
    assert f"{len(pictures)}, {pictures.dropped} dropped" in str(run)
    files = convert(run, tmp_path / "pictures")
    assert len(files) == len(pictures) and files[0].read_bytes() == pictures.files[0]
    (table,) = convert(run, tmp_path / "run.npz")
    with np.load(table) as arrays:
        assert set(arrays) == set(run.names)


def test_pictures_are_not_decoded_before_they_are_asked_for_and_there_may_be_none(
    peer: Peer, tmp_path: Path
) -> None:
    unread = ha.Pictures(np.array([0.0]), (b"no JPEG",))
    assert len(unread) == 1 and len(unread.between(0.0, 1.0)) == 1
    with peer.arm() as arm, arm.record(tmp_path / "run.mcap") as rec:
        until(lambda: rec.states > 3)
    run = ha.load(tmp_path / "run.mcap")
    assert len(run.pictures) == 0 and list(run.pictures) == [] and "pictures" not in str(run)
    with pytest.raises(CommandRejected, match="has no pictures"):
        run.pictures.at(0.0)
    with pytest.raises(CommandRejected, match="no pictures for a folder"):
        convert(run, tmp_path / "pictures")


def test_a_camera_that_is_too_slow_drops_pictures_and_holds_up_nothing() -> None:
    feed = CameraFeed(SMALL, CameraSubject("iiwa14", lambda: ()))
    feed.start()
    try:
        os.kill(feed.pid, signal.SIGSTOP)
        for number in range(1, 11):  # 100 ms apart: one is due each time
            feed.offer(number, number * 10**8, number * 10**8, UPRIGHT)
        assert feed.dropped == 9 and feed.take() == []
        feed.offer(11, 10**9 + 1, 10**9 + 1, UPRIGHT)
        feed.offer(11, 2 * 10**9, 2 * 10**9, (float("nan"),) * 7)
        assert feed.dropped == 9, "not due, or without positions"
        os.kill(feed.pid, signal.SIGCONT)
        assert [one.number for one in taken(feed)] == [1]
        feed.settle()
        os.kill(feed.pid, signal.SIGSTOP)
        feed.offer(12, 3 * 10**9, 3 * 10**9, UPRIGHT)
        os.kill(feed.pid, signal.SIGKILL)
        until(lambda: feed.dropped == 10)
        feed.offer(13, 4 * 10**9, 4 * 10**9, UPRIGHT)
        feed.settle()
        assert feed.dropped == 11 and feed.take() == []
    finally:
        feed.close()
    feed.close()


def test_the_scene_and_what_is_on_the_flange_are_drawn(tmp_path: Path) -> None:
    model = compiled("iiwa14", scene=Scene.of("bins"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    file = PositionsFile(tmp_path / "positions", model.nq)
    file.write(data.qpos)
    camera = ha.Camera((0.9, 0.2, 0.9), (0.5, 0.2, 0.2), size=(160, 120), rate=60)
    feed = CameraFeed(camera, CameraSubject("iiwa14", lambda: (), "bins", tmp_path / "positions"))
    feed.start()
    try:
        before = drawn(feed, UPRIGHT)
        free = int(model.jnt_qposadr[np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)[0]])
        data.qpos[free : free + 3] = (0.5, 0.2, 0.4)
        file.write(data.qpos)
        assert changed(before, drawn(feed, UPRIGHT, 2)) > 20, "a body of the scene has moved"
    finally:
        feed.close()


def test_the_shapes_of_a_tool_are_drawn_and_a_camera_may_be_on_the_flange() -> None:
    shapes: list[tuple[ha.shapes.Shape, ha.Pose]] = []
    camera = ha.Camera((0.0, 0.3, 0.1), (0.0, 0.0, 0.1), frame="flange", size=(160, 120), rate=60)
    feed = CameraFeed(camera, CameraSubject("iiwa14", lambda: tuple(shapes)))
    feed.start()
    try:
        bare = drawn(feed, UPRIGHT)
        shapes.append((ha.shapes.box(0.04, 0.04, 0.1), ha.Pose.at(0, 0, 0.1)))
        box = drawn(feed, UPRIGHT, 2)
        assert changed(bare, box) > 100
        assert tuple(box[60, 80]) != tuple(bare[60, 80]), "the box is in the middle"
        moved = drawn(feed, BENT, 3)
        middle = (slice(50, 70), slice(70, 90))
        assert changed(box[middle], moved[middle]) == 0 < changed(box, moved), (
            "the camera moves with the flange"
        )
    finally:
        feed.close()


def test_what_cannot_be_drawn_is_refused_in_one_sentence_and_leaves_an_old_file_alone(
    peer: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = tmp_path / "old.mcap"
    old.write_bytes(b"old")
    with peer.arm() as arm:
        with pytest.raises(ShapeError, match="camera must be"):
            arm.record(old, camera="front")  # type: ignore[arg-type]
        rec = arm.record(old, rate=400, camera=ha.Camera(scene="kitchen"), overwrite=True)
        with pytest.raises(CommandRejected, match="scene must be a file .* got 'kitchen'"):
            rec.start()
        assert arm.state_rate == 200.0, "the rate is as before"
        monkeypatch.setenv("MUJOCO_GL", "paper")
        with pytest.raises(CommandRejected, match="cannot draw the pictures") as raised:
            arm.record(old, camera=SMALL, overwrite=True).start()
        assert "paper" in raised.value.text and "libegl1" in raised.value.hint
    assert old.read_bytes() == b"old"


KILLED = """
import heptarm as ha, sys, time
camera = ha.Camera(size=(160, 120), rate=20)
with (
    ha.connect(sys.argv[1], control=False, timeout=30.0) as arm,
    arm.record(sys.argv[2], rate=200, camera=camera) as rec,
):
    while rec.pictures < 5:
        time.sleep(0.01)
    count = rec.states
    while rec.states < count + 400:  # several chunks
        time.sleep(0.01)
    print("enough", flush=True)
    time.sleep(60)
"""


def is_camera(pid: int) -> bool:
    try:
        return b"heptarm.sim.camera" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


@pytest.mark.slow
def test_a_killed_process_leaves_pictures_that_can_be_read_and_no_process(
    cabinet: RunningCabinet, tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    with subprocess.Popen(
        [sys.executable, "-c", PATIENT + KILLED, cabinet.target, str(path)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == "enough\n"
        os.kill(process.pid, signal.SIGKILL)
    until(lambda: not any(is_camera(one.pid) for one in running()))
    run = ha.load(path)
    assert not run.complete and len(run) >= 200
    assert len(run.pictures) >= 5 and all(picture.shape == (120, 160, 3) for picture in run.pictures)


@pytest.mark.slow
def test_a_private_simulator_shows_its_scene(tmp_path: Path) -> None:
    camera = ha.Camera((0.25, 0.0, 0.18), (0.0, 0.0, 0.14), fov=0.6, frame="flange", size=(160, 120), rate=30)
    with ha.connect("sim://iiwa14?scene=bins&speed=3", watchdog=5.0, timeout=30.0) as arm:
        cabinet = arm.connection.cabinet
        assert cabinet is not None and cabinet.scene == "bins" and cabinet.positions is not None
        folder = cabinet.positions.parent
        assert cabinet.positions.exists()
        with arm.record(tmp_path / "run.mcap", camera=camera) as rec:
            until(lambda: rec.pictures >= 2)
            arm.io["OutputX3Pin2"] = True  # closes the gripper
            until(lambda: bool(arm.io["InputX3Pin4"]))
            shown = rec.pictures
            until(lambda: rec.pictures >= shown + 3)
    assert not folder.exists()
    pictures = ha.load(tmp_path / "run.mcap").pictures
    assert changed(pictures[0], pictures[-1]) > 50, "the fingers have moved, and the arm has not"
