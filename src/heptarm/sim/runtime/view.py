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
from typing import Any

import mujoco
import numpy as np

from heptarm.errors import require
from heptarm.sim.plant.world import compiled
from heptarm.sim.runtime.view_guard import ViewGuard
from heptarm.values.arrays import Array

_RATE = 30.0
_COLOURS = {"silver": (192, 194, 199), "orange": (255, 107, 10), "dark": (64, 64, 69)}


class Scene:
    """The arm's shapes in viser, moved by joint positions.

    Args:
        server: a viser server.
        model: "iiwa7", "iiwa14", "med7" or "med14".
    """

    def __init__(self, server: Any, model: str) -> None:
        self._model = compiled(model)
        self._data = mujoco.MjData(self._model)
        self._handles = [
            (index, self._shape(server, index))
            for index in range(self._model.ngeom)
            if self._model.geom_bodyid[index] > 0
        ]
        server.scene.add_grid("/floor", width=3.0, height=3.0, cell_size=0.1, section_size=0.5)
        server.scene.add_frame("/base", axes_length=0.15, axes_radius=0.004)
        self._flange = server.scene.add_frame("/flange", axes_length=0.10, axes_radius=0.003)

    def _shape(self, server: Any, index: int) -> Any:
        creation = require("trimesh.creation", extra="viz")
        model = self._model
        radius, half = float(model.geom_size[index, 0]), float(model.geom_size[index, 1])
        kind = model.geom_type[index]
        if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            mesh = creation.capsule(height=2 * half, radius=radius, count=(24, 24))
            mesh.apply_translation([0, 0, -mesh.bounds.mean(axis=0)[2]])
        else:
            mesh = creation.cylinder(radius=radius, height=2 * half, sections=32)
        material = model.geom_matid[index]
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_MATERIAL, material) if material >= 0 else "silver"
        return server.scene.add_mesh_simple(
            f"/arm/{index}",
            np.asarray(mesh.vertices),
            np.asarray(mesh.faces),
            color=_COLOURS.get(name, (180, 180, 180)),
        )

    def show(self, q: Array) -> None:
        """Move the shapes to joint positions, shape (7,) [rad]."""
        self._data.qpos[:7] = q
        mujoco.mj_kinematics(self._model, self._data)
        quat = np.zeros(4)
        for index, handle in self._handles:
            mujoco.mju_mat2Quat(quat, self._data.geom_xmat[index])
            handle.position, handle.wxyz = self._data.geom_xpos[index].copy(), quat.copy()
        mujoco.mju_mat2Quat(quat, self._data.site_xmat[0])
        self._flange.position, self._flange.wxyz = self._data.site_xpos[0].copy(), quat.copy()


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
    options = parser.parse_args(argv)
    from heptarm.arm.connect import connect
    from heptarm.errors import HeptarmError

    try:
        viser = require("viser", extra="viz")
    except HeptarmError as error:  # the parent prints it
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
        scene = Scene(server, arm.robot.name)
        server.scene.set_up_direction("+z")
        server.initial_camera.position = (1.25, -1.1, 1.0)
        server.initial_camera.look_at = (0.15, 0.0, 0.5)
        text = server.gui.add_markdown("")
        print(json.dumps({"ready": True, "url": guard.url}), flush=True)
        title = f"{arm.robot.title}{' (virtual)' if arm.is_virtual else ''}"
        try:
            for state in arm.states(rate=_RATE):
                scene.show(state.q)
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
