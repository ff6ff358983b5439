"""Random programs: what a client may do, as values that hypothesis generates and shrinks.

A step is a frozen value with a method `run(arm)`. Refusals are the point of many of them: a `HeptarmError` ends a step,
and the program continues. Anything else that is raised is a defect.
"""

from __future__ import annotations

import contextlib
import math
import os
import socket
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from hypothesis import strategies as st

import heptarm as ha
from heptarm.model import forward
from heptarm.modes import CartesianImpedance, JointImpedance
from heptarm.when import force
from tests.long import longer

#: Postures that people teach, and their neighbourhood [deg].
TAUGHT = (
    (0, 30, 0, -90, 0, 60, 0),
    (0, 0, 0, 0, 0, 0, 0),
    (0, 0, 0, -90, 0, 90, 0),
    (0, 45, 0, -90, 0, 0, 0),
    (20, 0, 40, -90, 0, 60, 0),
    (90, 60, 0, -60, 0, 0, 90),
    (0, 115, 0, -115, 0, 115, 0),
    (165, 30, 165, -90, 0, 60, 170),
)
_LIMIT = np.deg2rad([170, 120, 170, 120, 170, 120, 175])


class Step(Protocol):
    """Something that a client does."""

    @property
    def is_compliant(self) -> bool:
        """Whether the arm does not follow its set-points closely, so that they are judged by less."""
        ...

    def run(self, arm: ha.Arm) -> None:
        """Do it."""
        ...


@dataclass(frozen=True)
class Posture:
    """A taught posture with offsets [deg]."""

    taught: int
    offset: tuple[int, ...]

    @property
    def q(self) -> np.ndarray:
        """Joint positions, shape (7,) [rad]; within the limits."""
        return np.asarray(np.clip(np.deg2rad(np.add(TAUGHT[self.taught], self.offset)), -_LIMIT, _LIMIT))


@dataclass(frozen=True)
class Move:
    """A motion, which may be cancelled, stopped or paused before its end."""

    kind: str
    goal: Posture
    speed: float
    mode: str
    interrupted: str
    after: float

    @property
    def is_compliant(self) -> bool:
        """Whether the arm is compliant."""
        return self.mode != "position"

    def motion(self, arm: ha.Arm) -> Any:
        q = self.goal.q
        pose = ha.Pose.from_matrix(forward(arm.robot, q))
        here = arm.state.pose
        match self.kind:
            case "ptp":
                return ha.ptp(q)
            case "ptp pose":
                return ha.ptp(pose)
            case "ptp near":
                return ha.ptp(pose, near=q)
            case "lin":
                return ha.lin(pose)
            case "lin turned":
                return ha.lin(ha.Pose.of(here.xyz, pose.quat))
            case "lin_rel":
                return ha.lin_rel(*(0.2 * np.sin(q[:3])).tolist())
            case "spline":
                points = [ha.Pose.of(here.xyz + step * np.sin(q[:3]), here.quat) for step in (0.05, 0.1)]
                return ha.spline(points)
            case "program":
                return [ha.ptp(q), ha.lin_rel(z=0.05), ha.ptp(np.zeros(7))]
            case _:
                return ha.ptp_home()

    def run(self, arm: ha.Arm) -> None:
        """Start it, and wait for its end or for what interrupts it."""
        mode = {
            "position": None,
            "joint": JointImpedance(stiffness=500.0),
            "cartesian": CartesianImpedance(stiffness=(500.0, 500.0, 500.0, 50.0, 50.0, 50.0)),
        }[self.mode]
        until = force > 20 if self.interrupted == "force" else None
        handle = arm.start(self.motion(arm), speed=self.speed, mode=mode, until=until)
        if self.interrupted not in ("no", "force"):
            began = arm.state.stamp
            arm.wait_until(lambda s: (s.stamp - began) * 1e-9 > self.after or handle.done, timeout=30.0)
            match self.interrupted:
                case "cancel":
                    handle.cancel()
                case "stop path":
                    arm.stop("path")
                case "stop fast":
                    arm.stop("fast")
                case "override":
                    arm.set_override(0.1)
                    arm.set_override(1.0)
                case "pause":
                    arm.pause()
                    arm.resume()
                case "lost":
                    cut(arm)
                    return
                case fault:
                    arm.operator.fault(fault)  # type: ignore[arg-type]
        handle.wait(timeout=60.0)


