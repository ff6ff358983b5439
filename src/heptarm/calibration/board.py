"""Calibration boards: ChArUco boards and grids of AprilTags, printed, put into a scene, and found in pictures.

The frame of a board is at its top left corner, x to the right, y down, z into the board, as in OpenCV, which finds its
corners: Garrido-Jurado et al., "Automatic generation and detection of highly reliable fiducial markers under
occlusion", 2014; Olson, "AprilTag: A robust and flexible visual fiducial system", 2011.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from heptarm.calibration.tag_edges import edge_corners
from heptarm.errors import LimitError, ShapeError, require
from heptarm.values.checks import Array, Value, frozen, integer, shown, within, word
from heptarm.values.files import path_of, refuse_existing, unwritable
from heptarm.values.pose import Pose, check_pose

#: Kinds of boards, and the dictionary of each one's markers in OpenCV.
KINDS = {"charuco": "DICT_5X5_250", "apriltag": "DICT_APRILTAG_36h11"}
#: Most columns and rows, and most markers that the dictionaries have.
_MOST, _MARKERS = 30, 250
#: Side of a ChArUco board's markers, and of an AprilTag, as a fraction of the side of a square.
_FRACTION = {"charuco": 0.74, "apriltag": 0.75}
#: Where the middle of the first pixel is for the refinement of AprilTags: their corners are counted from its corner.
_TAG_ORIGIN = 0.5
#: A square of so many pixels, or of a multiple, has its tag in the middle, and the tag whole modules.
_TAG_PIXELS = 8
#: Fewest corners that are a sighting; and how far they have to be from one line, by the side of a square: the root of
#: the sum of their squared distances from it.
FEWEST_CORNERS, _FROM_LINE = 4, 0.5
#: Thickness of the plate in a scene, and height of the print above it [m].
_PLATE, _ABOVE = 0.004, 0.0002
_SCENE = """<mujoco model="board">
  <!-- A calibration board: {board} -->
  <asset>
    <texture name="board" type="2d" file="{picture}"/>
    <material name="board" texture="board" specular="0" shininess="0"/>
    <mesh name="board" inertia="shell" vertex="{vertices}" texcoord="0 0 1 0 1 1 0 1" face="0 2 1 0 3 2"/>
  </asset>
  <worldbody>
    <body name="{body}">
      <body name="{plate}" pos="{pos}" quat="{quat}">
        <geom type="mesh" mesh="board" material="board" contype="0" conaffinity="0" mass="0"/>
        <geom type="box" size="{half}" pos="{middle}" rgba="1 1 1 1" mass="0.1"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


@dataclass(frozen=True, slots=True, eq=False)
class Sighting(Value):
    """Corners of a board in a picture.

    Attributes:
        points: on the board, shape (n, 3) [m].
        pixels: in the picture, u v, shape (n, 2); the middle of the first pixel is (0, 0).
        size: width and height of the picture [pixels].
    """

    points: Array
    pixels: Array
    size: tuple[int, int]

    def __len__(self) -> int:
        """Number of corners."""
        return len(self.points)


