"""D9, D10: the nodes with real rclpy and a real roscore: how a trajectory is followed, how evenly joint states come."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from bench.process import Cabinet, stolen
from bench.registry import Figure, benchmark

ROOT = Path(__file__).parents[1]
#: How near in time [ms] and in space [mrad] each way of execution is to pass a point.
WAYS = {"servo": (20.0, 2.0), "fri": (5.0, 0.5)}


def _peer(ros: str, what: str, target: str = "") -> dict[str, Any]:
    """What the peer in the environment of a ROS measured; it prints the node's log before."""
    environment = os.environ | {
        "ROS_DOMAIN_ID": str(os.getpid() % 101),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }
    before = stolen()
    done = subprocess.run(
        [str(_python(ros)), "-m", f"bench.{ros}_peer", what, target],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        timeout=300,
    )
    return dict(json.loads(done.stdout.splitlines()[-1])) | {"stolen_s": stolen() - before}


def _python(ros: str) -> Path:
    return ROOT / "build" / ros / "bin" / "python"


def _is_there(ros: str) -> bool:
    there = _python(ros).exists()
    if not there:
        print(f"no {ros} here (make test-{ros} sets it up): its figures are left out", file=sys.stderr)
    return there


def _trajectory(ros: str) -> Iterator[Figure]:
    if not _is_there(ros):
        return
    with Cabinet() as cabinet:
        for way, (moment, distance) in WAYS.items():
            found = _peer(ros, f"trajectory_{way}", cabinet.target)
            detail = {name: round(value, 6) for name, value in found.items()}
            name = f"{ros}_{way}_point"
            yield Figure(f"{name}_moment", "D9", found["moment"] * 1e3, "ms", limit=moment, detail=detail)
            yield Figure(f"{name}_distance", "D9", found["distance"] * 1e3, "mrad", limit=distance)
            yield Figure(f"{name}_at_its_time", "D9", found["at_its_time"] * 1e3, "mrad")


def _states(ros: str) -> Iterator[Figure]:
    if not _is_there(ros):
        return
    with Cabinet() as cabinet:
        found = _peer(ros, "states", cabinet.target)
    bare = _peer(ros, "bare")
    detail = {name: round(value, 6) for name, value in found.items()}
    yield Figure(f"{ros}_states_late", "D10", found["late"] * 100, "%", limit=0.5, detail=detail)
    yield Figure(f"{ros}_states_rate", "D10", found["rate"], "Hz")
    for name in ("latency_median", "latency_p99"):
        beside = {"bare_ms": bare[name] * 1e3}
        yield Figure(f"{ros}_states_{name}", "D10", found[name] * 1e3, "ms", detail=beside)


@benchmark("ros2_trajectory", "D9")
def ros2_trajectory() -> Iterator[Figure]:
    """10 s through 100 points over ROS 2's action: how far from each point, how far from its time."""
    yield from _trajectory("ros2")


@benchmark("ros1_trajectory", "D9")
def ros1_trajectory() -> Iterator[Figure]:
    """10 s through 100 points over ROS 1's action: how far from each point, how far from its time."""
    yield from _trajectory("ros1")


@benchmark("ros2_states", "D10")
def ros2_states() -> Iterator[Figure]:
    """ROS 2: joint states at 200 Hz for 60 s: late ones, and the latency beside that of a bare topic."""
    yield from _states("ros2")


@benchmark("ros1_states", "D10")
def ros1_states() -> Iterator[Figure]:
    """ROS 1: joint states at 200 Hz for 60 s: late ones, and the latency beside that of a bare topic."""
    yield from _states("ros1")
