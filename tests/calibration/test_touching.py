"""The tip of a tool by touch: from exact and noisy contacts, from the states of a push, and on a virtual cabinet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm import calibration, model
from heptarm.calibration import KnownSurface
from heptarm.errors import CommandRejected, LimitError, NoContact, ShapeError
from heptarm.values.checks import Array
from heptarm.values.robot import robot
from tests.simulators import FASTER

TIP = ha.Pose.at(0.012, -0.034, 0.187)
GUESS = ha.Pose.at(0.010, -0.030, 0.190)
RADIUS = 0.004
TABLE = KnownSurface.plane((0.6, 0.0, 0.2), sigma=0.0)
BALL = KnownSurface.sphere((0.6, 0.1, 0.22), 0.02, sigma=0.0)
TILTED = [(0.0, 0.0), *((25.0, 360.0 * one / 7) for one in range(7))]


def contacts(surface: KnownSurface, *, noise: Array | float = 0.0) -> list[ha.Pose]:
    """Poses of the flange in which the tip touches a surface from above, but for errors (8,) [m]."""
    at = surface.place + np.array([0.0, 0.0, surface.radius + RADIUS])
    errors = np.broadcast_to(noise, len(TILTED))
    found = []
    for (tilt, about), error in zip(TILTED, errors, strict=True):
        axis = np.array([np.cos(np.radians(about)), np.sin(np.radians(about)), 0.0])
        turn = ha.Pose.from_rotvec((0, 0, 0), np.radians(tilt) * axis) @ ha.Pose.xyz_abc(c=np.pi)
        found.append(ha.Pose.of(at + (0.0, 0.0, error) - turn.rotation @ TIP.xyz, turn.quat))
    return found


@pytest.mark.parametrize("surface", [TABLE, BALL], ids=["plane", "sphere"])
def test_exact_contacts_give_the_exact_tip(surface: KnownSurface) -> None:
    found = calibration.estimate_touched_tcp(contacts(surface), surface, guess=GUESS, tip_radius=RADIUS)
    np.testing.assert_allclose(found.pose.xyz, TIP.xyz, atol=1e-9)
    assert found.sigma.max() < 1e-9 and found.residuals.max() < 1e-9


@pytest.mark.parametrize("surface", [TABLE, BALL], ids=["plane", "sphere"])
def test_in_a_hundred_runs_the_truth_is_within_two_sigma(surface: KnownSurface) -> None:
    random = np.random.default_rng(1)
    inside, errors = np.zeros(3), []
    for _ in range(100):
        shift = random.normal(0.0, 5e-5)  # the surface itself is not where it is said to be
        known = (
            KnownSurface.sphere(surface.place, surface.radius, sigma=5e-5)
            if surface.radius
            else KnownSurface.plane(surface.place, sigma=5e-5)
        )
        given = contacts(surface, noise=shift + random.normal(0.0, 5e-5, len(TILTED)))
        found = calibration.estimate_touched_tcp(given, known, guess=GUESS, tip_radius=RADIUS)
        off = found.pose.xyz - TIP.xyz
        inside += np.abs(off) <= 2.0 * found.sigma
        errors.append(float(np.linalg.norm(off)))
    assert (inside >= 90).all(), inside
    assert np.quantile(errors, 0.95) < 0.3e-3


def test_what_makes_no_sense_is_refused() -> None:
    given = contacts(TABLE)
    still = [given[0]] * 6
    wrong = [*given[:3], ha.Pose.of(given[3].xyz + (0, 0, 0.02), given[3].quat), *given[4:]]
    for flanges, more, error, words in (
        (given[:4], {}, ShapeError, "flanges must be at least 5, got 4"),
        (still, {}, CommandRejected, "differ too little"),
        (wrong, {}, CommandRejected, r"contact 4 contradicts the others"),
        (given, {"surface": "table"}, ShapeError, r"surface must be a KnownSurface.*KnownSurface\.plane"),
        (given, {"tip_radius": -1.0}, LimitError, "tip_radius must be"),
    ):
        with pytest.raises(error, match=words):
            calibration.estimate_touched_tcp(
                flanges,
                **({"surface": TABLE, "guess": GUESS, "tip_radius": RADIUS} | more),  # type: ignore[arg-type]
            )
    with pytest.raises(LimitError, match="radius must be"):
        KnownSurface.sphere((0, 0, 0), 0.0)
    with pytest.raises(ShapeError, match="zero vector"):
        KnownSurface.plane((0, 0, 0), (0, 0, 0))
    assert str(BALL) == "sphere of 20 mm radius at (0.600, 0.100, 0.220) m"


SCENE = """<mujoco model="touched">
  <worldbody>
    <body name="table" pos="0.6 0 0.1"><geom type="box" size="0.2 0.3 0.1"/></body>
    <body name="ball" pos="0.6 0.1 0.22"><geom type="sphere" size="0.02"/></body>
    <body name="tool">
      <body name="pen" pos="{x} {y} {z}">
        <geom type="sphere" size="{radius}" mass="0.01"/>
        <geom type="capsule" fromto="0 0 0 {dx} {dy} {dz}" size="0.003" mass="0.02"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def scene(folder: Path) -> Path:
    """A table with a ball on it, and a tool with a round tip on the flange."""
    x, y, z = TIP.xyz
    file = folder / "touched.xml"
    text = SCENE.format(x=x, y=y, z=z, dx=-x, dy=-y, dz=0.01 - z, radius=RADIUS)
    file.write_text(text, encoding="utf-8")
    return file


