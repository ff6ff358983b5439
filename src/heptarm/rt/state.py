"""What a law and a user see of one monitoring message."""

from __future__ import annotations

import time

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected
from heptarm.fri.messages import (
    CommandMode,
    ControlMode,
    DriveState,
    IpoData,
    Monitoring,
    OperationMode,
    Overlay,
    Quality,
    RobotInfo,
    Safety,
    SessionState,
)
from heptarm.rt import layout as at
from heptarm.rt.signals import Signals
from heptarm.values.io import SignalValues
from heptarm.values.pose import Pose

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


class State:
    """One monitoring message with what was answered to it. Arrays are NaN where the controller sends nothing.

    Args:
        words: one slot of the ring of states, shape (122,); it is not copied.
        signals: of the session.

    Attributes:
        signals: of the session.
    """

    __slots__ = ("_floats", "_ints", "signals")

    def __init__(self, words: Floats, signals: Signals | None = None) -> None:
        self._floats = words
        self._ints: Ints = words.view(np.int64)
        self.signals = Signals() if signals is None else signals

    @property
    def q(self) -> Floats:
        """Measured position, shape (7,) [rad]."""
        return self._floats[at.S_Q : at.S_Q + 7]

    @property
    def tau(self) -> Floats:
        """Measured torques, shape (7,) [Nm]."""
        return self._floats[at.S_TAU : at.S_TAU + 7]

    @property
    def tau_cmd(self) -> Floats:
        """Torques that the controller commands, shape (7,) [Nm]."""
        return self._floats[at.S_TAU_CMD : at.S_TAU_CMD + 7]

    @property
    def tau_ext(self) -> Floats:
        """External torques, shape (7,) [Nm]."""
        return self._floats[at.S_TAU_EXT : at.S_TAU_EXT + 7]

    @property
    def q_cmd(self) -> Floats:
        """Position that the controller commands, shape (7,) [rad]; FRI 1.x only."""
        return self._floats[at.S_Q_CMD : at.S_Q_CMD + 7]

    @property
    def q_ipo(self) -> Floats:
        """Interpolator's position, on which the overlay is laid, shape (7,) [rad]."""
        return self._floats[at.S_Q_IPO : at.S_Q_IPO + 7]

    @property
    def wrench(self) -> Floats:
        """External wrench, shape (6,) [N, Nm]; FRI 2.7 only."""
        return self._floats[at.S_WRENCH : at.S_WRENCH + 6]

    @property
    def pose(self) -> Pose:
        """Measured pose; FRI 2.x only.

        Raises:
            CommandRejected: this version of FRI has none.
        """
        numbers = self._floats[at.S_POSE : at.S_POSE + 7]
        if numbers[0] != numbers[0]:
            raise CommandRejected(
                "the controller sends no pose", hint="FRI 1.x has none: use heptarm.model.forward(robot, s.q)"
            )
        return _pose(numbers)

    @property
    def pose_ipo(self) -> Pose:
        """Interpolator's pose, on which the overlay is laid.

        Raises:
            CommandRejected: no pose is commanded in this session, or not yet.
        """
        return _commanded(self._floats[at.S_POSE_IPO : at.S_POSE_IPO + 7])

    @property
    def e1(self) -> float:
        """Redundancy angle of the pose [rad]; NaN if there is none."""
        return float(self._floats[at.S_E1])

    @property
    def e1_ipo(self) -> float:
        """Interpolator's redundancy angle [rad]; NaN if no pose is commanded, or there is none."""
        return float(self._floats[at.S_E1_IPO])

    @property
    def io(self) -> SignalValues:
        """The session's signals in this message: `s.io["Flange.UserButton"]` or `s.io.user_button`."""
        numbers = self._floats[at.S_IO : at.S_IO + len(self.signals)]
        return SignalValues(self.stamp, self.signals.values(numbers.tolist()))

    @property
    def q_sent(self) -> Floats:
        """Position that was answered, shape (7,) [rad]."""
        return self._floats[at.S_Q_SENT : at.S_Q_SENT + 7]

    @property
    def tau_sent(self) -> Floats:
        """Torques that were answered, shape (7,) [Nm]."""
        return self._floats[at.S_TAU_SENT : at.S_TAU_SENT + 7]

    @property
    def wrench_sent(self) -> Floats:
        """Wrench that was answered, shape (6,) [N, Nm]."""
        return self._floats[at.S_WRENCH_SENT : at.S_WRENCH_SENT + 6]

    @property
    def pose_sent(self) -> Pose:
        """Pose that was answered.

        Raises:
            CommandRejected: no pose is commanded in this session, or not yet.
        """
        return _commanded(self._floats[at.S_POSE_SENT : at.S_POSE_SENT + 7])

    @property
    def e1_sent(self) -> float:
        """Redundancy angle that was answered [rad]; NaN if none was."""
        return float(self._floats[at.S_E1_SENT])

    @property
    def session(self) -> SessionState:
        """State of the session."""
        return SessionState(int(self._ints[at.S_SESSION]))

    @property
    def is_commanding(self) -> bool:
        """Commands are effective."""
        return bool(self._ints[at.S_SESSION] == SessionState.COMMANDING_ACTIVE)

    @property
    def quality(self) -> Quality:
        """Quality of the connection."""
        return Quality(int(self._ints[at.S_QUALITY]))

    @property
    def mode(self) -> CommandMode:
        """Client command mode."""
        return CommandMode(int(self._ints[at.S_MODE]))

    @property
    def overlay(self) -> Overlay | None:
        """Type of the overlay."""
        value = int(self._ints[at.S_OVERLAY])
        return None if value == at.ABSENT else Overlay(value)

    @property
    def safety(self) -> Safety | None:
        """Safety state."""
        value = int(self._ints[at.S_SAFETY])
        return None if value == at.ABSENT else Safety(value)

    @property
    def operation_mode(self) -> OperationMode | None:
        """Operation mode."""
        value = int(self._ints[at.S_OPERATION])
        return None if value == at.ABSENT else OperationMode(value)

    @property
    def control_mode(self) -> ControlMode | None:
        """Control mode under the overlay."""
        value = int(self._ints[at.S_CONTROL])
        return None if value == at.ABSENT else ControlMode(value)

    @property
    def drive(self) -> DriveState | None:
        """State of the drives; TRANSITIONING if they differ."""
        value = int(self._ints[at.S_DRIVE])
        return None if value == at.ABSENT else DriveState(value)

    @property
    def tracking(self) -> float:
        """Tracking performance, 0 to 1; NaN outside COMMANDING_ACTIVE."""
        return float(self._floats[at.S_TRACKING])

    @property
    def sequence(self) -> int:
        """Controller's counter."""
        return int(self._ints[at.S_SEQUENCE])

    @property
    def stamp(self) -> int:
        """Controller's clock [ns since 1970]; 0 if it sends none."""
        return int(self._ints[at.S_STAMP])

    @property
    def received(self) -> int:
        """This machine's monotonic clock at the message's receipt [ns]."""
        return int(self._ints[at.S_RECEIVED])

    @property
    def age(self) -> float:
        """Time since its receipt [s]."""
        return (time.monotonic_ns() - self.received) * 1e-9

    @property
    def period(self) -> float:
        """Send period [s]."""
        return float(self._ints[at.S_PERIOD]) * 1e-9

    @property
    def t(self) -> float:
        """Controller's time since commands became effective [s]; 0 before."""
        return float(self._ints[at.S_TICKS]) * self.period

    @property
    def latency(self) -> float:
        """Receipt to answer [s]; 0 without an answer."""
        return float(self._ints[at.S_LATENCY]) * 1e-9

    @property
    def is_answered(self) -> bool:
        """It was answered."""
        return bool(self._ints[at.S_FLAGS] & at.ANSWERED)

    @property
    def is_filled(self) -> bool:
        """The answer was made by the policy, without a fresh command."""
        return bool(self._ints[at.S_FLAGS] & at.FILLED)

    @property
    def is_limited(self) -> bool:
        """The guard changed something in the answer."""
        return bool(self._ints[at.S_FLAGS] & at.LIMITED)

    def __repr__(self) -> str:
        return (
            f"State({self.sequence}, {self.session.name}, {self.quality.name}, q={self.q.round(4).tolist()})"
        )


def _pose(numbers: Floats) -> Pose:
    """The pose of FRI's numbers: x y z [mm], w x y z."""
    return Pose.of(numbers[:3] * 1e-3, numbers[[4, 5, 6, 3]])


def _commanded(numbers: Floats) -> Pose:
    """A pose of a session that commands poses."""
    if numbers[0] != numbers[0]:
        raise CommandRejected(
            "no pose is commanded here",
            hint="poses are commanded in COMMANDING_ACTIVE of a session of kind pose",
        )
    return _pose(numbers)


def information(full: Monitoring) -> tuple[int, ...]:
    """What seldom changes: overlay, safety, operation, control, drive, multiplier."""
    robot, ipo = full.robot or RobotInfo(), full.ipo or IpoData()
    drives = set(robot.drives)
    drive = None if not drives else drives.pop() if len(drives) == 1 else DriveState.TRANSITIONING
    multiplier = full.connection.multiplier if full.connection is not None else None
    values = (ipo.overlay, robot.safety, robot.operation_mode, robot.control_mode, drive, multiplier)
    return tuple(at.ABSENT if value is None else int(value) for value in values)
