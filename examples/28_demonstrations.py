"""Record demonstrations as episodes, make a LeRobot data set of them, and let a policy follow what was demonstrated."""

import os
import tempfile
from pathlib import Path

import numpy as np

import heptarm as ha
from heptarm import devices, skills

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
folder = Path(tempfile.mkdtemp())

with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14"), watchdog=2.0) as arm:

    def person(seconds: float) -> devices.DeviceInput:
        """Push the stick to the left and down for a second."""
        return devices.DeviceInput.of([0, 1.0, -0.5, 0, 0, 0] if 0.2 < seconds < 1.2 else [0] * 6)

    def reset() -> None:
        """Go to the start of every episode."""
        arm.move(ha.ptp(HOME), speed=0.5)

    # two demonstrations by a device (a real one: devices.spacemouse()), with a sensor of your own beside the arm
    with arm.episodes(
        folder / "episodes", rate=20, task="Move aside", streams={"load": lambda: [0.0]}, reset=reset
    ) as episodes:
        for _ in range(2):
            with episodes.episode() as episode:
                skills.teleoperate(arm, devices.synthetic(person), scale=0.1, watchdog=1.0, duration=1.6)
                episode.succeed()

    found = ha.load_episodes(folder / "episodes", labels=["success"])
    print(found)
    print(ha.save_lerobot(found, folder / "data"))

    # a "policy" that repeats the first one, in chunks that come 0.3 s late
    reset()
    actions = found[0].action
    with arm.servo("joint", rate=50, speed=0.5, acceleration=0.5, watchdog=1.0) as sv:
        sv.hold()
        step, begin = 0, sv.t + 0.5
        while step < len(actions):
            seen = sv.t
            step = max(0, round((seen - begin) * 20))
            while sv.tick() and sv.t < seen + 0.3:
                pass  # inference
            chunk = actions[step : step + 25]
            if len(chunk) and begin + (step + len(chunk) - 1) / 20 > sv.t + 0.1:
                print(sv.follow(chunk, at=begin + step / 20, rate=20))
        while sv.tick() and np.abs(arm.state.q - actions[-1]).max() > 3e-3:
            pass
    print(f"at the end of the demonstration to within {np.abs(arm.state.q - actions[-1]).max():.4f} rad")
