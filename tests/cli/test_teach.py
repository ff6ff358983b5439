"""`heptarm teach` and `heptarm replay`; the simulated operator guides the arm by timed commands."""

from __future__ import annotations

from pathlib import Path

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
        refused = run("replay", str(tmp_path / "none.npz"), *target)
        assert refused.returncode == 1 and "none.npz" in refused.stderr