@dataclass(frozen=True, slots=True)
class Board:
    """A calibration board: flat, and measured after printing.

    Args:
        columns: squares, or tags, from left to right.
        rows: from top to bottom.
        square: side of a square, or distance from tag to tag [m].
        kind: "charuco": a chessboard with a marker in each white square; "apriltag": tags of the family 36h11, of
            three quarters of a square.

    Raises:
        LimitError: a number outside its range, or more markers than there are.
        ShapeError: wrong types.
    """

    columns: int = 7
    rows: int = 5
    square: float = 0.03
    kind: Literal["charuco", "apriltag"] = "charuco"

    def __post_init__(self) -> None:
        word(self.kind, "kind", tuple(KINDS))
        fewest = 3 if self.kind == "charuco" else 1
        for name in ("columns", "rows"):
            object.__setattr__(self, name, integer(getattr(self, name), name, fewest, _MOST))
        object.__setattr__(self, "square", within(self.square, "square", 1e-3, 1.0, unit="m"))
        if len(self._marked) > _MARKERS:
            raise LimitError(
                f"columns and rows must need at most {_MARKERS} markers, got {len(self._marked)}",
                code=2,
                parameter="columns",
                value=self.columns,
            )

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [m]."""
        return self.columns * self.square, self.rows * self.square

    @property
    def marker(self) -> float:
        """Side of a marker [m]."""
        return _FRACTION[self.kind] * self.square

    @property
    def points(self) -> Array:
        """Corners on the board that can be found, shape (n, 3) [m]: of the squares, or of the tags, four of each."""
        if self.kind == "charuco":
            across, down = np.arange(1, self.columns), np.arange(1, self.rows)
            grid = np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 2) * self.square
        else:
            low, high = 0.5 * (self.square - self.marker), 0.5 * (self.square + self.marker)
            around = np.array([(low, low), (high, low), (high, high), (low, high)])
            tags = np.array(self._marked)[:, ::-1] * self.square
            grid = (tags[:, None] + around[None]).reshape(-1, 2)
        return frozen(np.column_stack([grid, np.zeros(len(grid))]))

    @property
    def outline(self) -> Array:
        """Its four corners, shape (4, 3) [m]."""
        width, height = self.size
        return frozen(np.array([(0, 0, 0), (width, 0, 0), (width, height, 0), (0, height, 0)]))

    @property
    def centre(self) -> Array:
        """Its middle, shape (3,) [m]."""
        return frozen(0.5 * np.array([*self.size, 0.0]))

    def __str__(self) -> str:
        """Kind and measures."""
        what = "squares" if self.kind == "charuco" else "AprilTags"
        return (
            f"{self.kind} board, {self.columns} by {self.rows} {what} of {1e3 * self.square:g} mm, "
            f"markers of {1e3 * self.marker:g} mm"
        )

    @property
    def _marked(self) -> list[tuple[int, int]]:
        """Row and column of the squares with a marker, by its number."""
        return [
            (row, column)
            for row in range(self.rows)
            for column in range(self.columns)
            if self.kind == "apriltag" or (row + column) % 2
        ]

    def picture(self, *, pixels: int = 96) -> npt.NDArray[np.uint8]:
        """The board as it is printed, shape (height, width).

        Args:
            pixels: side of a square [pixels]; with AprilTags a multiple of 8.

        Raises:
            LimitError: outside 20 to 2000, or not such a multiple.
            MissingExtra: OpenCV is not installed.
        """
        cv, side = _opencv(), integer(pixels, "pixels", 20, 2000)
        if self.kind == "apriltag" and side % _TAG_PIXELS:
            raise LimitError(
                f"pixels must be a multiple of {_TAG_PIXELS} for AprilTags, got {side}",
                code=2,
                parameter="pixels",
                value=side,
                hint=f"for example {_TAG_PIXELS * max(round(side / _TAG_PIXELS), 3)}",
            )
        found = np.full((self.rows * side, self.columns * side), 255, np.uint8)
        if self.kind == "charuco":
            for row in range(self.rows):
                for column in range(row % 2, self.columns, 2):
                    found[row * side : (row + 1) * side, column * side : (column + 1) * side] = 0
        dictionary = cv.aruco.getPredefinedDictionary(getattr(cv.aruco, KINDS[self.kind]))
        marker = round(_FRACTION[self.kind] * side)
        for number, (row, column) in enumerate(self._marked):
            drawn = cv.aruco.generateImageMarker(dictionary, number, marker)
            top, left = row * side + (side - marker) // 2, column * side + (side - marker) // 2
            found[top : top + marker, left : left + marker] = drawn
        return found

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write it to a file to print in its true size (.pdf or .png).

        Print it without scaling, glue it onto something flat, and measure the squares.

        Raises:
            CommandRejected: the file exists, or cannot be written.
            ShapeError: another kind of file.
            MissingExtra: OpenCV or Pillow is not installed.
        """
        file = path_of(path)
        if file.suffix.lower() not in (".pdf", ".png"):
            raise ShapeError(
                f"path must end in .pdf or .png, got {shown(str(file))}", parameter="path", value=str(file)
            )
        refuse_existing(file, overwrite=overwrite)
        image = require("PIL.Image", extra="vision")
        side = 200
        dots = side / (self.square / 0.0254)
        pixels = np.pad(self.picture(pixels=side), side // 2, constant_values=255)
        try:
            image.fromarray(pixels).save(file, dpi=(dots, dots), resolution=dots)
        except OSError as error:
            raise unwritable(file, error) from None
        return file

    def save_scene(
        self, path: str | Path, *, at: Pose, on_flange: bool = False, overwrite: bool = False
    ) -> Path:
        """Write a scene with the board for the simulator, and its picture beside it.

        Args:
            path: the scene, .xml.
            at: pose of the board's frame in the base, or in the flange frame.
            on_flange: whether it is mounted on the flange.
            overwrite: replace files that exist.

        Raises:
            CommandRejected: a file exists, or cannot be written.
            MissingExtra: OpenCV or Pillow is not installed.
        """
        check_pose(at, "at")
        file = path_of(path).with_suffix(".xml")
        drawn = file.with_suffix(".png")
        for target in (file, drawn):
            refuse_existing(target, overwrite=overwrite)
        image = require("PIL.Image", extra="vision").fromarray(self.picture(pixels=128))
        middle = self.centre + (0.0, 0.0, 0.5 * _PLATE)
        numbers: dict[str, npt.ArrayLike] = {
            "vertices": self.outline - (0.0, 0.0, _ABOVE),
            "pos": at.xyz,
            "quat": np.roll(at.quat, 1),
            "half": (*(0.5 * length for length in self.size), 0.5 * _PLATE),
            "middle": middle,
        }
        texts = {
            name: " ".join(f"{number:.9g}" for number in np.ravel(value)) for name, value in numbers.items()
        }
        names = {"body": "tool" if on_flange else "stand", "plate": "board"}
        text = _SCENE.format(board=self, picture=drawn.name, **texts, **names)
        try:
            image.save(drawn)
            file.write_text(text, encoding="utf-8")
        except OSError as error:
            raise unwritable(file, error) from None
        return file

    def find(self, picture: npt.NDArray[np.uint8]) -> Sighting | None:
        """Find it in a picture; None: it is not seen, or only corners on one line, which do not show how it is turned.

        Args:
            picture: bytes, shape (height, width) or (height, width, 3).

        Raises:
            ShapeError: it is no picture.
            MissingExtra: OpenCV is not installed.
        """
        given = np.asarray(picture)
        if given.dtype != np.uint8 or given.ndim not in (2, 3) or not given.size:
            raise ShapeError(
                f"picture must be an array of bytes, height by width or with 3 colours, got {shown(picture)}",
                parameter="picture",
            )
        gray = given if given.ndim == 2 else given.mean(axis=2).astype(np.uint8)
        numbers, pixels = self._corners(np.ascontiguousarray(gray))
        if len(numbers) < FEWEST_CORNERS:
            return None
        points = self.points[numbers]
        if np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1] < _FROM_LINE * self.square:
            return None
        return Sighting(frozen(points), frozen(pixels), (gray.shape[1], gray.shape[0]))

    def _corners(self, gray: npt.NDArray[np.uint8]) -> tuple[npt.NDArray[np.int64], Array]:
        """Numbers of the corners that are found, shape (n,), and their pixels, shape (n, 2)."""
        cv = _opencv()
        dictionary = cv.aruco.getPredefinedDictionary(getattr(cv.aruco, KINDS[self.kind]))
        if self.kind == "charuco":
            size = (self.columns, self.rows)
            board = cv.aruco.CharucoBoard(size, self.square, self.marker, dictionary)
            pixels, numbers, _, _ = cv.aruco.CharucoDetector(board).detectBoard(gray)
            if numbers is None:
                return np.zeros(0, np.int64), np.zeros((0, 2))
            return np.ravel(numbers).astype(np.int64), np.asarray(pixels, float).reshape(-1, 2)
        settings = cv.aruco.DetectorParameters()
        settings.cornerRefinementMethod = cv.aruco.CORNER_REFINE_APRILTAG
        corners, tags, _ = cv.aruco.ArucoDetector(dictionary, settings).detectMarkers(gray)
        if tags is None:
            return np.zeros(0, np.int64), np.zeros((0, 2))
        known = [i for i, tag in enumerate(np.ravel(tags)) if tag < len(self._marked)]
        numbers = np.array([4 * int(np.ravel(tags)[i]) + k for i in known for k in range(4)], np.int64)
        levels = gray.astype(np.float64)
        edges = [edge_corners(levels, np.reshape(corners[i], (4, 2)) - _TAG_ORIGIN) for i in known]
        return numbers, np.reshape(edges, (-1, 2))


def _opencv() -> Any:
    """OpenCV, quiet about what it does not find.

    Raises:
        MissingExtra: it is not installed.
    """
    return require("cv2", extra="vision")
