"""Corners of AprilTags where their edges meet, to a hundredth of a pixel.

A detector's corners move with the blur, since a corner becomes round. A straight edge does not move: it is where the
mean of its slope is, whatever the blur (moments of the gradient, Tabatabai, Mitchell, 1984). So each of the four edges
of the black square is measured along its length, fitted by a line, and the lines are intersected.
"""

from __future__ import annotations

import math

import numpy as np

from heptarm.values.checks import Array

#: Modules of a tag along its side: the black border is one of them wide, and nothing else is within it.
_MODULES = 8
#: How far from an edge is looked, in modules and at most and at least [pixels].
_NEAR, _FARTHEST, _NEAREST = 0.4, 4.0, 1.0
#: Part of an edge at each end that the neighbouring edges disturb.
_END = 0.12
#: Spacings of the profiles along an edge, and of the samples of each [pixels].
_ALONG, _ACROSS = 0.5, 0.25
#: Profiles with less than this part of the median contrast do not count, and the fewest that are a line.
_CONTRAST, _FEWEST = 0.5, 8
#: Repetitions, each about the edges of the one before.
_STEPS = 3


def edge_corners(picture: Array, corners: Array) -> Array:
    """Corners of a tag from its edges.

    Args:
        picture: gray levels, shape (height, width).
        corners: about where they are, in order around the tag, shape (4, 2) [pixels]; the middle of the first pixel is
            (0, 0).

    Returns:
        Shape (4, 2) [pixels]; as given, where an edge cannot be measured.
    """
    found = corners
    for _ in range(_STEPS):
        shortest = float(np.linalg.norm(np.roll(found, -1, axis=0) - found, axis=1).min())
        near = min(max(_NEAR * shortest / _MODULES, _NEAREST), _FARTHEST)
        lines = [_line(picture, a, b, near) for a, b in zip(found, np.roll(found, -1, axis=0), strict=True)]
        known = [line for line in lines if line is not None]
        if len(known) < len(lines):
            return corners
        meeting = np.cross(np.roll(known, 1, axis=0), known)
        found = meeting[:, :2] / meeting[:, 2:]
    return found if np.abs(found - corners).max() < 2.0 * near else corners


def _line(picture: Array, begin: Array, end: Array, near: float) -> Array | None:
    """The edge near a line between two points, as homogeneous coordinates, shape (3,); None: there is none."""
    length = math.dist(begin, end)
    if length * (1.0 - 2.0 * _END) < _FEWEST * _ALONG:
        return None
    along = (end - begin) / length
    across = np.array([-along[1], along[0]])
    places = np.arange(_END * length, (1.0 - _END) * length, _ALONG)
    offsets = np.arange(-near, near + 0.5 * _ACROSS, _ACROSS)
    slopes = np.diff(
        _between(picture, begin + places[:, None, None] * along + offsets[:, None] * across), axis=1
    )
    contrast = slopes.sum(axis=1)
    is_edge = np.abs(contrast) > max(_CONTRAST * float(np.median(np.abs(contrast))), 1.0)
    if is_edge.sum() < _FEWEST:
        return None
    middles = 0.5 * (offsets[1:] + offsets[:-1])
    off = slopes[is_edge] @ middles / contrast[is_edge]
    turn, shift = np.polyfit(places[is_edge], off, 1)
    first, last = begin + shift * across, end + (shift + turn * length) * across
    return np.cross(np.append(first, 1.0), np.append(last, 1.0))


def _between(picture: Array, points: Array) -> Array:
    """Gray levels between the pixels (bilinear), of points u v, shape (..., 2)."""
    height, width = picture.shape
    u = np.clip(points[..., 0], 0.0, width - 1.001)
    v = np.clip(points[..., 1], 0.0, height - 1.001)
    i, j = u.astype(np.intp), v.astype(np.intp)
    right, down = u - i, v - j
    above = (1.0 - right) * picture[j, i] + right * picture[j, i + 1]
    below = (1.0 - right) * picture[j + 1, i] + right * picture[j + 1, i + 1]
    return np.asarray((1.0 - down) * above + down * below)
