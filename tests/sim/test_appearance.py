"""How the arm is drawn: own meshes fit the kinematics, a folder's replace them, the physics knows of neither."""

from __future__ import annotations

import importlib.util
import re
import struct
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.sim.picture import ArmPicture, Viewpoint
from heptarm.sim.plant.appearance import DRAWN_GROUP, HIDDEN_GROUP, LINKS, ArmMeshes
from heptarm.sim.plant.scene import Scene
from heptarm.sim.plant.world import MODELS, compiled
from heptarm.values.checks import Array
from heptarm.values.robot import ROBOTS

ROOT = Path(__file__).parents[2]
#: What the arm touches nothing in, and where it lies on its floor.
POSTURES = ((0.3, 0.6, 0.1, -1.3, 0.4, 1.0, 0.2), (0.0, 1.9, 0.0, -1.2, 0.0, 0.3, 0.0))


def shapes(model: mujoco.MjModel, group: int) -> list[int]:
    return [geom for geom in np.flatnonzero(model.geom_group == group).tolist() if model.geom_bodyid[geom]]


def points(model: mujoco.MjModel, link: str) -> Array:
    """Vertices of the meshes of a link in its frame, shape (n, 3)."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = []
    body = model.body(link).id
    for geom in shapes(model, DRAWN_GROUP):
        if model.geom_bodyid[geom] == body:
            mesh = model.geom_dataid[geom]
            vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
            world = vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
            found.append((world - data.xpos[body]) @ data.xmat[body].reshape(3, 3))
    return np.concatenate(found)


def write_stl(path: Path, scale: float = 1.0) -> None:
    """A tetrahedron 0.1 m large as a binary STL."""
    corners = 0.1 * scale * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    faces = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    triangles = b"".join(
        struct.pack("<12fH", 0, 0, 0, *corners[list(face)].ravel().tolist(), 0) for face in faces
    )
    path.write_bytes(b"\0" * 80 + struct.pack("<I", len(faces)) + triangles)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for link in LINKS:
        write_stl(tmp_path / f"{link}.stl")
    return tmp_path


def test_the_meshes_are_written_by_their_script() -> None:
    spec = importlib.util.spec_from_file_location("arm_meshes", ROOT / "scripts" / "arm_meshes.py")
    assert spec is not None and spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    sys.modules["arm_meshes"] = script
    spec.loader.exec_module(script)
    written = script.files()
    for name, text in written.items():
        there = (ROOT / name).read_text()
        ours, theirs = (re.findall(r"(?<![^\s>\"])-?\d*\.?\d+(?![^\s<\"])", one) for one in (text, there))
        assert len(ours) == len(theirs), f"run scripts/arm_meshes.py: {name} is old"
        # the last digit may differ from one processor to another
        numbers = np.array(ours, float), np.array(theirs, float)
        np.testing.assert_allclose(*numbers, atol=0.0101 if name.endswith(".dae") else 2e-4, err_msg=name)
    there = {str(path.relative_to(ROOT)) for path in (MODELS / "meshes").rglob("*.obj")}
    assert there == {name for name in written if name.endswith(".obj")}
    assert sum(len(text) for name, text in written.items() if name.endswith(".obj")) < 800_000


@pytest.mark.parametrize("name", ["iiwa7", "iiwa14"])
def test_the_physics_of_a_model_is_that_without_its_meshes(name: str) -> None:
    drawn, bare = compiled(name, meshes=ArmMeshes()), compiled(name)
    assert bare.nmesh == 0 and drawn.nmesh > 16
    for field in ("body_mass", "body_inertia", "body_ipos", "body_iquat", "dof_damping", "dof_armature"):
        np.testing.assert_array_equal(getattr(drawn, field), getattr(bare, field))
    for geom in shapes(drawn, DRAWN_GROUP):
        assert drawn.geom_contype[geom] == drawn.geom_conaffinity[geom] == 0
    meeting, all_there = (
        shapes(drawn, HIDDEN_GROUP),
        [geom for geom in range(bare.ngeom) if bare.geom_bodyid[geom]],
    )
    for field in (
        "geom_size",
        "geom_pos",
        "geom_quat",
        "geom_type",
        "geom_bodyid",
        "geom_solref",
        "geom_friction",
    ):
        np.testing.assert_array_equal(getattr(drawn, field)[meeting], getattr(bare, field)[all_there])
    for posture in POSTURES:
        ends = []
        for model in (drawn, bare):
            data = mujoco.MjData(model)
            data.qpos[:7], data.qvel[:7] = posture, 0.3
            touched = 0
            for _ in range(400):
                mujoco.mj_step(model, data)
                touched = max(touched, data.ncon)
            ends.append((data.qpos.copy(), data.qvel.copy(), touched))
        np.testing.assert_array_equal(ends[0][0], ends[1][0])
        np.testing.assert_array_equal(ends[0][1], ends[1][1])
        assert ends[0][2] == ends[1][2]
    assert ends[0][2] > 0, "the arm should have touched something"


@pytest.mark.parametrize("name", ["iiwa7", "iiwa14"])
def test_the_links_meet_at_their_joints(name: str) -> None:
    """Each link's mesh begins and ends where the kinematics has its joints."""
    model, links = compiled(name, meshes=ArmMeshes()), ROBOTS[name].links
    assert points(model, "link_0")[:, 2].min() == pytest.approx(0.0, abs=1e-3)
    for index in range(8):
        ours = points(model, f"link_{index}")
        assert np.abs(ours[:, 0]).max() < 0.14 and np.linalg.norm(ours[:, :2], axis=1).max() < 0.2
        height = links.origin[index][2] if index < 7 else links.flange[2]
        reach = 0.08 if index in (1, 3, 5) else 0.02  # the drum around a horizontal axis, or the seam
        assert height - 0.03 < ours[:, 2].max() < height + reach
    # the seams of A1, A3, A5 are circles about the joint, so they fit at every angle
    for lower, upper, height in (
        (0, 1, links.origin[0][2]),
        (2, 3, links.origin[2][2]),
        (4, 5, links.origin[4][2]),
    ):
        rims = []
        for link, at, centre in (
            (lower, height, links.origin[lower][1] if lower else 0.0),
            (upper, 0.0, 0.0),
        ):
            ours = points(model, f"link_{link}") - [0, centre, 0]
            rim = ours[np.abs(ours[:, 2] - at) < 0.0015]
            rims.append(np.linalg.norm(rim[:, :2], axis=1).max())
        assert rims[0] == pytest.approx(rims[1], abs=0.008)
    flange = points(model, "link_7")
    top = flange[flange[:, 2] > links.flange[2] - 1e-4]
    assert flange[:, 2].max() == pytest.approx(links.flange[2], abs=1e-4)
    assert np.linalg.norm(top[:, :2], axis=1).max() == pytest.approx(0.0305, abs=1e-3)


