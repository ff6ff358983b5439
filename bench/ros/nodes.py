"""The nodes with rclpy and a roscore: accuracy of trajectories, lag of streams, regularity of joint states."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import heptarm as ha
from bench.measure.blocks import Comparison, placements
from bench.measure.cabinet import WARM_UP, Cabinet
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from bench.ros.peer import RATE

ROOT = Path(__file__).parents[2]
#: Required accuracy in time [ms] and position [mrad] at the points of a trajectory, by execution.
EXECUTIONS = {"servo": (20.0, 2.0), "fri": (2.0, 0.5)}
#: How often a trajectory is executed; the median counts.
RUNS = 3
#: Largest fraction of joint states that are late by more than a period [%].
LATE = 0.5
#: Largest latency of a joint state beyond that of a bare topic [ms].
BEYOND = 0.5


def _peer(ros: str, what: str, *words: str) -> dict[str, Any]:
    """What the peer in the environment of a ROS measured; it prints the node's log before."""
    environment = os.environ | {
        "ROS_DOMAIN_ID": str(os.getpid() % 101),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }
    done = subprocess.run(
        [str(_python(ros)), "-m", f"bench.ros.{ros}_peer", what, *words],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        timeout=300,
    )
    return dict(json.loads(done.stdout.splitlines()[-1]))


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
        for execution, (moment, distance) in EXECUTIONS.items():
            runs, noisy = [], 0
            for _ in range(RUNS):
                with Noise() as noise:
                    runs.append(_peer(ros, f"trajectory_{execution}", cabinet.target))
                # a virtual cabinet that the machine holds up loses time, which no real one does
                noisy += noise.is_noisy or runs[-1]["longest_gap"] > 2.0 / RATE
            found = {name: median(run[name] for run in runs) for name in runs[0]}
            disturbed = 2 * noisy > RUNS
            detail = {name: [round(run[name], 6) for run in runs] for name in found}
            name = f"{ros}_{execution}_point"
            yield Figure(
                f"{name}_moment",
                found["moment"] * 1e3,
                "ms",
                limit=moment,
                disturbed=disturbed,
                detail=detail,
            )
            yield Figure(
                f"{name}_distance", found["distance"] * 1e3, "mrad", limit=distance, disturbed=disturbed
            )
            yield Figure(f"{name}_at_its_time", found["at_its_time"] * 1e3, "mrad")


def _stream(ros: str) -> Iterator[Figure]:
    if not _is_there(ros):
        return
    with Cabinet() as cabinet, Noise() as noise:
        found = _peer(ros, "stream", cabinet.target)
    for rate, values in found.items():
        name = f"{ros}_stream_{rate}hz"
        yield Figure(
            f"{name}_lag", values["lag"] * 1e3, "ms", limit=40.0, disturbed=noise.is_noisy, detail=values
        )
        yield Figure(f"{name}_speed", values["speed"] * 100, "%", limit=5.0, disturbed=noise.is_noisy)


def _states(ros: str) -> Iterator[Figure]:
    if not _is_there(ros):
        return
    with Cabinet() as cabinet:
        with ha.connect(cabinet.target, state_rate=1000) as arm:
            for _ in arm.states(duration=WARM_UP):
                pass
        found = _peer(ros, "states", cabinet.target, str(cabinet.process.pid))
    for rate, measured in found.items():
        name = f"{ros}_states_{rate}hz"
        comparisons = {placement.name: Comparison(placement) for placement in placements()}
        for block in measured["blocks"]:
            noise = Noise(others=block["others"], stolen=block["stolen"])
            comparisons[block["placement"]].add(block["values"], block["floors"], noise)
        noisy = any(noise.is_noisy for comparison in comparisons.values() for noise in comparison.noise)
        yield Figure(f"{name}_late", measured["late"] * 100, "%", limit=LATE, disturbed=noisy)
        yield Figure(f"{name}_rate", measured["rate"], "Hz")
        for comparison in comparisons.values():
            yield comparison.figure(name, 50, "ms", scale=1e3)
            yield comparison.figure(f"{name}_p99", 99, "ms", scale=1e3)
            beyond = [
                float(np.median(v) - np.median(f)) * 1e3
                for v, f in zip(comparison.values, comparison.floors, strict=True)
            ]
            yield Figure(
                f"{name}_beyond_{comparison.placement.name}",
                median(beyond),
                "ms",
                limit=BEYOND,
                disturbed=2 * sum(noise.is_noisy for noise in comparison.noise) > len(comparison.noise),
                detail={"blocks": [round(each, 3) for each in beyond]},
            )


@benchmark("ros2_trajectory")
def ros2_trajectory() -> Iterator[Figure]:
    """FollowJointTrajectory over ROS 2, 100 points in 10 s: distance from each point, and from its time."""
    yield from _trajectory("ros2")


@benchmark("ros1_trajectory")
def ros1_trajectory() -> Iterator[Figure]:
    """FollowJointTrajectory over ROS 1, 100 points in 10 s: distance from each point, and from its time."""
    yield from _trajectory("ros1")


@benchmark("ros2_stream")
def ros2_stream() -> Iterator[Figure]:
    """Single points on the trajectory topic of ROS 2, 0.3 rad in 4 s: lag, and error of the speed over its peak."""
    yield from _stream("ros2")


@benchmark("ros1_stream")
def ros1_stream() -> Iterator[Figure]:
    """Single points on the trajectory topic of ROS 1, 0.3 rad in 4 s: lag, and error of the speed over its peak."""
    yield from _stream("ros1")


@benchmark("ros2_states")
def ros2_states() -> Iterator[Figure]:
    """ROS 2: joint states at 200 Hz and 500 Hz: late ones, and their latency beside that of a bare topic."""
    yield from _states("ros2")


@benchmark("ros1_states")
def ros1_states() -> Iterator[Figure]:
    """ROS 1: joint states at 200 Hz and 500 Hz: late ones, and their latency beside that of a bare topic."""
    yield from _states("ros1")
