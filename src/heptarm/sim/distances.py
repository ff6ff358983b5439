"""Distances between the bodies of a compiled model at joint positions, and how far a movement of the joints moves them.

`native/collision.c` finds the near pairs, by boxes around the shapes, and asks MuJoCo for their distances. Bodies of
the world do not meet each other here, so that what lies on a table costs nothing.
"""

from __future__ import annotations

import ctypes
from collections.abc import Collection
from functools import cache

import mujoco
import numpy as np
import numpy.typing as npt

from heptarm._library import Unavailable, library
from heptarm.sim.plant.carried import GEOMS, plain
from heptarm.sim.plant.native import mujoco_library
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from heptarm.values.shape import Shape, ShapeKind

#: Where a shape belongs: what it may meet depends on it.
_WORLD, _LINK, _TOOL, _HELD = range(4)
#: Which of them meet: the world does not meet itself, and a gripper touches what it holds.
_MEETS = np.ones((4, 4), bool)
_MEETS[_WORLD, _WORLD] = _MEETS[_TOOL, _HELD] = _MEETS[_HELD, _TOOL] = False
#: Shapes of a body that are tried one by one, not by a box around them.
_FEW = 8
_JOINTS = 7
#: Kinds of shapes by MuJoCo's.
_KINDS: dict[int, ShapeKind] = {int(geom): kind for kind, geom in GEOMS.items()}
_POINTER, _WORD, _REAL = ctypes.c_void_p, ctypes.c_int64, ctypes.c_double
#: MuJoCo's functions that are called in C.
_CALLED = {"mj_kinematics": "kinematics", "mj_geomDistance": "distance"}


class _Checks(ctypes.Structure):
    """`struct checks` of native/collision.c."""

    _fields_ = [
        *[
            (name, _POINTER)
            for name in ["model", "data", "kinematics", "distance", "positions", "places", "turns"]
        ],
        *[(name, _POINTER) for name in ["flange_place", "flange_turn", "hulls", "centres"]],
        ("shells", _WORD),
        ("entries", _POINTER),
        *[("count", _WORD), ("all", _WORD)],
        *[("levers", _POINTER), ("moves", _POINTER)],
        ("levels", _WORD),
        *[("rooms", _POINTER), ("grips", _POINTER)],
        ("held", _WORD),
    ]


#: `struct hull` and `struct grip`.
_HULL = np.dtype(
    [
        *[("half", np.float64, 3), ("middle", np.float64, 3), ("radius", np.float64), ("reach", np.float64)],
        *[("frame", np.int64), ("is_plane", np.int64)],
    ]
)
_GRIP = np.dtype([("address", np.int64), ("place", np.float64, 3), ("quat", np.float64, 4)])


