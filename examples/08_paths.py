"""Move along an arc, a blended square, a spline and an ellipse, and measure them; --plot shows them."""

import os
import sys
from collections.abc import Sequence

import numpy as np

import heptarm as ha
from heptarm.values.motion.motion import Motion

SPEED, ZONE = 0.25, 0.02  # m/s, m


def drawn(arm: ha.Arm, motion: Motion | Sequence[Motion]) -> np.ndarray:
    """Execute a motion and return the positions of the flange, shape (n, 3) [m]."""
    handle = arm.start(motion)
    places = []
    for state in arm.states(rate=200):
        places.append(state.pose.xyz)
        if handle.done:
            break
    handle.wait()
    return np.array(places)


with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.6)
    start = arm.wait_for_rest().pose

    def at(x: float, y: float, z: float = 0.0) -> ha.Pose:
        return ha.Pose.of(start.xyz + [x, y, z], start.quat)

    corners = [at(0, 0.12), at(-0.1, 0.12), at(-0.1, 0), start]
    paths: dict[str, Motion | Sequence[Motion]] = {
        "arc": [ha.circ(at(0.05, 0.05), at(0, 0.1), speed_mps=SPEED), ha.lin(start, speed_mps=SPEED)],
        "square, blended": [ha.lin(corner, speed_mps=SPEED, blend_m=ZONE) for corner in corners],
        "spline": ha.spline([at(-0.05, 0.05), at(0, 0.1, 0.03), at(-0.05, 0.15), start], speed_mps=SPEED),
        "ellipse": ha.ellipse(start, 0.04, centre=start.xyz + [0, 0.08, 0], speed_mps=SPEED),
    }
    shapes = {name: drawn(arm, motion) for name, motion in paths.items()}

for name, places in shapes.items():
    length = np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
    closed = np.linalg.norm(places[-1] - start.xyz) * 1e3
    print(f"{name}: {length:.3f} m, closed within {closed:.3f} mm, {len(places)} states")

if "--plot" in sys.argv:
    import matplotlib.pyplot as plt

    for name, places in shapes.items():
        plt.plot(*((places - start.xyz)[:, 1::-1] * 1e3).T, label=name)
    plt.gca().set(xlabel="y [mm]", ylabel="x [mm]", aspect="equal")
    plt.legend()
    plt.show()
