"""The simulated camera of recordings and programs: a process that draws, fed with the newest state, never waited for.

One picture is drawn at a time. A picture that is due while the last one is not finished is dropped and counted.
"""

from __future__ import annotations

import contextlib
import json
import logging
import math
import os
import queue
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any, NamedTuple

from heptarm.errors import CommandRejected, HeptarmError, require, system_errors
from heptarm.io.keys import environment
from heptarm.values.camera import Camera
from heptarm.values.pose import Pose
from heptarm.values.shape import Shape

_log = logging.getLogger("heptarm.record")

#: Longest time for the process to begin, for a last picture, and for the process to end [s].
_START, _SETTLE, _END = 60.0, 5.0, 5.0
#: MuJoCo's drivers of OpenGL without a display, the first that works is taken, and the variable that chooses one.
_DRIVERS, _DRIVER = ("egl", "osmesa"), "MUJOCO_GL"
#: Mesa's threads: without a graphics card one is enough, and leaves the other cores to the robot.
_THREADS = "LP_NUM_THREADS"
#: Longest reason of a process that cannot draw [characters].
_LONGEST_REASON = 300


@dataclass(frozen=True, slots=True)
class CameraSubject:
    """What a camera draws of one arm.

    Attributes:
        robot: name of the robot, such as "iiwa14".
        shapes: gives the shapes on its flange, each with its pose in the flange frame.
        scene: what is around it in the simulator; "": the camera's own.
        positions: file in which the simulator writes all positions; None: what is not the arm stands still.
    """

    robot: str
    shapes: Callable[[], tuple[tuple[Shape, Pose], ...]]
    scene: str = ""
    positions: Path | None = None


class DrawnPicture(NamedTuple):
    """A picture of a state, as the process gives it.

    Attributes:
        number: that of the state.
        received: our clock at the state's receipt [ns].
        sampled: our clock at its sampling [ns].
        data: the bytes of its layers, such as of a JPEG file.
    """

    number: int
    received: int
    sampled: int
    data: bytes


