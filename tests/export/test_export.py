"""What other programs read has the frames, masses and limits of the virtual cabinet, to 1e-9."""

from __future__ import annotations

import json
import re
import subprocess
import venv
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import heptarm as ha
from heptarm.model.dynamics import inverse_dynamics
from heptarm.model.kinematics import forward
from heptarm.sim.plant.scene import Scene
from heptarm.sim.plant.world import compiled
from heptarm.values.robot import robot
from tests.calibration.hidden_arm import HIDDEN

TOOL = ha.Tool(
    "gripper",
    mass=1.3,
    com=(0.01, 0.02, 0.07),
    inertia=(0.002, 0.003, 0.0015, 1e-4, -2e-4, 3e-4),
    tcp=ha.Pose.xyz_abc(0.01, 0.0, 0.15, 0.3, 0.5, -0.2),
    frames={"camera": ha.Pose.xyz_abc(0.0, 0.06, 0.03, 0.0, np.pi / 2, 0.4)},
    shapes=[ha.shapes.capsule(0.03, 0.1, at=ha.Pose.of((0, 0, 0.08))), ha.shapes.box(0.1, 0.02, 0.02)],
)
MODEL = "iiwa14+touch"
NEAR = 1e-9


@pytest.fixture(scope="module", params=["urdf", "sdf", "xml", "usda"])
def exported(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model with media flange, tool and scene, in each format."""
    path = tmp_path_factory.mktemp("export") / f"cell.{request.param}"
    assert ha.export_model(path, robot=MODEL, tool=TOOL, scene="two-arms") == path
    return path


def postures() -> list[np.ndarray[Any, np.dtype[np.float64]]]:
    """Joint positions within the limits, shape (7,) [rad] each."""
    random, arm = np.random.default_rng(5), robot(MODEL)
    return [np.zeros(7), *random.uniform(arm.q_min, arm.q_max, (5, 7))]


def expected(q: np.ndarray[Any, np.dtype[np.float64]]) -> dict[str, np.ndarray[Any, np.dtype[np.float64]]]:
    """Poses of flange and tool frames in the base, by heptarm's own kinematics, shape (4, 4)."""
    flange = forward(robot(MODEL), q)
    return {"flange": flange, **{f"gripper_{name}": flange @ pose.matrix for name, pose in TOOL.frames}}


def test_read_back(exported: Path) -> None:
    """Each format by the reader that this environment has."""
    {".urdf": by_pinocchio, ".sdf": by_its_elements, ".xml": by_mujoco, ".usda": by_its_text}[
        exported.suffix
    ](exported)


def by_pinocchio(path: Path) -> None:
    """Frames, limits, mass, and the torques of a motion."""
    pin = pytest.importorskip("pinocchio")
    model = pin.buildModelFromUrdf(str(path))
    arm, random = robot(MODEL), np.random.default_rng(6)
    first = model.idx_qs[model.getJointId("A1")]
    arm_q, arm_v = slice(first, first + 7), slice(*(model.idx_vs[model.getJointId("A1")] + np.array([0, 7])))
    assert model.lowerPositionLimit[arm_q] == pytest.approx(arm.q_min, abs=NEAR)
    assert model.velocityLimit[arm_v] == pytest.approx(arm.dq_max, abs=NEAR)
    assert model.effortLimit[arm_v] == pytest.approx(arm.tau_max, abs=NEAR)
    data = model.createData()
    for q in postures():
        all_q = pin.neutral(model)
        all_q[arm_q] = q
        pin.framesForwardKinematics(model, data, all_q)
        for name, pose in expected(q).items():
            found = data.oMf[model.getFrameId(name)].homogeneous
            assert np.abs(found - pose).max() < NEAR, name
        dq, ddq = random.uniform(-1, 1, (2, 7))
        speeds, accelerations = np.zeros(model.nv), np.zeros(model.nv)
        speeds[arm_v], accelerations[arm_v] = dq, ddq
        torques = pin.rnea(model, data, all_q, speeds, accelerations)[arm_v]
        assert torques == pytest.approx(inverse_dynamics(arm, q, dq, ddq, load=TOOL.body), abs=1e-8)


def by_mujoco(path: Path) -> None:
    """Frames, and what MuJoCo itself has compiled from the model of the virtual cabinet."""
    model = mujoco.MjModel.from_xml_path(str(path))
    own = compiled(MODEL, scene=Scene.of("two-arms"))
    data, same = mujoco.MjData(model), mujoco.MjData(own)
    assert model.nq == own.nq
    for q in postures():
        data.qpos[:7] = same.qpos[:7] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_kinematics(own, same)
        for name, pose in expected(q).items():
            found = data.body(name)
            assert np.abs(found.xpos - pose[:3, 3]).max() < NEAR, name
            assert np.abs(found.xmat.reshape(3, 3) - pose[:3, :3]).max() < NEAR, name
        for index in range(1, own.nbody):
            name = own.body(index).name.replace("/", "_")
            assert np.abs(data.body(name).xipos - same.xipos[index]).max() < NEAR, name
            assert model.body(name).mass == pytest.approx(own.body_mass[index], abs=NEAR)
            assert np.sort(model.body(name).inertia) == pytest.approx(
                np.sort(own.body_inertia[index]), abs=NEAR
            )
    assert model.body("gripper").mass == pytest.approx(TOOL.mass, abs=NEAR)


def by_its_elements(path: Path) -> None:
    """SDF has no reader here: its elements are put together as its specification defines."""
    model = ET.parse(path).getroot().find("model")
    assert model is not None
    joints = {one.findtext("child"): one for one in model.findall("joint")}

    def placed(name: str, q: np.ndarray[Any, np.dtype[np.float64]]) -> np.ndarray[Any, np.dtype[np.float64]]:
        one = next(
            each for each in (*model.findall("link"), *model.findall("frame")) if each.get("name") == name
        )
        pose = one.find("pose")
        assert pose is not None and pose.text is not None
        x, y, z, roll, pitch, yaw = map(float, pose.text.split())
        own = ha.Pose.xyz_abc(x, y, z, yaw, pitch, roll).matrix
        parent = one.get("attached_to") or pose.get("relative_to")
        joint = joints.get(name)
        if joint is not None and joint.get("type") == "revolute":
            axis = np.array([float(part) for part in (joint.findtext("axis/xyz") or "").split()])
            angle = axis * q[int((joint.get("name") or "")[1:]) - 1]
            own = own @ _turn(angle)
        return own if not parent else placed(parent, q) @ own

    for q in postures():
        for name, pose in expected(q).items():
            assert np.abs(placed(name, q) - pose).max() < NEAR, name
    masses = {one.get("name"): float(one.findtext("inertial/mass") or 0) for one in model.findall("link")}
    assert masses["gripper"] == TOOL.mass and masses["link_3"] == robot(MODEL).links.mass[2]


def _turn(rotvec: np.ndarray[Any, np.dtype[np.float64]]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """A rotation about an axis (Rodrigues), shape (4, 4)."""
    angle = float(np.linalg.norm(rotvec))
    x, y, z = rotvec / angle if angle else rotvec
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return matrix


def by_its_text(path: Path) -> None:
    """USD has no reader here either (see the long test): poses at joint position 0, from the text."""
    text = path.read_text()
    number = r"[-+.e\d]+"
    pattern = r'def Xform "(\w+)"[^{]*\{\s*double3 xformOp:translate = \(([^)]*)\)\s*quatd xformOp:orient = \(([^)]*)\)'
    places = {
        name: ha.Pose.of(
            [float(one) for one in xyz.split(",")], np.roll([float(one) for one in quat.split(",")], -1)
        )
        for name, xyz, quat in re.findall(pattern, text)
    }
    found = places["link_7"] @ places["flange"]
    assert np.abs(found.matrix - expected(np.zeros(7))["flange"]).max() < NEAR
    assert (
        np.abs(
            (places["gripper"] @ places["gripper_tcp"]).matrix - expected(np.zeros(7))["gripper_tcp"]
        ).max()
        < NEAR
    )
    assert (
        len(re.findall(rf"float physics:mass = {number}", text)) == 8 + 1 + 3
    )  # links, tool, bodies of the scene


@pytest.mark.long
def test_usd_core_and_yourdfpy_read_it(tmp_path: Path) -> None:
    """By the readers for which these formats are written, in an environment of their own."""
    usd = ha.export_model(tmp_path / "cell.usda", robot=MODEL, tool=TOOL, scene="two-arms")
    urdf = ha.export_model(tmp_path / "cell.urdf", robot=MODEL, tool=TOOL, scene="two-arms")
    venv.create(tmp_path / "venv", with_pip=True)
    python = str(tmp_path / "venv/bin/python")
    subprocess.run([python, "-m", "pip", "install", "-q", "usd-core", "yourdfpy"], check=True)
    q = postures()[1]
    reader = Path(__file__).with_name("read_back.py")
    command = [python, str(reader), str(usd), str(urdf), ",".join(map(repr, q.tolist()))]
    read = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    for name, pose in expected(q).items():
        assert np.abs(np.array(read["urdf"][name]) - pose).max() < NEAR, name
    for name, pose in expected(np.zeros(7)).items():
        assert np.abs(np.array(read["usd"]["poses"][name]) - pose).max() < NEAR, name
    # single precision, by the schema
    assert read["usd"]["masses"]["gripper"] == pytest.approx(TOOL.mass, rel=1e-6)
    arm = compiled(MODEL)
    assert list(read["usd"]["resistance"]["joint_A3"]) == pytest.approx(
        [np.radians(arm.dof_damping[2]), arm.dof_frictionloss[2], arm.dof_armature[2]], rel=1e-6
    )
    limits = np.radians([read["usd"]["joints"][f"joint_A{index}"] for index in range(1, 8)])
    assert limits[:, 1] == pytest.approx(robot(MODEL).q_max, rel=1e-6)


@pytest.mark.parametrize("model", ["iiwa7", "med14"])
def test_a_scene_with_a_gripper(model: str, tmp_path: Path) -> None:
    """Its fingers slide, its parts are free, and its tool is behind the flange; every format has them."""
    for suffix in ("urdf", "sdf", "mjcf", "usda"):
        path = ha.export_model(tmp_path / f"{model}.{suffix}", robot=model, scene="table")
        assert "finger" in path.read_text()
    again = mujoco.MjModel.from_xml_path(str(tmp_path / f"{model}.mjcf"))
    own = compiled(model, scene=Scene.of("table"))
    assert again.nq == own.nq and again.body_mass.sum() == pytest.approx(own.body_mass.sum(), abs=1e-8)
    assert (tmp_path / f"{model}-meshes").is_dir()


def test_friction_and_rotors_that_were_identified(tmp_path: Path) -> None:
    """What the file of a fitted arm knows is in the joints; another robot's is refused."""
    for suffix in ("xml", "urdf", "sdf", "usda"):
        ha.export_model(tmp_path / f"arm.{suffix}", robot=MODEL, fitted=HIDDEN)
    found = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    dofs = [int(found.joint(f"A{axis + 1}").dofadr[0]) for axis in range(7)]
    assert found.dof_frictionloss[dofs] == pytest.approx(HIDDEN["coulomb"].value, abs=NEAR)
    assert found.dof_damping[dofs] == pytest.approx(HIDDEN["viscous"].value, abs=NEAR)
    assert found.dof_armature[dofs] == pytest.approx(HIDDEN["rotor"].value, abs=NEAR)
    for joint in ET.parse(tmp_path / "arm.urdf").findall("joint[dynamics]"):
        axis, dynamics = int(str(joint.get("name"))[1:]) - 1, joint.find("dynamics")
        assert dynamics is not None
        assert float(dynamics.get("friction", "nan")) == pytest.approx(
            HIDDEN["coulomb"].value[axis], abs=NEAR
        )
    frictions = [float(one.text or "nan") for one in ET.parse(tmp_path / "arm.sdf").iter("friction")]
    assert frictions == pytest.approx(HIDDEN["coulomb"].value.tolist(), abs=NEAR)
    text = (tmp_path / "arm.usda").read_text()
    for attribute, name, per in (
        ("drive:angular:physics:damping", "viscous", np.pi / 180.0),
        ("physxJoint:jointFriction", "coulomb", 1.0),
        ("physxJoint:armature", "rotor", 1.0),
    ):
        values = [float(one) for one in re.findall(rf"float {attribute} = ([-+.e\d]+)", text)]
        assert values == pytest.approx((per * HIDDEN[name].value).tolist(), abs=NEAR), attribute
    with pytest.raises(ha.CommandRejected, match="fitted must be an arm of the iiwa7, got one of the iiwa14"):
        ha.export_model(tmp_path / "other.urdf", robot="iiwa7", fitted=HIDDEN)


def test_what_cannot_be_exported(tmp_path: Path) -> None:
    """Another ending, another robot, a scene that other formats cannot express, a place that is taken."""
    scene = '<mujoco><worldbody><body name="odd">{}<geom size="0.1" mass="1"/></body></worldbody></mujoco>'
    two = tmp_path / "two.xml"
    two.write_text(scene.format('<joint axis="1 0 0"/><joint axis="0 1 0"/>'))
    ball = tmp_path / "ball.xml"
    ball.write_text(scene.format('<joint type="ball"/>'))
    for words, text in (
        ({"path": "arm.step"}, ".urdf"),
        ({"robot": "iiwa99"}, "iiwa99"),
        ({"scene": "kitchen"}, "kitchen"),
        ({"scene": str(two)}, "2 joints"),
        ({"scene": str(ball)}, "ball"),
        ({"scene": "table", "tool": TOOL}, "has a tool on the flange"),
        ({"tool": ha.Tool("link_7")}, "link_7"),
    ):
        given: dict[str, Any] = {"path": "arm.urdf", **words}
        given["path"] = tmp_path / given["path"]
        with pytest.raises(ha.CommandRejected, match=re.escape(text)):
            ha.export_model(**given)
        assert not given["path"].exists()
    path = ha.export_model(tmp_path / "arm.urdf")
    with pytest.raises(ha.CommandRejected, match="overwrite"):
        ha.export_model(path)
