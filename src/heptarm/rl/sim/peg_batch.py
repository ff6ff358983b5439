"""Many simulated arms in the peg-in-hole task: full dynamics, a Cartesian impedance inside the engine, contacts.

The impedance is six MuJoCo actuators between two sites, the peg's tip and the presumed hole: their lengths are the
pose, their controls the set-point, so that no law runs in Python between two decisions. Gravity counts as compensated.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from mujoco import batch

from heptarm.errors import CommandRejected
from heptarm.model.batch import forward_batch, jacobian_batch, solve_batch
from heptarm.rl.peg import PegInHole
from heptarm.rl.sim.episodes import ALL, Index, TaskBatch
from heptarm.rl.sim.randomisation import NONE, Randomisation
from heptarm.sim.plant.sensor_errors import GAIN, TORQUE_NOISE
from heptarm.sim.plant.world import specification
from heptarm.values.checks import Array

#: Steps of the engine in a second: its contacts need 2.5 ms or less.
_FREQUENCY = 400.0
#: The presumed hole in the base: z down into it; the middle of the shipped scene's.
PLACE = np.array([0.6, 0.1, 0.24])
DOWN = np.diag([-1.0, 1.0, -1.0])
#: Peg, gripper and hole of the scene `peg-in-hole` [m, kg].
_RADIUS, _SHAFT, _TIP = 0.01, 0.05, 0.225
_WALL, _WIDTH, _DEEP = 0.015, 0.0165, 0.02
_GRIPPER_MASS, _PEG_MASS = 1.0, 0.19
#: Radius of the peg's rounded edge [m], of so many points: the engine's contacts of a flat end are few and irregular,
#: so that their moment would not show on which side the end is supported.
_EDGE, _POINTS = 0.4e-3, 16
#: Readings of the torque sensors that a decision averages.
_READINGS = 4
#: Friction of steel on steel, and the range of training.
FRICTION = (0.1, 0.3)
#: Apparent mass and inertia at the tip, for the damping of the impedance [kg, kg m²], and its ratio.
_MASS, _INERTIA, _RATIO = 5.0, 0.2, 0.7
#: Spring and damper that hold the elbow [Nm/rad, Nms/rad].
_ELBOW = (0.5, 2.0)


def build(task: PegInHole) -> Any:
    """The engine's model of a task, an `mujoco.MjModel`; its six controls are the set-point [m, rad]."""
    spec = specification(task.robot)
    for servo in list(spec.actuators):
        spec.delete(servo)
    for geom in spec.geoms:  # the arm itself touches nothing
        geom.contype = geom.conaffinity = 0
    steel = {"solref": [0.005, 1.0], "friction": [0.2, 0.002, 0.0001]}
    hole = spec.worldbody.add_body(name="hole", mocap=True)
    middle = _RADIUS + 0.5 * task.clearance + _WALL
    for angle in np.arange(8) * np.pi / 4:
        hole.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[_WALL, _WIDTH, _DEEP],
            pos=[middle * np.cos(angle), middle * np.sin(angle), _DEEP],
            quat=[np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)],
            contype=2,
            conaffinity=1,
            **steel,
        )
    flange = spec.site("flange")
    link, base = flange.parent, np.array(flange.pos)
    link.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[0.03, 0.055, 0.03],
        pos=base + [0.0, 0.0, 0.05],
        mass=_GRIPPER_MASS,
        contype=0,
        conaffinity=0,
    )
    shaft = _SHAFT - _EDGE
    link.add_geom(
        name="peg",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[_RADIUS, 0.5 * shaft, 0.0],
        pos=base + [0.0, 0.0, _TIP - _EDGE - 0.5 * shaft],
        mass=_PEG_MASS,
        contype=1,
        conaffinity=2,
        **steel,
    )
    for angle in np.arange(_POINTS) * 2.0 * np.pi / _POINTS:
        ring = _RADIUS - _EDGE
        link.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[_EDGE, 0.0, 0.0],
            pos=base + [ring * np.cos(angle), ring * np.sin(angle), _TIP - _EDGE],
            mass=0.0,
            contype=1,
            conaffinity=2,
            **steel,
        )
    link.add_site(name="tip", pos=base + [0.0, 0.0, _TIP])
    spec.worldbody.add_site(name="presumed", pos=PLACE, quat=_quaternion(DOWN))
    stiff = np.repeat([task.stiffness, task.turn_stiffness], 3)
    damp = 2.0 * _RATIO * np.sqrt(stiff * np.repeat([_MASS, _INERTIA], 3))
    for axis in range(6):
        spring = spec.add_actuator(
            name=f"spring {axis}", trntype=mujoco.mjtTrn.mjTRN_SITE, target="tip", refsite="presumed"
        )
        spring.gear = np.eye(6)[axis]
        spring.dyntype = mujoco.mjtDyn.mjDYN_FILTEREXACT
        spring.dynprm[0] = 1.0 / 20.0
        spring.gaintype = mujoco.mjtGain.mjGAIN_FIXED
        spring.gainprm[0] = stiff[axis]
        spring.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        spring.biasprm[:3] = [0.0, -stiff[axis], -damp[axis]]
    for joint, rest in zip(spec.joints, home(task), strict=True):
        joint.stiffness, joint.springref = [_ELBOW[0], 0.0, 0.0], rest
        joint.damping = [_ELBOW[1], 0.0, 0.0]
    option = spec.option
    option.timestep = 1.0 / _FREQUENCY
    option.gravity = [0.0, 0.0, 0.0]
    option.cone, option.impratio = mujoco.mjtCone.mjCONE_PYRAMIDAL, 1.0
    return spec.compile()


