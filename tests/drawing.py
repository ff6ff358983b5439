"""Tests of pictures: whether this machine can draw them (without a display by EGL or OSMesa), and what they show."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected
from heptarm.record.camera import CameraFeed, CameraSubject
from heptarm.values.camera import Camera

#: Gray levels by which a pixel must differ to show something else, whatever JPEG does.
CHANGED = 60


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


def until(condition: Callable[[], bool]) -> None:
    """Wait for a condition; fails after a minute."""
    deadline = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def changed(one: npt.NDArray[np.uint8], other: npt.NDArray[np.uint8]) -> int:
    """Number of pixels that show something else."""
    return int((np.abs(one.astype(int) - other.astype(int)).max(axis=2) > CHANGED).sum())
