"""D9, D10: the ROS 2 node with real rclpy: how a trajectory is followed, how evenly joint states come."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from bench.process import Cabinet
from bench.registry import Figure, benchmark

ROOT = Path(__file__).parents[1]
PYTHON = ROOT / "build" / "ros2" / "bin" / "python"


def _peer(what: str, target: str = "") -> dict[str, Any]:
    """What the peer in the environment of ROS 2 measured; it prints the node's log before."""
    environment = os.environ | {
        "ROS_DOMAIN_ID": str(os.getpid() % 101),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }
    done = subprocess.run(
        [str(PYTHON), "-m", "bench.ros2_peer", what, target],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        timeout=300,
    )
    return dict(json.loads(done.stdout.splitlines()[-1]))


def _is_there() -> bool:
    if not PYTHON.exists():
        print("no ROS 2 here (make test-ros2 sets it up): its figures are left out", file=sys.stderr)
    return PYTHON.exists()


@benchmark("ros2_trajectory", "D9")
def ros2_trajectory() -> Iterator[Figure]:
    """10 s through 100 points over the action: how far from each point, how far from its time."""
    if not _is_there():
        return
    with Cabinet() as cabinet:
        for way, moment, distance in (("servo", 20.0, 2.0), ("fri", 5.0, 0.5)):
            found = _peer(f"trajectory_{way}", cabinet.target)
            detail = {name: round(value, 6) for name, value in found.items()}
            name = f"ros2_{way}_point"
            yield Figure(f"{name}_moment", "D9", found["moment"] * 1e3, "ms", limit=moment, detail=detail)
            yield Figure(f"{name}_distance", "D9", found["distance"] * 1e3, "mrad", limit=distance)
            yield Figure(f"{name}_at_its_time", "D9", found["at_its_time"] * 1e3, "mrad")


@benchmark("ros2_states", "D10")
def ros2_states() -> Iterator[Figure]:
    """Joint states at 200 Hz for 60 s: late ones, and the latency from the cabinet beside that of a bare topic."""
    if not _is_there():
        return
    with Cabinet() as cabinet:
        found = _peer("states", cabinet.target)
    bare = _peer("bare")
    detail = {name: round(value, 6) for name, value in found.items()}
    yield Figure("ros2_states_late", "D10", found["late"] * 100, "%", limit=0.5, detail=detail)
    yield Figure("ros2_states_rate", "D10", found["rate"], "Hz")
    for name in ("latency_median", "latency_p99"):
        yield Figure(
            f"ros2_states_{name}", "D10", found[name] * 1e3, "ms", detail={"bare_ms": bare[name] * 1e3}
        )