@cache
def _functions() -> ctypes.CDLL:
    """The functions of native/collision.c.

    Raises:
        Unavailable: the compiled part of heptarm is missing, or does not fit.
    """
    made = library()
    made.hc_nearest.restype = None
    made.hc_nearest.argtypes = (_POINTER, _WORD, _POINTER, _REAL, _POINTER)
    made.hc_first.restype = _WORD
    made.hc_first.argtypes = (_POINTER, _WORD, _POINTER, _REAL, _REAL, _REAL, _POINTER, _POINTER)
    made.hc_is_free.argtypes = (_POINTER, _POINTER, _REAL, _REAL, _REAL, _POINTER)
    made.hc_pairs.restype = _WORD
    made.hc_pairs.argtypes = (_POINTER, _POINTER, _REAL, _POINTER, _POINTER)
    made.hc_size.restype = _WORD
    if made.hc_size() != ctypes.sizeof(_Checks):
        raise Unavailable(f"`struct checks` must have {ctypes.sizeof(_Checks)} bytes, got {made.hc_size()}")
    return made


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
            if name.endswith("/link_0") and plain(name) == name
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
        self._boxes = _Boxes(model, _hulls(model))
        self._flange = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, "flange"))
        self._measure()
        # a search asks for many lines: nothing is made for each of them
        self._line, self._line_checks = np.empty((2, _JOINTS)), _WORD(0)
        self._line_address, self._checks_pointer = self._line.ctypes.data, ctypes.byref(self._line_checks)
        self._held: dict[str, Pose] = {}
        self._group = np.zeros(0, int)
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
        return np.array(self._data.qpos[address : address + _JOINTS])

    def shapes_of(self, name: str) -> tuple[Shape, ...]:
        """Shapes of a body in its frame; those that are no box, cylinder, sphere or capsule are left out."""
        model = self._model
        found = []
        for geom in np.flatnonzero([self._bodies[int(body)] == name for body in model.geom_bodyid]).tolist():
            kind = _KINDS.get(int(model.geom_type[geom]))
            if kind is not None:
                at = Pose.of(model.geom_pos[geom], np.roll(model.geom_quat[geom], -1))
                found.append(Shape(kind, _size(kind, model.geom_size[geom]), at))
        return tuple(found)

    def hold(self, held: dict[str, Pose]) -> None:
        """Let the flange carry free bodies, and nothing else; their poses in the flange frame."""
        model = self._model
        self._held = dict(held)
        is_held = np.array([self._bodies[int(body)] in held for body in model.geom_bodyid], bool) & (
            self._fixed_group == _WORLD
        )
        group = np.where(is_held, _HELD, self._fixed_group)
        if not np.array_equal(group, self._group):
            self._group = group
            self._meet()
        self._levers, self._last = self._own_levers.copy(), self._own_last.copy()
        for geom in np.flatnonzero(is_held).tolist():
            self._levers[geom] = self._lever(self._in_flange(geom), geom)
            self._last[geom] = _JOINTS - 1
        self._prepare()

    def _meet(self) -> None:
        """Which pairs of shapes meet: first those that may not touch, then the others."""
        pairs = _candidates(self._model, self._group != _WORLD)
        pairs = pairs[_MEETS[self._group[pairs[:, 0]], self._group[pairs[:, 1]]]]
        counts = self._counts(pairs)
        self._met = list[tuple[int, npt.NDArray[np.int32]]]()
        parts = [self._boxes.entries(some, self._met) for some in (pairs[counts], pairs[~counts])]
        self._entries, self._count, self._hulls = np.concatenate(parts), len(parts[0]), self._boxes.hulls
        self._found = np.empty((len(pairs), 2), np.int32), np.empty(len(pairs))

    def _prepare(self) -> None:
        """What the functions in C need to know: the shapes that meet, and what the flange carries."""
        model, data, memory = self._model, self._data, _Checks()
        grips = np.array(
            [(self._free_at[name], pose.xyz, pose.quat) for name, pose in self._held.items()], _GRIP
        )
        place, turn = data.site_xpos[self._flange], data.site_xmat[self._flange]
        memory.model, memory.data = model._address, data._address
        shown = mujoco_library(_CALLED)
        for name, member in _CALLED.items():
            setattr(memory, member, ctypes.cast(getattr(shown, name), _POINTER).value)
        memory.positions, memory.places = data.qpos.ctypes.data, data.geom_xpos.ctypes.data
        memory.turns = data.geom_xmat.ctypes.data
        memory.flange_place, memory.flange_turn = place.ctypes.data, turn.ctypes.data
        memory.hulls, memory.entries = self._hulls.ctypes.data, self._entries.ctypes.data
        self._centres, self._rooms = np.empty((len(self._hulls), 3)), np.empty(len(self._entries))
        memory.centres, memory.rooms = self._centres.ctypes.data, self._rooms.ctypes.data
        memory.shells = len(self._hulls)
        memory.count, memory.all = self._count, len(self._entries)
        levers = np.array([self._relative(*met) for met in self._met]).reshape(-1, _JOINTS)
        self._pair_levers, self._moves = levers, np.empty(len(levers))
        memory.levers, memory.moves, memory.levels = levers.ctypes.data, self._moves.ctypes.data, len(levers)
        memory.grips, memory.held = grips.ctypes.data, len(grips)
        self._grips = grips
        self._memory, self._memory_pointer = memory, ctypes.byref(memory)

    def _in_flange(self, geom: int) -> Array:
        """Where a shape of a held body is in the base at the posture of the levers, shape (3,) [m]."""
        name = self._bodies[int(self._model.geom_bodyid[geom])]
        middle = Pose.of(self._model.geom_pos[geom])  # in its body, which has the free joint
        return (self._flange_pose @ self._held[name] @ middle).xyz

    def _counts(self, geoms: npt.NDArray[np.int32]) -> npt.NDArray[np.bool_]:
        """Which of n pairs of shapes may not touch, shape (n,)."""
        if self._forbidden is None:
            return np.ones(len(geoms), bool)
        counted: npt.NDArray[np.bool_] = self._forbidden[geoms[:, 0], geoms[:, 1]]
        return counted

    # ---------------------------------------------------------------------------------- distances

    def pairs(self, q: Array, below: float) -> tuple[npt.NDArray[np.int32], Array]:
        """Pairs of shapes nearer than a distance at joint positions, also those that may touch: (n, 2) and (n,) [m]."""
        given, (shapes, distances) = np.ascontiguousarray(q, float), self._found
        count = _functions().hc_pairs(
            *(ctypes.byref(self._memory), given.ctypes.data, below),
            *(shapes.ctypes.data, distances.ctypes.data),
        )
        self.checks += 1
        return shapes[:count].copy(), distances[:count].copy()

    def nearest(self, q: Array, below: float) -> Array:
        """Distance of the nearest two bodies that may not touch, in n postures, shape (n,) [m].

        Args:
            q: joint positions, shape (n, 7) [rad].
            below: largest distance that is computed [m]; where none are nearer it is infinite.
        """
        given, result = np.ascontiguousarray(q, float), np.empty(len(q))
        _functions().hc_nearest(
            ctypes.byref(self._memory), len(given), given.ctypes.data, below, result.ctypes.data
        )
        self.checks += len(given)
        return result

    def first(
        self, path: Array, *, margin: float, least: float, far: float
    ) -> tuple[int, float, Array] | None:
        """The first place on a joint path at which two bodies that may not touch are nearer than a margin.

        Args:
            path: joint positions, straight from one to the next, shape (n, 7) [rad].
            margin: nearer bodies touch [m].
            least: what two bodies may move beyond their distance before they are looked at again [m].
            far: exact distances are computed below this only [m].

        Returns:
            The piece between two of its points, the fraction of that, and the joint positions there; None: there is
            no such place.
        """
        given, place, checks = np.ascontiguousarray(path, float), np.empty(1 + _JOINTS), _WORD(0)
        piece = _functions().hc_first(
            *(ctypes.byref(self._memory), len(given), given.ctypes.data, margin, least, far),
            *(place.ctypes.data, ctypes.byref(checks)),
        )
        self.checks += checks.value
        return None if piece < 0 else (piece, float(place[0]), place[1:])

    def is_free(self, first: Array, last: Array, *, margin: float, least: float, far: float) -> bool | None:
        """Whether `first` finds nothing on a straight joint path between two rows, shape (7,) [rad]; faster if it does.

        None: bodies touch at its beginning.
        """
        self._line[0], self._line[1] = first, last
        self._line_checks.value = 0
        free: int = _functions().hc_is_free(
            self._memory_pointer, self._line_address, margin, least, far, self._checks_pointer
        )
        self.checks += self._line_checks.value
        return None if free < 0 else free > 0

    def nearest_of_arms(self, q: Array, below: float) -> tuple[tuple[str, str], float] | None:
        """The nearest bodies of this arm and another one, their distance [m]; None: none are nearer than `below`."""
        geoms, distances = self.pairs(q, below)
        counts = self._is_of_arm[geoms].any(axis=1) & self._counts(geoms)
        if not counts.any():
            return None
        index = int(np.where(counts, distances, np.inf).argmin())
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
        self._own_levers, self._own_last = np.zeros((model.ngeom, _JOINTS)), np.full(model.ngeom, -1)
        for geom in np.flatnonzero(self._fixed_group != _WORLD).tolist():
            self._own_last[geom] = joint = self._joint_of(int(model.geom_bodyid[geom]))
            if joint >= 0:
                self._own_levers[geom] = self._lever(data.geom_xpos[geom], geom, joint)

    def _relative(self, geom: int, others: npt.NDArray[np.int32]) -> Array:
        """How far a shape and those of another body may move to each other, shape (7,) [m/rad].

        Only the joints between them count, by the levers of the one that they move.
        """
        low, high = sorted((int(self._last[geom]), int(self._last[others[0]])))
        rows = self._levers[[geom]] if self._last[geom] == high else self._levers[others]
        joints = np.arange(_JOINTS)
        return np.where((low < joints) & (joints <= high), rows.max(axis=0), 0.0)

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


