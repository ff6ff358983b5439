"""Pictures of a camera's topic, for `Arm.camera`: the conversion of sensor_msgs/Image, and a feed of the newest one."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import ShapeError

#: Encodings of a sensor_msgs/Image that are pictures, with their channels: red, green, blue, or gray.
_ENCODINGS = {
    **{"rgb8": (3, (0, 1, 2)), "8UC3": (3, (2, 1, 0)), "bgr8": (3, (2, 1, 0))},
    **{"rgba8": (4, (0, 1, 2)), "bgra8": (4, (2, 1, 0)), "mono8": (1, (0,)), "8UC1": (1, (0,))},
}
#: Time between two looks whether a feed has ended [s].
_LOOK = 0.2


def pixels_of(message: Any) -> npt.NDArray[np.uint8]:
    """The picture of a sensor_msgs/Image, shape (height, width, 3), or (height, width) of a gray one.

    Raises:
        ShapeError: an encoding that is no picture of bytes, or another number of bytes than it should have.
    """
    if message.encoding not in _ENCODINGS:
        raise ShapeError(
            f"encoding must be one of {', '.join(_ENCODINGS)}, got {message.encoding!r}",
            parameter="encoding",
            value=message.encoding,
        )
    count, order = _ENCODINGS[message.encoding]
    data = np.frombuffer(bytes(message.data), np.uint8)
    height, width, step = message.height, message.width, message.step
    if len(data) != height * step or step < count * width or not height * width:
        raise ShapeError(
            f"data must have {height} rows of {width} pixels with {count} bytes, got {len(data)} bytes and step {step}",
            parameter="data",
        )
    found = data.reshape(height, step)[:, : count * width].reshape(height, width, count)[:, :, order]
    return np.ascontiguousarray(found[:, :, 0] if len(order) == 1 else found)


class ImageFeed:
    """The newest picture of a topic of images, of either ROS: `put` is its callback, `read` is for `Arm.camera`.

    ::

        feed = ImageFeed()
        node.create_subscription(Image, "image_raw", feed.put, 1)
        with arm.camera(feed.read, frame="flange") as camera:
            ...
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._newest: npt.NDArray[np.uint8] | None = None
        self._count = 0

    def put(self, message: Any) -> None:
        """Take a sensor_msgs/Image.

        Raises:
            ShapeError: it is no picture.
        """
        pixels = pixels_of(message)
        with self._changed:
            self._newest = pixels
            self._count += 1
            self._changed.notify_all()

    def read(self) -> npt.NDArray[np.uint8]:
        """Wait for the next picture; the one before again, if none comes for a moment."""
        with self._changed:
            before = self._count
            self._changed.wait_for(lambda: self._count != before, _LOOK)
            while self._newest is None:
                self._changed.wait(_LOOK)
            return self._newest
