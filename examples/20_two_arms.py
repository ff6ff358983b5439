"""Two arms move in mirror image: they begin together, one stop reaches both, one file records both.

Run it without arguments for two simulators, or with two targets: python 20_two_arms.py lab1 lab2
"""

import sys
from pathlib import Path

import numpy as np

import heptarm as ha

SIDE = 0.12  # [m]


def main() -> None:
    targets = sys.argv[1:3] if len(sys.argv) > 2 else ["sim://iiwa14", "sim://iiwa14"]
    with ha.connect_all(left=targets[0], right=targets[1], settings={"state_rate": 250}) as arms:
        left, right = arms
        left.speed = right.speed = 0.3
        ready = ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0))
        ha.start_together({left: ready, right: ready}).wait()

        with arms.record("both.mcap"):
            for sign in (1.0, -1.0):
                both = ha.start_together(
                    {
                        left: ha.lin_rel(y=sign * SIDE, frame="base", speed_mps=0.15),
                        right: ha.lin_rel(y=-sign * SIDE, frame="base", speed_mps=0.15),
                    }
                )
                both.wait()
                print(f"began {both.skew * 1e3:.1f} ms apart")
        now = ha.states_together(left, right)
        print(f"at rest: {now.states[0].pose} and {now.states[1].pose}")

    # on one time line: how well the arms mirrored each other
    one, other = (ha.load("both.mcap", arm=name) for name in arms.names)
    y = np.interp(one.t, other.t, other["xyz"][:, 1])
    moving = one["motion"] > 0
    if moving.any():
        print(f"mirrored within {np.abs(one['xyz'][:, 1] + y)[moving].max() * 1e3:.1f} mm")
    print(f"{Path('both.mcap').stat().st_size / 1e6:.1f} MB in both.mcap")


if __name__ == "__main__":
    main()
