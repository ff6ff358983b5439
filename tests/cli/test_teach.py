"""`heptarm teach` and `heptarm replay`; the simulated operator guides the arm by timed commands."""

from __future__ import annotations

from pathlib import Path

import heptarm as ha
from tests.cli.running import objects, run, sim


def test_taught_and_replayed(tmp_path: Path) -> None:
    file = tmp_path / "path.npz"
    hand = [word for second in range(2, 40, 2) for word in ("--fault", f"push 0 4 4 0.3@{second}")]
    with sim(*hand, "--speed", "2") as ready:
        target = ("--target", ready["target"])
        (taught,) = objects("teach", str(file), "--free", "xyz", "--seconds", "3", *target)
        assert taught["recorded"] > taught["points"] >= 2 and file.exists()
        (done,) = objects("replay", str(file), "--by", "spline", "--speed-scaling", "0.3", *target)
        assert done["cause"] == "finished" and done["deviation_rad"] < 0.2
        recorded = tmp_path / "run.mcap"
        with ha.connect(ready["target"], watchdog=5.0, timeout=30.0) as arm, arm.record(recorded):
            arm.move(ha.ptp(arm.state.q + 0.1), speed=0.5)
        (again,) = objects("replay", str(recorded), "--by", "spline", "--speed-scaling", "0.5", *target)
        assert again["cause"] == "finished" and again["deviation_rad"] < 0.05
        refused = run("replay", str(tmp_path / "none.npz"), *target)
        assert refused.returncode == 1 and "none.npz" in refused.stderr
        refused = run("replay", str(file), "--speed-scaling", "0", *target)
        assert refused.returncode == 1 and "--speed-scaling must be in (0, 100], got 0" in refused.stderr
