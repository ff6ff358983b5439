"""The same problems by mplib, in an environment of its own and in the same run: it has OMPL's search and FCL's checks.

    .venv/bin/python -m venv build/mplib && build/mplib/bin/python -m pip install mplib==0.2.1

Tesseract is left out. Its wheel installs (tesseract-robotics 0.5.1), and its environment loads the same URDF with the
checks of Bullet. But Python gets the settings of its OMPL planner (`OMPLRealVectorPlanProfile.solver_config`) as a
pointer without members: neither time nor step can be set, so that a search cannot be held to the same second.

mplib gets the shapes of heptarm's model one by one, and a capsule as a cylinder with two spheres. The two have
to agree which postures are free; how many do is measured, too.
"""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import heptarm as ha
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from bench.planning.problems import ROBOT, SCENES, length, problems
from heptarm import planning
from heptarm.sim.distances import Distances
from heptarm.values.checks import Array

ROOT = Path(__file__).parents[2]
PYTHON = ROOT / "build" / "mplib" / "bin" / "python"
#: Every so many problems of a scene, of those for which both get this long [s].
EVERY, LONGEST = 4, 1.0
#: Postures at which both check for contacts.
POSTURES = 2000
#: At least so many times as fast as mplib.
FASTER = 2.0
_GEOM = mujoco.mjtGeom


@dataclass(frozen=True)
class _Part:
    """A shape: its kind, its sizes as URDF has them [m], its rotation and its place."""

    kind: str
    size: tuple[float, ...]
    turn: Array
    at: Array

    def seen_from(self, turn: Array, at: Array) -> _Part:
        """The shape in another frame."""
        return _Part(self.kind, self.size, turn.T @ self.turn, turn.T @ (self.at - at))


def _parts(model: Any, data: Any, geom: int) -> list[_Part]:
    """The shapes of which URDF makes one of MuJoCo's, in the world."""
    turn, at = data.geom_xmat[geom].reshape(3, 3).copy(), data.geom_xpos[geom].copy()
    a, b, c = model.geom_size[geom].tolist()
    make: dict[int, Callable[[], list[_Part]]] = {
        int(_GEOM.mjGEOM_BOX): lambda: [_Part("box", (2 * a, 2 * b, 2 * c), turn, at)],
        int(_GEOM.mjGEOM_CYLINDER): lambda: [_Part("cylinder", (a, 2 * b), turn, at)],
        int(_GEOM.mjGEOM_SPHERE): lambda: [_Part("sphere", (a,), turn, at)],
        int(_GEOM.mjGEOM_CAPSULE): lambda: [
            _Part("cylinder", (a, 2 * b), turn, at),
            *(_Part("sphere", (a,), turn, at + side * b * turn[:, 2]) for side in (1, -1)),
        ],
        int(_GEOM.mjGEOM_PLANE): lambda: [_Part("box", (6.0, 6.0, 0.1), turn, at - 0.05 * turn[:, 2])],
    }
    return make[int(model.geom_type[geom])]()


class _World:
    """Arm and bodies as a URDF, an SRDF and a list of shapes."""

    def __init__(self, world: ha.CollisionModel) -> None:
        distances: Distances = world._distances
        self._robot, model, data = world.robot, distances._model, distances._data
        data.qpos[:7] = 0.0
        mujoco.mj_kinematics(model, data)
        self.links = [f"link_{number}" for number in range(8)]
        bodies = [model.body(name).id for name in self.links]
        self._frames = [(data.xmat[body].reshape(3, 3).copy(), data.xpos[body].copy()) for body in bodies]
        self._axes = model.jnt_axis[:7].copy()
        self._own: list[list[_Part]] = [[] for _ in self.links]
        self.bodies: list[_Part] = []
        owners: dict[int, int] = {}
        for geom in range(model.ngeom):
            if not (model.geom_contype[geom] or model.geom_conaffinity[geom]):
                continue
            body = int(model.geom_bodyid[geom])
            while body and body not in bodies:
                body = int(model.body_parentid[body])
            parts = _parts(model, data, geom)
            if body and distances._group[geom]:
                owners[geom] = bodies.index(body)
                self._own[owners[geom]] += [one.seen_from(*self._frames[owners[geom]]) for one in parts]
            else:
                self.bodies += parts
        pairs = [
            (owners[a], owners[b])
            for a, b in distances.pairs(np.zeros(7), 100.0)[0].tolist()
            if a in owners and b in owners
        ]
        self._met = set(map(frozenset, pairs))

    def write(self, folder: Path) -> None:
        """Write `arm.urdf` and `arm.srdf`."""
        text = "".join(self._link(index) + self._joint(index) for index in range(len(self.links)))
        (folder / "arm.urdf").write_text(f'<robot name="arm">{text}</robot>', encoding="utf-8")
        apart = "".join(
            f'<disable_collisions link1="{self.links[a]}" link2="{self.links[b]}" reason="Never"/>'
            for a, b in itertools.combinations(range(len(self.links)), 2)
            if frozenset((a, b)) not in self._met
        )
        (folder / "arm.srdf").write_text(f'<robot name="arm">{apart}</robot>', encoding="utf-8")

    def _link(self, index: int) -> str:
        names = {"box": ("size",), "cylinder": ("radius", "length"), "sphere": ("radius",)}
        shapes = ""
        for one in self._own[index]:
            size = [_text(one.size)] if one.kind == "box" else map(str, one.size)
            given = " ".join(f'{name}="{value}"' for name, value in zip(names[one.kind], size))
            shapes += f"<collision>{_origin(one.turn, one.at)}<geometry><{one.kind} {given}/></geometry></collision>"
        inertia = '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>'
        return (
            f'<link name="{self.links[index]}"><inertial><mass value="1"/>{inertia}</inertial>{shapes}</link>'
        )

    def _joint(self, index: int) -> str:
        if not index:
            return ""
        (turn, at), (own_turn, own_at), robot = self._frames[index - 1], self._frames[index], self._robot
        low, high, fast = robot.q_min[index - 1], robot.q_max[index - 1], robot.dq_max[index - 1]
        return (
            f'<joint name="A{index}" type="revolute"><parent link="{self.links[index - 1]}"/>'
            f'<child link="{self.links[index]}"/>{_origin(turn.T @ own_turn, turn.T @ (own_at - at))}'
            f'<axis xyz="{_text(self._axes[index - 1])}"/>'
            f'<limit lower="{low}" upper="{high}" velocity="{fast}" effort="100"/></joint>'
        )


