"""What is on the flange, hidden in a scene of the simulator: the tip of a tool and its load; how honest sigma is."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Literal

import numpy as np

import heptarm as ha
from bench.measure.figure import Figure, benchmark
from heptarm import calibration
from heptarm.values.checks import Array
from tests.calibration import test_hand_eye as eye
from tests.calibration import test_load as loads
from tests.calibration import test_tcp as tips
from tests.calibration import test_touching as touched

#: Limits: of a tip [mm], [deg], of a load's mass as a fraction, its centre [mm], and its inertia as a fraction.
PLACE, TURN, MASS, CENTRE, INERTIA = 0.3, 0.1, 0.02, 3.0, 0.15
#: Runs in which the truth has to be within two standard deviations, and the fraction of these that is enough.
RUNS, ENOUGH = 100, 0.9
#: Standard deviation of a person who brings a tip to a point [m].
POINTING = 1e-4
#: Where a measurement begins, and where with a long tool, which would reach the floor.
HOME, HIGH = ha.deg(0, 30, 0, -90, 0, 60, 0), ha.deg(0, 0, 0, -70, 0, 60, 0)
#: A part of 3 kg and a long tool of 4 kg as the scene's tool: edges, and where the middle is in the flange frame [m].
EDGES, MIDDLE, WEIGHT = np.array([0.06, 0.08, 0.32]), np.array([0.01, -0.02, 0.16]), 3.0
LONG_EDGES, LONG_MIDDLE, LONG_WEIGHT = np.array([0.05, 0.06, 0.4]), np.array([0.0, 0.02, 0.205]), 4.0
_PART = """<mujoco model="part"><worldbody><body name="tool">
  <geom type="box" size="{half}" pos="{middle}" mass="{mass}"/>
</body></worldbody></mujoco>
"""


@benchmark("tip")
def tip() -> Iterator[Figure]:
    """Error of a tip by touch with noisy sensors, by pointing with 0.1 mm of noise, and of its orientation."""
    with tempfile.TemporaryDirectory() as folder:
        target = f"sim://iiwa14?speed=5&sensors=noisy:5&scene={touched.scene(Path(folder))}"
        with ha.connect(target, state_rate=500.0, watchdog=5.0, timeout=60.0) as arm:
            for name, surface in (("plane", touched.TABLE), ("sphere", touched.BALL)):
                arm.move(ha.ptp(touched.over(surface)))
                plan = calibration.touch_plan(
                    arm, surface, guess=touched.GUESS, tip_radius=touched.RADIUS, speed=0.5
                )
                found = calibration.touch_tcp(arm, plan=plan)
                off = 1e3 * float(np.linalg.norm(found.pose.xyz - touched.TIP.xyz))
                sigma = {"sigma_mm": (1e3 * found.sigma).tolist()}
                yield Figure(f"tip_by_{name}", off, "mm", limit=PLACE, detail=sigma)
    random, off_place, off_turn = np.random.default_rng(0), [], []
    for _ in range(RUNS):
        poses = tips.about(tips.POINT, tips.TILTS, noise=random.normal(0.0, POINTING, (6, 3)))
        shift = ha.Pose.of(random.normal(0.0, POINTING / 2.0, 3))
        along = {
            "z": shift @ tips.reaching("z", 0.12, (10, 5, 170)),
            "x": tips.reaching("x", 0.1, (-20, 10, 190)),
        }
        made = calibration.tcp(poses, along=along)
        off_place.append(1e3 * float(np.linalg.norm(made.pose.xyz - tips.TIP.xyz)))
        off_turn.append(math.degrees(made.pose.angle_to(tips.TIP)))
    detail = {"runs": RUNS, "pointing_mm": 1e3 * POINTING}
    yield Figure("tip_by_point", float(np.quantile(off_place, 0.95)), "mm", limit=PLACE, detail=detail)
    yield Figure("tip_turn", float(np.median(off_turn)), "deg", limit=TURN, detail=detail)


@benchmark("load")
def load() -> Iterator[Figure]:
    """Error of mass, centre and inertia of a part and a long tool that nobody declared, with noisy sensors."""
    rests, swings = _measured(HOME, EDGES, MIDDLE, WEIGHT, ("rests", "full"))
    detail = {"sigma_kg": rests.sigma_mass, "sigma_mm": (1e3 * rests.sigma_com).tolist()}
    yield Figure("load_mass", abs(rests.mass / WEIGHT - 1.0), "fraction", limit=MASS, detail=detail)
    off = 1e3 * float(np.linalg.norm(rests.com - MIDDLE))
    yield Figure("load_centre", off, "mm", limit=CENTRE, detail=detail)
    yield _inertia("load_inertia", swings, EDGES, WEIGHT)
    (swings,) = _measured(HIGH, LONG_EDGES, LONG_MIDDLE, LONG_WEIGHT, ("full",))
    yield _inertia("long_tool_inertia", swings, LONG_EDGES, LONG_WEIGHT)


def _measured(
    start: Array, edges: Array, middle: Array, mass: float, excitations: tuple[Literal["rests", "full"], ...]
) -> list[calibration.IdentifiedLoad]:
    """A box on the flange, measured by an arm with noisy sensors that does not know of it."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "part.xml"
        half, place = (" ".join(map(str, values)) for values in (0.5 * edges, middle))
        scene.write_text(_PART.format(half=half, middle=place, mass=mass), encoding="utf-8")
        target = f"sim://iiwa14?speed=5&sensors=noisy:7&scene={scene}"
        with ha.connect(target, state_rate=500.0, watchdog=5.0, timeout=60.0) as arm:
            arm.move(ha.ptp(start), speed=0.5)
            plans = [calibration.load_plan(arm, excitation=name, speed=0.5) for name in excitations]
            return [calibration.load(arm, plan=plan) for plan in plans]


