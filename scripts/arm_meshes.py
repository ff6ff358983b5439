"""Makes the shapes in which the arm is drawn: own meshes, from its kinematics and a few radii.

    .venv/bin/python scripts/arm_meshes.py [FOLDER]

Writes src/heptarm/sim/models/meshes (OBJ, a file for each colour of a link) and ros2/heptarm_description/meshes
(Collada for ROS, a file for each link); a test compares. The shapes are for the eye: contacts, masses and inertias have
their own numbers.

A link is the zero set of a signed distance: a tube along the z axis of its one joint, and a drum along the y axis of
its other one, blended into each other. The tube is sampled in horizontal rings, the drum is turned on a lathe; both lie
on the same surface where they meet.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src")]

from heptarm.values.checks import Array  # noqa: E402
from heptarm.values.robot import robot  # noqa: E402

SIMULATOR = "src/heptarm/sim/models/meshes"
DESCRIPTION = "ros2/heptarm_description/meshes"
MODELS = ("iiwa7", "iiwa14")
#: Links that are alike in all models.
COMMON = "lbr"
#: Colours: diffuse, red green blue.
COLOURS = {"silver": (0.75, 0.76, 0.78), "orange": (1.0, 0.42, 0.04), "dark": (0.16, 0.16, 0.18)}
#: Vertices of a ring.
AROUND = 32
#: Half of the seam between two links [m].
SEAM = 0.001

Distance = Callable[[Array], Array]


@dataclass(frozen=True)
class Part:
    """A piece of a link in one colour.

    Attributes:
        colour: of `COLOURS`.
        vertices: in the frame of the link, shape (n, 3) [m].
        normals: unit vectors, shape (n, 3).
        faces: vertices of each triangle, counter-clockwise from outside, shape (m, 3).
    """

    colour: str
    vertices: Array
    normals: Array
    faces: Array

    def moved(self, turn: Array, shift: Array) -> Part:
        """The piece turned by a rotation matrix, then shifted [m]."""
        return Part(self.colour, self.vertices @ turn.T + shift, self.normals @ turn.T, self.faces)


# ------------------------------------------------------------------------------------- distances


def _smooth(x: Array) -> Array:
    """From 0 below 0 to 1 above 1, smoothly."""
    t = np.clip(x, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def _blend(first: Array, second: Array, width: float | Array) -> Array:
    """The smooth minimum of two distances: equal to it where they differ by more than the width [m] (Quilez 2013)."""
    h = np.maximum(width - np.abs(first - second), 0.0) / width
    return np.minimum(first, second) - 0.25 * width * h * h


def _drum(p: Array, axis: int, begin: float, end: float, radius: float, edge: float) -> Array:
    """Distance to a cylinder along a coordinate axis through the origin, with rounded edges."""
    across = np.delete(p, axis, axis=1)
    out = np.linalg.norm(across, axis=1) - radius + edge
    along = np.abs(p[:, axis] - 0.5 * (begin + end)) - 0.5 * abs(end - begin) + edge
    inside = np.minimum(np.maximum(out, along), 0.0)
    return np.asarray(inside + np.hypot(np.maximum(out, 0.0), np.maximum(along, 0.0)) - edge)


def _limb(p: Array, a: Array, b: Array, first: float, last: float) -> Array:
    """Distance to a capsule whose radius changes from its first to its last end; nearly."""
    ab = b - a
    t = _smooth((p - a) @ ab / (ab @ ab))
    return np.asarray(np.linalg.norm(p - a - t[:, None] * ab, axis=1) - (first + (last - first) * t))


def _gradient(f: Distance, p: Array) -> Array:
    step = 5e-4 * np.eye(3)
    g = np.stack([f(p + s) - f(p - s) for s in step], axis=1)
    return np.asarray(g / np.linalg.norm(g, axis=1, keepdims=True))


# ------------------------------------------------------------------------------------- surfaces


def _strip(rows: int, around: int = AROUND) -> Array:
    """Triangles between the rings of a grid of vertices (row after row), outside to the right of growing angle."""
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(around), indexing="ij")
    a, b = row * around + column, row * around + (column + 1) % around
    c, d = a + around, b + around
    return np.concatenate([np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)])


def _rings(f: Distance, heights: Array, centres: Array, reach: float = 0.2) -> tuple[Array, Array, Array]:
    """A body in horizontal rings: vertices, normals, faces.

    Args:
        f: its distance.
        heights: of the rings, growing [m].
        centres: y of a point inside, from which every ray leaves the body once [m].
        reach: longest ray [m].
    """
    angles = 2 * np.pi * np.arange(AROUND) / AROUND
    rays = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    origins = np.stack([0 * heights, centres, heights], axis=1)
    o = np.repeat(origins, AROUND, axis=0)
    r = np.tile(rays, (len(heights), 1))
    if (f(origins) >= 0.0).any():
        raise ValueError(f"centres must be inside, got {origins[f(origins) >= 0.0]}")
    low, high = np.zeros(len(o)), np.full(len(o), reach)
    for length in np.linspace(reach, 0.0, 80)[1:-1]:  # the first crossing from inside
        high = np.where(f(o + length * r) > 0.0, length, high)
    low = np.maximum(high - reach / 79 * 1.01, 0.0)
    for _ in range(24):
        middle = 0.5 * (low + high)
        outside = f(o + middle[:, None] * r) > 0.0
        low, high = np.where(outside, low, middle), np.where(outside, middle, high)
    vertices = o + high[:, None] * r
    return vertices, _gradient(f, vertices), _strip(len(heights))


def _lathe(
    profile: list[tuple[float, float]], colour: str, around: int = AROUND, crease: float = 35.0
) -> Part:
    """A body turned about the z axis.

    Args:
        profile: points (radius, z) from its top to its bottom, outside on the left [m].
        colour: of `COLOURS`.
        around: vertices of a ring.
        crease: edges sharper than this are sharp [deg].
    """
    points = np.array(profile)
    along = np.diff(points, axis=0)
    out = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    rows: list[tuple[float, float, float, float]] = []
    faces, angles = [], 2 * np.pi * np.arange(around) / around
    for index, normal in enumerate(out):
        ends = []
        for end, other in ((index, index - 1), (index + 1, index + 1)):
            n = normal
            if 0 <= other < len(out) and normal @ out[other] > np.cos(np.radians(crease)):
                n = (normal + out[other]) / np.linalg.norm(normal + out[other])
            ends.append((*points[end], *n))
        if not rows or rows[-1] != ends[0]:
            rows.append(ends[0])
        rows.append(ends[1])
        first = (len(rows) - 2) * around
        faces.append(_strip(2, around)[:, ::-1] + first)
    table = np.array(rows)
    c, s, one = np.cos(angles), np.sin(angles), np.ones(around)

    def turned(of: Array) -> Array:
        around_z = [np.outer(of[:, 0], c), np.outer(of[:, 0], s), np.outer(of[:, 1], one)]
        return np.stack(around_z, -1).reshape(-1, 3)

    return _tidy(colour, turned(table[:, :2]), turned(table[:, 2:]), np.concatenate(faces))


def _tidy(colour: str, vertices: Array, normals: Array, faces: Array) -> Part:
    """Leave out triangles without area, and vertices that no triangle has."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    faces = faces[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-9]
    used, again = np.unique(faces, return_inverse=True)
    triangles: Any = again.reshape(-1, 3)
    return Part(colour, vertices[used], normals[used], triangles)