def over(surface: KnownSurface) -> Array:
    """Joint positions in which the tip is thought to be 6 mm over a surface."""
    x, y, z = surface.place
    above = ha.Pose.xyz_abc(x, y, z + surface.radius + RADIUS + 0.006, a=np.pi, c=np.pi)
    return model.solve(robot("iiwa14"), above @ GUESS.inverse(), near=ha.deg(0, 30, 0, -90, 0, 60, 0))


@pytest.mark.long
def test_the_arm_measures_its_tip_by_touch(tmp_path: Path) -> None:
    start = over(TABLE)
    target = f"sim://iiwa14?speed={FASTER:g}&sensors=noisy:5&scene={scene(tmp_path)}"
    with ha.connect(target, state_rate=500.0, watchdog=5.0, timeout=30.0) as arm:
        arm.move(ha.ptp(start))
        with pytest.raises(
            CommandRejected, match=r"the tip must be 2 to 50 mm over the plane .* got 306\.0 mm"
        ):
            calibration.touch_plan(arm, KnownSurface.plane((0.6, 0, -0.1)), guess=GUESS, tip_radius=RADIUS)
        plan = calibration.touch_plan(
            arm, TABLE, guess=GUESS, tip_radius=RADIUS, touches=6, speed=0.6, speed_mps=0.01
        )
        shown: list[str] = []
        with pytest.raises(CommandRejected, match="nothing moves"):
            calibration.touch_tcp(arm, plan=plan, confirm=lambda plan: bool(shown.append(str(plan))))
        assert "6 N end an approach" in shown[0] and "6 times, each within 16 mm" in shown[0]
        done: list[tuple[int, int]] = []
        found = calibration.touch_tcp(arm, plan=plan, progress=lambda *now: done.append(now))
        np.testing.assert_allclose(arm.state.q_cmd, start, atol=1e-6)
        assert done[-1] == (6, 6)
        nothing = KnownSurface.plane((0.6, 0.0, 0.23))
        arm.move(ha.lin_rel(z=0.03, frame="base"))
        with pytest.raises(NoContact, match="nothing was touched within 16 mm"):
            calibration.touch_tcp(
                arm, plan=calibration.touch_plan(arm, nothing, guess=GUESS, tip_radius=RADIUS, speed_mps=0.05)
            )
    off = found.pose.xyz - TIP.xyz
    assert np.linalg.norm(off) < 0.3e-3 and (np.abs(off) <= 3.0 * found.sigma).all(), found
