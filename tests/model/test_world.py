"""A world that changes: bodies that are added, placed, held and removed; checks of many postures, and between them."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import model, shapes
from heptarm.values.checks import Array
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import robot

IIWA = robot("iiwa14")
HOME = deg(0, 30, 0, -90, 0, 60, 0)
DOWN = (0.0, 1.0, 0.0, 0.0)

#: A cube of 0.1 m around the origin as a text of its corners and quadrangles.
CUBE = "\n".join(
    [f"v {x} {y} {z}" for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (-0.05, 0.05)]
    + ["f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]
)


def flange_at(x: float, y: float, z: float) -> Array:
    """Joint positions with the flange there, upside down."""
    return model.solve(IIWA, Pose.of((x, y, z), DOWN), near=HOME.tolist())


def distance_to(world: ha.CollisionModel, name: str, q: Array) -> float:
    return min(one.distance for one in world.clearances(q, below=0.5) if one.second == name)


@pytest.fixture
def world() -> ha.CollisionModel:
    return ha.CollisionModel("iiwa14")


@pytest.fixture
def cube_file(tmp_path: Path) -> Path:
    file = tmp_path / "cube.obj"
    file.write_text(CUBE)
    return file


def test_bodies_of_every_shape_are_where_they_were_added(world: ha.CollisionModel, cube_file: Path) -> None:
    q, under = flange_at(0.5, 0.0, 0.5), Pose.at(0.5, 0.0, 0.3)
    for shape, top in (
        (shapes.box(0.2, 0.2, 0.1), 0.05),
        (shapes.sphere(0.06), 0.06),
        (shapes.cylinder(0.1, 0.08), 0.04),
        (shapes.capsule(0.03, 0.06), 0.06),
        (shapes.mesh(cube_file), 0.05),
        (shapes.mesh(cube_file, scale=0.5, at=Pose.at(0, 0, 0.01)), 0.035),
        (shapes.height_map([[0.0, 0.02], [0.03, 0.07]], cell=0.08), 0.07),
        ([shapes.box(0.2, 0.2, 0.1), shapes.sphere(0.06)], 0.06),
    ):
        world.add("crate", shape, at=under)
        assert "crate" in world.bodies
        assert distance_to(world, "crate", q) == pytest.approx(0.2 - top, abs=2e-3), shape
        world.remove("crate")
    assert "crate" not in world.bodies
    assert not any(one.second == "crate" for one in world.clearances(q, below=0.5))


def test_a_mesh_of_parts_leaves_the_room_between_them_free(tmp_path: Path, world: ha.CollisionModel) -> None:
    corners = [line for line in CUBE.splitlines() if line.startswith("v")]
    shifted = [f"v {float(x) + 0.4} {y} {z}" for _, x, y, z in (line.split() for line in corners)]
    faces = [line for line in CUBE.splitlines() if line.startswith("f")]
    others = ["f " + " ".join(str(int(k) + 8) for k in line.split()[1:]) for line in faces]
    file = tmp_path / "two.obj"
    file.write_text("\n".join(corners + shifted + faces + others))
    two = shapes.mesh(file)
    assert len(two.parts()) == 2
    world.add("boards", two, at=Pose.at(0.3, 0.0, 0.5))
    assert distance_to(world, "boards", flange_at(0.5, 0.0, 0.6)) > 0.05  # between 0.35 and 0.65


@pytest.mark.parametrize("kind", ["binary", "text"])
def test_stl_files_of_both_kinds_are_read(tmp_path: Path, kind: str) -> None:
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    triangles = corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
    file = tmp_path / "part.stl"
    if kind == "binary":
        rows = np.zeros(4, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        rows["corners"] = triangles
        file.write_bytes(bytes(80) + (4).to_bytes(4, "little") + rows.tobytes())
    else:
        texts = ("\n".join(f"vertex {x} {y} {z}" for x, y, z in one) for one in triangles)
        file.write_text("solid part\n" + "\n".join(f"facet\n{one}\nendfacet" for one in texts) + "\nendsolid")
    found = shapes.mesh(file)
    assert len(found.vertices) == 4 and len(found.faces) == 4
    assert np.ptp(found.vertices, axis=0) == pytest.approx([0.1] * 3, abs=1e-6)


def test_a_cloud_of_points_keeps_the_arm_away_by_its_radius(world: ha.CollisionModel) -> None:
    x, y = np.meshgrid(np.linspace(-0.1, 0.1, 81), np.linspace(-0.1, 0.1, 81))
    cloud = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])  # a plate, 2.5 mm between its points
    world.add_points(cloud, radius=0.02, at=Pose.at(0.5, 0.0, 0.2))
    distance = distance_to(world, "points", flange_at(0.5, 0.0, 0.4))
    assert 0.16 < distance <= 0.18 + 1e-6  # never farther than 20 mm above each point
    world.remove("points")
    world.add_points(cloud[:1], name="one", at=Pose.at(0.6, 0.1, 0.2))
    assert distance_to(world, "one", flange_at(0.5, 0.0, 0.4)) == pytest.approx(0.19, abs=1e-3)


def test_what_was_added_is_placed_held_and_released(world: ha.CollisionModel) -> None:
    q = flange_at(0.5, 0.0, 0.5)
    world.add("crate", shapes.box(0.1, 0.1, 0.1), at=Pose.at(0.5, 0.0, 0.2))
    world.add("shelf", shapes.box(0.4, 0.4, 0.02), at=Pose.at(0.5, 0.0, 0.3))
    world.place("crate", Pose.at(0.5, 0.0, 0.41))
    assert distance_to(world, "crate", q) == pytest.approx(0.04, abs=1e-6)
    assert not any(one.first == "crate" for one in world.clearances(q, below=0.5))
    world.hold("crate", Pose.at(0.0, 0.0, 0.06))  # from 10 to 110 mm before the flange
    (found,) = (
        one for one in world.clearances(q, below=0.2) if (one.first, one.second) == ("crate", "shelf")
    )
    assert found.distance == pytest.approx(0.5 - 0.11 - 0.31, abs=1e-6)
    higher = flange_at(0.5, 0.0, 0.6)
    loaded = world.carrying(ha.Tool("pen", shapes=[shapes.sphere(0.01, at=Pose.at(0, 0, 0.05))]))
    near = {one.first: one.distance for one in loaded.clearances(higher, below=0.3) if one.second == "shelf"}
    assert near["crate"] == pytest.approx(0.18, abs=1e-6)
    world.clearances(higher)
    world.release("crate")
    assert distance_to(world, "crate", flange_at(0.5, 0.0, 0.7)) == pytest.approx(0.7 - 0.59, abs=1e-6)
    world.remove("crate")
    world.add("other", shapes.sphere(0.05), at=Pose.at(0.0, 0.8, 0.5))
    assert set(world.bodies) >= {"shelf", "other"} and "crate" not in world.bodies


def test_adding_a_body_leaves_the_others_where_they_are() -> None:
    table = ha.CollisionModel("iiwa14", scene="table")
    table.place("cube", Pose.at(0.5, 0.0, 0.6))
    near = flange_at(0.5, 0.0, 0.8)
    before = [one for one in table.clearances(near, below=0.3) if one.second == "cube"]
    assert before
    table.add("post", shapes.cylinder(0.02, 0.4), at=Pose.at(-0.5, 0.0, 0.2))
    assert [one for one in table.clearances(near, below=0.3) if one.second == "cube"] == before


def test_changes_of_a_world_are_counted_and_waited_for(world: ha.CollisionModel) -> None:
    before = world.revision
    world.add("ball", shapes.sphere(0.1), at=Pose.at(1.0, 0.0, 0.5))
    world.place("ball", Pose.at(1.0, 0.5, 0.5))
    world.hold("ball", Pose.at(0.0, 0.0, 0.2))
    world.release("ball")
    view = world.carrying(None)
    assert world.revision == view.revision == before + 4
    world.remove("ball")
    assert (world.revision, view.revision) == (before + 5, before + 4)
    with pytest.raises(ha.CommandRejected):
        world.remove("ball")
    assert world.wait_for_change(before + 5, timeout=0.0) == before + 5  # a refused change is none
    ended = threading.Thread(target=world.add_points, args=([[1.0, 0.0, 0.5]],))
    ended.start()
    assert world.wait_for_change(before + 5, timeout=60.0) == before + 6
    ended.join()


def test_a_world_becomes_another_one_in_one_change(world: ha.CollisionModel) -> None:
    world.add("old", shapes.sphere(0.1), at=Pose.at(1.0, 0.0, 0.5))
    pen = ha.Tool("pen", shapes=[shapes.sphere(0.01, at=Pose.at(0, 0, 0.05))])
    mine = world.carrying(pen).allowing([("ball", "pen")])
    draft = mine.carrying(None)
    draft.remove("old")
    draft.add("ball", shapes.sphere(0.1), at=Pose.at(1.0, 0.0, 0.5))
    draft.add("part", shapes.sphere(0.02), at=Pose.at(1.0, 0.0, 0.5))
    draft.hold("part", Pose.at(0.0, 0.0, 0.1))
    draft = draft.with_arm("right", at=Pose.at(0.0, 1.2, 0.0), q=np.full(7, 0.2))
    before, bodies = mine.revision, mine.bodies
    with pytest.raises(ha.CommandRejected, match="iiwa14, got one of the iiwa7"):
        mine.become(ha.CollisionModel("iiwa7"))
    assert (mine.revision, mine.bodies) == (before, bodies)
    mine.become(draft)
    assert mine.revision == before + 1 and "old" not in mine.bodies
    assert {"pen", "ball", "part", "right/link_3"} <= set(mine.bodies)
    assert mine.held("part") == Pose.at(0.0, 0.0, 0.1) and mine.pose("ball") == Pose.at(1.0, 0.0, 0.5)
    assert mine.allowed == {frozenset({"ball", "pen"})} and mine.margin == world.margin
    q = np.full(7, 0.1)
    assert mine.carrying(None).clearances(q, below=1.0) == draft.allowing([("ball", "pen")]).clearances(
        q, below=1.0
    )
    draft.place("ball", Pose.at(2.0, 0.0, 0.5))
    draft.set_arm("right", np.zeros(7))
    assert mine.pose("ball") == Pose.at(1.0, 0.0, 0.5)
    assert mine.clearances(q, below=1.0) != draft.clearances(q, below=1.0)
    mine.become(mine)
    assert mine.revision == before + 2 and "ball" in mine.bodies


def test_two_worlds_may_become_each_other_at_once(world: ha.CollisionModel) -> None:
    other = world.carrying(None)
    world.add("ball", shapes.sphere(0.1), at=Pose.at(1.0, 0.0, 0.5))

    def become(one: ha.CollisionModel, another: ha.CollisionModel) -> None:
        for _ in range(20):
            one.become(another)

    threads = [
        threading.Thread(target=become, args=pair, daemon=True) for pair in ((world, other), (other, world))
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(120.0)
    assert not any(thread.is_alive() for thread in threads)


def test_a_world_is_changed_while_other_threads_check_it(world: ha.CollisionModel) -> None:
    world.add("ball", shapes.sphere(0.1), at=Pose.at(0.0, 0.0, 1.4))
    touch, free, q = Pose.at(0.0, 0.0, 1.4), Pose.at(0.0, 0.0, 3.0), np.zeros((20, 7))
    ended = threading.Event()

    def change() -> None:
        for number in range(200):
            world.place("ball", free if number % 2 == 0 else touch)
            if number % 50 == 0:
                world.add(
                    f"post {number}", shapes.box(0.1, 0.1, 0.1), at=Pose.at(-1.0, 0.0, 0.5 + 0.001 * number)
                )
        ended.set()

    thread = threading.Thread(target=change)
    thread.start()
    seen = set()
    while not ended.is_set():
        distances = world.distances(q, below=0.05)
        assert (distances == distances[0]).all()  # all of one check are of one world
        seen.add(bool(np.isfinite(distances[0])))
    thread.join()
    assert seen and world.distances(q, below=0.05)[0] < 0.0


def test_many_postures_at_once_agree_with_each_alone(world: ha.CollisionModel) -> None:
    world.add("box", shapes.box(0.3, 0.3, 0.3), at=Pose.at(0.5, 0.2, 0.4))
    q = np.random.default_rng(1).uniform(IIWA.q_min, IIWA.q_max, (200, 7))
    found = world.distances(q, below=0.05)
    for row, distance in zip(q, found):
        nearest = world.clearances(row, below=0.05)
        assert distance == (nearest[0].distance if nearest else np.inf)
    assert np.isinf(found).any() and (found < 0.0).any()
    allowed = ha.CollisionModel("iiwa14", boxes=["0.5,0.2,0.4,0.3,0.3,0.3"], allowed=[("link_7", "box 0")])
    inside = flange_at(0.5, 0.2, 0.53)
    assert allowed.distances([inside])[0] > allowed.clearances(inside)[0].distance


def test_a_line_is_free_where_no_first_touch_is_on_it() -> None:
    """Both ask for the same, and no pair moves farther than its own bound: many small steps find no other touch."""
    world = ha.CollisionModel("iiwa14", scene="shelf")
    world.hold("box", Pose.xyz_abc(0.0, 0.0, 0.2, 0.3, 0.0, 0.0))
    random, seen = np.random.default_rng(9), {True: 0, False: 0}
    for start in random.uniform(IIWA.q_min, IIWA.q_max, (200, 7)):
        if world.touching(start):
            continue
        end = np.clip(start + random.uniform(-0.6, 0.6, 7), IIWA.q_min, IIWA.q_max)
        is_free, touch = world.is_free(start, end), world.first_on([start, end])
        assert is_free == (touch is None)
        many = start + np.linspace(0.0, 1.0, 150)[:, None] * (end - start)
        if touch is None:
            assert world.distances(many, below=world.margin).min() >= -1e-6
        else:
            assert touch.clearance == world.touching(touch.q)[0]
            assert touch.q == pytest.approx(start + touch.at * (end - start))
        seen[is_free] += 1
    assert min(seen.values()) > 10
    bare, inside = ha.CollisionModel("iiwa14"), flange_at(0.5, 0.0, 0.5)
    bare.add("ball", shapes.sphere(0.1), at=Pose.at(0.5, 0.0, 0.402))
    assert bare.touching(inside) and bare.is_free(inside, flange_at(0.5, 0.0, 0.7))  # a contact may be left
    assert not bare.is_free(inside, flange_at(0.5, 0.0, 0.45))
    with pytest.raises(ha.ShapeError, match="last"):
        world.is_free(inside, inside[:6])
    with pytest.raises(ha.LimitError, match="first"):
        world.is_free(np.full(7, np.nan), inside)


def test_no_point_moves_farther_than_the_bound(world: ha.CollisionModel) -> None:
    pen = ha.Tool("pen", shapes=[shapes.capsule(0.01, 0.2, at=Pose.at(0.1, 0, 0.1))])
    loaded = world.carrying(pen)
    engine, random = loaded._distances, np.random.default_rng(7)
    tips = []
    for start in random.uniform(IIWA.q_min, IIWA.q_max, (100, 7)):
        change = random.uniform(-0.2, 0.2, 7) * (random.random(7) < 0.5)
        ends = []
        for q in (start, start + change):
            engine.pairs(q, 0.0)
            ends.append(engine._data.geom_xpos.copy())
        moved = np.linalg.norm(ends[1] - ends[0], axis=1).max()
        assert moved <= engine.moved(change) + 1e-12
        tips.append(moved / max(engine.moved(change), 1e-9))
    assert max(tips) > 0.4  # and it is no idle bound


@pytest.mark.parametrize("thickness", [0.01, 0.002])
@pytest.mark.parametrize("turn", [0.6, 1.5, 3.0])
def test_a_thin_wall_is_never_jumped(world: ha.CollisionModel, thickness: float, turn: float) -> None:
    world.add("wall", shapes.box(0.5, thickness, 0.3), at=Pose.at(0.75, 0.0, 0.6))
    left, right = deg(0, 60, 0, -60, 0, -30, 0), deg(0, 60, 0, -60, 0, -30, 0)
    left, right = left + [turn / 2, 0, 0, 0, 0, 0, 0], right - [turn / 2, 0, 0, 0, 0, 0, 0]
    assert min(world.distances([left, right])) > world.margin
    found = world.first_on([left, right])
    assert found is not None and found.clearance.second == "wall"
    assert 0.0 < found.at < 0.5


def test_checks_between_the_points_agree_with_many_small_steps(world: ha.CollisionModel) -> None:
    world.add("wall", shapes.box(0.8, 0.02, 0.9), at=Pose.at(0.7, 0.0, 0.6))
    random, hits = np.random.default_rng(11), 0
    for _ in range(100):
        a, b = random.uniform(IIWA.q_min, IIWA.q_max, (2, 7)) * 0.6
        if min(world.distances([a, b])) < world.margin:
            continue
        dense = world.distances(a + np.linspace(0.0, 1.0, 600)[:, None] * (b - a), below=0.05)
        found = world.first_on([a, b])
        if (dense < 0.0).any():
            assert found is not None and found.at <= np.argmax(dense < 0.0) / 599 + 1e-9
            hits += 1
        if found is not None:
            assert dense.min() < world.margin + 2e-3
    assert hits > 5


@pytest.mark.parametrize(
    ("change", "error", "match"),
    [
        (lambda w: w.add_points([[0.5, np.nan, 0.1]]), ha.LimitError, "cloud"),
        (lambda w: w.add_points([0.5, 0.0, 0.1]), ha.ShapeError, r"cloud must be points of shape \(n, 3\)"),
        (lambda w: w.add_points(np.zeros((0, 3))), ha.ShapeError, "cloud"),
        (lambda w: w.add_points([[0.5, 0, 0]], radius=0.0), ha.LimitError, "radius"),
        (
            lambda w: w.add_points(np.random.default_rng(0).uniform(0.3, 0.9, (9000, 3)), radius=0.002),
            ha.LimitError,
            "at most 5000 points",
        ),
        (lambda w: w.add("link_3", shapes.sphere(0.1)), ha.CommandRejected, "new name"),
        (lambda w: w.add("a/b", shapes.sphere(0.1)), ha.CommandRejected, "without a slash"),
        (lambda w: w.add("crate", "box"), ha.ShapeError, "shape"),
        (lambda w: w.add("crate", []), ha.ShapeError, "at least one"),
        (
            lambda w: w.add("crate", shapes.box(0.2, 0.2, 0.2), at=Pose.at(0.05, 0, 0.1)),
            ha.CommandRejected,
            "mm inside link_0, the base of the arm",
        ),
        (lambda w: w.remove("floor"), ha.CommandRejected, "a body that was added, one of none"),
        (lambda w: w.place("crate", Pose.at(1, 0, 0)), ha.CommandRejected, "one of none; got 'crate'"),
        (lambda w: shapes.height_map([[0.0, 0.0]], cell=0.1), ha.ShapeError, "no ground"),
        (lambda w: shapes.height_map([[np.inf]], cell=0.1), ha.LimitError, "heights"),
        (lambda w: shapes.height_map(np.ones((200, 100)), cell=0.1), ha.LimitError, "number of cells"),
    ],
)
def test_bad_bodies_change_nothing(world: ha.CollisionModel, change: Any, error: Any, match: str) -> None:
    before = world.bodies
    with pytest.raises(error, match=match):
        change(world)
    assert world.bodies == before
    world.add("good", shapes.sphere(0.05), at=Pose.at(0.6, 0.0, 0.5))
    assert "good" in world.bodies


@pytest.mark.parametrize(
    ("text", "match"),
    [
        (CUBE.replace("0.05", "50.0"), "extent of a mesh must be.*got 100 m"),
        (CUBE.rsplit("\n", 1)[0], "the mesh has a hole: 4 of its edges"),
        (CUBE + "\nf 1 2 900", "indices of 8 vertices, got 899"),
        (CUBE + "\nv 0 0 nan", "vertices"),
        (CUBE.replace("v -0.05 -0.05 -0.05", "v one two three"), "line 1 has no numbers"),
        ("", "no vertices"),
    ],
)
def test_bad_meshes_are_refused(tmp_path: Path, text: str, match: str) -> None:
    file = tmp_path / "bad.obj"
    file.write_text(text)
    with pytest.raises(ha.CommandRejected, match=match):
        shapes.mesh(file)


def test_bad_stl_files_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "bad.stl"
    for data in (b"", b"\x00" * 90, b"solid\nvertex 0 0", b"solid\nvertex a b c\n"):
        file.write_bytes(data)
        with pytest.raises(ha.CommandRejected, match="STL|corners"):
            shapes.mesh(file)