def _arc(
    radius: float, z: float, edge: float, begin: float, end: float, count: int = 5
) -> list[tuple[float, float]]:
    """Points of a rounded edge about (radius, z), from one angle to another [deg]."""
    angles = np.radians(np.linspace(begin, end, count))
    return [(radius + edge * float(np.cos(t)), z + edge * float(np.sin(t))) for t in angles]


#: The z axis along +y and along -y.
_ALONG_Y = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
_AGAINST_Y = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])


# ------------------------------------------------------------------------------------- links


@dataclass(frozen=True)
class Elbow:
    """A link from a joint about z (below, at the origin) to one about y (above).

    Attributes:
        height: of the upper axis [m].
        side: +1 or -1: on which side along y the drum lies.
        tube: radius of the lower end [m].
        neck: radius of the limb between [m].
        drum: radius of the drum [m].
        face: distance of the drum's face, at the joint, from the middle plane [m].
        cap: distance of its outer end [m].
        edge: rounding of its outer end [m].
        neighbour: radius that the next link's drum needs [m].
        foot: height of the upright part of the tube [m].
    """

    height: float
    side: int
    tube: float = 0.080
    neck: float = 0.064
    drum: float = 0.076
    face: float = 0.0
    cap: float = 0.098
    edge: float = 0.022
    neighbour: float = 0.078
    foot: float = 0.055

    def _distance(self, p: Array) -> Array:
        up = p - [0.0, 0.0, self.height]
        side = self.side
        drum = _drum(up, 1, side * (self.face + SEAM), side * self.cap, self.drum, self.edge)
        middle = side * (0.45 * self.face + 0.42 * self.cap)
        limb = _limb(
            p,
            np.array([0, 0, 0.2 * self.foot]),
            np.array([0, middle, self.height]),
            self.tube - 0.012,
            self.neck,
        )
        tube = _drum(p, 2, -0.1, self.foot, self.tube, 0.02)
        # no blending at the seam, where the tube is a circle
        body = _blend(_blend(tube, limb, 0.004 + 0.04 * _smooth(p[:, 2] / 0.08)), drum, 0.05)
        body = -_blend(-body, self.cap - 0.002 - side * p[:, 1], 0.03)
        other = np.maximum(
            np.hypot(up[:, 0], up[:, 2]) - self.neighbour - 0.003, side * up[:, 1] - self.face - SEAM
        )
        return -_blend(-body, other, 0.016)

    def parts(self) -> list[Part]:
        """The pieces of the link."""
        side, height = self.side, self.height
        top = height - 0.15 * self.drum
        shelf = height - self.neighbour - 0.003
        steps = np.concatenate([np.linspace(0.012, shelf - 0.02, 7), np.linspace(shelf + 0.02, top, 4)])
        heights = np.sort(
            np.concatenate([[SEAM, SEAM + 0.002], steps, shelf + 0.001 * np.array([-12, -7, -3, 0, 4, 10])])
        )
        centres = side * 0.5 * (self.face + self.cap) * _smooth((heights / height - 0.25) / 0.37)
        vertices, normals, faces = _rings(self._distance, heights, centres)
        vertices[:AROUND, :2] *= 1 - 0.0005 / self.tube  # a bevel at the seam
        body = _tidy("silver", vertices, normals, faces)
        edge, drum, cap = self.edge, self.drum, self.cap
        profile = [  # open where the cover is
            (drum - edge - 0.010, cap),
            *_arc(drum - edge, cap - edge, edge, 90, 0, 5),
            (drum, self.face + SEAM + 0.002),
            (drum - 0.002, self.face + SEAM),
            (0.0, self.face + SEAM),
        ]
        turn = _ALONG_Y if side > 0 else _AGAINST_Y
        up = np.array([0, 0, height])
        ring = drum - edge
        accent = [
            (ring - 0.001, cap - 0.001),
            (ring - 0.001, cap + 0.0012),
            (ring - 0.003, cap + 0.002),
            (ring - 0.009, cap + 0.002),
            (ring - 0.011, cap + 0.0012),
            (ring - 0.011, cap - 0.001),
        ][::-1]
        cover = [(0.0, cap + 0.0012), (ring - 0.011, cap + 0.0012)]
        seam = [(drum - 0.001, self.face + 3 * SEAM), (drum - 0.001, self.face - 3 * SEAM)]
        return [
            body,
            *(
                _lathe(points, colour).moved(turn, up)
                for points, colour in (
                    (profile, "silver"),
                    (accent, "orange"),
                    (cover, "dark"),
                    (seam, "dark"),
                )
            ),
            _lathe([(self.tube - 0.001, 3 * SEAM), (self.tube - 0.001, -3 * SEAM)], "dark"),
        ]


