"""`heptarm sim --scene`, and the view that draws the scene and its moving bodies."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm.sim.collision import CollisionModel
from heptarm.sim.plant.appearance import HIDDEN_GROUP, ArmMeshes
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.scene import Scene
from heptarm.sim.plant.shared_state import PositionsFile
from heptarm.sim.plant.world import compiled
from tests.cli.running import run, sim

pytest.importorskip("trimesh")


@dataclass
class Drawing:
    """A shape or frame, as viser has it."""

    vertices: Any = None
    color: tuple[int, ...] = ()
    position: Any = None
    wxyz: Any = None
    is_removed: bool = False

    def remove(self) -> None:
        self.is_removed = True


@dataclass
class Canvas:
    """A viser server that draws nothing: its scene is itself."""

    shapes: dict[str, Drawing] = field(default_factory=dict)
    labels: dict[str, Drawing] = field(default_factory=dict)

    @property
    def scene(self) -> Canvas:
        return self

    def add_grid(self, name: str, **_: object) -> None: ...

    def add_frame(self, name: str, **_: object) -> Drawing:
        return Drawing()

    def add_label(self, name: str, text: str, **given: Any) -> Drawing:
        self.labels[text] = Drawing(**given)
        return self.labels[text]

    def add_mesh_simple(self, name: str, vertices: Any, faces: Any, **given: Any) -> Drawing:
        assert faces.max() < len(vertices)
        self.shapes[name] = Drawing(vertices, **given)
        return self.shapes[name]


def test_every_shape_of_arm_and_scene_is_drawn_and_moves_with_its_body(tmp_path: Path) -> None:
    from heptarm.panel.drawing import DrawnWorld

    plant = Plant(q=(0.0, 0.4, 0.0, -1.5, 0.0, 1.1, 0.0), scene=Scene.of("table"))
    file, canvas = tmp_path / "positions", Canvas()
    world = DrawnWorld(canvas, "iiwa14", Scene.of("table"), file)
    model = compiled(
        "iiwa14", (), Scene.of("table"), ArmMeshes()
    )  # as the simulator's, with what is only drawn
    drawn = [one for one in range(model.ngeom) if model.geom_group[one] < HIDDEN_GROUP]
    assert len(canvas.shapes) == len(drawn) - 1  # all but the floor
    index = model.geom("scene/cube").id
    cube = canvas.shapes[f"/world/{index}"]
    assert np.ptp(cube.vertices, axis=0) == pytest.approx((0.04, 0.04, 0.04))
    assert cube.color[0] > 2 * cube.color[1]  # red
    q = np.array((0.0, 0.4, 0.0, -1.5, 0.0, 1.1, 0.0))
    world.show(q)
    assert cube.position == pytest.approx((0.55, 0.0, 0.22), abs=1e-3)  # as in the file of the scene
    assert model.nq == plant.model.nq
    plant.data.qpos[model.jnt_qposadr[model.body("scene/cube").jntadr[0]] + 2] = 0.5
    PositionsFile(file, model.nq).write(plant.data.qpos)
    world.show(q)
    assert cube.position == pytest.approx((0.55, 0.0, 0.5), abs=1e-3)
    pad = canvas.shapes[f"/world/{model.geom('scene/left_pad').id}"]
    assert abs(float(pad.position[1])) > 0.04  # the simulator's gripper is open


def test_bodies_of_the_scene_have_their_names_and_places_in_a_path(tmp_path: Path) -> None:
    from heptarm.panel.drawing import DrawnWorld

    plant, canvas, file = Plant(scene=Scene.of("table")), Canvas(), tmp_path / "positions"
    world = DrawnWorld(canvas, "iiwa14", Scene.of("table"), file)
    planned = CollisionModel("iiwa14", scene="table")
    world.name_bodies(visible=True)
    assert set(canvas.labels) == {"table", "cube", "block", "can"}, "those of the arm have none"
    address = plant.model.jnt_qposadr[plant.model.body("scene/cube").jntadr[0]]
    plant.data.qpos[address + 2] = 0.5
    PositionsFile(file, plant.model.nq).write(plant.data.qpos)
    world.show(np.zeros(7))
    assert canvas.labels["cube"].position == pytest.approx((0.55, 0.0, 0.5), abs=1e-3)
    assert set(world.places) == {"cube", "block", "can"}
    for name, pose in world.places.items():
        planned.place(name, pose)  # of the same names
    assert world.places["cube"].xyz == pytest.approx((0.55, 0.0, 0.5), abs=1e-3)
    world.name_bodies(visible=False)
    assert all(one.is_removed for one in canvas.labels.values())


def test_shapes_of_the_attached_tool_are_drawn_on_the_flange_until_it_is_off() -> None:
    from heptarm.panel.drawing import DrawnWorld

    at = ha.Pose.xyz_abc(0.0, 0.02, 0.1, 0.0, 0.0, 0.5)
    kinds = (
        ha.shapes.box(0.1, 0.2, 0.3, at=at),
        ha.shapes.cylinder(0.05, 0.2),
        ha.shapes.sphere(0.05),
        ha.shapes.capsule(0.05, 0.2),
    )
    canvas = Canvas()
    world, shapes = DrawnWorld(canvas, "iiwa14", root="/arm1"), tuple((one, one.pose) for one in kinds)
    world.carry(shapes)
    drawn = [canvas.shapes[f"/arm1/flange/carried/{number}"] for number in range(4)]
    sizes = [np.ptp(one.vertices, axis=0).tolist() for one in drawn]
    expected = [(0.1, 0.2, 0.3), (0.1, 0.1, 0.2), (0.1, 0.1, 0.1), (0.1, 0.1, 0.3)]
    assert np.allclose(sizes, expected, atol=2e-3)
    assert drawn[0].position == pytest.approx(at.xyz)
    assert np.roll(drawn[0].wxyz, -1) == pytest.approx(at.quat)
    world.carry(shapes)
    assert not any(one.is_removed for one in drawn)  # nothing has changed
    world.carry(())
    assert all(one.is_removed for one in drawn)
    gripper = Canvas()
    DrawnWorld(gripper, "iiwa14", Scene.of("table")).carry(shapes)
    assert not any("carried" in name for name in gripper.shapes)  # the scene has its own tool on the flange


def test_shapes_of_every_kind_are_drawn(tmp_path: Path) -> None:
    from heptarm.panel.drawing import DrawnWorld

    file = tmp_path / "shapes.xml"
    file.write_text(
        """<mujoco><asset><mesh name="wedge" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/></asset><worldbody>
        <geom type="sphere" size="0.1"/><geom type="ellipsoid" size="0.1 0.2 0.3"/><geom type="capsule" size="0.1 0.2"/>
        <geom type="cylinder" size="0.1 0.2"/><geom type="mesh" mesh="wedge"/><geom type="plane" size="1 1 1"/>
        <geom type="box" size="0.1 0.2 0.3" group="3"/></worldbody></mujoco>"""
    )
    bare, canvas = Canvas(), Canvas()
    DrawnWorld(bare, "iiwa14")
    DrawnWorld(canvas, "iiwa14", Scene.of(str(file))).show(np.zeros(7))
    assert len(canvas.shapes) == len(bare.shapes) + 5
    mesh = [one for one in canvas.shapes.values() if len(one.vertices) == 4]
    assert len(mesh) == 1 and np.ptp(mesh[0].vertices, axis=0).max() > 1.0  # in its principal axes
    sizes = {tuple(np.ptp(one.vertices, axis=0).round(2).tolist()) for one in canvas.shapes.values()}
    assert {(0.2, 0.2, 0.2), (0.2, 0.4, 0.6), (0.2, 0.2, 0.6), (0.2, 0.2, 0.4)} <= sizes


def test_a_virtual_cabinet_with_a_scene_serves_its_clients() -> None:
    with sim("--scene", "table") as ready, ha.connect(ready["target"], watchdog=5.0, timeout=30.0) as arm:
        arm.io["InputX3Pin3"]
        arm.io.wait("InputX3Pin3", timeout=30.0)  # the gripper is open


@pytest.mark.parametrize(
    ("options", "because"),
    [
        (
            ("--scene", "nowhere"),
            "one of bins, cage, narrow-slot, peg-in-hole, shelf, table, table-and-post, two-arms",
        ),
        (("--scene", "table", "--fri", "1.15"), "cannot be used with heptarm sim fri"),
    ],
)
def test_a_scene_that_cannot_be_is_refused(options: tuple[str, ...], because: str) -> None:
    done = run("sim", "--port", "0", *options)
    assert done.returncode != 0 and because in done.stderr
