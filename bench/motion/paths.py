"""Speed at blended corners, distance of splines from their points, stops on every kind of path."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bench.measure.figure import Figure, benchmark
from heptarm.model.kinematics import forward
from heptarm.planning.seam import Batch, PlantMotion, Spl, Spline
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.values.pose import Pose
from tests.sim import motions

READY = (0.0, 0.5, 0.0, -1.3, 0.0, 0.9, 0.0)
SPEED, ZONE = 0.25, 0.02
INSTANTS = 200
#: Braking from the axes' full speed at a third of their acceleration, and three ramps of it [s].
LONGEST = 1.2


def _ready() -> tuple[Plant, Pose]:
    plant = Plant("iiwa14", q=READY)
    return plant, Pose.from_matrix(forward(plant.robot, plant.snapshot.q_cmd))


def _at(start: Pose, x: float, y: float, z: float) -> tuple[float, ...]:
    return tuple([*(start.xyz + [x, y, z]).tolist(), *start.quat.tolist()])


def _orders(start: Pose) -> dict[str, MotionCommand]:
    """One order of every kind of path."""
    knots = ((0.05, 0.05, 0.0), (0.0, 0.12, 0.03), (0.06, 0.2, 0.0), (0.0, 0.25, -0.03))
    joints = ((0.4, 0.3, 0.1, -1.0, 0.2, 0.7, -0.2), (0.8, 0.5, 0.0, -1.2, 0.2, 0.9, 0.4), READY)
    made: dict[str, PlantMotion] = {
        "ptp": motions.ptp(joints[0]),
        "lin": motions.lin(_at(start, 0.05, 0.25, 0.05), velocity=SPEED),
        "circ": motions.circ(_at(start, 0.06, 0.06, 0), _at(start, 0, 0.12, 0), velocity=SPEED),
        "batch": _square(start, ZONE),
        "spline": motions.spline(*(motions.spl(_at(start, *knot), velocity=SPEED) for knot in knots)),
        "spline_joints": motions.spline_joints(*map(motions.ptp, joints)),
    }
    return {kind: MotionCommand(1, motion) for kind, motion in made.items()}


def _square(start: Pose, zone: float) -> Batch:
    """A square whose corners are blended within a distance [m]."""
    corners = ((0, 0.15, 0), (0.1, 0.15, 0), (0.1, 0, 0), (0, 0, 0))
    return motions.batch(
        *(motions.lin(_at(start, *c), velocity=SPEED, blending=(0.0, zone, 0.0)) for c in corners)
    )


def _track(plant: Plant) -> tuple[np.ndarray, np.ndarray]:
    """Measured and commanded joints until the plant is idle, shapes (n, 7)."""
    seen = []
    while not plant.idle:
        plant.tick()
        state = plant.snapshot
        seen.append((state.q, state.q_cmd))
    measured, commanded = zip(*seen, strict=True)
    return np.array(measured), np.array(commanded)


def _places(plant: Plant, joints: np.ndarray) -> np.ndarray:
    return np.array([forward(plant.robot, q)[:3, 3] for q in joints])


@benchmark("blending")
def blending() -> Iterator[Figure]:
    """Slowest speed between the first and the last straight of a square with blended corners."""
    for zone in (ZONE, 2 * ZONE):
        plant, start = _ready()
        plant.submit(MotionCommand(1, _square(start, zone)))
        measured, _ = _track(plant)
        speed = np.linalg.norm(np.diff(_places(plant, measured), axis=0), axis=1) * 1e3
        fast = np.flatnonzero(speed > 0.9 * SPEED)
        fraction = float(speed[fast[0] : fast[-1]].min()) / SPEED
        yield Figure(
            f"blended_speed_{zone * 1e3:.0f}_mm", 100 * fraction, "%", limit=30.0, at_least=True,
            detail={"speed_mps": SPEED, "corner_deg": 90},
        )  # fmt: skip


@benchmark("spline_points")
def spline_points() -> Iterator[Figure]:
    """Largest distance of the measured path from a spline's points, and its slowest speed between them."""
    plant, start = _ready()
    order = _orders(start)["spline"]
    plant.submit(order)
    measured, _ = _track(plant)
    places = _places(plant, measured)
    assert isinstance(order.motion, Spline)
    knots = [np.array(part.target.xyz) for part in order.motion.segments if isinstance(part, Spl)]
    off = max(float(np.linalg.norm(places - knot, axis=1).min()) for knot in knots)
    speed = np.linalg.norm(np.diff(places, axis=0), axis=1) * 1e3
    inside = speed[len(speed) // 10 : -len(speed) // 3]
    yield Figure("spline_distance", off * 1e3, "mm", limit=0.5)
    yield Figure("spline_slowest", 100 * float(inside.min()) / SPEED, "%")


@benchmark("stops_on_paths")
def stops_on_paths() -> Iterator[Figure]:
    """200 stops at random instants of six kinds of motion: rest, how soon, and how hard."""
    random = np.random.default_rng(19)
    kinds = list(_orders(_ready()[1]))
    lengths = {}
    for kind in kinds:
        plant, start = _ready()
        plant.submit(_orders(start)[kind])
        lengths[kind] = len(_track(plant)[1]) - 20
    rested, longest, hardest = 0, 0.0, 0.0
    for index in range(INSTANTS):
        kind = kinds[index % len(kinds)]
        plant, start = _ready()
        plant.submit(_orders(start)[kind])
        plant.step(int(random.integers(1, lengths[kind])))
        plant.stop()
        _, commanded = _track(plant)
        moving = np.flatnonzero(np.abs(np.diff(commanded, axis=0)).max(axis=1) > 1e-9)
        time = (int(moving[-1]) + 1) * 1e-3 if len(moving) else 0.0
        rest = float(np.abs(plant.snapshot.dq).max()) < 2e-3
        rested += rest and time <= LONGEST
        longest = max(longest, time)
        acceleration = np.abs(np.diff(commanded, 2, axis=0)).max(initial=0.0) * 1e6
        hardest = max(hardest, float(acceleration) / float(plant.robot.ddq_max.max()))
    detail = {"kinds": kinds, "instants": INSTANTS, "limit_s": LONGEST}
    yield Figure("stops_rested", 100 * rested / INSTANTS, "%", limit=100.0, at_least=True, detail=detail)
    yield Figure("stops_longest", longest, "s")
    yield Figure("stops_hardest", 100 * hardest, "% of the axes' acceleration")
