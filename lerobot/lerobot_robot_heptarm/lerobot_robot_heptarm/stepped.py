"""The simulated robot of a virtual arm alone, moved on by its caller step by step.

A virtual arm runs in real time, and on a busy machine an action comes late. Here simulated time waits: as fast as the
processor allows, and the same for the same seed. Dynamics, drives, limits, contacts and gripper are those of a virtual
arm; cabinet, network and watchdogs are not there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

import heptarm as ha
from heptarm.planning.seam import JointDynamics, ServoSmart, ServoTiming
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.scene import Scene
from heptarm.values.robot import Body, RobotModel
from lerobot_robot_heptarm.scenes import GRIPPER, HOME

#: Simulated milliseconds in which bodies come to rest before an episode.
_SETTLE = 200


@dataclass(frozen=True)
class _State:
    """The part of a state that there is.

    Attributes:
        q: measured joint positions, shape (7,) [rad].
    """

    q: np.ndarray


class SteppedArm:
    """A virtual iiwa 14 with the scenes' gripper, at `HOME`: the part of `heptarm.Arm` that tasks and robots need.

    Args:
        scene: around it.
    """

    def __init__(self, scene: str) -> None:
        self._plant = Plant("iiwa14", q=tuple(HOME.tolist()), scene=Scene.of(scene))
        self._plant.set_load_data(Body(GRIPPER.mass, np.array(GRIPPER.com)))
        self._orders, self._taken = 0, 0
        self.operator, self.io = _Operator(self._plant), _Signals(self._plant)
        self._plant.step(_SETTLE)

    @property
    def robot(self) -> RobotModel:
        """Its limits."""
        return self._plant.robot

    @property
    def state(self) -> _State:
        """The measured state."""
        return _State(np.array(self._plant.data.qpos[:7]))

    @contextmanager
    def servo(self, kind: str, *, speed: float, watchdog: float) -> Iterator[SteppedArm]:
        """A stream of joint targets; nothing watches over its silence, since time waits."""
        assert kind == "joint" and watchdog > 0.0
        self._orders += 1
        motion = ServoSmart(timing=ServoTiming(), dynamics=JointDynamics(velocity=(speed,) * 7))
        self._plant.submit(MotionCommand(self._orders, motion))
        self._plant.step(2)
        yield self
        self._plant.cancel(self._orders)
        while not self._plant.idle:
            self._plant.step()

    def set(self, q: np.ndarray) -> None:
        """The newest target of the stream, shape (7,) [rad].

        Raises:
            NotReady: a drive error has stopped the arm.
        """
        if not np.isfinite(q).all():
            raise ha.LimitError(f"q must be finite, got {q}", parameter="q")
        if self._plant.idle:
            raise ha.NotReady("the arm has stopped: a joint was too far behind its set-point")
        self._plant.shared.post(self._orders, q)

    def step(self, seconds: float) -> None:
        """Let simulated time go on [s]."""
        self._plant.step(max(round(1e3 * seconds), 1))


class _Operator:
    """Where the bodies of the scene are; see `heptarm.Arm.operator`."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant

    def where(self, body: str) -> ha.Pose:
        """Pose of a body in the base."""
        pose = self._plant.body_pose(body)
        return ha.Pose.of(pose[:3], pose[3:])

    def place(self, body: str, pose: ha.Pose) -> None:
        """Place a body at rest."""
        self._plant.bodies.place(body, np.concatenate([pose.xyz, pose.quat]))
        self._plant.step(_SETTLE)

    def reset(self) -> None:
        """Put all bodies back."""
        self._plant.bodies.reset()
        self._plant.step(_SETTLE)


class _Signals:
    """Signals of the media flange; see `heptarm.Arm.io`."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant

    def __getitem__(self, name: str) -> bool:
        return bool(self._plant.signals.get(name))

    def set(self, values: Mapping[str, bool]) -> None:
        """Set outputs."""
        for name, value in values.items():
            self._plant.signals.set(name, float(value))