def _inertia(name: str, found: calibration.IdentifiedLoad, edges: Array, mass: float) -> Figure:
    """Largest error of a moment of inertia that matters, of a box."""
    moments = mass / 12.0 * (float(edges @ edges) - edges**2)
    worst = float(np.abs(found.inertia[:3] / moments - 1.0)[np.array(found.matters)].max())
    detail = {"sigma": found.sigma_inertia.tolist(), "moments": moments.tolist(), "matters": found.matters}
    return Figure(name, worst, "fraction", limit=INERTIA, detail=detail)


@benchmark("calibration_sigma")
def calibration_sigma() -> Iterator[Figure]:
    """Fraction of 100 runs in which the true tip, load and camera are within two standard deviations."""
    kinds: dict[str, Callable[[int], Array]] = {
        "tip_by_point": _point,
        "tip_by_touch": _touch,
        "load": _load,
        "inertia": _moved,
        "hand_eye": _hand_eye,
        "hand_eye_tags": _tags,
    }
    for name, off in kinds.items():
        inside = np.mean([off(seed) <= 2.0 for seed in range(RUNS)], axis=0)
        yield Figure(
            f"{name}_within_two_sigma",
            float(inside.min()),
            "fraction",
            limit=ENOUGH,
            at_least=True,
            detail={"runs": RUNS, "each": inside.tolist()},
        )


def _point(seed: int) -> Array:
    """Errors of a tip by pointing, by their standard deviations."""
    noise = np.random.default_rng(seed).normal(0.0, POINTING, (6, 3))
    found = calibration.tcp(tips.about(tips.POINT, tips.TILTS, noise=noise))
    return np.abs(found.pose.xyz - tips.TIP.xyz) / found.sigma


def _touch(seed: int) -> Array:
    random = np.random.default_rng(seed)
    surface = calibration.KnownSurface.plane(touched.TABLE.place, sigma=POINTING / 2.0)
    noise = random.normal(0.0, POINTING / 2.0) + random.normal(0.0, POINTING / 2.0, len(touched.TILTED))
    found = calibration.estimate_touched_tcp(
        touched.contacts(surface, noise=noise), surface, guess=touched.GUESS, tip_radius=touched.RADIUS
    )
    return np.abs(found.pose.xyz - touched.TIP.xyz) / found.sigma


def _load(seed: int) -> Array:
    found = calibration.estimate_load(loads.at_rest(seed, loads.LOAD), robot="iiwa14")
    off = np.abs([found.mass - loads.LOAD.mass, *(found.com - loads.LOAD.com)])
    return np.asarray(off / np.array([found.sigma_mass, *found.sigma_com]))


def _moved(seed: int) -> Array:
    """Errors of the inertia from recorded motions, by their standard deviations."""
    known = loads.LONG_LOAD
    samples = loads.at_rest(seed, known).joined(loads.moving(seed, known, None, "short"))
    found = calibration.estimate_load(samples, robot="iiwa14")
    return np.asarray(np.abs(found.inertia - known.inertia) / found.sigma_inertia)


def _hand_eye(seed: int) -> Array:
    return _camera(eye.views("flange", pixels=0.1, arm=1e-4, seed=seed))


def _tags(seed: int) -> Array:
    return _camera(eye.seen_tags(seed))


def _camera(views: list[calibration.HandEyeView]) -> Array:
    found = calibration.estimate_hand_eye(views, matrix=eye.MATRIX)
    sigma = np.concatenate([found.sigma, found.sigma_angle])
    return np.asarray(np.abs(eye.errors(found, eye.CAMERA)) / sigma)
