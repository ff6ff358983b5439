"""Meshes and height maps of bodies in a world, and how their files are read."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from heptarm.errors import LimitError, ShapeError
from heptarm.values.checks import Array, Value, finite_entries, frozen, numbers, within
from heptarm.values.files import path_of, read_bytes, unreadable
from heptarm.values.pose import Pose
from heptarm.values.shape import LARGEST, ORIGIN, Shape, box, check_near

Triangles = npt.NDArray[np.int64]

#: Smallest extent of a mesh [m], and most triangles and cells.
_SMALLEST = 1e-4
_MOST_TRIANGLES = 200_000
_MOST_CELLS = 10_000
#: Vertices nearer than this fraction of the extent are the same one.
_WELD = 1e-6
_STL_HEADER, _STL_TRIANGLE = 84, 50


@dataclass(frozen=True, slots=True, eq=False)
class Mesh(Value):
    """A closed surface of triangles; make one with `heptarm.shapes.mesh`.

    Bodies keep clear of the convex hull of each of its connected parts: a bowl counts as full, while the boards of a
    shelf that are closed parts of their own leave the room between them free.

    Attributes:
        vertices: shape (n, 3) [m].
        faces: three indices of vertices for each triangle, shape (m, 3).
        pose: of its frame in that of the body.

    Raises:
        ShapeError: wrong shapes, an index of no vertex, or the surface is not closed.
        LimitError: a number that is not finite, or an extent outside [1e-4, 4] m.
    """

    vertices: Array
    faces: Triangles
    pose: Pose = ORIGIN

    def __post_init__(self) -> None:
        vertices = finite_entries(numbers(self.vertices, "vertices", "numbers of shape (n, 3)"), "vertices")
        faces = finite_entries(numbers(self.faces, "faces", "indices of shape (m, 3)"), "faces").astype(
            np.int64
        )
        for name, given in (("vertices", vertices), ("faces", faces)):
            if given.ndim != 2 or given.shape[1] != 3 or len(given) < 4:
                raise ShapeError(
                    f"{name} must have shape (n, 3) with n >= 4, got {given.shape}", parameter=name
                )
        if len(faces) > _MOST_TRIANGLES:
            raise LimitError(
                f"a mesh must have at most {_MOST_TRIANGLES} triangles, got {len(faces)}",
                code=2,
                parameter="faces",
                value=len(faces),
                hint="simplify it: its convex parts count alone",
            )
        if faces.min() < 0 or faces.max() >= len(vertices):
            wrong = int(faces.min() if faces.min() < 0 else faces.max())
            raise ShapeError(
                f"faces must be indices of {len(vertices)} vertices, got {wrong}",
                parameter="faces",
                value=wrong,
            )
        extent = float(np.ptp(vertices, axis=0).max())
        if not _SMALLEST <= extent <= LARGEST:
            raise LimitError(
                f"the extent of a mesh must be in [{_SMALLEST:g}, {LARGEST:g}] m, got {extent:.4g} m",
                code=2,
                parameter="vertices",
                value=extent,
                allowed=f"[{_SMALLEST:g}, {LARGEST:g}] m",
                hint="a mesh in millimetres needs scale=0.001"
                if extent > LARGEST
                else "is its unit the metre?",
            )
        check_near(self.pose, "pose")
        vertices, faces = _welded(vertices, faces, extent)
        _check_closed(faces)
        object.__setattr__(self, "vertices", frozen(vertices))
        faces.setflags(write=False)
        object.__setattr__(self, "faces", faces)

    def parts(self) -> list[Array]:
        """Vertices of each connected part, shapes (k, 3) [m]."""
        part = np.arange(len(self.vertices))
        while True:  # each vertex takes the least number of its triangles, until none changes
            least = part[self.faces].min(axis=1)
            new = part.copy()
            np.minimum.at(new, self.faces, least[:, None].repeat(3, axis=1))
            new = new[new]
            if (new == part).all():
                break
            part = new
        used = np.unique(self.faces)
        return [self.vertices[used[part[used] == label]] for label in np.unique(part[used])]


def mesh(path: str | Path, *, scale: float = 1.0, at: Pose = ORIGIN) -> Mesh:
    """A closed mesh of a file, STL (binary or text) or OBJ.

    Args:
        path: the file.
        scale: length of its unit [m]: 0.001 for millimetres.
        at: pose of its frame, within 2 m of the origin of the body's frame along each axis.

    Raises:
        CommandRejected: the file cannot be read, or is not of this kind; the text has the place.
        ShapeError: the surface is not closed.
        LimitError: an extent outside [1e-4, 4] m, as of a file in millimetres without its scale.
    """
    file = path_of(path)
    factor = within(scale, "scale", 0.0, 1000.0, above=True, unit="m")
    data = read_bytes(file)
    vertices, faces = _obj(data, file) if file.suffix.lower() == ".obj" else _stl(data, file)
    return Mesh(vertices * factor, faces, at)


def height_map(heights: npt.ArrayLike, *, cell: float, at: Pose = ORIGIN) -> tuple[Shape, ...]:
    """The ground that a map of heights describes: a column for each cell.

    Args:
        heights: above the plane z = 0 of `at`, rows along y and columns along x, shape (n, m) [m], 0 to 4; cells with
            height 0 are empty.
        cell: edge of a cell [m].
        at: pose of the middle of the map.

    Returns:
        Columns; neighbours in a row that have the same height are one.

    Raises:
        ShapeError: not a table of numbers.
        LimitError: a number that is not finite or outside its range, or more than 10,000 cells.
    """
    table = finite_entries(numbers(heights, "heights", "numbers of shape (n, m)"), "heights")
    if table.ndim != 2 or not table.size:
        raise ShapeError(f"heights must have shape (n, m), got {table.shape}", parameter="heights")
    within(len(table) * table.shape[1], "the number of cells", 1, _MOST_CELLS)
    for bound in (float(table.min()), float(table.max())):
        within(bound, "heights", 0.0, LARGEST, unit="m")
    edge = within(cell, "cell", 0.0, LARGEST, above=True, unit="m")
    check_near(at, "at")
    rows, columns = table.shape
    found = []
    for row, line in enumerate(table.tolist()):
        starts = [0, *(k for k in range(1, columns) if line[k] != line[k - 1]), columns]
        for first, last in pairwise(starts):
            if line[first] > 0.0:
                middle = Pose.at(
                    (0.5 * (first + last) - 0.5 * columns) * edge,
                    (row + 0.5 - 0.5 * rows) * edge,
                    0.5 * line[first],
                )
                found.append(box((last - first) * edge, edge, line[first], at=at @ middle))
    if not found:
        raise ShapeError("heights has no cell above 0: there is no ground", parameter="heights")
    return tuple(found)


def _welded(vertices: Array, faces: Triangles, extent: float) -> tuple[Array, Triangles]:
    """Vertices at the same place as one, without triangles that have no area then."""
    _, first, index = np.unique(
        np.round(vertices / (extent * _WELD)), axis=0, return_index=True, return_inverse=True
    )
    joined = index.ravel()[faces]
    a, b, c = joined.T
    return vertices[first], joined[(a != b) & (b != c) & (a != c)]


def _check_closed(faces: Triangles) -> None:
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    loose = int((counts % 2 != 0).sum())
    if loose or not len(faces):
        raise ShapeError(
            f"the mesh has a hole: {loose} of its edges belong to no second triangle",
            parameter="faces",
            value=loose,
            hint="close it in a mesh editor, or describe the body by boxes",
        )


def _stl(data: bytes, file: Path) -> tuple[Array, Triangles]:
    count = int.from_bytes(data[80:_STL_HEADER], "little")
    if len(data) == _STL_HEADER + count * _STL_TRIANGLE and count:
        kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        corners = np.frombuffer(data, kind, count, _STL_HEADER)["corners"].astype(float).reshape(-1, 3)
    else:
        words = data.split()
        if not words or words[0].lower() != b"solid":
            raise unreadable(
                file, "its length is not that of its triangles, and it is no text", what="an STL file"
            )
        places = [k for k, word in enumerate(words) if word == b"vertex"]
        try:
            corners = np.array([[float(word) for word in words[k + 1 : k + 4]] for k in places], float)
        except ValueError as error:
            raise unreadable(file, str(error), what="an STL file") from None
        if corners.ndim != 2 or corners.shape[1] != 3 or len(corners) % 3:
            raise unreadable(file, "its triangles have not three corners each", what="an STL file")
    return corners, np.arange(len(corners)).reshape(-1, 3)


def _obj(data: bytes, file: Path) -> tuple[Array, Triangles]:
    vertices: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    for number, line in enumerate(data.splitlines(), start=1):
        words = line.split()
        try:
            if words[:1] == [b"v"]:
                x, y, z = (float(word) for word in words[1:4])
                vertices.append([x, y, z])
            elif words[:1] == [b"f"]:
                corners = [int(word.partition(b"/")[0]) for word in words[1:]]
                corners = [k - 1 if k > 0 else len(vertices) + k for k in corners]
                faces += [(corners[0], b, c) for b, c in pairwise(corners[1:])]
        except ValueError:
            raise unreadable(file, f"line {number} has no numbers", what="an OBJ file") from None
    if not vertices or not faces:
        raise unreadable(file, "it has no vertices, or no faces", what="an OBJ file")
    try:
        return np.array(vertices), np.array(faces, dtype=np.int64)
    except OverflowError:
        raise unreadable(file, "the number of a vertex has more than 18 digits", what="an OBJ file") from None