class CameraFeed:
    """Gets pictures of one arm from a process; used by the thread of a recorder or of a `CameraStream`.

    Args:
        camera: its place and its pictures.
        subject: what it draws.
        layers: what a picture consists of: "jpeg"; "pixels", "depth" and "labels" as bytes of arrays.

    Attributes:
        camera: likewise.
        dropped: pictures that were due and could not be drawn.
        names: bodies of the model by their labels, as soon as it can draw.
    """

    def __init__(self, camera: Camera, subject: CameraSubject, *, layers: Sequence[str] = ("jpeg",)) -> None:
        self.camera, self._subject, self._layers = camera, subject, tuple(layers)
        self.dropped = 0
        self.names: tuple[str, ...] = ()
        self._process: subprocess.Popen[bytes] | None = None
        self._reader: threading.Thread | None = None
        self._pictures: deque[DrawnPicture] = deque()
        self._asked: tuple[int, int, int] | None = None
        self._lock = threading.Lock()
        self._is_idle = threading.Event()
        self._is_idle.set()
        self._is_over = False
        self._due: int | None = None
        self._shapes: tuple[tuple[Shape, Pose], ...] = ()

    def start(self) -> None:
        """Start the process and wait until it can draw, a second or two.

        Raises:
            MissingExtra: MuJoCo or Pillow is not installed.
            CommandRejected: there is no such scene, or this machine cannot draw.
        """
        require("PIL.Image", extra="record")
        with system_errors("the package 'mujoco' cannot be looked for"):
            is_missing = find_spec("mujoco") is None  # imported in the process alone
        if is_missing:
            require("mujoco", extra="sim")
        failures: list[str] = []
        for driver in _drivers():
            reason = self._begin(driver)
            if not reason:
                return
            failures.append(reason if not driver else f"{driver}: {reason}")
        raise CommandRejected(
            f"this machine cannot draw the pictures of a camera: {'; '.join(failures)}",
            parameter="camera",
            hint="install Mesa's EGL, as in apt install libegl1 libgl1-mesa-dri, or name a driver that works here "
            "by MUJOCO_GL=egl, osmesa or glfw; a recording without a camera has all else",
        )

    def _begin(self, driver: str) -> str:
        """Start the process with a driver; the reason why it cannot, "" if it can.

        Raises:
            CommandRejected: there is no such scene.
        """
        process = self._process = self._spawned(driver)
        first: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self._is_over = False
        self._reader = threading.Thread(
            target=self._read, args=(process, first), name="heptarm-camera", daemon=True
        )
        self._reader.start()
        try:
            answer = first.get(timeout=_START)
        except queue.Empty:
            answer = {"error": f"it did not begin within {_START:g} s"}
        except BaseException:
            self.close()
            raise
        if "ready" in answer:
            self.names = tuple(answer["names"])
            return ""
        self.close()
        if "refused" in answer:
            raise CommandRejected(answer["refused"], parameter="camera")
        return str(answer["error"])

    def _spawned(self, driver: str) -> subprocess.Popen[bytes]:
        camera, subject = self.camera, self._subject
        is_its_scene = camera.scene in ("", subject.scene)
        settings = {
            "robot": subject.robot,
            "camera": asdict(camera),
            "scene": camera.scene or subject.scene,
            "positions": str(subject.positions or "") if is_its_scene else "",
            "layers": self._layers,
        }
        # a session of its own: Ctrl-C in the terminal ends the recording, which then ends this process
        with system_errors("the process of the camera cannot be started"):
            return subprocess.Popen(
                [sys.executable, "-m", "heptarm.sim.camera", json.dumps(settings)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,  # why it cannot begin
                start_new_session=True,
                env={_THREADS: "1"} | environment(None) | ({_DRIVER: driver} if driver else {}),
            )

    @property
    def pid(self) -> int:
        """Id of the process that draws; 0: there is none."""
        return 0 if self._process is None else self._process.pid

    @property
    def is_over(self) -> bool:
        """Whether there will be no pictures any more."""
        return self._is_over

    def is_due(self, received: int) -> bool:
        """Whether a picture is due at a time of our clock [ns]."""
        return self._due is None or received >= self._due

    def offer(self, number: int, received: int, sampled: int, q: Sequence[float]) -> None:
        """Ask for a picture of a state if one is due; returns at once.

        Args:
            number: of the state.
            received: our clock at its receipt [ns].
            sampled: our clock at its sampling [ns].
            q: joint positions, shape (7,) [rad]; without them there is no picture.
        """
        if not self.is_due(received) or not all(map(math.isfinite, q)):
            return
        due, period = received if self._due is None else self._due, round(1e9 / self.camera.rate)
        self._due = due + ((received - due) // period + 1) * period
        if self._is_over or not self._is_idle.is_set():
            with self._lock:
                self.dropped += 1
            return
        self._asked = (number, received, sampled)
        self._is_idle.clear()
        process = self._process
        assert process is not None and process.stdin is not None
        try:
            process.stdin.write(self._request(q))  # it fits into the pipe, which is empty
            process.stdin.flush()
        except OSError:  # the process has ended; its reader reports it
            self._give_up()

    def _request(self, q: Sequence[float]) -> bytes:
        request: dict[str, Any] = {"q": list(q)}
        try:
            shapes = self._subject.shapes()
        except HeptarmError:  # the connection is lost: what was on the flange is
            shapes = self._shapes
        if shapes != self._shapes:
            self._shapes = shapes
            request["shapes"] = [
                {
                    "kind": shape.kind,
                    "size": shape.size.tolist(),
                    "xyz": at.xyz.tolist(),
                    "quat": at.quat.tolist(),
                }
                for shape, at in shapes
            ]
        return json.dumps(request).encode() + b"\n"

    def take(self) -> list[DrawnPicture]:
        """The pictures that are finished."""
        return [self._pictures.popleft() for _ in range(len(self._pictures))]

    def settle(self) -> None:
        """Wait for the picture that is being drawn, if there is one."""
        self._is_idle.wait(_SETTLE)

    def close(self) -> None:
        """End the process; calling it again has no effect."""
        process, self._process = self._process, None
        if process is None or self._reader is None:
            return
        self._is_over = True
        with contextlib.suppress(OSError):  # it may have ended already
            if process.stdin is not None:
                process.stdin.close()
        try:
            process.wait(_END)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait(_END)
        self._reader.join(_END)

    # -------------------------------------------------------------------------------------- its own thread

    def _read(self, process: subprocess.Popen[bytes], first: queue.SimpleQueue[dict[str, Any]]) -> None:
        """Hand on the process's first answer, then take over pictures until it ends."""
        assert process.stdout is not None
        answer: dict[str, Any] = {}
        with process.stdout as answers, contextlib.suppress(ValueError):  # it was killed within an answer
            answer = _first_answer(answers)
            first.put(answer)
            while "ready" in answer and (line := answers.readline()):
                size = json.loads(line)["size"]
                data = answers.read(size)
                if self._asked is None or len(data) < size:
                    break
                self._pictures.append(DrawnPicture(*self._asked, data))
                self._is_idle.set()
        if "ready" in answer and not self._is_over:
            _log.warning("the process of the camera has ended: there are no more pictures")
        self._is_over = True
        self._give_up()

    def _give_up(self) -> None:
        """Expect no answer to the last request."""
        with self._lock:
            self.dropped += not self._is_idle.is_set()
            self._is_idle.set()


def _first_answer(answers: IO[bytes]) -> dict[str, Any]:
    """The first answer of a process; one that ends without it has said why in its last line."""
    last = b""
    for line in answers:
        last = line
        if line.startswith(b"{") and line.endswith(b"}\n"):
            return dict(json.loads(line))
    return {"error": last.decode(errors="replace").strip()[-_LONGEST_REASON:] or "no reason given"}


def _drivers() -> tuple[str, ...]:
    """MuJoCo's drivers that are tried; "": its own choice, or the user's."""
    if os.environ.get(_DRIVER) or sys.platform != "linux":
        return ("",)
    return (*_DRIVERS, "glfw") if os.environ.get("DISPLAY") else _DRIVERS