def _flipped(parts: list[Part], height: float) -> list[Part]:
    """Upside down: the joint about y below, at the origin, the one about z above."""
    return [part.moved(np.diag([-1.0, 1.0, -1.0]), np.array([0, 0, height])) for part in parts]


def _base(height: float) -> list[Part]:
    """The base: a foot with a box for the plugs behind, and the collar of A1."""

    def distance(p: Array) -> Array:
        foot = _drum(p, 2, -0.05, 0.035, 0.108, 0.012)
        body = _limb(p, np.array([0, 0, 0.0]), np.array([0, 0, height]), 0.1, 0.068)
        collar = _drum(p, 2, 0.0, height + 0.05, 0.081, 0.01)
        box = np.abs(p - [-0.085, 0, 0.025]) - [0.035, 0.045, 0.03]
        plugs = np.linalg.norm(np.maximum(box, 0), axis=1) + np.minimum(box.max(axis=1), 0.0) - 0.018
        return _blend(_blend(_blend(body, collar, 0.012), foot, 0.02), plugs, 0.03)

    top = height - SEAM
    heights = np.concatenate([np.linspace(0.0, 0.05, 10), np.linspace(0.057, top - 0.003, 12), [top]])
    vertices, normals, faces = _rings(distance, heights, 0 * heights)
    vertices[-AROUND:, :2] *= 1 - 0.0005 / 0.081
    return [
        _tidy("silver", vertices, normals, faces),
        _lathe([(0.0, top), (0.079, top)], "dark"),
    ]


