"""Live pictures: of a simulated camera or a function of yours, each with the arm at the moment it was taken."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, HeptarmError, ShapeError, StaleState, Timeout, require
from heptarm.io.clock import Clock
from heptarm.model.kinematics import forward
from heptarm.record.camera import CameraFeed
from heptarm.record.samples import SampleQueue, state_rows
from heptarm.values.camera import FASTEST, FRAMES, NO_DISTORTION, Picture, intrinsic, lens_distortion
from heptarm.values.checks import Array, frozen, integer, shown, within, word
from heptarm.values.pose import Pose, check_pose
from heptarm.values.robot import RobotModel
from heptarm.values.sealed import Sealed

_log = logging.getLogger("heptarm.arm")

#: What your own camera gives: a picture in red, green and blue, or what `cv2.VideoCapture.read` returns: whether there
#: is one, and the picture in OpenCV's blue, green and red.
PictureSource: TypeAlias = Callable[[], Any]
#: Longest age of a picture when your camera gives it [s].
OLDEST = 2.0
#: For so long the arm's positions are kept for pictures that come late [ns].
_KEPT = round((OLDEST + 2.0) * 1e9)
#: States that wait for the thread, states that it takes at once, and time between two looks at what is there [s].
_WAITING, _BATCH, _LOOK = 4000, 2000, 0.1
#: Shortest time between two calls of your camera's function [s].
_PAUSE = 1.0 / FASTEST / 4.0


class _Shot(NamedTuple):
    """A picture before it is known where the arm was.

    Attributes:
        moment: our clock when it was taken [ns].
        due: our clock from which on a program may have it [ns].
        layers: pixels, and depth and labels if they were asked for.
    """

    moment: int
    due: int
    layers: dict[str, npt.NDArray[Any]]


class _Source(Protocol):
    """Where pictures come from."""

    @property
    def dropped(self) -> int:
        """Pictures that were due and could not be drawn."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """Bodies by their labels; empty: there are none."""
        ...

    def show(self, number: int, received: int, moment: int, q: Array) -> None:
        """Take the newest state."""
        ...

    def take(self) -> list[_Shot]:
        """Pictures that are finished.

        Raises:
            CommandRejected: there will be none any more.
        """
        ...

    def close(self) -> None:
        """End it."""
        ...


class DrawnSource:
    """Pictures of a simulated camera.

    Args:
        feed: draws them.
        layers: those of the feed.
        latency: for which they are held back [s].
        factor: seconds of the robot's clock per second of ours.
    """

    def __init__(self, feed: CameraFeed, layers: Sequence[str], latency: float, factor: float) -> None:
        self._feed, self._layers, self._latency = feed, layers, round(latency / factor * 1e9)
        feed.start()

    @property
    def dropped(self) -> int:
        """Pictures that were due while the one before was being drawn."""
        return self._feed.dropped

    @property
    def names(self) -> tuple[str, ...]:
        """Bodies by their labels; empty: there are no labels."""
        return self._feed.names if "labels" in self._layers else ()

    def show(self, number: int, received: int, moment: int, q: Array) -> None:
        """Ask for a picture of the newest state, if one is due."""
        if self._feed.is_due(received):
            self._feed.offer(number, received, moment, q.tolist())

    def take(self) -> list[_Shot]:
        """Pictures that are finished."""
        if self._feed.is_over:
            raise CommandRejected("the process of the camera has ended", parameter="camera")
        return [
            _Shot(sample.sampled, sample.sampled + self._latency, self._split(sample.data))
            for sample in self._feed.take()
        ]

    def _split(self, data: bytes) -> dict[str, npt.NDArray[Any]]:
        """The layers as arrays, all of which share the bytes."""
        width, height = self._feed.camera.size
        kinds: dict[str, tuple[Any, tuple[int, ...]]] = {
            "pixels": (np.uint8, (height, width, 3)),
            "depth": (np.float32, (height, width)),
            "labels": (np.int16, (height, width)),
        }
        found, begin = {}, 0
        for name in self._layers:
            dtype, shape = kinds[name]
            count = int(np.prod(shape))
            found[name] = np.frombuffer(data, dtype, count, begin).reshape(shape)
            begin += found[name].nbytes
        return found

    def close(self) -> None:
        """End the process."""
        self._feed.close()


class CalledSource:
    """Pictures of a function, which a thread of its own calls: it may wait for the camera.

    Args:
        read: gives the next picture.
        layers: what a picture is to consist of.
        clock: ours.
        latency: age of a picture when the function returns it [s].

    Raises:
        ShapeError: it is no function.
        CommandRejected: layers that only a simulated camera has.
    """

    dropped = 0
    names = ()

    def __init__(self, read: PictureSource, layers: Sequence[str], clock: Clock, latency: float) -> None:
        if not callable(read):
            raise ShapeError(
                f"source must be a Camera or a function that returns a picture, got {shown(read)}",
                parameter="source",
                value=read,
                hint="for example heptarm.Camera(), or cv2.VideoCapture(0).read",
            )
        if len(layers) > 1:
            raise CommandRejected(
                f"{layers[1]} is of simulated cameras, and a function gives a picture alone",
                parameter=layers[1],
                hint="leave it out",
            )
        self._read, self._clock, self._latency = read, clock, round(latency * 1e9)
        self._shots: deque[_Shot] = deque(maxlen=8)
        self._failure: HeptarmError | None = None
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="heptarm-pictures", daemon=True)
        self._thread.start()

    def show(self, number: int, received: int, moment: int, q: Array) -> None:
        """Your camera sees the arm itself."""

    def take(self) -> list[_Shot]:
        """Pictures that were returned."""
        found = [self._shots.popleft() for _ in range(len(self._shots))]
        if not found and self._failure is not None:
            raise self._failure
        return found

    def close(self) -> None:
        """Call the function no more; a call that waits for its camera ends when it will."""
        self._is_over.set()
        self._thread.join(1.0)

    def _run(self) -> None:
        last: object = None
        while not self._is_over.wait(_PAUSE):
            try:
                given = self._read()
                if given is last and given is not None:  # a function that returns what it has: nothing new
                    continue
                last = given
                pixels = _pixels(given)
            except Exception as error:  # it is yours and may raise anything; the next read raises it
                text = error.text if isinstance(error, HeptarmError) else f"{type(error).__name__}: {error}"
                self._failure = CommandRejected(
                    f"the function of the camera gives no picture: {text}",
                    parameter="source",
                    hint="it returns an array of uint8, or True and the array as cv2.VideoCapture.read does",
                )
                return
            moment = self._clock.nanos() - self._latency
            self._shots.append(_Shot(moment, 0, {"pixels": pixels}))


def opened_camera(text: str) -> PictureSource:
    """What reads the next picture of a camera of this computer, or of a stream.

    Args:
        text: its number, or the address of a stream, as OpenCV opens it.

    Raises:
        CommandRejected: it cannot be opened.
        MissingExtra: OpenCV is not installed.
    """
    opened = require("cv2", extra="vision").VideoCapture(int(text) if text.isdigit() else text)
    if not opened.isOpened():
        raise CommandRejected(
            f"the camera {text!r} cannot be opened",
            parameter="camera",
            value=text,
            hint="give its number, from 0, the address of a stream, or sim for a simulated one",
        )
    read: PictureSource = opened.read
    return read


def _pixels(given: object) -> npt.NDArray[np.uint8]:
    """The picture that a function has returned, in red, green and blue.

    Raises:
        ShapeError: it is none.
    """
    is_of_opencv = False
    if isinstance(given, tuple) and len(given) == 2:
        is_of_opencv, given = True, given[1] if given[0] else None
        if given is None:
            raise ShapeError("the camera reports that there is none")
    found = given if isinstance(given, np.ndarray) else None
    is_flat = found is not None and (found.ndim == 2 or (found.ndim == 3 and found.shape[2] == 3))
    if found is None or found.dtype != np.uint8 or not is_flat or not found.size:
        got = shown(given) if found is None else f"an array of {found.dtype} of shape {found.shape}"
        raise ShapeError(
            f"a picture must be an array of uint8 of shape (height, width, 3) or (height, width), got {got}"
        )
    return np.ascontiguousarray(found[..., ::-1]) if is_of_opencv and found.ndim == 3 else found


class StateSource(Protocol):
    """The connection, as far as pictures need it."""

    clock: Clock

    def to_ours(self, stamp: int) -> int:
        """Our clock at a time of the cabinet's [ns]."""
        ...

    def open_samples(self, size: int) -> SampleQueue:
        """A queue of pushed states."""
        ...

    def close_samples(self, queue: SampleQueue) -> None:
        """End it."""
        ...

    def check_open(self) -> None:
        """Raise ConnectionLost if there will be no states any more."""
        ...