def home(task: PegInHole) -> Array:
    """Joint positions with the tip at the presumed rim, shape (7,) [rad]."""
    result: Array = _joints(task, np.zeros((1, 6)))[0]
    return result


def _joints(task: PegInHole, poses: Array) -> Array:
    """Joint positions for poses of the tip without rotation, shape (n, 6) to (n, 7)."""
    flanges = np.tile(np.eye(4), (len(poses), 1, 1))
    flanges[:, :3, :3] = DOWN
    flanges[:, :3, 3] = PLACE + (poses[:, :3] - [0.0, 0.0, _TIP]) @ DOWN.T
    return solve_batch(task.model, flanges)


def _quaternion(matrix: Array) -> Array:
    found = np.empty(4)
    mujoco.mju_mat2Quat(found, matrix.ravel())
    return found


class BatchPeg(TaskBatch):
    """The peg-in-hole task on many simulated arms.

    Args:
        task: the task.
        envs: number of arms.
        randomisation: latency and bandwidth; what else differs is the task's.
        seed: of everything drawn.
        threads: of the simulation.
        starts: "staggered" or "together", see `TaskBatch`.
        reveal: whether observations end with `PegInHole.hidden`, for the value network of a training.

    Attributes:
        target: the true holes, shape (envs, 6) [m, rad].
        pose: of the tips, likewise.
        wrench: on the tips, as the arms' torque sensors show it, shape (envs, 6) [N, Nm].
        true_wrench: without their errors.

    Raises:
        LimitError: no arms, or no threads.
        CommandRejected: a randomisation that this task has not.
    """

    task: PegInHole

    def __init__(
        self,
        task: PegInHole,
        *,
        envs: int = 256,
        randomisation: Randomisation = NONE,
        seed: int | np.random.SeedSequence = 0,
        threads: int = 2,
        starts: str = "staggered",
        reveal: bool = False,
    ) -> None:
        if randomisation != randomisation.of_servo():
            raise CommandRejected("only latency and bandwidth differ in this task", parameter="randomisation")
        super().__init__(
            task,
            envs=envs,
            randomisation=randomisation,
            seed=seed,
            threads=threads,
            starts=starts,
            sizes=(6, 6),
        )
        self._batch = batch.Batch(build(task), nsim=envs, nthread=threads)
        bind, expand = self._batch.bind, self._batch.expand
        names = ("qpos", "qvel", "act", "ctrl", "qacc_warmstart", "mocap_pos", "mocap_quat")
        self._state = {name: bind(name) for name in names}
        self._length, self._contact = bind("actuator_length"), bind("qfrc_constraint")
        self._filter, self._friction = expand("actuator_dynprm"), expand("geom_friction")
        self._substeps = round(_FREQUENCY / task.rate / _READINGS)
        self._reveal = reveal
        self._noise = TORQUE_NOISE * task.model.tau_max / np.sqrt(_READINGS)
        self.pose, self.wrench, self.true_wrench = (np.zeros((envs, 6)) for _ in range(3))
        self._gain = np.ones((envs, 7))
        self._frames = np.zeros((max(task.history) + 1, envs, task.frame_size))
        self.reset()

    @property
    def q(self) -> Array:
        """Measured positions, shape (envs, 7) [rad]."""
        return np.asarray(self._state["qpos"])

    def _place(self, which: Index, starts: Array) -> None:
        count, task, random, state = len(which), self.task, self._random, self._state
        self.pose[which] = starts
        self._filter[which, :, 0] = 1.0 / self.randomisation.draw_bandwidth(random, count)[:, None]
        self._friction[which, :, 0] = random.uniform(*FRICTION, (count, 1))
        self._gain[which] = random.uniform(1.0 - GAIN, 1.0 + GAIN, (count, 7))
        state["qpos"][which] = _joints(task, starts)
        for name in ("qvel", "qacc_warmstart"):
            state[name][which] = 0.0
        state["act"][which] = state["ctrl"][which] = starts
        hole = self.target[which]
        state["mocap_pos"][which, 0] = PLACE + hole[:, :3] @ DOWN.T
        turn = np.empty(4)
        base = _quaternion(DOWN)
        for row, one in zip(which.tolist(), hole, strict=True):
            angle = float(np.linalg.norm(one[3:]))
            mujoco.mju_axisAngle2Quat(turn, one[3:] / max(angle, 1e-12), angle)
            mujoco.mju_mulQuat(turn, base, turn)
            state["mocap_quat"][row, 0] = turn
        self.wrench[which] = self.true_wrench[which] = 0.0
        self._frames[:, which] = task.frame(starts, starts, np.zeros((count, 6)))

    def observe(self, which: Index | slice = ALL) -> Array:
        """The current observations of all arms or some, shape (envs, n)."""
        seen = self.task.observe(self._frames[:, which])
        if not self._reveal:
            return seen
        friction = np.asarray(self._friction)[which, 0, 0]
        hidden = self.task.hidden(self.pose[which], self.target[which], friction)
        return np.concatenate([seen, hidden], axis=-1)

    def teach(self) -> Array:
        """What one who knows the true holes would do, shape (envs, 5)."""
        return self.task.teach(self.command, self.pose, self.target)

    def _advance(self, action: Array) -> Array:
        return self.task.advance(self.command, self.pose, action)

    def _simulate(self, command: Array) -> Array:
        self._state["ctrl"][:] = command
        torque = np.zeros((self.envs, 7))
        for _ in range(_READINGS):
            self._batch.step(nstep=self._substeps)
            torque += np.asarray(self._contact) / _READINGS
        self.pose[:] = self._length
        self._sense(torque)
        self._frames[1:] = self._frames[:-1]
        self._frames[0] = self.task.frame(self.pose, self.command, self.wrench)
        force: Array = np.linalg.norm(self.true_wrench[:, :3], axis=1)
        return force

    def _sense(self, torque: Array) -> None:
        """Wrenches of the tips from external torques, shape (envs, 7) [Nm], with and without the errors of sensors."""
        felt = self._gain * torque + self._noise * self._random.standard_normal(torque.shape)
        q = self.q
        jacobian = jacobian_batch(self.task.model, q)
        arm = forward_batch(self.task.model, q)[:, :3, 2] * _TIP
        # velocity of the tip: v + w x arm
        jacobian[:, :3] += np.cross(np.swapaxes(jacobian[:, 3:], 1, 2), arm[:, None]).swapaxes(1, 2)
        inverse = np.linalg.solve(jacobian @ jacobian.swapaxes(1, 2), jacobian)
        found = (inverse @ np.stack([torque, felt], axis=-1)).reshape(self.envs, 2, 3, 2)
        found = np.einsum("ij,nkjl->nkil", DOWN.T, found).reshape(self.envs, 6, 2)
        self.true_wrench[:], self.wrench[:] = found[..., 0], found[..., 1]

    def outcome(self) -> tuple[Array, Array]:
        """Where the tips are in the frame of the presumed hole, shape (envs, 3), and missing depths, (envs,) [m]."""
        return self.pose[:, :3].copy(), self.task.missing(self.pose, self.target)

    def _reward(self, distance: Array) -> Array:
        return self.task.reward(self.pose, self.target, self.true_wrench)

    def _changing(self) -> dict[str, Any]:
        own = ("pose", "wrench", "_frames", "_gain", "_filter", "_friction")
        return {**super()._changing(), **self._state, **{name: getattr(self, name) for name in own}}
