"""Live pictures: of the real process that draws, and of a function, each with the arm at the moment it was taken."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import model
from heptarm.errors import CommandRejected, LimitError, ShapeError, StaleState, Timeout
from tests.arm.peer import Peer
from tests.drawing import cannot_draw, changed

UPRIGHT, BENT = (0.1,) * 7, (0.5, 0.9, 0.0, -1.2, 0.0, 0.8, 0.0)


def needs_drawing() -> None:
    if why := cannot_draw():
        pytest.skip(why)


def test_a_simulated_camera_gives_pictures_depth_and_labels_of_the_states(peer: Peer) -> None:
    needs_drawing()
    peer.q = UPRIGHT
    camera = ha.Camera(
        (0.9, 0.3, 0.9), (0.5, 0.0, 0.2), size=(160, 120), rate=60, scene="table", shadows=False
    )
    with peer.arm() as arm, arm.camera(camera, depth=True, labels=True) as stream:
        first = stream.read(timeout=60.0)
        assert first.pixels.shape == (120, 160, 3) and first.pixels.dtype == np.uint8
        np.testing.assert_allclose(first.q, UPRIGHT, atol=1e-6)
        assert first.flange == ha.Pose.from_matrix(model.forward(arm.robot, first.q))
        assert (
            first.pose == camera.pose
            and first.matrix is not None
            and np.array_equal(first.matrix, camera.matrix)
        )
        v, u = np.argwhere(first.mask("cube")).mean(axis=0)
        np.testing.assert_allclose(first.pixel((0.55, 0.0, 0.22)), (u, v), atol=1.5)
        np.testing.assert_allclose(first.point(u, v)[:2], (0.55, 0.0), atol=0.02)
        assert abs(first.point(u, v)[2] - 0.24) < 0.02
        assert stream.read(timeout=60.0).stamp > first.stamp, "none is returned twice"
        peer.q = BENT
        bent = stream.read(timeout=60.0, after=arm.wait_until(lambda state: state.q[1] > 0.5).stamp)
        np.testing.assert_allclose(bent.q, BENT, atol=1e-6)
        assert changed(first.pixels, bent.pixels) > 100 and "table" in bent.names
        with pytest.raises(CommandRejected, match=r"body must be one of .*cube.* got 'cup'"):
            bent.mask("cup")
    with pytest.raises(CommandRejected, match="the camera is closed"):
        stream.read()


def test_noise_blur_latency_and_a_camera_on_the_flange(peer: Peer) -> None:
    needs_drawing()
    where: Any = {"place": (0.0, 0.3, 0.1), "target": (0.0, 0.0, 0.1), "frame": "flange", "size": (160, 120)}
    with peer.arm() as arm:
        with arm.camera(ha.Camera(**where, rate=60), latency=0.2) as stream:
            plain = stream.read(timeout=60.0)
            assert arm.state.stamp - plain.stamp >= 0.2e9, "it comes late"
            assert plain.pose is not None
            np.testing.assert_allclose(plain.pose.xyz, (plain.flange @ ha.Pose.at(0.0, 0.3, 0.1)).xyz)
            with pytest.raises(CommandRejected, match="no depth"):
                plain.point(80, 60)
            with pytest.raises(CommandRejected, match="no labels"):
                plain.mask("table")
        with arm.camera(ha.Camera(**where, noise=8.0, blur=2.0)) as stream:
            noisy = stream.read(timeout=60.0)
    off = noisy.pixels.astype(float) - plain.pixels
    assert 4.0 < np.median(np.abs(off[10:20])) * 1.48 < 12.0, (
        "where all is of one colour there is noise alone"
    )
    edges = [np.abs(np.diff(one.gray.astype(float), axis=1)).max() for one in (plain, noisy)]
    assert edges[1] < 0.8 * edges[0], "edges are blurred"


def test_a_function_is_a_camera(peer: Peer) -> None:
    gate = threading.Semaphore(0)
    taken: list[None] = []

    def read() -> tuple[bool, np.ndarray]:
        gate.acquire()
        taken.append(None)
        return True, np.full((4, 6, 3), np.uint8(len(taken)), np.uint8)

    matrix = np.array([[10.0, 0, 2.5], [0, 10.0, 1.5], [0, 0, 1]])
    at = ha.Pose.at(0, 0, 0.05)
    with peer.arm() as arm, arm.camera(read, matrix=matrix, pose=at) as stream:
        arm.wait_until(lambda state: True)
        with pytest.raises(Timeout, match=r"no new picture within 0\.01 s"):
            stream.read(timeout=0.01)
        gate.release()
        first = stream.read(timeout=60.0)
        assert (first.pixels == 1).all() and first.gray.shape == (4, 6)
        np.testing.assert_allclose(first.q, peer.q, atol=1e-6)
        assert first.pose == first.flange @ at
        np.testing.assert_allclose(first.pixel(first.point(2.5, 1.5, depth=0.4)), (2.5, 1.5), atol=1e-9)
        gate.release(2)
        assert next(stream).stamp > first.stamp
        gate.release(20)


@pytest.mark.parametrize("is_of_opencv", [True, False])
def test_pictures_are_red_green_and_blue_of_opencv_too(peer: Peer, is_of_opencv: bool) -> None:
    red = np.zeros((4, 6, 3), np.uint8)
    red[..., 0] = 200

    def read() -> object:
        return (True, red[..., ::-1]) if is_of_opencv else red.copy()

    with peer.arm() as arm, arm.camera(read) as stream:
        np.testing.assert_array_equal(stream.read(timeout=60.0).pixels, red)


def test_a_late_picture_belongs_to_the_state_of_its_moment(peer: Peer) -> None:
    gate = threading.Event()

    def read() -> np.ndarray:
        gate.wait()
        return np.zeros((4, 6), np.uint8)

    with peer.arm() as arm, arm.camera(read, latency=1.0) as stream:
        start = arm.wait_until(lambda state: True).stamp
        newest = arm.wait_until(lambda state: state.stamp > start + 1.2e9)
        gate.set()
        picture = stream.read(timeout=60.0)
        assert picture.stamp < arm.state.stamp - 0.95e9 and picture.stamp >= start - 1.0e9
        assert newest.stamp > picture.stamp


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (lambda: (False, None), "gives no picture: the camera reports that there is none"),
        (
            lambda: np.zeros((4, 6)),
            r"a picture must be an array of uint8 of shape .* got an array of float64 of shape \(4, 6\)",
        ),
        (lambda: np.zeros((4, 6, 4), np.uint8), r"got an array of uint8 of shape \(4, 6, 4\)"),
        (lambda: 1 / 0, "gives no picture: ZeroDivisionError"),
    ],
)
def test_a_function_that_fails_is_reported(peer: Peer, given: Callable[[], Any], words: str) -> None:
    with peer.arm() as arm, arm.camera(given) as stream, pytest.raises(CommandRejected, match=words):
        stream.read(timeout=60.0)


def test_what_makes_no_sense_is_refused(peer: Peer) -> None:
    with peer.arm() as arm:
        for given, error, words in (
            ({"source": "front"}, ShapeError, "source must be a Camera or a function"),
            ({"source": print, "depth": True}, CommandRejected, "depth is of simulated cameras"),
            ({"source": print, "matrix": np.zeros((3, 3))}, LimitError, "focal lengths above 0"),
            ({"source": print, "matrix": np.eye(4)}, ShapeError, r"matrix must have the shape \(3, 3\)"),
            (
                {"source": ha.Camera(), "pose": ha.Pose.at(0, 0, 0)},
                CommandRejected,
                "a simulated one has them",
            ),
            ({"source": ha.Camera(), "latency": 10.0}, LimitError, r"latency must be in \[0, 2\] s"),
        ):
            with pytest.raises(error, match=words):
                arm.camera(**given)
        arm.subscribe(rate=100, groups=("motion",))
        with pytest.raises(StaleState, match='pictures need the state group "joints"'):
            arm.camera(print)