@dataclass(frozen=True)
class Stream:
    """A servo stream towards a posture: in steps, smooth, or of velocities, ended in one of several manners."""

    kind: str
    goal: Posture
    speed: float
    shape: str
    count: int
    ending: str
    engine: str
    is_compliant = False

    def run(self, arm: ha.Arm) -> None:
        """Send the targets."""
        q0 = arm.state.q
        settings: dict[str, Any] = {"rate": 200.0, "watchdog": 1.0}
        if self.kind in ("joint", "pose"):
            settings |= {"speed": self.speed, "engine": self.engine}
        elif self.kind == "velocity":
            settings |= {"speed": self.speed}
        elif self.kind == "lin":
            settings |= {"speed_mps": 2.0 * self.speed, "speed_radps": 4.0 * self.speed}
        with arm.servo(self.kind, **settings) as sv:  # type: ignore[call-overload]
            for number in range(self.count):
                if sv.tick() is None:
                    break
                part = 1.0 if self.shape == "step" else math.sin(3.0 * number / self.count)
                sv.set(self.target(arm, q0, part))
            if self.ending == "error":
                raise Interrupted
            if self.ending == "lost":
                cut(arm)
            elif self.ending == "stop":
                arm.stop("fast")
            elif self.ending == "fault":
                arm.operator.fault("emergency_stop")

    def target(self, arm: ha.Arm, q0: np.ndarray, part: float) -> Any:
        q = q0 + part * (self.goal.q - q0)
        match self.kind:
            case "joint":
                return q
            case "velocity":
                return part * np.sign(self.goal.q - q0) * arm.robot.dq_max
            case "twist":
                return part * np.concatenate([0.5 * np.sin(self.goal.q[:3]), np.sin(self.goal.q[3:6])])
            case _:
                return ha.Pose.from_matrix(forward(arm.robot, q))


@dataclass(frozen=True)
class Fri:
    """An FRI session: positions towards a posture, torques or a wrench, ended in one of several manners."""

    kind: str
    goal: Posture
    period: int
    shape: str
    seconds: float
    ending: str

    @property
    def is_compliant(self) -> bool:
        """Whether the arm is compliant: under torques and wrenches. The guard limits positions."""
        return self.kind != "position"

    def run(self, arm: ha.Arm) -> None:
        """Answer the messages."""
        mode = {
            "position": None,
            "torque": JointImpedance(stiffness=100.0),
            "wrench": CartesianImpedance(stiffness=(500.0, 500.0, 500.0, 50.0, 50.0, 50.0)),
        }[self.kind]
        with arm.fri(self.kind, period_ms=self.period, mode=mode, timeout=3.0) as rt:  # type: ignore[arg-type]
            for s in rt:
                rt.command(**self.command(rt.start.q_ipo, s.t))
                if s.t > self.seconds:
                    break
            match self.ending:
                case "error":
                    raise Interrupted
                case "lost":
                    cut(arm)
                case "stop":
                    arm.stop("fast")
                case "fault":
                    arm.operator.fault("emergency_stop")

    def command(self, q0: np.ndarray, t: float) -> dict[str, Any]:
        part = 1.0 if self.shape == "step" else math.sin(2.0 * t)
        match self.kind:
            case "position":
                return {"q": q0 + part * (self.goal.q - q0)}
            case "torque":
                return {"tau": 100.0 * part * np.sin(self.goal.q)}
            case _:
                return {"wrench": part * np.concatenate([100.0 * np.sin(self.goal.q[:3]), np.zeros(3)])}


class Interrupted(Exception):
    """A program's own error in a stream."""


