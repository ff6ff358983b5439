"""The lens of a simulated camera: a straight picture, drawn larger than what is seen, is bent by the distortion.

MuJoCo draws straight lines as straight ones. Where a pixel of the bent picture is in the straight one follows from the
inverse of Brown's distortion; colours are interpolated, distances and labels are those of the nearest pixel.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from heptarm.values.camera import NO_DISTORTION, SIZES, Camera, undistorted
from heptarm.values.checks import Array

_LayerT = TypeVar("_LayerT", bound=np.generic)
#: Pixels around the straight picture, for the interpolation.
_MARGIN = 2


class Lens:
    """Bends pictures as the lens of a camera does; one without distortion leaves them.

    Args:
        camera: whose pictures they are.

    Attributes:
        straight: camera without distortion that sees all of it, from which it is drawn.
    """

    def __init__(self, camera: Camera) -> None:
        self.straight = camera
        self._at: Array | None = None
        if camera.distortion == NO_DISTORTION:
            return
        width, height = camera.size
        matrix = camera.matrix
        focal, centre = matrix[0, 0], matrix[:2, 2]
        u, v = np.meshgrid(np.arange(width), np.arange(height))
        seen = undistorted(np.stack([u, v], axis=-1), matrix, camera.distortion)
        at = focal * seen + centre  # in the picture without distortion, with the same origin
        first = np.minimum(np.floor(at.min(axis=(0, 1))).astype(int) - _MARGIN, 0)
        last = np.maximum(np.ceil(at.max(axis=(0, 1))).astype(int) + _MARGIN, (width - 1, height - 1))
        size = last - first + 1
        if size.max() > SIZES[1]:
            raise ValueError(
                f"distortion needs a straight picture of {size[0]} by {size[1]} pixels, and {SIZES[1]} are allowed"
            )
        self._at = at - first
        self.straight = replace(
            camera,
            size=(int(size[0]), int(size[1])),
            fov=2.0 * math.atan(0.5 * float(size[1]) / focal),
            principal=tuple(centre - first),
            distortion=NO_DISTORTION,
        )

    def bent(self, pixels: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
        """Colours, shape (height, width, 3), from those of the straight picture (bilinear)."""
        if self._at is None:
            return pixels
        i, j = np.floor(self._at).astype(np.intp).transpose(2, 0, 1)
        right, down = np.moveaxis(self._at - np.floor(self._at), 2, 0)[:, :, :, None].astype(np.float32)
        above = pixels[j, i] * (1.0 - right) + pixels[j, i + 1] * right
        below = pixels[j + 1, i] * (1.0 - right) + pixels[j + 1, i + 1] * right
        return np.asarray(above * (1.0 - down) + below * down + 0.5, np.uint8)

    def nearest(self, layer: npt.NDArray[_LayerT]) -> npt.NDArray[_LayerT]:
        """Distances or labels, shape (height, width), from those of the straight picture."""
        if self._at is None:
            return layer
        i, j = np.rint(self._at).astype(np.intp).transpose(2, 0, 1)
        return np.ascontiguousarray(layer[j, i])
