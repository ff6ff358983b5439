"""Pictures of a simulated arm in a task, by the cameras that also look at virtual and real arms."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected
from heptarm.rl.sim.contact_batch import BatchContact, build
from heptarm.rl.sim.episodes import TaskBatch
from heptarm.rl.task import ReachTask
from heptarm.rl.tasks import Task
from heptarm.sim.camera import ArmCamera
from heptarm.sim.lens import Lens
from heptarm.sim.plant.appearance import ArmMeshes
from heptarm.sim.plant.world import compiled
from heptarm.values.camera import Camera
from heptarm.values.checks import instance
from heptarm.values.frames import check_name


class TaskPictures:
    """Draws one arm of a simulation.

    Args:
        task: of the simulation.
        cameras: by the names of their pictures. Their scenes do not count: the task's own is drawn; of the reach task
            the arm alone.

    Raises:
        CommandRejected: a name that is not allowed, or this machine cannot draw.
        ShapeError: something else than cameras.
    """

    def __init__(self, task: Task, cameras: Mapping[str, Camera]) -> None:
        self.sizes: dict[str, tuple[int, int]] = {}
        self._cameras: dict[str, ArmCamera] = {}
        for name, camera in instance(cameras, Mapping, "pictures").items():
            check_name(name, "pictures")
            size = instance(camera, Camera, f"pictures[{name!r}]").size
            straight = Lens(camera).straight
            model = (
                compiled(task.robot, meshes=ArmMeshes(), camera=straight)
                if isinstance(task, ReachTask)
                else build(task, straight)
            )
            try:
                self._cameras[name] = ArmCamera(model, camera)
            except Exception as error:  # of any graphics driver
                raise CommandRejected(
                    f"this machine cannot draw: {type(error).__name__}: {error}",
                    parameter="pictures",
                    hint="set MUJOCO_GL to egl or osmesa before the program starts",
                ) from error
            self.sizes[name] = size

    def draw(self, arms: TaskBatch, index: int = 0) -> dict[str, npt.NDArray[np.uint8]]:
        """The pictures of an arm: red, green, blue, shape (height, width, 3) each."""
        found = {}
        for name, camera in self._cameras.items():
            if isinstance(arms, BatchContact):
                camera.place_all(*arms.placed(index))
            else:
                camera.place(arms.q[index])
            found[name] = camera.draw()
        return found
