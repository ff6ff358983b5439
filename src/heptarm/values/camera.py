"""A simulated camera: where it is, what it looks at, how its pictures are."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from heptarm.errors import LimitError, ShapeError
from heptarm.values.checks import Array, array, instance, integer, shown, within, word
from heptarm.values.frames import check_printable
from heptarm.values.pose import Pose

#: Farthest place of a camera from its frame's origin along each axis, shortest distance to what it looks at [m].
FARTHEST, NEAREST = 20.0, 0.001
#: Least and greatest vertical field of view [rad], width and height [pixels], and pictures per second.
FIELDS, SIZES, FASTEST = (0.02, 2.8), (16, 4096), 60.0
#: Frames that a camera may be attached to.
FRAMES = ("base", "flange")


@dataclass(frozen=True, slots=True)
class Camera:
    """A simulated camera of a recording: it draws a model of the arm at the joint positions that the arm reports.

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
        """Its intrinsic matrix: a point x y z of `pose` is in the picture at (u/w, v/w) [pixels], shape (3, 3)."""
        width, height = self.size
        focal = 0.5 * height / math.tan(0.5 * self.fov)
        return np.array([[focal, 0.0, 0.5 * width], [0.0, focal, 0.5 * height], [0.0, 0.0, 1.0]])