@dataclass(frozen=True, slots=True)
class Mounting:
    """Where a camera is, and how it projects.

    Attributes:
        robot: the robot.
        frame: "base" or "flange".
        pose: of the camera in that frame; None: not known.
        matrix: intrinsic matrix, shape (3, 3) [pixels]; None: not known.
        distortion: of the lens, k1 k2 p1 p2 k3 as in OpenCV.
    """

    robot: RobotModel
    frame: str
    pose: Pose | None
    matrix: Array | None
    distortion: tuple[float, ...] = NO_DISTORTION

    @staticmethod
    def of(
        robot: RobotModel,
        *,
        frame: str,
        pose: Pose | None,
        matrix: npt.ArrayLike | None,
        distortion: npt.ArrayLike,
    ) -> Mounting:
        """The mounting of a camera of your own.

        Raises:
            ShapeError: wrong types.
            LimitError: no intrinsic matrix.
        """
        word(frame, "frame", FRAMES)
        if pose is not None:
            check_pose(pose)
        lens = tuple(lens_distortion(distortion).tolist())
        return Mounting(robot, frame, pose, None if matrix is None else intrinsic(matrix), lens)

    def refuse_for_simulated(self) -> None:
        """Refuse what was said of a camera that knows it itself.

        Raises:
            CommandRejected: something was said.
        """
        said = {
            "pose": self.pose is not None,
            "matrix": self.matrix is not None,
            "distortion": self.distortion != NO_DISTORTION,
            "frame": self.frame != "flange",
        }
        if any(said.values()):
            raise CommandRejected(
                "pose, frame, matrix and distortion are of your own camera: a simulated one has them",
                parameter=next(name for name, is_said in said.items() if is_said),
                hint="leave them out, or set place, target, frame, fov and distortion of the Camera",
            )

    def picture(self, layers: dict[str, Any], stamp: int, q: Array, names: tuple[str, ...]) -> Picture:
        """A picture taken at joint positions."""
        flange = Pose.from_matrix(forward(self.robot, q))
        pose = self.pose if self.pose is None or self.frame == "base" else flange @ self.pose
        return Picture(
            stamp=stamp,
            q=q,
            flange=flange,
            pose=pose,
            matrix=self.matrix,
            distortion=self.distortion,
            names=names,
            **layers,
        )


