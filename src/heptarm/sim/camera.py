"""The process of a simulated camera: reads joint positions, draws the arm and its scene with MuJoCo, writes pictures.

A process of its own, of low priority, holds up neither the states nor the plant, and has the graphics driver for
itself. `heptarm.record.camera` starts it and talks to it: a line of JSON for each picture, answered by a line of JSON
and the bytes of the layers that it asked for at the start.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import mujoco
import numpy as np
import numpy.typing as npt
from PIL import Image, ImageFilter

from heptarm.sim.lens import Lens
from heptarm.sim.plant.appearance import ArmMeshes
from heptarm.sim.plant.carried import COLOUR, GEOMS, mujoco_size
from heptarm.sim.plant.scene import Scene, is_mounted, plain
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
#: Added to the priority's number, of live pictures and of those of a recording: whatever controls an arm goes first,
#: then a program that waits for a picture.
_NICENESS = (3, 10)
#: Fraction of the farthest distance that is drawn, from which on there is nothing.
_NOTHING = 0.999
#: Name among the labels of what is on the flange and no body of the model.
FLANGE_LOAD = "on the flange"
#: Shapes that a scene for the eye has room for, beside those of the model; to look at its shapes takes time for each.
_MORE_GEOMS = 100


class ArmCamera:
    """Draws an arm in its scene as a camera sees it.

    Args:
        model: MuJoCo's model of arm and scene with the camera `Lens(camera).straight`, see
            `heptarm.sim.plant.world.compiled`.
        camera: how its pictures are.
        positions: file in which the simulator writes all positions; None: what is not the arm stands still.

    Attributes:
        shapes: what is on the flange, each with its pose in the flange frame; a scene's own tool takes its place.
    """

    def __init__(self, model: mujoco.MjModel, camera: Camera, positions: Path | None = None) -> None:
        self._model, self._data, self._camera = model, mujoco.MjData(model), camera
        self._lens = Lens(camera)
        width, height = self._lens.straight.size
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        model.vis.quality.shadowsize = _SHADOW_SIZE
        self._positions = None if positions is None else PositionsFile(positions, model.nq)
        self._has_tool = is_mounted(model)
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0
        self._renderer = mujoco.Renderer(
            model, height, width, max_geom=model.ngeom + model.nsite + _MORE_GEOMS
        )
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = camera.shadows
        self._noise = np.random.default_rng(0)
        self.shapes: tuple[tuple[Shape, Pose], ...] = ()
        #: Bodies by their labels; the last one is what is on the flange by `shapes`.
        self.names = (*(plain(model.body(index).name) for index in range(model.nbody)), FLANGE_LOAD)

    def place(self, q: Array) -> None:
        """Put the arm at joint positions, shape (7,) [rad], and all else where the simulator has it."""
        everything = None if self._positions is None else self._positions.read()
        if everything is not None:
            self._data.qpos[:] = everything
        self._data.qpos[:7] = q
        self._show()

    def place_all(self, positions: Array, mocap: tuple[Array, Array]) -> None:
        """Put everything where a simulation of the same model has it.

        Args:
            positions: MuJoCo's qpos, shape (nq,).
            mocap: places and quaternions w x y z of the bodies that are moved by hand, shapes (n, 3) and (n, 4).
        """
        self._data.qpos[:] = positions
        self._data.mocap_pos[:], self._data.mocap_quat[:] = mocap
        self._show()

    def _show(self) -> None:
        mujoco.mj_forward(self._model, self._data)
        self._renderer.update_scene(self._data, CAMERA, self._option)
        if not self._has_tool:
            self._add_shapes()

    def draw(self) -> npt.NDArray[np.uint8]:
        """A picture: red, green, blue, shape (height, width, 3)."""
        pixels = self._lens.bent(np.asarray(self._renderer.render()))
        if self._camera.blur:
            blurred = Image.fromarray(pixels).filter(ImageFilter.GaussianBlur(self._camera.blur))
            pixels = np.asarray(blurred)
        if self._camera.noise:
            noise = self._noise.standard_normal(pixels.shape, np.float32) * np.float32(self._camera.noise)
            pixels = np.clip(pixels + noise + np.float32(0.5), 0, 255).astype(np.uint8)
        return pixels

    def depth(self) -> npt.NDArray[np.float32]:
        """Distance along the optical axis [m], shape (height, width); infinite where there is nothing."""
        self._renderer.enable_depth_rendering()
        found = self._lens.nearest(np.array(self._renderer.render(), np.float32))
        self._renderer.disable_depth_rendering()
        farthest = self._model.vis.map.zfar * self._model.stat.extent
        found[found > _NOTHING * farthest] = np.inf
        return found

    def labels(self) -> npt.NDArray[np.int16]:
        """Index in `names` of what each pixel shows, shape (height, width); -1 where there is nothing."""
        self._renderer.enable_segmentation_rendering()
        geoms, kinds = np.moveaxis(self._renderer.render(), 2, 0)
        self._renderer.disable_segmentation_rendering()
        bodies = np.append(
            self._model.geom_bodyid, (self._model.nbody, -1)
        )  # what was added to the scene; nothing
        is_geom, is_added = kinds == int(mujoco.mjtObj.mjOBJ_GEOM), kinds == int(mujoco.mjtObj.mjOBJ_UNKNOWN)
        chosen = np.where(is_geom, geoms, np.where(is_added & (geoms >= 0), -2, -1))
        return self._lens.nearest(np.asarray(bodies[chosen], np.int16))

    def _add_shapes(self) -> None:
        """Add what is on the flange to what is drawn."""
        scene, flange = self._renderer.scene, self._data.site("flange")
        turn = flange.xmat.reshape(3, 3)
        geoms = scene.geoms if self.shapes else ()  # each look at them takes long
        for shape, pose in self.shapes:
            if scene.ngeom >= scene.maxgeom:
                return
            geom = geoms[scene.ngeom]
            mujoco.mjv_initGeom(
                geom,
                GEOMS[shape.kind],
                mujoco_size(shape.kind, shape.size),
                flange.xpos + turn @ pose.xyz,
                (turn @ pose.rotation).reshape(-1),
                np.array(COLOUR, np.float32),
            )
            geom.objid, geom.segid = 0, scene.ngeom  # of an unknown type, and yet something
            scene.ngeom += 1


def _shapes(given: Sequence[Mapping[str, Any]]) -> tuple[tuple[Shape, Pose], ...]:
    return tuple(
        (Shape(shape["kind"], np.array(shape["size"])), Pose.of(shape["xyz"], shape["quat"]))
        for shape in given
    )


def jpeg(pixels: npt.NDArray[np.uint8]) -> bytes:
    """A picture as a JPEG file."""
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", quality=_QUALITY)
    return file.getvalue()


#: What a picture may consist of, as bytes.
_LAYERS: Mapping[str, Callable[[ArmCamera], bytes]] = {
    "jpeg": lambda camera: jpeg(camera.draw()),
    "pixels": lambda camera: camera.draw().tobytes(),
    "depth": lambda camera: camera.depth().tobytes(),
    "labels": lambda camera: camera.labels().tobytes(),
}


def _serve(camera: ArmCamera, layers: Sequence[str], requests: BinaryIO, answers: BinaryIO) -> None:
    """Draw pictures until there are no more requests."""
    for line in requests:
        request = json.loads(line)
        if "shapes" in request:
            camera.shapes = _shapes(request["shapes"])
        camera.place(np.array(request["q"]))
        data = b"".join(_LAYERS[layer](camera) for layer in layers)
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
        os.nice(_NICENESS["jpeg" in settings["layers"]])
    try:
        camera = _opened(settings)
    except Exception as error:  # drivers fail in many ways; all of them are reported
        kind = "refused" if isinstance(error, SceneError) else "error"
        answers.write(json.dumps({kind: " ".join(str(error).split())[:300]}).encode() + b"\n")
        answers.flush()
        return 1
    answers.write(json.dumps({"ready": True, "names": camera.names}).encode() + b"\n")
    answers.flush()
    with contextlib.suppress(BrokenPipeError):  # nobody reads any more
        _serve(camera, settings["layers"], sys.stdin.buffer, answers)
    os._exit(0)  # at once: the driver has nothing to keep, and some fail when they are unloaded


def _opened(settings: Mapping[str, Any]) -> ArmCamera:
    camera = Camera(**settings["camera"])
    try:
        scene = Scene.of(settings["scene"]) if settings["scene"] else None
        straight = Lens(camera).straight
        model = compiled(settings["robot"], scene=scene, meshes=ArmMeshes(), camera=straight)
    except ValueError as error:
        raise SceneError(str(error)) from error
    found = ArmCamera(model, camera, Path(settings["positions"]) if settings["positions"] else None)
    found.place(np.zeros(7))
    found.draw()  # what does not work fails now
    return found


class SceneError(Exception):
    """There is no such scene, or its file is not in MuJoCo's format."""


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