def _quaternion(matrix: Array) -> Array:
    """Quaternion x y z w of MuJoCo's rotation matrix, shape (4,)."""
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, matrix)
    return np.roll(quat, -1)


def _size(kind: ShapeKind, size: Array) -> Array:
    """The size of a shape, shape (3,) [m], from MuJoCo's half edges, or radius and half length."""
    radius, half = float(size[0]), float(size[1])
    if kind == "box":
        return 2.0 * size
    return np.array([radius, 0.0 if kind == "sphere" else 2.0 * half, 0.0])


def _hulls(model: mujoco.MjModel) -> npt.NDArray[np.void]:
    """`struct hull` of each shape: a box with rounded edges around it.

    Raises:
        ValueError: a kind of shape whose distances MuJoCo does not compute reliably.
    """
    kinds = mujoco.mjtGeom
    result = np.zeros(model.ngeom, _HULL)
    result["half"], result["middle"] = model.geom_aabb[:, 3:], model.geom_aabb[:, :3]
    result["frame"] = np.arange(model.ngeom)
    for geom, kind in enumerate(model.geom_type.tolist()):
        radius, length = model.geom_size[geom, :2].tolist()
        if kind in (kinds.mjGEOM_SPHERE, kinds.mjGEOM_CAPSULE):
            half = 0.0 if kind == kinds.mjGEOM_SPHERE else length
            result[geom]["half"], result[geom]["middle"], result[geom]["radius"] = (
                (0.0, 0.0, half),
                0.0,
                radius,
            )
        elif kind == kinds.mjGEOM_PLANE:
            result[geom]["is_plane"] = True
        elif kind not in (kinds.mjGEOM_CYLINDER, kinds.mjGEOM_BOX, kinds.mjGEOM_MESH, kinds.mjGEOM_ELLIPSOID):
            name = plain(model.geom(geom).name or model.body(model.geom_bodyid[geom]).name) or "of the world"
            raise ValueError(
                f"a scene must have no height field and no signed distance field to compute distances, got geom {name};"
                " add heptarm.shapes.height_map instead, or boxes and meshes"
            )
    corners = np.linalg.norm(result["half"], axis=1) + result["radius"]
    bounds = model.geom_rbound + np.linalg.norm(result["middle"], axis=1)  # MuJoCo's are around the origin
    result["reach"] = np.minimum(corners, bounds)
    return result


