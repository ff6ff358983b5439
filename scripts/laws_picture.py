"""Draw docs/_static/laws.png: responses of the ready laws on a simulated arm.

python scripts/laws_picture.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from heptarm import laws  # noqa: E402
from tests.laws.plant import DT, HOME, Plant  # noqa: E402


def main() -> None:
    """Draw the picture."""
    figure, axes = plt.subplots(2, 4, figsize=(15, 6), constrained_layout=True)
    _cartesian(axes[0, 0])
    _wall(axes[0, 1])
    _joints(axes[0, 2])
    _readings(axes[0, 3])
    _guiding(axes[1, 0])
    _admittance(axes[1, 1])
    _hybrid(axes[1, 2])
    _targets(axes[1, 3])
    for one in axes.flat:
        one.set_xlabel("t [s]")
        one.grid(alpha=0.3)
    figure.savefig(ROOT / "docs" / "_static" / "laws.png", dpi=90)
    print("docs/_static/laws.png")


def _times(count: int) -> np.ndarray:
    return np.arange(count) * DT


def _cartesian(axis: plt.Axes) -> None:
    for damping in (0.3, 0.7, 1.0):
        plant = Plant(laws.cartesian_impedance(damping=damping, speed=2.0))
        plant.run(0.02)
        begin = plant.place
        goal = np.array(plant.trial.memory.goal)
        goal[0] += 0.03
        plant.trial.params.goal = goal
        moved = 1e3 * (np.array(plant.run(0.8))[:, 0] - begin[0])
        axis.plot(_times(len(moved)), moved, label=f"damping {damping:g}")
    axis.set(title="cartesian_impedance: step of 30 mm", ylabel="x [mm]")
    axis.legend()


def _wall(axis: plt.Axes) -> None:
    plant = Plant(laws.cartesian_impedance(speed=0.1))
    plant.wall = plant.place[2] - 0.01
    plant.run(0.02)
    goal = np.array(plant.trial.memory.goal)
    goal[2] -= 0.03
    plant.trial.params.goal = goal
    forces = []
    for _ in range(1000):
        plant.torque_step()
        forces.append(plant.force)
    axis.plot(_times(len(forces)), forces)
    axis.set(title="the same on a wall of 30 kN/m", ylabel="force [N]")


def _joints(axis: plt.Axes) -> None:
    plant = Plant(laws.joint_impedance(smoothing=0.08))
    plant.run(0.02)
    plant.trial.params.goal = HOME + np.radians([0, 0, 0, 20, 0, 0, 0])
    reached, followed = [], []
    for _ in range(800):
        plant.torque_step()
        reached.append(np.degrees(plant.q[3] - HOME[3]))
        followed.append(np.degrees(plant.trial.memory.q[3] - HOME[3]))
    axis.plot(_times(len(followed)), followed, "--", label="reference")
    axis.plot(_times(len(reached)), reached, label="A4")
    axis.set(title="joint_impedance: step of 20 deg", ylabel="angle [deg]")
    axis.legend()


def _guiding(axis: plt.Axes) -> None:
    start = Plant(laws.free_guiding()).place
    plant = Plant(laws.free_guiding(box=(start - [0.2, 0.05, 0.2], start + 0.2)))
    plant.push = lambda t: np.array([0.0, -20.0 if t < 1.0 else 0.0, 0.0])
    moved = 1e3 * (np.array(plant.run(1.5))[:, 1] - start[1])
    axis.plot(_times(len(moved)), moved)
    axis.axhline(-50.0, color="grey", linestyle=":")
    axis.set(title="free_guiding: 20 N against a wall", ylabel="y [mm]")


def _admittance(axis: plt.Axes) -> None:
    law = laws.admittance(wrench=(0, 0, -20.0, 0, 0, 0), damping=(800,) * 3 + (40,) * 3, dead_band=0.0)
    plant = Plant(law, wall_stiffness=20_000.0)
    plant.wall = plant.place[2] - 0.005
    forces = []
    for _ in range(1500):
        plant.position_step()
        forces.append(plant.force)
    axis.plot(_times(len(forces)), forces)
    axis.set(title="admittance: 20 N on 20 kN/m", ylabel="force [N]")


def _hybrid(axis: plt.Axes) -> None:
    plant = Plant(laws.hybrid(wrench=(0, 0, -20.0, 0, 0, 0), speed=0.05), wall_stiffness=20_000.0)
    plant.wall = plant.place[2] - 0.005
    begin, forces, moved = plant.place, [], []
    for k in range(2000):
        if k == 600:
            plant.trial.params.goal = plant.trial.memory.goal + [0.0, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0]
        plant.position_step()
        forces.append(plant.force)
        moved.append(1e3 * (plant.place[1] - begin[1]))
    axis.plot(_times(len(forces)), forces, label="force [N]")
    axis.plot(_times(len(moved)), moved, label="y [mm]")
    axis.set(title="hybrid: 20 N on a wall, 50 mm along it")
    axis.legend()


def _readings(axis: plt.Axes) -> None:
    made = [("order 1", laws.low_pass_readings()), ("order 2", laws.low_pass_readings(order=2))]
    noise = np.random.default_rng(1).normal(0.0, 1.0, 400)
    raw = np.where(np.arange(400) < 100, 0.0, 10.0) + noise
    axis.plot(_times(400), raw, color="lightgrey", label="measured")
    for name, law in made:
        trial, shown = Plant(law).trial, []
        for one in raw:
            trial(HOME, q_ipo=HOME, tau_ext=np.full(7, one))
            shown.append(float(trial.memory.tau_ext[0]))
        axis.plot(_times(400), shown, label=name)
    axis.set(title="low_pass_readings: 10 Hz", ylabel="external torque [Nm]")
    axis.legend()


def _targets(axis: plt.Axes) -> None:
    goal = HOME + np.radians([30, 0, 0, 0, 0, 0, 0])
    made = (
        ("minimum_jerk", laws.minimum_jerk()),
        ("jerk_limited", laws.jerk_limited()),
        ("low_pass, order 1", laws.low_pass(order=1)),
        ("low_pass, order 2", laws.low_pass()),
    )
    for name, law in made:
        trial = Plant(law).trial
        trial(HOME)
        path = []
        for k in range(1500):
            trial.params.goal = goal if k < 700 else HOME
            path.append(np.degrees(trial(HOME, q_ipo=HOME).q[0] - HOME[0]))
        axis.plot(_times(len(path)), path, label=name)
    axis.set(title="targets that change", ylabel="A1 [deg]")
    axis.legend()


if __name__ == "__main__":
    main()