@dataclass(frozen=True)
class Outside:
    """What others do meanwhile: a person beside the robot, a stranger on the network."""

    what: str
    is_compliant = False

    def run(self, arm: ha.Arm) -> None:
        """Do it."""
        match self.what:
            case "garbage":
                with (
                    contextlib.suppress(OSError),
                    socket.create_connection(address(arm), timeout=5.0) as stranger,
                ):
                    stranger.sendall(bytes(range(256)) * 4)
            case "recover":
                arm.operator.clear()
                arm.recover(timeout=5.0)
            case "push":
                arm.operator.start_push((0.0, 20.0, -30.0), duration=0.3)
            case "t1":
                arm.operator.choose("t1")
                arm.operator.hold()
            case "aut":
                arm.operator.choose("aut")
            case "tool":
                arm.attach_tool(ha.Tool("weight", mass=2.0, com=(0.0, 0.0, 0.1)))
            case "no tool":
                arm.detach_tool()
            case fault:
                arm.operator.fault(fault)  # type: ignore[arg-type]


def cut(arm: ha.Arm) -> None:
    """Cut the connection, as a pulled cable does to both sides."""
    for number in map(int, os.listdir("/proc/self/fd")):
        with contextlib.suppress(OSError):
            if not stat.S_ISSOCK(os.fstat(number).st_mode):  # else its copy would stay open
                continue
            with socket.socket(fileno=os.dup(number)) as line:
                if line.getpeername() == address(arm):
                    line.shutdown(socket.SHUT_RDWR)


def address(arm: ha.Arm) -> tuple[str, int]:
    """Where the cabinet listens."""
    host, _, port = arm.connection.link.peer.rpartition(":")
    return host, int(port)


FAULTS = ("emergency_stop", "external_emergency_stop", "operator_safety", "protective_stop", "drive_error")
_offsets = st.tuples(*(st.sampled_from((0, 0, 0, -15, 15, -60, 60, 1)) for _ in range(7)))
postures = st.builds(Posture, st.integers(0, len(TAUGHT) - 1), _offsets)
_speeds = st.sampled_from((0.2, 1.0))
moves = st.builds(
    Move,
    st.sampled_from(
        ("ptp", "ptp pose", "ptp near", "lin", "lin turned", "lin_rel", "spline", "program", "home")
    ),
    postures,
    _speeds,
    st.sampled_from(("position", "position", "joint", "cartesian")),
    st.sampled_from(
        ("no", "no", "no", "cancel", "stop path", "stop fast", "override", "pause", "lost", "force", *FAULTS)
    ),
    st.sampled_from((0.02, 0.3, 0.8)),
)
streams = st.builds(
    Stream,
    st.sampled_from(("joint", "pose", "lin", "velocity", "twist")),
    postures,
    _speeds,
    st.sampled_from(("step", "smooth")),
    st.sampled_from((5, 60, 300)),
    st.sampled_from(("leave", "leave", "error", "lost", "stop", "fault")),
    st.sampled_from(("smart", "direct")),
)
fri = st.builds(
    Fri,
    st.sampled_from(("position", "position", "torque", "wrench")),
    postures,
    st.sampled_from((5, 10)),
    st.sampled_from(("step", "smooth")),
    st.sampled_from((0.3, 1.5)),
    st.sampled_from(("leave", "leave", "error", "lost", "stop", "fault")),
)
outside = st.builds(
    Outside,
    st.sampled_from(("recover", "recover", "garbage", "push", "t1", "aut", "tool", "no tool", *FAULTS)),
)
_usual = (moves, streams, moves, streams, moves, streams, outside)
#: Sessions of FRI answer by this machine's clock, and a busy one opens none in time: in the long run only, and rarely.
#: test_random_sessions.py has theirs on the clock of the plant.
programs = st.lists(
    st.one_of(*_usual, *longer((), (*_usual, fri))),
    min_size=1,
    max_size=5,
)


@contextlib.contextmanager
def refusals() -> Iterator[None]:
    """Errors that heptarm raises on purpose, and the program's own one."""
    try:
        yield
    except (ha.HeptarmError, Interrupted):
        pass