def _candidates(model: mujoco.MjModel, is_own: npt.NDArray[np.bool_]) -> npt.NDArray[np.int32]:
    """Pairs of shapes that MuJoCo lets meet by the rules of the model, the first one of the arm's, shape (n, 2)."""
    first, second = (
        side.ravel() for side in np.meshgrid(np.flatnonzero(is_own), np.arange(model.ngeom), indexing="ij")
    )
    once = ~is_own[second] | (first < second)
    first, second = first[once], second[once]
    kind, meets, body = model.geom_contype, model.geom_conaffinity, model.geom_bodyid.astype(int)
    does = ((kind[first] & meets[second]) | (kind[second] & meets[first])) != 0
    marks = np.stack([body[first] << 16 | body[second], body[second] << 16 | body[first]])
    does &= ~np.isin(marks, model.exclude_signature).any(axis=0)
    welded, above = model.body_weldid, model.body_weldid[model.body_parentid]
    one, other = welded[body[first]], welded[body[second]]
    does &= one != other
    if not model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT):
        does &= ~((one != 0) & (other != 0) & ((one == above[other]) | (other == above[one])))
    listed = np.sort(np.column_stack([model.pair_geom1, model.pair_geom2]), axis=1)
    ordered = np.sort(np.column_stack([first, second]), axis=1)
    for pair in listed:
        does |= (ordered == pair).all(axis=1)
    return np.asarray(np.column_stack([first, second])[does], np.int32)