def _origin(turn: Array, at: Array) -> str:
    angles = (
        np.arctan2(turn[2, 1], turn[2, 2]),
        np.arctan2(-turn[2, 0], np.hypot(turn[2, 1], turn[2, 2])),
        np.arctan2(turn[1, 0], turn[0, 0]),
    )
    return f'<origin xyz="{_text(at)}" rpy="{_text(angles)}"/>'


def _text(values: Any) -> str:
    return " ".join(str(float(value)) for value in values)


def _quaternion(turn: Array) -> list[float]:
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, np.ascontiguousarray(turn).ravel())
    return [float(one) for one in found]


@benchmark("rivals")
def rivals() -> Iterator[Figure]:
    """Problems of each scene by mplib and by heptarm: solved within a second of processor time, and how fast."""
    if not PYTHON.exists():
        print("no build/mplib here (bench/planning/rivals.py has the command): left out", file=sys.stderr)
        return
    for scene in SCENES:
        if scene == "two-arms":
            continue  # its other arm is no list of shapes
        world, posed = ha.CollisionModel(ROBOT, scene=scene), problems(scene)[::EVERY]
        robot = world.robot
        q = np.random.default_rng(5).uniform(robot.q_min, robot.q_max, (POSTURES, 7))
        with Noise() as noise, tempfile.TemporaryDirectory() as folder:
            begin = time.process_time()
            gaps = world.distances(q, below=0.0)
            check = (time.process_time() - begin) / len(q) * 1e6
            given = _World(world)
            given.write(Path(folder))
            task = {
                "bodies": [
                    (one.kind, one.size, one.at.tolist(), _quaternion(one.turn)) for one in given.bodies
                ],
                "speed": robot.dq_max.tolist(),
                "acceleration": robot.ddq_max.tolist(),
                "postures": q.tolist(),
                "problems": [(one.start.tolist(), one.goal.tolist()) for one in posed],
                "longest": LONGEST,
            }
            (Path(folder) / "task.json").write_text(json.dumps(task), encoding="utf-8")
            words = [str(PYTHON), str(Path(__file__).with_name("mplib_peer.py")), folder]
            done = subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True, timeout=1800)
            theirs = json.loads(done.stdout.splitlines()[-1])
            own = []
            for one in posed:
                begin = time.process_time()
                try:
                    path = planning.find_path(world, start=one.start, goal=one.goal, timeout=4.0 * LONGEST)
                except ha.NoPath:
                    own.append((np.inf, np.nan))
                else:
                    own.append((time.process_time() - begin, length(path.curve)))
        ours, rival = np.array(own), np.array(theirs["found"], float)
        ours[ours[:, 0] > LONGEST, 0] = rival[~(rival[:, 0] <= LONGEST), 0] = LONGEST
        solved = [int((one[:, 0] < LONGEST).sum()) for one in (ours, rival)]
        agree = float((np.array(theirs["touch"], bool) == (gaps <= 0.0)).mean())
        detail = {
            "problems": len(posed),
            "mplib": theirs["version"],
            "agree": agree,
            "noise": round(noise.others, 2),
        }
        yield Figure(
            f"mplib_solved_{scene}", solved[0], "count", limit=solved[1], at_least=True,
            detail=detail | {"mplib_solved": solved[1], "longest_s": LONGEST},
        )  # fmt: skip
        middles = [float(np.median(one[:, 0]) * 1e3) for one in (rival, ours)]
        both = (ours[:, 0] < LONGEST) & (rival[:, 0] < LONGEST)
        lengths = float(np.median(ours[both, 1] / rival[both, 1])) if both.any() else None
        yield Figure(
            f"mplib_time_{scene}", middles[0], "ms", reference=middles[1], limit=FASTER, at_least=True,
            detail={"mplib_ms": round(middles[0], 1), "own_ms": round(middles[1], 1), "length_by_mplib": lengths},
        )  # fmt: skip
        yield Figure(
            f"fcl_check_{scene}", theirs["check_us"], "us", reference=check,
            detail={"own_us": round(check, 1), "postures": len(q)},
        )  # fmt: skip
