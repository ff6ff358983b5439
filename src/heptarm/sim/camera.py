"""The process of a simulated camera: reads joint positions, draws the arm and its scene with MuJoCo, writes pictures.

A process of its own, of low priority, holds up neither the states nor the plant, and has the graphics driver for
itself. `heptarm.record.camera` starts it and talks to it: a line of JSON for each picture, answered by a line of JSON
and the bytes of a JPEG file.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import mujoco
import numpy as np
import numpy.typing as npt
from PIL import Image

from heptarm.sim.plant.appearance import ArmMeshes
from heptarm.sim.plant.carried import COLOUR, GEOMS, mujoco_size
from heptarm.sim.plant.scene import Scene, is_mounted
from heptarm.sim.plant.shared_state import PositionsFile
from heptarm.sim.plant.world import CAMERA, compiled
from heptarm.values.camera import Camera
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from heptarm.values.shape import Shape

#: Quality of the pictures, of JPEG's 1 to 95.
_QUALITY = 85
#: Width and height of the map of shadows [pixels]: without a graphics card a larger one takes longer than the picture.
_SHADOW_SIZE = 1024
#: Added to the priority's number: whatever controls an arm goes first.
_NICENESS = 10
#: Shapes that a scene for the eye has room for, beside those of the model.
_MOST_GEOMS = 2000


class ArmCamera:
    """Draws an arm in its scene as a camera sees it.

    Args:
        model: MuJoCo's model of arm and scene with the camera, see `heptarm.sim.plant.world.compiled`.
        size: width and height of the pictures [pixels].
        positions: file in which the simulator writes all positions; None: what is not the arm stands still.

    Attributes:
        shapes: what is on the flange, each with its pose in the flange frame; a scene's own tool takes its place.
    """

    def __init__(self, model: mujoco.MjModel, size: tuple[int, int], positions: Path | None = None) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        width, height = size
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        model.vis.quality.shadowsize = _SHADOW_SIZE
        self._positions = None if positions is None else PositionsFile(positions, model.nq)
        self._has_tool = is_mounted(model)
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0
        self._renderer = mujoco.Renderer(model, height, width, max_geom=_MOST_GEOMS)
        self.shapes: tuple[tuple[Shape, Pose], ...] = ()

    def draw(self, q: Array) -> npt.NDArray[np.uint8]:
        """A picture at joint positions, shape (7,) [rad]: red, green, blue, shape (height, width, 3)."""
        everything = None if self._positions is None else self._positions.read()
        if everything is not None:
            self._data.qpos[:] = everything
        self._data.qpos[:7] = q
        mujoco.mj_forward(self._model, self._data)
        self._renderer.update_scene(self._data, CAMERA, self._option)
        if not self._has_tool:
            self._add_shapes()
        return np.asarray(self._renderer.render())

    def _add_shapes(self) -> None:
        """Add what is on the flange to what is drawn."""
        scene, flange = self._renderer.scene, self._data.site("flange")
        turn = flange.xmat.reshape(3, 3)
        for one, pose in self.shapes:
            if scene.ngeom >= scene.maxgeom:
                return
            mujoco.mjv_initGeom(
                scene.geoms[scene.ngeom],
                GEOMS[one.kind],
                mujoco_size(one.kind, one.size),
                flange.xpos + turn @ pose.xyz,
                (turn @ pose.rotation).reshape(-1),
                np.array(COLOUR, np.float32),
            )
            scene.ngeom += 1


def _shapes(given: Sequence[Mapping[str, Any]]) -> tuple[tuple[Shape, Pose], ...]:
    return tuple(
        (Shape(one["kind"], np.array(one["size"])), Pose.of(one["xyz"], one["quat"])) for one in given
    )


def jpeg(pixels: npt.NDArray[np.uint8]) -> bytes:
    """A picture as a JPEG file."""
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", quality=_QUALITY)
    return file.getvalue()


def _serve(camera: ArmCamera, requests: BinaryIO, answers: BinaryIO) -> None:
    """Draw pictures until there are no more requests."""
    for line in requests:
        request = json.loads(line)
        if "shapes" in request:
            camera.shapes = _shapes(request["shapes"])
        data = jpeg(camera.draw(np.array(request["q"])))
        answers.write(json.dumps({"size": len(data)}).encode() + b"\n" + data)
        answers.flush()


def main(arguments: Sequence[str]) -> int:
    """Open a camera, report that it is ready, and draw until standard input ends."""
    answers = os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # what a graphics driver prints is no answer
        os.dup2(nowhere, stream)
    settings = json.loads(arguments[0])
    with contextlib.suppress(AttributeError, OSError):  # not on Windows
        os.nice(_NICENESS)
    try:
        camera = _opened(settings)
    except Exception as error:  # drivers fail in many ways; all of them are reported
        kind = "refused" if isinstance(error, SceneError) else "error"
        answers.write(json.dumps({kind: " ".join(str(error).split())[:300]}).encode() + b"\n")
        answers.flush()
        return 1
    answers.write(json.dumps({"ready": True}).encode() + b"\n")
    answers.flush()
    with contextlib.suppress(BrokenPipeError):  # nobody reads any more
        _serve(camera, sys.stdin.buffer, answers)
    os._exit(0)  # at once: the driver has nothing to keep, and some fail when they are unloaded


def _opened(settings: Mapping[str, Any]) -> ArmCamera:
    camera = Camera(**settings["camera"])
    try:
        scene = Scene.of(settings["scene"]) if settings["scene"] else None
        model = compiled(settings["robot"], scene=scene, meshes=ArmMeshes(), camera=camera)
    except ValueError as error:
        raise SceneError(str(error)) from error
    found = ArmCamera(model, camera.size, Path(settings["positions"]) if settings["positions"] else None)
    found.draw(np.zeros(7))  # what does not work fails now
    return found


class SceneError(Exception):
    """There is no such scene, or its file is not in MuJoCo's format."""


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