def test_a_scene_is_drawn_around_the_meshes() -> None:
    model = compiled("med7", scene=Scene.of("bins"), meshes=ArmMeshes())
    assert model.body("scene/part_1").id > 0 and len(shapes(model, DRAWN_GROUP)) > 16


def test_meshes_of_a_folder_replace_ours(folder: Path) -> None:
    (folder / "link_3.stl").unlink()
    (folder / "readme.txt").write_text("no mesh")
    for colour in ("silver", "orange"):
        (folder / f"Link_3.{colour}.obj").write_text(
            "v 0 0 0\nv .2 0 0\nv 0 .2 0\nv 0 0 .2\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
        )
    model = compiled("iiwa7", meshes=ArmMeshes.of(str(folder)))
    assert model.nmesh == 9 and len(shapes(model, DRAWN_GROUP)) == 9
    np.testing.assert_allclose(np.ptp(points(model, "link_2"), axis=0), 0.1, atol=1e-6)
    np.testing.assert_allclose(np.ptp(points(model, "link_3"), axis=0), 0.2, atol=1e-6)
    bare = compiled("iiwa7")
    np.testing.assert_array_equal(model.body_mass, bare.body_mass)
    np.testing.assert_array_equal(model.body_inertia, bare.body_inertia)


def test_meshes_that_cannot_be_used_are_refused(folder: Path) -> None:
    with pytest.raises(ValueError, match=r"must be a folder with link_0\.stl to link_7\.stl, got '/nowhere'"):
        ArmMeshes.of("/nowhere")
    (folder / "link_5.obj").write_text("v 0 0 0\n")
    with pytest.raises(
        ValueError, match=r"one file for a link and a colour, got link_5\.obj and link_5\.stl"
    ):
        ArmMeshes.of(str(folder))
    (folder / "link_5.stl").unlink()
    with pytest.raises(ValueError, match=r"link_5\.obj must be a binary STL or an OBJ file"):
        ArmMeshes.of(str(folder))
    (folder / "link_5.obj").unlink()
    with pytest.raises(ValueError, match=r"such as link_5\.stl or link_5\.obj; .* has none for link_5"):
        ArmMeshes.of(str(folder))
    write_stl(folder / "link_5.stl", scale=1000.0)
    with pytest.raises(
        ValueError, match=r"link_5\.stl must be a link in metres, .* got 141 m; scale it, by 0\.001"
    ):
        ArmMeshes.of(str(folder))
    # a new name: MuJoCo remembers what it has read within a second
    (folder / "link_0.dark.stl").write_text("solid ascii\nendsolid ascii\n")
    with pytest.raises(ValueError, match=r"link_0\.dark\.stl must be a binary STL"):
        ArmMeshes.of(str(folder))


def test_a_picture_shows_the_arm_where_the_kinematics_has_it() -> None:
    viewpoint = Viewpoint(target=(0.2, 0.0, 0.5))
    picture = ArmPicture("iiwa14", viewpoint, (240, 200))
    for q in POSTURES[:1] + ((-0.8, 0.4, 0.0, -1.6, 0.0, 1.0, 0.0),):
        image = picture.draw(np.array(q))
        assert image.shape == (200, 240, 3)
        arm = np.asarray((image < 245).any(axis=2))
        assert 0.02 < arm.mean() < 0.3
        pose = forward(ROBOTS["iiwa14"], np.array(q))
        inside = pose[:3, 3] - 0.03 * pose[:3, 2]  # in the middle of link 7
        right, up, depth = viewpoint.seen(inside[None])[0]
        assert arm[round(100 - 200 * up), round(120 + 200 * right)] and depth > 1.0
        orange = (image[..., 0] > 150) & (image[..., 2] < 80)
        assert orange.mean() > 0.0005, "no rings"
