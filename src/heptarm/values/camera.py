"""Cameras: a simulated one, where it is and how its pictures are; and a picture with the arm at that moment."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.checks import (
    Array,
    Value,
    array,
    finite_entries,
    flag,
    frozen,
    instance,
    integer,
    numbers,
    shown,
    within,
    word,
)
from heptarm.values.frames import check_name, check_printable
from heptarm.values.pose import Pose, check_pose

#: Farthest place of a camera from its frame's origin along each axis, shortest distance to what it looks at [m].
FARTHEST, NEAREST = 20.0, 0.001
#: Least and greatest vertical field of view [rad], width and height [pixels], and pictures per second.
FIELDS, SIZES, FASTEST = (0.02, 2.8), (16, 4096), 60.0
#: Most noise of a picture [gray levels], and most blur [pixels].
NOISIEST, BLURREST = 100.0, 20.0
#: Distortion of a straight lens.
NO_DISTORTION = (0.0, 0.0, 0.0, 0.0, 0.0)
#: Steps of Newton's method by which distortion is undone, and what may be left of it.
_STEPS, _LEFT = 20, 1e-9
#: Frames that a camera may be attached to.
FRAMES = ("base", "flange")


def lens_distortion(distortion: npt.ArrayLike, name: str = "distortion") -> Array:
    """Distortion of a lens as in OpenCV: k1 k2 p1 p2 k3, shape (5,).

    Raises:
        ShapeError: not five numbers.
        LimitError: one that is not finite.
    """
    found = finite_entries(numbers(distortion, name), name)
    if found.shape != (5,):
        raise ShapeError(
            f"{name} must have five numbers, k1 k2 p1 p2 k3, got the shape {found.shape}",
            parameter=name,
            value=distortion,
        )
    return frozen(found)


class BentPoint(NamedTuple):
    """Where a lens shows points, and how this changes with them; arrays of one shape.

    Attributes:
        x: to the right, at distance 1.
        y: down.
        dx_dx: derivative of `x` by the straight one.
        mixed: of `x` by the straight y, and of `y` by the straight x.
        dy_dy: of `y` by the straight one.
    """

    x: Array
    y: Array
    dx_dx: Array
    mixed: Array
    dy_dy: Array


def distorted(x: Array, y: Array, distortion: Sequence[float]) -> BentPoint:
    """Where a lens shows points at distance 1: radial distortion k1 k2 k3 and tangential p1 p2 (Brown, 1966)."""
    k1, k2, p1, p2, k3 = distortion
    r = x * x + y * y
    radial, slope = 1.0 + r * (k1 + r * (k2 + r * k3)), k1 + r * (2.0 * k2 + r * 3.0 * k3)
    return BentPoint(
        x * radial + 2.0 * p1 * x * y + p2 * (r + 2.0 * x * x),
        y * radial + p1 * (r + 2.0 * y * y) + 2.0 * p2 * x * y,
        radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
        2.0 * (x * y * slope + p1 * x + p2 * y),
        radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
    )


def undistorted(pixels: npt.ArrayLike, matrix: Array, distortion: Sequence[float]) -> Array:
    """Points at distance 1 that a lens shows at pixels, by Newton's method; shape (..., 2) as the pixels.

    Raises:
        LimitError: the lens shows nothing there, or two points: its distortion folds the picture.
    """
    given = (np.asarray(pixels, np.float64) - matrix[:2, 2]) / np.diagonal(matrix)[:2]
    u, v = given[..., 0], given[..., 1]
    x, y = u, v
    with np.errstate(all="ignore"):  # what does not converge is refused
        for _ in range(_STEPS):
            at = distorted(x, y, distortion)
            off_x, off_y, turn = at.x - u, at.y - v, at.dx_dx * at.dy_dy - at.mixed**2
            x = x - (at.dy_dy * off_x - at.mixed * off_y) / turn
            y = y - (at.dx_dx * off_y - at.mixed * off_x) / turn
        at = distorted(x, y, distortion)
        left = np.maximum(np.abs(at.x - u), np.abs(at.y - v))
        is_good = (left < _LEFT) & (at.dx_dx * at.dy_dy > at.mixed**2) & (at.dx_dx > 0.0)
    if not is_good.all():
        raise LimitError(
            "distortion must show each point once within the picture: it folds it",
            code=2,
            parameter="distortion",
            value=tuple(distortion),
            hint="smaller numbers, or a smaller field of view",
        )
    return np.stack([x, y], axis=-1)


def intrinsic(matrix: npt.ArrayLike, name: str = "matrix") -> Array:
    """An intrinsic matrix, shape (3, 3) [pixels].

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: not of the form (fx 0 cx; 0 fy cy; 0 0 1) with positive focal lengths.
    """
    found = numbers(matrix, name, "an intrinsic matrix of shape (3, 3)")
    if found.shape != (3, 3):
        raise ShapeError(
            f"{name} must have the shape (3, 3), got {found.shape}", parameter=name, value=matrix
        )
    finite_entries(found, name)
    rest = found - np.diag(np.diagonal(found))
    rest[:2, 2] = 0.0
    if min(found[0, 0], found[1, 1]) <= 0.0 or found[2, 2] != 1.0 or np.abs(rest).max() > 1e-9:
        raise LimitError(
            f"{name} must be (fx 0 cx; 0 fy cy; 0 0 1) with focal lengths above 0, got {shown(found.tolist())}",
            code=2,
            parameter=name,
            value=matrix,
        )
    return frozen(found)


@dataclass(frozen=True, slots=True, eq=False)
class MountedCamera(Value):
    """A camera of your own that was measured: where it is, and how it projects.

    Attributes:
        name: of the camera.
        frame: "flange": it moves with the arm; or "base".
        pose: in that frame: x to the right of its pictures, y down, z ahead.
        matrix: intrinsic matrix, shape (3, 3) [pixels].
        distortion: k1 k2 p1 p2 k3 as in OpenCV, shape (5,).

    Raises:
        ShapeError: wrong types.
        LimitError: no intrinsic matrix.
        CommandRejected: a name that is not allowed.
    """

    name: str
    frame: str
    pose: Pose
    matrix: Array
    distortion: Array = field(default_factory=lambda: np.zeros(5))

    def __post_init__(self) -> None:
        check_name(self.name, "name")
        word(self.frame, "frame", FRAMES)
        check_pose(self.pose)
        object.__setattr__(self, "matrix", intrinsic(self.matrix))
        object.__setattr__(self, "distortion", lens_distortion(self.distortion))


@dataclass(frozen=True, slots=True)
class Camera:
    """A simulated camera: it draws a model of the arm at the joint positions that the arm reports.

    `arm.camera(...)` gives its pictures to a program, `arm.record(..., camera=...)` writes them to a file.

    Its pictures are no photographs. A robot knows nothing of what is around it: there the camera draws the arm with the
    shapes of its tool and workpiece, and, if one is named, a scene that stands still.

    Args:
        place: in its frame, x y z [m].
        target: point in the middle of the pictures, in the same frame [m]. The frame's z axis is upright in the
            pictures; if the camera looks along it, the x axis.
        fov: vertical field of view [rad].
        size: width and height of the pictures [pixels].
        rate: pictures per second on this computer's clock [Hz], at most as many as states are pushed.
        frame: "base", or "flange": the camera moves with the arm.
        scene: what is around the arm, as in `heptarm sim --scene`; "": nothing. A private simulator's own scene is
            drawn by itself, with its bodies where they are.
        principal: where the optical axis meets the pictures, u v [pixels]; None: in their middle.
        distortion: of the lens, k1 k2 p1 p2 k3 as in OpenCV.
        noise: standard deviation of each pixel's colours [gray levels of 255].
        blur: standard deviation of a Gaussian blur [pixels].
        shadows: whether there are shadows; without them a picture takes half the time where there is no graphics card.

    Raises:
        ShapeError: wrong types.
        LimitError: a number outside its range, or a target at the camera's place.
    """

    place: tuple[float, float, float] = (1.5, -1.3, 1.1)
    target: tuple[float, float, float] = (0.2, 0.0, 0.5)
    fov: float = 0.8
    size: tuple[int, int] = (640, 480)
    rate: float = 10.0
    frame: str = "base"
    scene: str = ""
    principal: tuple[float, float] | None = field(default=None, kw_only=True)
    distortion: tuple[float, float, float, float, float] = field(default=NO_DISTORTION, kw_only=True)
    noise: float = field(default=0.0, kw_only=True)
    blur: float = field(default=0.0, kw_only=True)
    shadows: bool = field(default=True, kw_only=True)

    def __post_init__(self) -> None:
        for name in ("place", "target"):
            values = array(getattr(self, name), 3, name).tolist()
            for index, value in enumerate(values):
                within(value, f"{name}[{index}]", -FARTHEST, FARTHEST, unit="m")
            object.__setattr__(self, name, tuple(values))
        if math.dist(self.place, self.target) < NEAREST:
            raise LimitError(
                f"target must be at least {NEAREST * 1e3:g} mm from place, got {shown(self.target)} m for both",
                code=2,
                parameter="target",
                value=self.target,
                allowed=f"at least {NEAREST * 1e3:g} mm from place",
            )
        object.__setattr__(self, "fov", within(self.fov, "fov", *FIELDS, unit="rad"))
        size = self.size
        if not isinstance(size, (tuple, list)) or len(size) != 2:
            raise ShapeError(
                f"size must be width and height in pixels, got {shown(size)}", parameter="size", value=size
            )
        object.__setattr__(
            self, "size", tuple(integer(value, f"size[{i}]", *SIZES) for i, value in enumerate(size))
        )
        object.__setattr__(self, "rate", within(self.rate, "rate", 0.0, FASTEST, above=True, unit="Hz"))
        word(self.frame, "frame", FRAMES)
        check_printable(instance(self.scene, str, "scene"), "scene")
        if self.principal is not None:
            axis = array(self.principal, 2, "principal").tolist()
            for index, value in enumerate(axis):
                within(value, f"principal[{index}]", 0.0, self.size[index] - 1.0, unit="pixels")
            object.__setattr__(self, "principal", tuple(axis))
        object.__setattr__(self, "distortion", tuple(lens_distortion(self.distortion).tolist()))
        if self.distortion != NO_DISTORTION:
            width, height = self.size
            across, down = np.linspace(-0.5, width - 0.5, 33), np.linspace(-0.5, height - 0.5, 33)
            undistorted(np.stack(np.meshgrid(across, down), axis=-1), self.matrix, self.distortion)
        object.__setattr__(self, "noise", within(self.noise, "noise", 0.0, NOISIEST))
        object.__setattr__(self, "blur", within(self.blur, "blur", 0.0, BLURREST, unit="pixels"))
        flag(self.shadows, "shadows")

    @property
    def pose(self) -> Pose:
        """Its pose in its frame: x to the right of the pictures, y down, z to what it looks at."""
        place = np.array(self.place)
        ahead = np.array(self.target) - place
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, (0.0, 0.0, 1.0))
        if np.linalg.norm(right) < 1e-6:
            right = np.cross(ahead, (1.0, 0.0, 0.0))
        right /= np.linalg.norm(right)
        turn = np.column_stack([right, np.cross(ahead, right), ahead])
        return Pose.from_matrix(np.column_stack([turn, place]))

    @property
    def matrix(self) -> Array:
        """Its intrinsic matrix: a point x y z of `pose` is in the picture at (u/w, v/w) [pixels], shape (3, 3).

        That is where a lens without `distortion` shows it.
        The middle of the first pixel is at (0, 0), as in OpenCV and ROS.
        """
        width, height = self.size
        focal = 0.5 * height / math.tan(0.5 * self.fov)
        u, v = (0.5 * (width - 1), 0.5 * (height - 1)) if self.principal is None else self.principal
        return np.array([[focal, 0.0, u], [0.0, focal, v], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, slots=True, eq=False)
class Picture(Value):
    """What a camera saw, with the arm at that moment.

    Attributes:
        pixels: red, green, blue, shape (height, width, 3); of a camera of your own that is grey, shape (height, width).
        stamp: the cabinet's clock when it was taken [ns].
        q: joint positions then, shape (7,) [rad].
        flange: pose of the flange in the base then.
        pose: pose of the camera in the base then; None: nobody said where the camera is.
        matrix: intrinsic matrix, shape (3, 3) [pixels]; None: nobody said.
        distortion: of the lens, k1 k2 p1 p2 k3 as in OpenCV.
        depth: distance of what each pixel shows along the optical axis, shape (height, width) [m], infinite where
            there is nothing; None: not asked for.
        labels: what each pixel shows, an index of `names`, shape (height, width), -1 where there is nothing; None: not
            asked for.
        names: bodies of the model by their labels.
    """

    pixels: npt.NDArray[np.uint8]
    stamp: int
    q: Array
    flange: Pose
    pose: Pose | None = None
    matrix: Array | None = None
    distortion: tuple[float, ...] = NO_DISTORTION
    depth: npt.NDArray[np.float32] | None = None
    labels: npt.NDArray[np.int16] | None = None
    names: tuple[str, ...] = ()

    @property
    def gray(self) -> npt.NDArray[np.uint8]:
        """Mean of its colours, shape (height, width)."""
        return self.pixels if self.pixels.ndim == 2 else self.pixels.mean(axis=2).astype(np.uint8)

    def mask(self, body: str) -> npt.NDArray[np.bool_]:
        """Where it shows a body, shape (height, width).

        Raises:
            CommandRejected: it has no labels, or there is no such body; the text lists them.
        """
        if self.labels is None:
            raise CommandRejected(
                "the picture has no labels", parameter="body", hint="arm.camera(camera, labels=True)"
            )
        found = [index for index, name in enumerate(self.names) if name == body]
        if not found:
            raise CommandRejected(
                f"body must be one of {', '.join(self.names)}; got {shown(body)}",
                parameter="body",
                value=body,
            )
        return np.asarray(self.labels == found[0])

    def point(self, u: float, v: float, *, depth: float | None = None) -> Array:
        """The point in the base that a pixel shows, shape (3,) [m].

        Args:
            u: to the right, the middle of the first pixel is 0 [pixels].
            v: down [pixels].
            depth: its distance along the optical axis [m]; None: that of the picture.

        Raises:
            CommandRejected: pose or matrix of the camera, or the depth, is not known.
            LimitError: the pixel is outside the picture, or shows nothing.
        """
        pose, matrix = self._placed()
        height, width = self.pixels.shape[:2]
        column, row = within(u, "u", -0.5, width - 0.5), within(v, "v", -0.5, height - 0.5)
        if depth is not None:
            far = within(depth, "depth", 0.0, 1e3, above=True, unit="m")
        elif self.depth is not None:
            far = float(self.depth[min(round(row), height - 1), min(round(column), width - 1)])
        else:
            raise CommandRejected(
                "the picture has no depth",
                parameter="depth",
                hint="arm.camera(camera, depth=True), or give it here",
            )
        if not math.isfinite(far):
            raise LimitError(
                f"the pixel must show a body, got nothing at u {column:g}, v {row:g}",
                code=2,
                parameter="u",
                value=column,
            )
        x, y = undistorted((column, row), matrix, self.distortion)
        return pose.xyz + far * pose.rotation @ (x, y, 1.0)

    def pixel(self, point: npt.ArrayLike) -> Array:
        """Where a point of the base would be in the picture, u v, shape (2,) [pixels]; it may be outside.

        Raises:
            CommandRejected: pose or matrix of the camera is not known.
            LimitError: the point is not in front of the camera.
        """
        pose, matrix = self._placed()
        seen = pose.rotation.T @ (array(point, 3, "point") - pose.xyz)
        if seen[2] < NEAREST:
            raise LimitError(
                f"point must be in front of the camera, got a distance of {seen[2]:.3g} m along its axis",
                code=2,
                parameter="point",
                value=float(seen[2]),
                allowed=f"at least {NEAREST:g} m",
            )
        at = distorted(seen[0] / seen[2], seen[1] / seen[2], self.distortion)
        return np.asarray((matrix @ np.array([at.x, at.y, 1.0]))[:2])

    def _placed(self) -> tuple[Pose, Array]:
        if self.pose is None or self.matrix is None:
            raise CommandRejected(
                "pose and matrix of the camera are not known",
                parameter="pose",
                hint="arm.camera(source, pose=..., matrix=...), as heptarm.calibration.hand_eye measures them",
            )
        return self.pose, self.matrix
