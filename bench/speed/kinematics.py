"""Kinematics of 100,000 poses at once, beside Pinocchio's of one pose after another."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from bench.measure.blocks import BLOCKS
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from heptarm import model
from heptarm.values.robot import ROBOTS, RobotModel

POSES = 100_000
#: Poses that Pinocchio computes in a block; it takes as long for each of more.
OTHERS = 5_000
#: Limits for one pose [us].
FORWARD, JACOBIAN, INVERSE = 1.0, 2.0, 5.0


@benchmark("kinematics_in_bulk")
def kinematics_in_bulk() -> Iterator[Figure]:
    """Forward kinematics, Jacobian and inverse kinematics of 100,000 poses: time for one of them."""
    robot = ROBOTS["iiwa14"]
    q = np.random.default_rng(7).uniform(robot.q_min, robot.q_max, (POSES, 7))
    poses, own = model.forward_batch(robot, q), model.redundancy_batch(robot, q)
    found = model.solve_batch(robot, poses, e1=own.e1, status=own.status)
    solved = float((np.abs(model.forward_batch(robot, found) - poses).max(axis=(1, 2)) < 1e-9).mean())
    peer = _Pinocchio(robot)
    if not np.allclose(peer.forward(q[:100]), poses[:100], atol=1e-9):
        raise RuntimeError("Pinocchio computes another chain")
    sides: dict[str, tuple[Callable[[], object], Callable[[], object] | None, float]] = {
        "bulk_forward": (lambda: model.forward_batch(robot, q), lambda: peer.forward(q[:OTHERS]), FORWARD),
        "bulk_jacobian": (
            lambda: model.jacobian_batch(robot, q),
            lambda: peer.jacobian(q[:OTHERS]),
            JACOBIAN,
        ),
        "bulk_inverse": (
            lambda: model.solve_batch(robot, poses, e1=own.e1, status=own.status),
            None,
            INVERSE,
        ),
        "bulk_inverse_near": (lambda: model.solve_batch(robot, poses, near=q), None, INVERSE),
    }
    for name, (ours, others, limit) in sides.items():
        ours()  # warm caches
        with Noise() as noise:
            times, theirs = [], []
            for _ in range(BLOCKS):
                times.append(_microseconds(ours, POSES))
                if others is not None:
                    theirs.append(_microseconds(others, OTHERS))
        detail = {"fastest_us": round(min(times), 3), "poses": POSES}
        if theirs:
            detail["pinocchio_us"] = round(float(np.median(theirs)), 3)
        # the limit is a time, not a ratio: Pinocchio's is a detail
        yield Figure(
            name, float(np.median(times)), "us", limit=limit, disturbed=noise.is_noisy, detail=detail
        )
    yield Figure("bulk_inverse_solved", solved, "fraction", limit=1.0, at_least=True)


def _microseconds(work: Callable[[], object], count: int) -> float:
    """Processor time for one of `count` poses [us]."""
    begin = time.thread_time_ns()
    work()
    return (time.thread_time_ns() - begin) / count / 1e3


class _Pinocchio:
    """The same chain in Pinocchio, one pose after another."""

    def __init__(self, robot: RobotModel) -> None:
        import pinocchio as pin

        self._pin = pin
        self._model = pin.Model()
        axes = (pin.JointModelRZ, pin.JointModelRY) * 3 + (pin.JointModelRZ,)
        heights = (robot.d_bs, 0.0, robot.d_se, 0.0, robot.d_ew, 0.0, 0.0)
        parent = 0
        for number, (axis, height) in enumerate(zip(axes, heights, strict=True)):
            # A4 turns the other way round
            turn = np.diag([-1.0, -1.0, 1.0]) if number in (3, 4) else np.eye(3)
            placed = pin.SE3(turn, np.array([0.0, 0.0, height]))
            parent = self._model.addJoint(parent, axis(), placed, f"A{number + 1}")
        flange = pin.SE3(np.eye(3), np.array([0.0, 0.0, robot.d_wf]))
        self._frame = self._model.addFrame(pin.Frame("flange", parent, flange, pin.FrameType.OP_FRAME))
        self._data = self._model.createData()

    def forward(self, q: npt.NDArray[np.float64]) -> list[npt.NDArray[np.float64]]:
        """Poses of the flange."""
        pin, chain, data, frame = self._pin, self._model, self._data, self._frame
        poses = []
        for one in q:
            pin.forwardKinematics(chain, data, one)
            poses.append(pin.updateFramePlacement(chain, data, frame).homogeneous)
        return poses

    def jacobian(self, q: npt.NDArray[np.float64]) -> list[npt.NDArray[np.float64]]:
        """Geometric Jacobians of the flange, base axes."""
        pin, chain, data, frame = self._pin, self._model, self._data, self._frame
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        return [pin.computeFrameJacobian(chain, data, one, frame, axes) for one in q]
