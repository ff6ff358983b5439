"""Distances between the bodies of a compiled model at joint positions, and how far a movement of the joints moves them.

MuJoCo computes them. Bodies of the world do not meet each other here, so that what lies on a table costs nothing.
"""

from __future__ import annotations

from collections.abc import Collection
from math import inf

import mujoco
import numpy as np
import numpy.typing as npt

from heptarm.sim.plant.carried import plain
from heptarm.values.checks import Array
from heptarm.values.pose import Pose

#: Where a shape belongs: what it may meet depends on it.
_WORLD, _LINK, _TOOL, _HELD = range(4)
#: Which of them meet: the world does not meet itself, and a gripper touches what it holds.
_MEETS = np.ones((4, 4), bool)
_MEETS[_WORLD, _WORLD] = _MEETS[_TOOL, _HELD] = _MEETS[_HELD, _TOOL] = False
#: Bits of a contact type that can be moved apart: MuJoCo has 32 of them, for three domains.
_BITS = 10
_JOINTS = 7


class Distances:
    """A compiled model, with positions of its free bodies of its own.

    Args:
        model: MuJoCo's; its first seven joints are the arm's. It is copied.
        allowed: pairs of names of bodies that may touch.

    Attributes:
        names: of all bodies, without the world.
        arms: names of the other arms.
        free: names of the free bodies of the world.
        checks: postures computed so far.
    """

    def __init__(self, model: mujoco.MjModel, allowed: Collection[frozenset[str]]) -> None:
        self._model = model = model.__copy__()
        # several contacts of two shapes help a simulation; their distances may all be larger than the true one
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_MULTICCD)
        self._data = mujoco.MjData(model)
        self._open_gripper()
        names = [str(model.body(body).name) for body in range(model.nbody)]
        self._bodies = [plain(name) for name in names]
        self.names = tuple(self._bodies[1:])
        self._free_at = {
            self._bodies[int(model.jnt_bodyid[joint])]: int(model.jnt_qposadr[joint])
            for joint in range(model.njnt)
            if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        }
        self.free = tuple(self._free_at)
        self._arms_at = {
            name.removesuffix("/link_0"): int(model.jnt_qposadr[model.joint(name.replace("link_0", "A1")).id])
            for name in names
            if name.endswith("/link_0")
        }
        self.arms = tuple(self._arms_at)
        self.checks = 0
        root = int(model.body("link_0").id)  # the arm and what is mounted on it are of the tree of the base
        bodies = model.geom_bodyid.astype(int)
        is_own = model.body_rootid[bodies] == root
        is_tool = np.array([names[body] != self._bodies[body] for body in bodies.tolist()])
        roots = [int(model.body(f"{name}/link_0").id) for name in self.arms]
        self._is_of_arm = np.isin(model.body_rootid[bodies], roots)
        self._fixed_group = np.where(is_own, np.where(is_tool, _TOOL, _LINK), _WORLD)
        self._geom_names = [
            (self._bodies[body] if body else plain(str(model.geom(geom).name))) or "world"
            for geom, body in enumerate(bodies.tolist())
        ]
        known = sorted(set(self._geom_names))
        labels = np.array([known.index(name) for name in self._geom_names])
        may_touch = np.array([[frozenset((a, b)) in allowed for b in known] for a in known])
        self._forbidden = ~may_touch[np.ix_(labels, labels)] if may_touch.any() else None
        self._types = model.geom_contype.copy(), model.geom_conaffinity.copy()
        self._below = -1.0
        self._flange = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, "flange"))
        self._measure()
        self._held: dict[str, Pose] = {}
        self.hold({})

    def _open_gripper(self) -> None:
        """A gripper counts as open, which is where it needs most room."""
        from heptarm.sim.plant.gripper import driven_joints, has_gripper

        if has_gripper(self._model):
            for joint in driven_joints(self._model):
                self._data.qpos[self._model.jnt_qposadr[joint]] = self._model.jnt_range[joint, 1]

    # ------------------------------------------------------------------------------- free bodies

    def put(self, name: str, pose: Pose) -> None:
        """Put a free body somewhere, its pose in the base."""
        address = self._free_at[name]
        self._data.qpos[address : address + 3] = pose.xyz
        self._data.qpos[address + 3 : address + 7] = np.roll(pose.quat, 1)

    def place_of(self, name: str) -> Pose:
        """Where a free body was at the last check, in the base."""
        address = self._free_at[name]
        return Pose.of(
            self._data.qpos[address : address + 3], np.roll(self._data.qpos[address + 3 : address + 7], -1)
        )

    def set_arm(self, name: str, q: Array) -> None:
        """Put another arm into a posture, shape (7,) [rad]."""
        address = self._arms_at[name]
        self._data.qpos[address : address + _JOINTS] = q

    def posture_of(self, name: str) -> Array:
        """The posture of another arm, shape (7,) [rad]."""
        address = self._arms_at[name]
        return self._data.qpos[address : address + _JOINTS].copy()

    def hold(self, held: dict[str, Pose]) -> None:
        """Let the flange carry free bodies, and nothing else; their poses in the flange frame."""
        model = self._model
        self._held = dict(held)
        is_held = np.array([self._bodies[int(body)] in held for body in model.geom_bodyid], bool) & (
            self._fixed_group == _WORLD
        )
        self._group = np.where(is_held, _HELD, self._fixed_group)
        self._separate(self._group != _WORLD)
        self._levers = self._own_levers
        if held:
            found = [self._lever(self._in_flange(geom), geom) for geom in np.flatnonzero(is_held).tolist()]
            self._levers = np.vstack([self._own_levers, *found])

    def _in_flange(self, geom: int) -> Array:
        """Where a shape of a held body is in the base at the posture of the levers, shape (3,) [m]."""
        name = self._bodies[int(self._model.geom_bodyid[geom])]
        middle = Pose.of(self._model.geom_pos[geom])  # in its body, which has the free joint
        return (self._flange_pose @ self._held[name] @ middle).xyz

    def _separate(self, is_own: npt.NDArray[np.bool_]) -> None:
        """Move the bits of contact types so that shapes of the world meet none of the world."""
        model, (kind, meets) = self._model, self._types
        if max(kind.max(), meets.max()) >= 1 << _BITS:
            return  # too many kinds: all meet, and what does not count is left out later
        # own to world in the first domain, world to own in the second, own to own in the third
        model.geom_contype[:] = np.where(is_own, kind | kind << 2 * _BITS, kind << _BITS)
        model.geom_conaffinity[:] = np.where(is_own, meets << _BITS | meets << 2 * _BITS, meets)
        for of_body, of_geom in (
            (model.body_contype, model.geom_contype),
            (model.body_conaffinity, model.geom_conaffinity),
        ):
            of_body[:] = 0
            np.bitwise_or.at(of_body, model.geom_bodyid, of_geom)

    # ---------------------------------------------------------------------------------- distances

    def pairs(self, q: Array, below: float) -> tuple[npt.NDArray[np.int32], Array]:
        """Pairs of shapes nearer than a distance [m] at joint positions, shapes (n, 2) and (n,) [m].

        Pairs that may touch are among them, see `counts`.
        """
        model, data = self._model, self._data
        if below != self._below:  # of the narrow and of the broad phase
            model.geom_margin[:] = model.body_margin[:] = self._below = below
        data.qpos[:_JOINTS] = q
        mujoco.mj_kinematics(model, data)
        if self._held:
            self._carry()
        mujoco.mj_collision(model, data)
        self.checks += 1
        if not data.ncon:
            return _NO_PAIRS
        contact = data.contact
        geoms, distances = contact.geom, contact.dist
        group = self._group
        counts = _MEETS[group[geoms[:, 0]], group[geoms[:, 1]]] & (distances <= below)
        return geoms[counts], distances[counts]

    def _carry(self) -> None:
        """Move what is held with the flange."""
        at, quat = self._data.site_xpos[self._flange], np.zeros(4)
        mujoco.mju_mat2Quat(quat, self._data.site_xmat[self._flange])
        flange = Pose.of(at, np.roll(quat, -1))
        for name, pose in self._held.items():
            self.put(name, flange @ pose)
        mujoco.mj_kinematics(self._model, self._data)

    def counts(self, geoms: npt.NDArray[np.int32]) -> npt.NDArray[np.bool_]:
        """Which of n pairs of shapes may not touch, shape (n,)."""
        if self._forbidden is None:
            return np.ones(len(geoms), bool)
        counted: npt.NDArray[np.bool_] = self._forbidden[geoms[:, 0], geoms[:, 1]]
        return counted

    def nearest(self, q: Array, below: float) -> float:
        """Distance of the nearest two bodies that may not touch [m]; infinite: none are nearer than `below`."""
        geoms, distances = self.pairs(q, below)
        if len(distances) and self._forbidden is not None:
            distances = distances[self.counts(geoms)]
        return float(distances.min()) if len(distances) else inf

    def nearest_of_arms(self, q: Array, below: float) -> tuple[tuple[str, str], float] | None:
        """The nearest bodies of this arm and another one, their distance [m]; None: none are nearer than `below`."""
        geoms, distances = self.pairs(q, below)
        counts = self._is_of_arm[geoms].any(axis=1) & self.counts(geoms)
        if not counts.any():
            return None
        index = int(np.where(counts, distances, inf).argmin())
        return self.named(*geoms[index].tolist()), float(distances[index])

    def named(self, first: int, second: int) -> tuple[str, str]:
        """Names of the bodies of two shapes, that of the arm first; both of the arm: in the order of the alphabet."""
        groups = int(self._group[first]), int(self._group[second])
        names = self._geom_names[first], self._geom_names[second]
        is_arm = [group in (_LINK, _TOOL) for group in groups]
        if all(is_arm):
            return (min(names), max(names))
        is_first = is_arm[0] or (groups[0] == _HELD and not is_arm[1])
        return names if is_first else (names[1], names[0])

    # ----------------------------------------------------------------------------------- movement

    def moved(self, change: Array) -> float:
        """Bound on the path of any point of the arm, its tool and what it holds [m].

        Args:
            change: of the joints, along a straight line, shape (7,) [rad].

        A point at a distance r from the axis of a joint moves by r for each radian. The largest r of each shape at
        any posture is computed when the model is made: along the chain of the joints, whose lengths do not change.
        """
        return float((self._levers @ np.abs(change)).max())

    def _measure(self) -> None:
        """Axes of the joints, and the levers of the shapes of arm and tool."""
        model, data = self._model, self._data
        data.qpos[:_JOINTS] = 0.0
        mujoco.mj_kinematics(model, data)
        self._anchors, self._axes = data.xanchor[:_JOINTS].copy(), data.xaxis[:_JOINTS].copy()
        self._flange_pose = Pose.of(data.site_xpos[self._flange], _quaternion(data.site_xmat[self._flange]))
        rows = []
        for geom in np.flatnonzero(self._fixed_group != _WORLD).tolist():
            joint = self._joint_of(int(model.geom_bodyid[geom]))
            if joint >= 0:
                rows.append(self._lever(data.geom_xpos[geom], geom, joint))
        self._own_levers = np.array(rows)

    def _joint_of(self, body: int) -> int:
        """The last joint of the arm that moves a body; -1: none does."""
        model = self._model
        while body:
            joint = int(model.body_jntadr[body])
            if 0 <= joint < _JOINTS:
                return joint
            body = int(model.body_parentid[body])
        return -1

    def _lever(self, middle: Array, geom: int, last: int = _JOINTS - 1) -> Array:
        """Largest distance of a shape from the axis of each joint at any posture, shape (7,) [m].

        Args:
            middle: of the shape in the base, at the posture at which the axes are known, shape (3,) [m].
            geom: the shape.
            last: the last joint that moves it.
        """
        radius = float(self._model.geom_rbound[geom])
        result = np.zeros(_JOINTS)
        result[last] = self._off_axis(middle, last) + radius
        reach = float(np.linalg.norm(middle - self._anchors[last])) + radius
        for joint in range(last - 1, -1, -1):
            following = self._anchors[joint + 1]
            result[joint] = self._off_axis(following, joint) + reach
            reach += float(np.linalg.norm(following - self._anchors[joint]))
        return result

    def _off_axis(self, point: Array, joint: int) -> float:
        return float(np.linalg.norm(np.cross(point - self._anchors[joint], self._axes[joint])))


_NO_PAIRS = (np.zeros((0, 2), np.int32), np.zeros(0))


def _quaternion(matrix: Array) -> Array:
    """Quaternion x y z w of MuJoCo's rotation matrix, shape (4,)."""
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, matrix)
    return np.roll(quat, -1)
