"""A simulated camera of heptarm as a camera of LeRobot."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from lerobot.cameras import Camera, CameraConfig
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError
from lerobot_robot_heptarm import connected

import heptarm as ha


@CameraConfig.register_subclass("heptarm")
@dataclass(kw_only=True)
class HeptarmCameraConfig(CameraConfig):
    """What the entry of a camera sets.

    Attributes:
        place: of the camera in its frame, x y z [m].
        target: the point in the middle of its pictures, in the same frame [m].
        fov: vertical field of view [rad].
        frame: "base", or "flange", which carries it.
        noise: standard deviation of each pixel [gray levels].
        blur: of a picture [pixels].
    """

    place: tuple[float, float, float] = (1.1, -0.6, 0.8)
    target: tuple[float, float, float] = (0.5, 0.0, 0.25)
    fov: float = 0.8
    frame: str = "base"
    noise: float = 0.0
    blur: float = 0.0

    def __post_init__(self) -> None:
        if self.width is None or self.height is None or self.fps is None:
            raise ValueError("a camera of the type heptarm needs width and height [pixels] and fps [Hz]")


class HeptarmCamera(Camera):
    """Draws the scene of the robot that is connected in this process."""

    def __init__(self, config: HeptarmCameraConfig) -> None:
        super().__init__(config)
        self.config = config
        self._stream: ha.CameraStream | None = None
        self._thread: threading.Thread | None = None
        self._changed = threading.Condition()
        self._newest: npt.NDArray[np.uint8] | None = None
        self._taken = -np.inf
        self._is_new = False
        self._error: BaseException | None = None

    @staticmethod
    def find_cameras() -> list[dict[str, Any]]:
        """None: where a simulated camera is, its configuration says."""
        return []

    @property
    def is_connected(self) -> bool:
        """Whether it gives pictures."""
        return self._stream is not None

    def connect(self, warmup: bool = True) -> None:
        """Begin to draw; the robot is connected before."""
        if self.is_connected:
            raise DeviceAlreadyConnectedError("the camera is already connected")
        config = self.config
        self._stream = connected().arm.camera(
            ha.Camera(
                place=config.place,
                target=config.target,
                fov=config.fov,
                size=(config.width, config.height),
                rate=float(config.fps),
                frame=config.frame,
                noise=config.noise,
                blur=config.blur,
            )
        )
        self._error = None
        self._thread = threading.Thread(target=self._read, args=(self._stream,), daemon=True)
        self._thread.start()
        self.async_read(timeout_ms=30e3)

    def _read(self, stream: ha.CameraStream) -> None:
        """Keep the newest picture, until the camera is closed."""
        try:
            for picture in stream:
                with self._changed:
                    self._newest, self._taken, self._is_new = picture.pixels, time.monotonic(), True
                    self._changed.notify_all()
        except ha.HeptarmError as error:
            with self._changed:
                self._error = error
                self._changed.notify_all()

    def _check(self) -> None:
        if self._stream is None:
            raise DeviceNotConnectedError("the camera is not connected")
        if self._error is not None:
            raise self._error

    def read(self) -> npt.NDArray[np.uint8]:
        """The next picture, red, green, blue, shape (height, width, 3)."""
        with self._changed:
            self._is_new = False
        return self.async_read(timeout_ms=30e3)

    def async_read(self, timeout_ms: float = 1000.0) -> npt.NDArray[np.uint8]:
        """The newest picture that was not yet read; waits for it.

        Raises:
            TimeoutError: none came in time.
        """
        with self._changed:
            self._changed.wait_for(
                lambda: self._is_new or self._error is not None or self._stream is None, timeout_ms * 1e-3
            )
            self._check()
            if not self._is_new or self._newest is None:
                raise TimeoutError(f"no new picture within {timeout_ms:g} ms")
            self._is_new = False
            return self._newest

    def read_latest(self, max_age_ms: int = 1000) -> npt.NDArray[np.uint8]:
        """The newest picture, at once.

        Raises:
            TimeoutError: it is older than `max_age_ms`: the camera stalls.
        """
        with self._changed:
            self._check()
            age = time.monotonic() - self._taken
            if self._newest is None or age > max_age_ms * 1e-3:
                raise TimeoutError(
                    f"the newest picture is {age * 1e3:.0f} ms old, at most {max_age_ms} ms are allowed"
                )
            return self._newest

    def disconnect(self) -> None:
        """End the pictures."""
        if self._stream is None:
            raise DeviceNotConnectedError("the camera is not connected")
        stream, self._stream = self._stream, None
        stream.close()
        if self._thread is not None:
            self._thread.join(10.0)
