"""A camera as a value: where its pose and its matrix put a point, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm.errors import LimitError, ShapeError
from heptarm.sim.lens import Lens
from heptarm.values.camera import Picture, distorted, undistorted


def seen(camera: ha.Camera, point: tuple[float, float, float]) -> np.ndarray:
    """Where a point of the camera's frame is in the picture, and how far away: u v [pixels], depth [m]."""
    u, v, depth = camera.matrix @ (camera.pose.inverse().matrix @ (*point, 1.0))[:3]
    return np.array([u / depth, v / depth, depth])


@pytest.mark.parametrize(
    ("place", "target"),
    [
        ((1.5, -1.3, 1.1), (0.2, 0.0, 0.5)),
        ((0.0, 0.0, 3.0), (0.0, 0.0, 0.0)),
        ((0.1, 0.0, 0.0), (0.1, 0.0, 0.4)),
        ((-2.0, 0.0, 0.3), (0.0, 0.0, 0.3)),
    ],
)
def test_the_target_is_in_the_middle_and_the_picture_is_upright(place: Any, target: Any) -> None:
    camera = ha.Camera(place, target, size=(320, 200))
    np.testing.assert_allclose(seen(camera, target)[:2], (159.5, 99.5), atol=1e-9)
    assert seen(camera, target)[2] == pytest.approx(np.linalg.norm(np.subtract(target, place)))
    upright = (0, 0, 0.05) if place[:2] != target[:2] else (0.05, 0, 0)
    u, v, _ = seen(camera, tuple(np.add(target, upright)))
    assert u == pytest.approx(159.5) and v < 99.5
    np.testing.assert_allclose(camera.pose.rotation @ camera.pose.rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(camera.pose.rotation) == pytest.approx(1.0)


def test_the_field_of_view_is_from_edge_to_edge() -> None:
    camera = ha.Camera((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), fov=2 * np.arctan(0.5), size=(100, 50))
    np.testing.assert_allclose(seen(camera, (0.0, 0.0, 1.0)), (49.5, -0.5, 2.0), atol=1e-9)
    np.testing.assert_allclose(seen(camera, (0.0, 2.0, -1.0)), (99.5, 49.5, 2.0), atol=1e-9)


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ({"place": (0, 0, 30)}, LimitError, r"place\[2\] must be in \[-20, 20\] m, got 30 m"),
        ({"target": (1.5, -1.3, 1.1)}, LimitError, "target must be at least 1 mm from place"),
        ({"fov": 45.0}, LimitError, "math.radians"),
        ({"size": (640,)}, ShapeError, "size must be width and height in pixels"),
        ({"size": (640, 5)}, LimitError, r"size\[1\] must be in \[16, 4096\], got 5"),
        ({"rate": 0.0}, LimitError, r"rate must be in \(0, 60\] Hz"),
        ({"frame": "tool"}, ShapeError, "frame must be"),
        ({"scene": 3}, ShapeError, "scene"),
        ({"principal": (3.0, 480.0)}, LimitError, r"principal\[1\] must be in \[0, 479\] pixels, got 480"),
        ({"noise": -1.0}, LimitError, r"noise must be in \[0, 100\]"),
        ({"blur": 30.0}, LimitError, r"blur must be in \[0, 20\] pixels"),
        ({"shadows": 1}, ShapeError, "shadows must be True or False"),
    ],
)
def test_what_is_no_camera_is_refused(given: dict[str, Any], error: type[Exception], words: str) -> None:
    with pytest.raises((error, ha.CommandRejected), match=words):
        ha.Camera(**given)


def test_it_is_frozen_and_compared() -> None:
    one, other = ha.Camera(), ha.Camera(place=[1.5, -1.3, 1.1], size=[640, 480])  # type: ignore[arg-type]
    assert one == other and hash(one) == hash(other) and one != ha.Camera(rate=5)
    with pytest.raises(AttributeError):
        one.rate = 3.0  # type: ignore[misc]


BENT = (-0.2, 0.05, 0.002, -0.001, 0.01)


def test_a_bent_picture_and_its_points() -> None:
    camera = ha.Camera((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), fov=0.9, size=(100, 80), distortion=BENT)
    picture = Picture(
        np.zeros((80, 100, 3), np.uint8),
        stamp=1,
        q=np.zeros(7),
        flange=ha.Pose.of((0, 0, 0)),
        pose=camera.pose,
        matrix=camera.matrix,
        distortion=camera.distortion,
    )
    for u, v in ((0.0, 0.0), (99.0, 20.0), (49.5, 39.5)):
        point = picture.point(u, v, depth=1.5)
        np.testing.assert_allclose(picture.pixel(point), (u, v), atol=1e-6)
        x, y = undistorted((u, v), camera.matrix, BENT)
        shown = distorted(x, y, BENT)
        again = camera.matrix @ np.array([shown.x, shown.y, 1.0])
        np.testing.assert_allclose(again[:2], np.array([u, v]), atol=1e-6)


def test_the_lens_bends_a_straight_picture() -> None:
    camera = ha.Camera(fov=0.9, size=(120, 90), principal=(55.0, 48.0), distortion=BENT)
    lens = Lens(camera)
    width, height = lens.straight.size
    assert width > 120 and height > 90, "barrel distortion sees more"
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    drawn = np.stack([u, v, np.zeros_like(u)], axis=-1)  # each pixel shows where it is
    across, down = np.meshgrid(np.arange(120), np.arange(90))
    at = undistorted(np.stack([across, down], axis=-1), camera.matrix, BENT)
    straight = np.column_stack([at.reshape(-1, 2), np.ones(at.size // 2)]) @ lens.straight.matrix.T
    bent = lens.bent(drawn.astype(np.uint8)).reshape(-1, 3)
    assert np.abs(bent[:, :2] - straight[:, :2]).max() <= 0.51
    labels = lens.nearest(u.astype(np.int16)).ravel()
    assert labels.dtype == np.int16 and np.abs(labels - straight[:, 0]).max() <= 0.5
    plain = Lens(ha.Camera())
    assert plain.straight == ha.Camera() and plain.bent(drawn) is drawn  # type: ignore[arg-type]


def test_a_lens_that_folds_the_picture_is_refused() -> None:
    with pytest.raises(LimitError, match="distortion must show each point once within the picture"):
        ha.Camera(fov=1.2, distortion=(-1.5, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(ShapeError, match="distortion must have five numbers"):
        ha.Camera(distortion=(0.1, 0.0))  # type: ignore[arg-type]
