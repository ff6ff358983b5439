"""A live 3D view of a cabinet in the browser: a separate process that observes over the wire protocol.

python -m heptarm.sim.runtime.view --target sim://127.0.0.1:30001
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import sys
import threading
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from heptarm.errors import require
from heptarm.sim.plant.appearance import HIDDEN_GROUP, ArmMeshes
from heptarm.sim.plant.scene import Scene
from heptarm.sim.plant.shared_state import PositionsFile
from heptarm.sim.plant.world import compiled
from heptarm.sim.runtime.view_guard import ViewGuard
from heptarm.values.arrays import Array

_RATE = 30.0
_COLOURS = {"silver": (192, 194, 199), "orange": (255, 107, 10), "dark": (64, 64, 69)}


class DrawnWorld:
    """The shapes of arm and scene in viser, moved by joint positions.

    Args:
        server: a viser server.
        model: "iiwa7", "iiwa14", "med7" or "med14".
        scene: what is around the arm and on its flange; None: nothing.
        positions: file in which the simulator writes all positions; None: only the arm moves.
        meshes: of the arm; None: heptarm's own.
    """

    def __init__(
        self,
        server: Any,
        model: str,
        scene: Scene | None = None,
        positions: Path | None = None,
        meshes: ArmMeshes | None = None,
    ) -> None:
        self._model = compiled(model, (), scene, meshes or ArmMeshes())
        self._data = mujoco.MjData(self._model)
        self._positions = None if positions is None else PositionsFile(positions, self._model.nq)
        self._handles = [
            (index, self._shape(server, index)) for index in range(self._model.ngeom) if self._is_drawn(index)
        ]
        server.scene.add_grid("/floor", width=3.0, height=3.0, cell_size=0.1, section_size=0.5)
        server.scene.add_frame("/base", axes_length=0.15, axes_radius=0.004)
        self._flange = server.scene.add_frame("/flange", axes_length=0.10, axes_radius=0.003)

    def _is_drawn(self, index: int) -> bool:
        kind = int(self._model.geom_type[index])
        endless = kind in (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))
        return not endless and int(self._model.geom_group[index]) < HIDDEN_GROUP

    def _shape(self, server: Any, index: int) -> Any:
        vertices, faces = self._mesh(index)
        model, red_green_blue = self._model, self._model.geom_rgba[index, :3]
        material = model.geom_matid[index]
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_MATERIAL, material) if material >= 0 else ""
        colour = _COLOURS.get(name) or tuple(round(255 * float(part)) for part in red_green_blue)
        return server.scene.add_mesh_simple(f"/world/{index}", vertices, faces, color=colour)

    def _mesh(self, index: int) -> tuple[Array, Array]:
        """Vertices and faces of a shape in its own frame."""
        creation = require("trimesh.creation", extra="viz")
        model, kind = self._model, self._model.geom_type[index]
        radius, half, depth = model.geom_size[index].tolist()
        if kind == mujoco.mjtGeom.mjGEOM_MESH:
            one = int(model.geom_dataid[index])
            first, face = int(model.mesh_vertadr[one]), int(model.mesh_faceadr[one])
            vertices = model.mesh_vert[first : first + int(model.mesh_vertnum[one])]
            return np.array(vertices), np.array(model.mesh_face[face : face + int(model.mesh_facenum[one])])
        if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            mesh = creation.capsule(height=2 * half, radius=radius, count=(24, 24))
            mesh.apply_translation([0, 0, -mesh.bounds.mean(axis=0)[2]])
        elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
            mesh = creation.cylinder(radius=radius, height=2 * half, sections=32)
        elif kind == mujoco.mjtGeom.mjGEOM_BOX:
            mesh = creation.box(extents=(2 * radius, 2 * half, 2 * depth))
        else:  # a sphere has one radius, an ellipsoid three
            mesh = creation.icosphere(subdivisions=3, radius=1.0)
            mesh.apply_scale((radius, half or radius, depth or radius))
        return np.asarray(mesh.vertices), np.asarray(mesh.faces)

    def show(self, q: Array) -> None:
        """Move the shapes to joint positions, shape (7,) [rad]; those of the scene to the simulator's."""
        everything = None if self._positions is None else self._positions.read()
        if everything is not None:
            self._data.qpos[:] = everything
        self._data.qpos[:7] = q
        mujoco.mj_kinematics(self._model, self._data)
        quat = np.zeros(4)
        for index, handle in self._handles:
            mujoco.mju_mat2Quat(quat, self._data.geom_xmat[index])
            handle.position, handle.wxyz = self._data.geom_xpos[index].copy(), quat.copy()
        flange = self._data.site("flange")
        mujoco.mju_mat2Quat(quat, flange.xmat)
        self._flange.position, self._flange.wxyz = flange.xpos.copy(), quat.copy()


def _readout(state: Any, title: str) -> str:
    joints = " ".join(f"{v:.1f}" for v in np.degrees(state.q).round(1) + 0.0)
    x, y, z = state.pose.xyz * 1e3
    running = f"motion {state.motion.id}, {state.motion.progress:.0%}" if state.motion.active else "at rest"
    ready = "ready" if state.safety.ready_to_move else "**not ready**"
    return (
        f"**{title}**\n\njoints {joints} deg\n\nflange {x:.0f} {y:.0f} {z:.0f} mm\n\n"
        f"{running}, {state.safety.mode.value.upper()}, {ready}"
    )


def main(argv: list[str] | None = None) -> int:
    """Show a cabinet until standard input is closed or the cabinet ends."""
    parser = argparse.ArgumentParser(prog="python -m heptarm.sim.runtime.view")
    parser.add_argument("--target", required=True)
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=8080)
    parser.add_argument("--scene", default="")
    parser.add_argument("--positions", type=Path, default=None)
    parser.add_argument("--meshes", default="", help="folder with link_0.stl to link_7.stl or .obj")
    options = parser.parse_args(argv)
    from heptarm.arm.connect import connect
    from heptarm.errors import HeptarmError

    try:
        viser = require("viser", extra="viz")
        meshes = ArmMeshes.of(options.meshes)
    except (HeptarmError, ValueError) as error:  # the parent prints it
        print(json.dumps({"ready": False, "error": str(error), "host": True}), flush=True)
        return 1
    signal.signal(signal.SIGTERM, lambda *_: os._exit(0))
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with connect(options.target, control=False, name="view", state_rate=_RATE) as arm:
        guard = ViewGuard(options.host)
        # standard output is for the line with the URL
        with contextlib.redirect_stdout(sys.stderr), guard.installed():
            server = viser.ViserServer(host=options.host, port=options.port, verbose=False)
        guard.port = server.get_port()
        scene = Scene.of(options.scene) if options.scene else None
        world = DrawnWorld(server, arm.robot.name, scene, options.positions, meshes)
        server.scene.set_up_direction("+z")
        server.initial_camera.position = (1.25, -1.1, 1.0)
        server.initial_camera.look_at = (0.15, 0.0, 0.5)
        text = server.gui.add_markdown("")
        print(json.dumps({"ready": True, "url": guard.url}), flush=True)
        title = f"{arm.robot.title}{' (virtual)' if arm.is_virtual else ''}"
        try:
            for state in arm.states(rate=_RATE):
                world.show(state.q)
                text.content = _readout(state, title)
        except HeptarmError as error:
            print(f"the view ends: {error}", file=sys.stderr)
    return 0


def _end_with_parent() -> None:
    while os.read(0, 4096):
        pass
    os._exit(0)


if __name__ == "__main__":
    sys.exit(main())
