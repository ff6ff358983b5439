"""Many simulated arms in a task with contacts: full dynamics, a Cartesian impedance inside the engine, contacts.

The impedance is six MuJoCo actuators between two sites, the tip of the tool and the origin of the task: their lengths
are the pose, their controls the set-point, so that no law runs in Python between two decisions. The weight of arm and
tool counts as compensated.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from mujoco import batch

from heptarm.errors import CommandRejected, Unreachable
from heptarm.model.batch import forward_batch, jacobian_batch, solve_batch
from heptarm.rl.contact.check import Contents, check_task
from heptarm.rl.contact.task import ContactTask, Moment
from heptarm.rl.sim.episodes import ALL, BatchSettings, Index, TaskBatch
from heptarm.sim.plant.appearance import ArmMeshes
from heptarm.sim.plant.gripper import driven_joints, has_gripper
from heptarm.sim.plant.scene import GRIPPER, PREFIX, TOOL, attach_text
from heptarm.sim.plant.sensor_errors import FRICTION, GAIN, STICTION_SPEED, TORQUE_NOISE
from heptarm.sim.plant.world import add_camera, specification
from heptarm.values.camera import Camera
from heptarm.values.checks import Array

#: Readings of the torque sensors whose noise a decision averages.
_READINGS = 4
#: Apparent mass and inertia at the tip, for the damping of the impedance [kg, kg m²], and its ratio.
_MASS, _INERTIA, _RATIO = 5.0, 0.2, 0.7
#: Spring and damper that hold the elbow [Nm/rad, Nms/rad].
_ELBOW = (0.5, 2.0)
#: Deviation of the zero of the torque sensors in an episode, in those of a single reading: what is left of an offset
#: when the arm turns a little, and what averaging at the start has left of the noise.
_DRIFT = 0.15
#: Site at the origin of the task.
_ORIGIN = "origin"


def build(task: ContactTask, camera: Camera | None = None) -> Any:
    """The engine's model of a task, an `mujoco.MjModel`; its last six controls are the set-point [m, rad].

    Args:
        task: the task.
        camera: that draws it, see `heptarm.sim.camera.ArmCamera`; None: nobody looks.

    Raises:
        CommandRejected: the scene is not in MuJoCo's format, or has no body `tool` with the site of its tip.
    """
    spec = specification(task.robot, None if camera is None else ArmMeshes())
    if camera is not None:
        add_camera(spec, camera)
    for servo in list(spec.actuators):
        spec.delete(servo)
    for geom in spec.geoms:  # the arm itself touches nothing
        geom.contype = geom.conaffinity = 0
    attach_text(spec, task.scene(), what=f"the scene of {task.name}")
    tip = spec.site(PREFIX + task.site)
    if tip is None or tip.parent.name != PREFIX + TOOL:
        raise CommandRejected(f"the scene of {task.name} must have a body `tool` with a site `{task.site}`")
    arm = spec.body("link_0")
    for body in (arm, *arm.find_all(mujoco.mjtObj.mjOBJ_BODY)):
        body.gravcomp = 1.0
    spec.worldbody.add_site(name=_ORIGIN, pos=task.origin.xyz, quat=np.roll(task.origin.quat, 1))
    stiff = np.repeat([task.stiffness, task.turn_stiffness], 3)
    damp = 2.0 * _RATIO * np.sqrt(stiff * np.repeat([_MASS, _INERTIA], 3))
    for axis in range(6):
        spring = spec.add_actuator(
            name=f"spring {axis}", trntype=mujoco.mjtTrn.mjTRN_SITE, target=tip.name, refsite=_ORIGIN
        )
        spring.gear = np.eye(6)[axis]
        spring.dyntype = mujoco.mjtDyn.mjDYN_FILTEREXACT
        spring.dynprm[0] = 1.0 / 20.0
        spring.gaintype = mujoco.mjtGain.mjGAIN_FIXED
        spring.gainprm[0] = stiff[axis]
        spring.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        spring.biasprm[:3] = [0.0, -stiff[axis], -damp[axis]]
    reach = float(tip.pos[2])
    for index, rest in enumerate(_joints(task, np.zeros((1, 6)), reach)[0]):
        joint = spec.joint(f"A{index + 1}")
        joint.stiffness, joint.springref = [_ELBOW[0], 0.0, 0.0], rest
        joint.damping = [_ELBOW[1], 0.0, 0.0]
    spec.option.timestep = 1.0 / task.frequency
    return spec.compile()


def _joints(task: ContactTask, poses: Array, reach: float) -> Array:
    """Joint positions for poses of a tip that is so far from the flange, shape (n, 6) to (n, 7).

    Raises:
        Unreachable: there are none for one of them.
    """
    flanges = np.tile(np.eye(4), (len(poses), 1, 1))
    turned = _turned(_quaternions(poses[:, 3:]))
    flanges[:, :3, :3] = task.origin.rotation @ turned
    flanges[:, :3, 3] = task.origin.xyz + (poses[:, :3] - reach * turned[:, :, 2]) @ task.origin.rotation.T
    found = solve_batch(task.model, flanges)
    for index in np.flatnonzero(np.isnan(found).any(axis=1)).tolist():
        raise Unreachable(
            f"a start of the task {task.name} must be within reach of the {task.model.title}, got the flange at "
            f"{np.round(flanges[index, :3, 3], 3).tolist()} m",
            code=51,
            parameter="starts",
            hint="move the task's origin or its starts, or shorten its tool",
        )
    return found


def _contents(model: Any) -> tuple[dict[str, int], dict[str, int], dict[str, int]]:
    """What a scene has by names: numbers of mocap bodies, places in qpos of free bodies, and of other joints."""
    mocaps = {
        model.body(body).name.removeprefix(PREFIX): int(model.body_mocapid[body])
        for body in np.flatnonzero(model.body_mocapid >= 0)
    }
    free: dict[str, int] = {}
    others: dict[str, int] = {}
    for joint in range(7, model.njnt):
        place, body = int(model.jnt_qposadr[joint]), model.body(int(model.jnt_bodyid[joint]))
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
            free[body.name.removeprefix(PREFIX)] = place
        else:
            others[model.joint(joint).name.removeprefix(PREFIX)] = place
    return mocaps, free, others


class BatchContact(TaskBatch):
    """A task with contacts on many simulated arms.

    Args:
        task: the task.
        settings: of the simulation; of the randomisation latency and bandwidth, what else differs is the task's.
        reveal: whether observations end with `ContactTask.hidden`, for the value network of a training.

    Attributes:
        target: as the task draws it, shape (envs, k).
        pose: of the tips in the frame of the task, shape (envs, 6) [m, rad].
        wrench: on the tips, as the arms' torque sensors show it, likewise [N, Nm].
        true_wrench: without their errors.

    Raises:
        CommandRejected: a randomisation that these tasks have not, or a scene that cannot be read.
        HeptarmError: functions of the task that do not fit each other or the scene, see `check_task`.
    """

    task: ContactTask

    def __init__(
        self, task: ContactTask, settings: BatchSettings | None = None, *, reveal: bool = False
    ) -> None:
        chosen = settings or BatchSettings()
        randomisation, envs = chosen.randomisation, chosen.envs
        if randomisation != randomisation.of_servo():
            raise CommandRejected(
                f"only latency and bandwidth differ in the task {task.name}", parameter="randomisation"
            )
        model = build(task)
        mocaps, free, others = _contents(model)
        check_task(task, Contents(free, mocaps, others, has_gripper(model)))
        size = task.targets(np.random.default_rng(0), 1).shape[1]
        super().__init__(task, chosen, sizes=(size, task.command_size))
        self._batch = batch.Batch(model, nsim=envs, nthread=chosen.threads)
        bind, expand = self._batch.bind, self._batch.expand
        names = ("qpos", "qvel", "act", "ctrl", "qacc_warmstart", "mocap_pos", "mocap_quat")
        self._state = {name: bind(name) for name in names}
        self._length, self._contact = bind("actuator_length"), bind("qfrc_constraint")
        self._filter, self._friction = expand("actuator_dynprm"), expand("geom_friction")
        self._damping = expand("dof_damping")
        self._springs = (
            (expand("actuator_gainprm"), expand("actuator_biasprm")) if task.has_stiffness else None
        )
        self._stiff, self._damp = model.actuator_gainprm[-6:, 0].copy(), -model.actuator_biasprm[-6:, 2]
        self._steels = np.flatnonzero(model.geom_priority == 0)
        self._reach = float(model.site(PREFIX + task.site).pos[2])
        self._first = model.qpos0.copy()
        self._mocaps, self._free, self._others = mocaps, free, others
        self._gripper: Array | None = None
        if has_gripper(model):
            self._grip = int(model.actuator(PREFIX + GRIPPER).id)
            self._gripper = model.actuator_ctrlrange[self._grip][::-1].copy()  # opens at the upper end
            for joint in driven_joints(model):
                self._first[model.jnt_qposadr[joint]] = model.jnt_range[joint, 1]
        self._substeps = round(task.frequency / task.rate)
        self._reveal = reveal
        self._single = TORQUE_NOISE * task.model.tau_max
        self._stuck = FRICTION * task.model.tau_max / STICTION_SPEED
        self.pose, self.wrench, self.true_wrench = (np.zeros((envs, 6)) for _ in range(3))
        self._gain, self._zero = np.ones((envs, 7)), np.zeros((envs, 7))
        self._memory = np.zeros((envs, task.memory_size))
        self._frames = np.zeros((max(task.history) + 1, envs, task.frame_size))
        self.reset()

    @property
    def q(self) -> Array:
        """Measured positions, shape (envs, 7) [rad]."""
        return np.asarray(self._state["qpos"])[:, :7]

    def placed(self, index: int) -> tuple[Array, tuple[Array, Array]]:
        """Where everything of one arm is: MuJoCo's qpos, and what is moved by hand; see `ArmCamera.place_all`."""
        positions, places, turns = (
            np.asarray(self._state[name])[index] for name in ("qpos", "mocap_pos", "mocap_quat")
        )
        return positions, (places, turns)

    def bodies(self, which: Index | slice = ALL) -> dict[str, Array]:
        """Poses of the free bodies in the frame of the task, shape (n, 6) [m, rad] each."""
        rows = np.asarray(self._state["qpos"])[which]
        return {
            name: self._seen_from_origin(rows[:, place : place + 7]) for name, place in self._free.items()
        }

    def moment(self, which: Index | slice = ALL, *, is_true: bool = False) -> Moment:
        """What the task is asked about.

        Args:
            which: of the arms.
            is_true: with the wrench without errors of sensors.
        """
        rows = np.asarray(self._state["qpos"])[which]
        return Moment(
            pose=self.pose[which],
            command=self.command[which],
            wrench=(self.true_wrench if is_true else self.wrench)[which],
            target=self.target[which],
            bodies=self.bodies(which),
            joints={name: rows[:, place] for name, place in self._others.items()},
            memory=self._memory[which],
            time=self.age[which] / self.task.rate,
            friction=np.asarray(self._friction)[which, self._steels[0], 0],
            q=rows[:, :7],
        )

    def _place(self, which: Index, starts: Array) -> None:
        count, task, random, state = len(which), self.task, self._random, self._state
        self.pose[which], self._memory[which] = starts, 0.0
        self._filter[which, -6:, 0] = 1.0 / self.randomisation.draw_bandwidth(random, count)[:, None]
        self._friction[which[:, None], self._steels, 0] = random.uniform(*task.friction, (count, 1))
        self._damping[which, :7] = _ELBOW[1] + self._stuck * random.uniform(0.0, 1.0, (count, 1))
        self._gain[which] = random.uniform(1.0 - GAIN, 1.0 + GAIN, (count, 7))
        self._zero[which] = _DRIFT * self._single * random.standard_normal((count, 7))
        rows = np.tile(self._first, (count, 1))
        rows[:, :7] = _joints(task, starts, self._reach)
        for name, poses in task.bodies(self.target[which]).items():
            placed = self._in_base(poses)
            if name in self._mocaps:
                body = self._mocaps[name]
                state["mocap_pos"][which, body], state["mocap_quat"][which, body] = (
                    placed[:, :3],
                    placed[:, 3:],
                )
            else:
                rows[:, self._free[name] : self._free[name] + 7] = placed
        state["qpos"][which] = rows
        for name in ("qvel", "qacc_warmstart"):
            state[name][which] = 0.0
        state["act"][which] = starts
        self._control(which)
        self.wrench[which] = self.true_wrench[which] = 0.0
        self._frames[:, which] = task.frame(self.moment(which))

    def _control(self, which: Index | slice, command: Array | None = None) -> None:
        given = self.command[which] if command is None else command
        self._state["ctrl"][which, -6:] = given[:, :6]
        if self._springs is not None:
            (gain, bias), fraction = self._springs, self.task.fraction(given)[:, None]
            gain[which, -6:, 0] = fraction * self._stiff
            bias[which, -6:, 1] = -fraction * self._stiff
            bias[which, -6:, 2] = -np.sqrt(fraction) * self._damp
        if self._gripper is not None:
            closes = given[:, 6] > 0.0 if self.task.has_gripper else np.zeros(len(given), dtype=bool)
            self._state["ctrl"][which, self._grip] = np.where(closes, self._gripper[1], self._gripper[0])

    def observe(self, which: Index | slice = ALL) -> Array:
        """The current observations of all arms or some, shape (envs, n)."""
        seen = self.task.observe(self._frames[:, which])
        return np.concatenate([seen, self.task.hidden(self.moment(which))], axis=-1) if self._reveal else seen

    def teach(self) -> Array:
        """What one who knows everything would do, shape (envs, actions); as stiff as allowed."""
        taught = self.task.teach(self.moment())
        missing = self.task.action_size - taught.shape[1]
        return np.concatenate([taught, np.ones((self.envs, missing))], axis=1) if missing else taught

    def _advance(self, action: Array) -> Array:
        return self.task.advance(self.command, self.pose, action)

    def _simulate(self, command: Array) -> Array:
        self._control(ALL, command)
        torque = np.zeros((self.envs, 7))
        for _ in range(self._substeps):  # a stiff contact chatters: single steps show what no sensor feels
            self._batch.step()
            torque += np.asarray(self._contact)[:, :7] / self._substeps
        self.pose[:] = np.asarray(self._length)[:, -6:]
        self._sense(torque)
        self._memory[:] = self.task.remember(self.moment(is_true=True))
        self._frames[1:] = self._frames[:-1]
        self._frames[0] = self.task.frame(self.moment())
        force: Array = np.linalg.norm(self.true_wrench[:, :3], axis=1)
        return force

    def _sense(self, torque: Array) -> None:
        """Wrenches of the tips from external torques, shape (envs, 7) [Nm], with and without the errors of sensors."""
        noise = self._single / np.sqrt(_READINGS) * self._random.standard_normal(torque.shape)
        felt = self._gain * torque + self._zero + noise
        q = self.q
        jacobian = jacobian_batch(self.task.model, q)
        arm = forward_batch(self.task.model, q)[:, :3, 2] * self._reach
        # velocity of the tip: v + w x arm
        jacobian[:, :3] += np.cross(np.swapaxes(jacobian[:, 3:], 1, 2), arm[:, None]).swapaxes(1, 2)
        inverse = np.linalg.solve(jacobian @ jacobian.swapaxes(1, 2), jacobian)
        found = (inverse @ np.stack([torque, felt], axis=-1)).reshape(self.envs, 2, 3, 2)
        found = np.einsum("ij,nkjl->nkil", self.task.origin.rotation.T, found).reshape(self.envs, 6, 2)
        self.true_wrench[:], self.wrench[:] = found[..., 0], found[..., 1]

    def outcome(self) -> tuple[Array, Array]:
        """Where the tips are in the frame of the task, shape (envs, 3), and what is missing, (envs,) [m]."""
        return self.pose[:, :3].copy(), self.task.missing(self.moment(is_true=True))

    def _reward(self, distance: Array) -> Array:
        return self.task.reward(self.moment(is_true=True))

    def _changing(self) -> dict[str, Any]:
        own = (
            "pose",
            "wrench",
            "_frames",
            "_memory",
            "_gain",
            "_zero",
            "_filter",
            "_friction",
            "_damping",
        )
        return {**super()._changing(), **self._state, **{name: getattr(self, name) for name in own}}

    # ------------------------------------------------------------------------------ poses of many

    def _in_base(self, poses: Array) -> Array:
        """Poses in the frame of the task as position and quaternion w x y z in the base, shape (n, 6) to (n, 7)."""
        origin = self.task.origin
        turn = _product(np.roll(origin.quat, 1), _quaternions(poses[:, 3:]))
        return np.concatenate([origin.xyz + poses[:, :3] @ origin.rotation.T, turn], axis=1)

    def _seen_from_origin(self, placed: Array) -> Array:
        """The reverse of `_in_base`."""
        origin = self.task.origin
        turn = _product(np.roll(origin.inverse().quat, 1), placed[:, 3:])
        turn *= np.where(turn[:, :1] < 0.0, -1.0, 1.0)
        length = np.linalg.norm(turn[:, 1:], axis=1, keepdims=True)
        angle = 2.0 * np.arctan2(length, turn[:, :1])
        vector = turn[:, 1:] * (angle / np.maximum(length, 1e-12))
        return np.concatenate([(placed[:, :3] - origin.xyz) @ origin.rotation, vector], axis=1)


def _quaternions(vectors: Array) -> Array:
    """Of rotation vectors, shape (n, 3) [rad] to (n, 4), w x y z."""
    angle = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.concatenate([np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * vectors], axis=1)


def _product(left: Array, right: Array) -> Array:
    """Quaternion left times each of right, w x y z; shapes (4,) and (n, 4)."""
    w, v, others = left[0], left[1:], right[:, 1:]
    real = w * right[:, :1] - others @ v[:, None]
    return np.concatenate([real, w * others + right[:, :1] * v + np.cross(v, others)], axis=1)


def _turned(quaternions: Array) -> Array:
    """Rotation matrices of quaternions w x y z, shape (n, 4) to (n, 3, 3)."""
    w, x, y, z = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)
