"""Free bodies of a scene that a person beside the robot moves: placed, or put back where they were."""

from __future__ import annotations

from collections import deque

import mujoco
import numpy as np

from heptarm.sim.plant.scene import PREFIX, find_body, plain
from heptarm.values.checks import Array


class FreeBodies:
    """Places the free bodies of a scene, from any thread; the tick carries it out.

    Args:
        model: MuJoCo's model.
        data: the state of the simulation.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model, self._data = model, data
        self._start = data.qpos.copy()
        self._asked: deque[tuple[int, Array]] = deque()
        free = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
        bodies = {int(model.jnt_bodyid[joint]): int(joint) for joint in free}
        self._joints = {
            body: joint for body, joint in bodies.items() if model.body(body).name.startswith(PREFIX)
        }

    @property
    def has_changed(self) -> bool:
        """Whether the next tick has something to carry out."""
        return bool(self._asked)

    def place(self, name: str, pose: Array) -> None:
        """Place a body at rest: x y z [m] and unit quaternion x y z w in the base, shape (7,).

        Raises:
            ValueError: the scene has no such body, or it is fixed.
        """
        joint = self._joints.get(find_body(self._model, name))
        if joint is None:
            free = ", ".join(plain(self._model.body(body).name) for body in self._joints) or "none"
            raise ValueError(f"{name} is fixed in the scene and cannot be placed; free are: {free}")
        self._asked.append((joint, np.concatenate([pose[:3], np.roll(pose[3:], 1)])))

    def reset(self) -> None:
        """Put all of them back, at rest."""
        for joint in self._joints.values():
            begin = int(self._model.jnt_qposadr[joint])
            self._asked.append((joint, self._start[begin : begin + 7]))

    def take(self) -> None:
        """Carry out what was asked for; called by the tick."""
        while self._asked:
            joint, pose = self._asked.popleft()
            begin, speed = int(self._model.jnt_qposadr[joint]), int(self._model.jnt_dofadr[joint])
            self._data.qpos[begin : begin + 7] = pose
            self._data.qvel[speed : speed + 6] = 0.0