def _hand(height: float, face: float) -> list[Part]:
    """Link 6: a drum about y, rounded like a ball, and the neck of A7; the middle plane is at y = 0."""
    begin, end, radius, edge = -face + SEAM, 0.064, 0.06, 0.03

    def distance(p: Array) -> Array:
        drum = _drum(p, 1, begin, end, radius, edge)
        neck = _drum(p, 2, -0.02, height + 0.05, 0.047, 0.01)
        body = _blend(drum, neck, 0.003 + 0.035 * _smooth(1.0 - p[:, 2] / height))
        walls = np.minimum(p[:, 1] - begin, end - 0.001 - p[:, 1])
        return np.maximum(body, -walls)

    heights = np.concatenate([np.linspace(0.0, height - 0.006, 13), [height - SEAM]])
    vertices, normals, faces = _rings(distance, heights, 0 * heights)
    vertices[-AROUND:, :2] *= 1 - 0.0005 / 0.047
    profile = [
        (radius - edge - 0.009, end),
        *_arc(radius - edge, end - edge, edge, 90, 0, 6),
        (radius, begin + 0.004),
    ]
    profile += [(radius - 0.004, begin), (0.0, begin)]
    ring = radius - edge
    accent = [(ring - 0.010, end - 0.001), (ring - 0.010, end + 0.001), (ring - 0.008, end + 0.0016)]
    accent += [(ring - 0.002, end + 0.0016), (ring, end + 0.001), (ring, end - 0.001)]
    return [
        _tidy("silver", vertices, normals, faces),
        _lathe(profile, "silver").moved(_ALONG_Y, np.zeros(3)),
        _lathe(accent, "orange").moved(_ALONG_Y, np.zeros(3)),
        _lathe([(0.0, end + 0.001), (ring - 0.010, end + 0.001)], "dark").moved(_ALONG_Y, np.zeros(3)),
        _lathe([(0.0, height + SEAM), (0.046, height + SEAM), (0.046, height - 3 * SEAM)], "dark"),
    ]


def _flange(below: float, top: float) -> list[Part]:
    """Link 7: the turning disc, and the flange for the tool (ISO 9409-1-50)."""
    disc = [(0.0, top - 0.012), (0.044, top - 0.012), (0.0465, top - 0.0145), (0.047, below + 0.003)]
    disc += [(0.045, below), (0.0, below)]
    plate = [(0.0, top), (0.0305, top), (0.0315, top - 0.001), (0.0315, top - 0.013)]
    ring = [(0.0468, top - 0.018), (0.0478, top - 0.019), (0.0478, top - 0.022), (0.0468, top - 0.023)]
    return [_lathe(disc, "silver"), _lathe(plate, "dark"), _lathe(ring, "orange")]


def links(model: str) -> list[list[Part]]:
    """The pieces of links 0 to 7 of a robot, each in the frame of its link."""
    arm = robot(model).links
    origin = arm.origin
    height = [float(one[2]) for one in origin]
    aside = np.cumsum(origin[:, 1])  # of the frames of links 1 to 7 from the middle plane

    def placed(index: int, parts: list[Part]) -> list[Part]:
        return [part.moved(np.eye(3), np.array([0.0, -aside[index - 1], 0.0])) for part in parts]

    slim = {"tube": 0.075, "neck": 0.058, "drum": 0.070, "neighbour": 0.072, "cap": 0.092}
    first = Elbow(height[1], -1)
    second = Elbow(height[2], +1, tube=0.075)
    third = Elbow(height[3], +1, **slim)
    fourth = Elbow(height[4], -1, **{**slim, "tube": 0.070})
    fifth = Elbow(
        height[5], -1, 0.070, 0.036, 0.050, face=0.044, cap=0.098, edge=0.02, neighbour=0.062, foot=0.05
    )
    below = -0.018
    return [
        _base(height[0]),
        placed(1, first.parts()),
        placed(2, _flipped(second.parts(), height[2])),
        placed(3, third.parts()),
        placed(4, _flipped(fourth.parts(), height[4])),
        placed(5, fifth.parts()),
        placed(6, _hand(height[6] + below, 0.044)),
        placed(7, _flange(below + SEAM, float(arm.flange[2]))),
    ]


# ------------------------------------------------------------------------------------- files