class _Boxes:
    """Pairs of shapes in the order in which they are tried: a box around many shapes of a body before each of them.

    Args:
        model: MuJoCo's.
        hulls: of its shapes.
    """

    def __init__(self, model: mujoco.MjModel, hulls: npt.NDArray[np.void]) -> None:
        self._bodies, self._own, self._around = model.geom_bodyid, hulls, list[npt.NDArray[np.void]]()
        self._trees: dict[bytes, npt.NDArray[np.int32]] = {}
        self._turns = np.empty((model.ngeom, 3, 3))
        for turn, quat in zip(self._turns, model.geom_quat):
            mujoco.mju_quat2Mat(turn.reshape(-1), quat)
        self._places = model.geom_pos  # in the body, as the turns
        self._middles = self._places + np.einsum("nij,nj->ni", self._turns, hulls["middle"])

    @property
    def hulls(self) -> npt.NDArray[np.void]:
        """Hulls of the shapes, then those around several."""
        return np.concatenate([self._own, *self._around])

    def entries(
        self, pairs: npt.NDArray[np.int32], met: list[tuple[int, npt.NDArray[np.int32]]]
    ) -> npt.NDArray[np.int32]:
        """`struct entry` of pairs of shapes, shape (n, 4).

        Args:
            pairs: ordered by the first shape, shape (n, 2).
            met: where it appends each shape with those of a body that it may meet: they have levers in common.
        """
        found = [np.zeros((0, 4), np.int32)]
        for firsts in np.split(pairs, np.flatnonzero(np.diff(pairs[:, 0])) + 1):
            # a plane has an entry of its own, as if it were a body
            others = firsts[:, 1]
            bodies = np.where(self._own["is_plane"][others] != 0, -1 - others, self._bodies[others])
            for body in set(bodies.tolist()):
                shapes = others[bodies == body]
                tree, numbers = self._tree(shapes), np.array([firsts[0, 0], len(met)])
                found += [np.insert(tree, [0, 2], numbers, axis=1)]
                met.append((int(firsts[0, 0]), shapes))
        return np.concatenate(found, dtype=np.int32)

    def _tree(self, geoms: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
        """Entries of shapes of one body, without the first shapes, shape (n, 2)."""
        key = geoms.tobytes()
        if key not in self._trees:
            made = np.column_stack([geoms, np.ones(len(geoms), np.int32)])
            if len(geoms) > _FEW:
                middles = self._middles[geoms]
                order = geoms[middles[:, np.ptp(middles, axis=0).argmax()].argsort(kind="stable")]
                half = len(order) // 2
                parts = self._tree(order[:half]), self._tree(order[half:])
                top = (self._hull(geoms), 1 + sum(map(len, parts)))
                made = np.concatenate([[top], *parts], dtype=np.int32)
            self._trees[key] = made
        return self._trees[key]

    def _hull(self, geoms: npt.NDArray[np.int32]) -> int:
        """Make a hull around shapes of one body; returns its index."""
        middles = self._middles[geoms]
        inner = 0.5 * (middles.min(axis=0) + middles.max(axis=0))
        frame = int(geoms[((self._places[geoms] - inner) ** 2).sum(axis=1).argmin()])
        turn = self._turns[frame]
        centres = (middles - self._places[frame]) @ turn
        halves = np.abs(turn.T @ self._turns[geoms]) @ self._own["half"][geoms][:, :, None]
        extents = halves[:, :, 0] + self._own["radius"][geoms][:, None]
        low, high = (centres - extents).min(axis=0), (centres + extents).max(axis=0)
        made = np.zeros(1, _HULL)
        made["half"], made["middle"] = 0.5 * (high - low), 0.5 * (low + high)
        made["reach"], made["frame"] = np.linalg.norm(made["half"]), frame
        self._around.append(made)
        return len(self._own) + len(self._around) - 1
