"""Whether this machine can draw pictures: MuJoCo needs EGL or OSMesa where there is no display."""

from __future__ import annotations

from functools import cache

from heptarm.errors import CommandRejected
from heptarm.record.camera import CameraFeed, CameraSubject
from heptarm.values.camera import Camera


@cache
def cannot_draw() -> str:
    """Why not; empty: it can."""
    feed = CameraFeed(Camera(size=(64, 48)), CameraSubject("iiwa14", lambda: ()))
    try:
        feed.start()
    except CommandRejected as error:
        return error.text
    feed.close()
    return ""