def _joined(parts: list[Part]) -> list[Part]:
    """One piece for each colour."""
    found = []
    for colour in COLOURS:
        ours = [part for part in parts if part.colour == colour]
        if ours:
            shifts = np.cumsum([0] + [len(part.vertices) for part in ours])
            faces = [part.faces + shift for part, shift in zip(ours, shifts, strict=False)]
            normals = np.concatenate([part.normals for part in ours])
            vertices = np.concatenate([part.vertices for part in ours])
            found.append(Part(colour, vertices, normals, np.concatenate(faces)))
    return found


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}".rstrip("0").rstrip(".").replace("-0.", "-.").lstrip("0") or "0"


def _numbers(values: Array, digits: int) -> str:
    return " ".join(_number(value + 0.0, digits) for value in np.round(values, digits).ravel().tolist())


def wavefront(part: Part) -> str:
    """A piece as an OBJ file."""
    lines = [f"v {_numbers(vertex, 4)}" for vertex in part.vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in (part.faces + 1).tolist()]
    return "# written by scripts/arm_meshes.py\n" + "\n".join(lines) + "\n"


def collada(parts: list[Part]) -> str:
    """The pieces of a link as a Collada file."""
    effects, materials, geometries, nodes = [], [], [], []
    for part in parts:
        name = part.colour
        rgb = " ".join(f"{value:g}" for value in COLOURS[name])
        effects.append(
            f'<effect id="{name}-effect"><profile_COMMON><technique sid="common"><phong>'
            f"<ambient><color>{rgb} 1</color></ambient><diffuse><color>{rgb} 1</color></diffuse>"
            "<specular><color>0.3 0.3 0.3 1</color></specular><shininess><float>40</float></shininess>"
            "</phong></technique></profile_COMMON></effect>"
        )
        materials.append(
            f'<material id="{name}" name="{name}"><instance_effect url="#{name}-effect"/></material>'
        )
        sources = []
        for kind, values, digits in (("position", part.vertices, 4), ("normal", part.normals, 2)):
            sources.append(
                f'<source id="{name}-{kind}"><float_array id="{name}-{kind}-array" count="{values.size}">'
                f"{_numbers(values, digits)}</float_array><technique_common>"
                f'<accessor source="#{name}-{kind}-array" count="{len(values)}" stride="3">'
                '<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor>'
                "</technique_common></source>"
            )
        indices = " ".join(map(str, part.faces.ravel().tolist()))
        geometries.append(
            f'<geometry id="{name}-mesh"><mesh>{"".join(sources)}<vertices id="{name}-vertices">'
            f'<input semantic="POSITION" source="#{name}-position"/><input semantic="NORMAL" source="#{name}-normal"/>'
            f'</vertices><triangles material="{name}" count="{len(part.faces)}">'
            f'<input semantic="VERTEX" source="#{name}-vertices" offset="0"/><p>{indices}</p></triangles>'
            "</mesh></geometry>"
        )
        nodes.append(
            f'<node id="{name}-node"><instance_geometry url="#{name}-mesh"><bind_material><technique_common>'
            f'<instance_material symbol="{name}" target="#{name}"/></technique_common></bind_material>'
            "</instance_geometry></node>"
        )
    libraries = (("effects", effects), ("materials", materials), ("geometries", geometries))
    body = "\n".join(
        f"<library_{name}>\n" + "\n".join(found) + f"\n</library_{name}>" for name, found in libraries
    )
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n<!-- written by scripts/arm_meshes.py -->\n'
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">\n'
        "<asset><created>2026-01-01T00:00:00</created><modified>2026-01-01T00:00:00</modified>"
        '<unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>\n'
        f'{body}\n<library_visual_scenes><visual_scene id="scene">{"".join(nodes)}</visual_scene>'
        '</library_visual_scenes>\n<scene><instance_visual_scene url="#scene"/></scene>\n</COLLADA>\n'
    )


def files() -> dict[str, str]:
    """What there is to write, by the path from the project's folder; a common link is written once."""
    found = {}
    shapes = {model: links(model) for model in MODELS}
    for index in range(8):
        made = {model: [wavefront(part) for part in _joined(shapes[model][index])] for model in MODELS}
        alike = len({tuple(texts) for texts in made.values()}) == 1
        for model in MODELS[:1] if alike else MODELS:
            name = f"{COMMON if alike else model}/link_{index}"
            parts = _joined(shapes[model][index])
            found[f"{DESCRIPTION}/{name}.dae"] = collada(parts)
            for part in parts:
                found[f"{SIMULATOR}/{name}.{part.colour}.obj"] = wavefront(part)
    return found


def main() -> int:
    """Write all files."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT
    for name, text in files().items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
