"""Accuracy of end positions and of straight lines."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import heptarm as ha
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark


@benchmark("ptp_residual")
def ptp_residual() -> Iterator[Figure]:
    """Largest joint residual of 20 finished PTP motions."""
    random = np.random.default_rng(1)
    worst = 0.0
    with Cabinet("--speed", "4") as cabinet, ha.connect(cabinet.target) as arm:
        for _ in range(20):
            q = np.array([0, 0.4, 0, -1.4, 0, 0.9, 0]) + random.uniform(-0.4, 0.4, 7)
            result = arm.move(ha.ptp(q))
            worst = max(worst, result.residual, float(np.abs(arm.wait_for_rest().q - q).max()))
    yield Figure("ptp_residual", worst, "rad", limit=1e-4)


@benchmark("lin_straightness")
def lin_straightness() -> Iterator[Figure]:
    """Deviation of measured poses from the straight line and its orientation, 6 LIN motions."""
    off, turn = 0.0, 0.0
    count = 0
    with Cabinet() as cabinet, ha.connect(cabinet.target, state_rate=500) as arm:
        arm.move(ha.ptp(ha.deg(0, 30, 0, -80, 0, 70, 0)))
        for x, y, z, a in ((0, 0.3, 0, 0.3), (0.1, -0.4, 0.1, -0.6), (-0.1, 0.1, -0.2, 0.3)) * 2:
            start = arm.wait_for_rest().pose
            end = ha.Pose.of(start.xyz + [x, y, z], (start @ ha.Pose.xyz_abc(a=a)).quat)
            handle = arm.start(ha.lin(end, near=arm.state.q))
            poses = []
            for state in arm.states():
                poses.append(state.pose)
                if handle.done:
                    break
            handle.wait(timeout=10)
            d, r = _deviation(start, end, poses)
            off, turn, count = max(off, d), max(turn, r), count + len(poses)
    yield Figure("lin_straightness", off * 1e3, "mm", limit=0.5, detail={"poses": count})
    yield Figure("lin_orientation", float(np.degrees(turn)), "deg", limit=0.2, detail={"poses": count})


def _deviation(start: ha.Pose, end: ha.Pose, poses: list[ha.Pose]) -> tuple[float, float]:
    """Largest distance from the line [m], and from the orientation that belongs to the foot point [rad]."""
    line = end.xyz - start.xyz
    total = start.angle_to(end)
    off = turn = 0.0
    for pose in poses:
        s = float(np.clip((pose.xyz - start.xyz) @ line / (line @ line), 0.0, 1.0))
        off = max(off, float(np.linalg.norm(start.xyz + s * line - pose.xyz)))
        # along one axis: the angles to both ends must be s and 1 - s of the whole
        turn = max(turn, abs(start.angle_to(pose) - s * total), abs(pose.angle_to(end) - (1 - s) * total))
    return off, turn