class CameraStream(Sealed, Iterator[Picture]):
    """Live pictures, each with the arm at the moment when it was taken; made by `Arm.camera`.

    A thread of its own keeps the newest picture: a slow program misses pictures, and never gets an old one. Iterating
    returns picture after picture, each at most once.
    """

    def __init__(self, link: StateSource, source: _Source, mounting: Mounting) -> None:
        self._link, self._source, self._mounting = link, source, mounting
        self._past: deque[tuple[int, int, Array]] = deque()
        self._shots: deque[_Shot] = deque()
        self._newest: Picture | None = None
        self._returned = 0
        self._failure: HeptarmError | None = None
        self._is_over = False
        self._changed = threading.Condition()
        self._samples = link.open_samples(_WAITING)
        self._thread = threading.Thread(target=self._run, name="heptarm-live-pictures", daemon=True)
        self._thread.start()

    @property
    def matrix(self) -> Array | None:
        """Intrinsic matrix, shape (3, 3) [pixels]; None: not known."""
        return self._mounting.matrix

    @property
    def distortion(self) -> tuple[float, ...]:
        """Distortion of the lens, k1 k2 p1 p2 k3 as in OpenCV; zeros where it is not known."""
        return self._mounting.distortion

    @property
    def frame(self) -> str:
        """Where the camera is mounted: "base", or "flange"."""
        return self._mounting.frame

    @property
    def dropped(self) -> int:
        """Pictures of a simulated camera that were due while the one before was being drawn."""
        return self._source.dropped

    def read(self, *, timeout: float = 30.0, after: int = 0) -> Picture:
        """The newest picture; waits until there is one that this method has not returned yet.

        Args:
            timeout: longest wait [s].
            after: return none that was taken before this time of the cabinet's clock, such as `arm.state.stamp` [ns].

        Raises:
            Timeout: there was none in time.
            CommandRejected: the camera was closed, or gives no pictures any more.
            ConnectionLost: the connection has ended.
        """
        seconds = within(timeout, "timeout", 0.0, 1e6, unit="s")
        first = integer(after, "after", 0, 2**63 - 1)

        def is_new() -> bool:
            shot = self._newest
            return shot is not None and shot.stamp > self._returned and shot.stamp >= first

        with self._changed:
            self._changed.wait_for(lambda: is_new() or self._is_over, seconds)
            if is_new():
                assert self._newest is not None
                self._returned = self._newest.stamp
                return self._newest
        if self._failure is not None:
            raise self._failure
        if self._is_over:
            raise CommandRejected(
                "the camera is closed", parameter="camera", hint="open another: arm.camera(...)"
            )
        raise Timeout(f"no new picture within {seconds:g} s", hint="a picture belongs to a pushed state")

    def __next__(self) -> Picture:
        """The next picture, see `read`."""
        return self.read()

    def __enter__(self) -> CameraStream:
        """The stream itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self.close()

    def close(self) -> None:
        """End the camera; calling it again has no effect."""
        with self._changed:
            self._is_over = True
            self._changed.notify_all()
        if threading.current_thread() is not self._thread:
            self._thread.join(OLDEST)

    # -------------------------------------------------------------------------------------- its own thread

    def _run(self) -> None:
        try:
            while not self._is_over:
                self._look()
        except HeptarmError as error:
            self._failure = error
        finally:
            self._link.close_samples(self._samples)
            self._source.close()
            with self._changed:
                self._is_over = True
                self._changed.notify_all()

    def _look(self) -> None:
        """Take the states and pictures that have arrived, and publish those whose time has come."""
        self._link.check_open()
        first = self._samples.get(_LOOK)
        batch = [] if first is None else [first, *self._samples.take(_BATCH)]
        if batch:
            rows = state_rows([sample.body for sample in batch])
            for stamp, q in zip(rows["joints_stamp"].tolist(), rows["q"], strict=True):
                if np.isfinite(q).all():
                    self._past.append((self._link.to_ours(stamp), stamp, q))
            if self._past:
                last = batch[-1]
                self._source.show(last.number, last.received, self._past[-1][0], self._past[-1][2])
                while self._past[0][0] < self._past[-1][0] - _KEPT:
                    self._past.popleft()
        self._shots += self._source.take()
        while (
            self._shots and self._past and self._past[-1][0] >= max(self._shots[0].moment, self._shots[0].due)
        ):
            self._publish(self._shots.popleft())

    def _publish(self, shot: _Shot) -> None:
        """Make the picture of a shot the newest one; one that is older than the states known is left out."""
        if shot.moment < self._past[0][0]:
            return
        index = next(i for i, (moment, _, _) in enumerate(self._past) if moment >= shot.moment)
        (begin, from_stamp, from_q), (end, to_stamp, to_q) = self._past[max(index - 1, 0)], self._past[index]
        part = (shot.moment - begin) / (end - begin) if end > begin else 1.0
        stamp = from_stamp + round(part * (to_stamp - from_stamp))
        q = frozen(from_q + part * (to_q - from_q))
        picture = self._mounting.picture(shot.layers, stamp, q, self._source.names)
        with self._changed:
            self._newest = picture
            self._changed.notify_all()


def check_states(rate: float, groups: tuple[str, ...]) -> None:
    """Refuse an arm whose states do not say where it is.

    Raises:
        StaleState: they do not.
    """
    if rate <= 0 or "joints" not in groups:
        raise StaleState(
            'pictures need the state group "joints"', hint='arm.subscribe(rate=100, groups=(..., "joints"))'
        )
