"""Messages of FRI as values, the same for every version; a field that a version lacks is None.

Units are those on the wire (rad, Nm, N, and millimetres in transformations); the client converts them to SI. Joint
arrays have 7 entries.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field, fields

Joints = tuple[float, ...]

JOINTS = 7
MAX_IO = 10
MAX_TRANSFORMATIONS = 5
#: Largest number of characters of a name; it may be empty.
MAX_NAME = 63


class SessionState(enum.IntEnum):
    """State of an FRI session."""

    IDLE = 0
    MONITORING_WAIT = 1
    MONITORING_READY = 2
    COMMANDING_WAIT = 3
    COMMANDING_ACTIVE = 4


class Quality(enum.IntEnum):
    """Quality of the connection, as the controller rates it."""

    POOR = 0
    FAIR = 1
    GOOD = 2
    EXCELLENT = 3


class Safety(enum.IntEnum):
    """Safety state of the robot."""

    NORMAL_OPERATION = 0
    STOP_0 = 1
    STOP_1 = 2
    STOP_2 = 3


class OperationMode(enum.IntEnum):
    """Operation mode of the controller."""

    T1 = 0
    T2 = 1
    AUT = 2


class DriveState(enum.IntEnum):
    """State of the drives."""

    OFF = 0
    TRANSITIONING = 1
    ACTIVE = 2


class ControlMode(enum.IntEnum):
    """Control mode of the motion under the overlay."""

    POSITION = 0
    CARTESIAN_IMPEDANCE = 1
    JOINT_IMPEDANCE = 2
    NO_CONTROL = 3


class CommandMode(enum.IntEnum):
    """Quantity that the client commands. POSITION is called JOINT_POSITION from 2.x on."""

    NO_COMMAND = 0
    POSITION = 1
    WRENCH = 2
    TORQUE = 3
    CARTESIAN_POSE = 4


class Overlay(enum.IntEnum):
    """Type of the motion overlay."""

    NONE = 0
    JOINT = 1
    CARTESIAN = 2


class IoType(enum.IntEnum):
    """Type of a signal."""

    BOOLEAN = 0
    DIGITAL = 1
    ANALOG = 2


class IoDirection(enum.IntEnum):
    """Direction of a signal, seen from the controller."""

    INPUT = 0
    OUTPUT = 1


class RedundancyStrategy(enum.IntEnum):
    """Meaning of the redundancy value."""

    E1 = 0
    NONE = 4


@dataclass(frozen=True, slots=True)
class Header:
    """Counters of the messages: the sender's, and the last one received from the other side."""

    sequence: int
    reflected: int


@dataclass(frozen=True, slots=True)
class TimeStamp:
    """Time of the controller's clock, UNIX epoch."""

    seconds: int
    nanoseconds: int


@dataclass(frozen=True, slots=True)
class Redundancy:
    """Redundancy of a Cartesian pose; `value` is E1 [rad]."""

    strategy: RedundancyStrategy
    value: float


@dataclass(frozen=True, slots=True)
class Transformation:
    """A named frame: 12 numbers (3x4 row-major, mm) in 1.x; 7 (x y z [mm], qw qx qy qz) in 2.x."""

    name: str
    values: tuple[float, ...]
    stamp: TimeStamp | None = None


@dataclass(frozen=True, slots=True)
class IoValue:
    """A signal "Group.Signal"; boolean and digital values are integers, analog ones floats."""

    name: str
    type: IoType
    direction: IoDirection
    value: int | float


@dataclass(frozen=True, slots=True)
class RobotInfo:
    """State of the robot."""

    joints: int | None = None
    safety: Safety | None = None
    drives: tuple[DriveState, ...] = ()
    operation_mode: OperationMode | None = None
    control_mode: ControlMode | None = None


@dataclass(frozen=True, slots=True)
class ConnectionInfo:
    """State of the session; period in ms."""

    state: SessionState
    quality: Quality
    period_ms: int | None = None
    multiplier: int | None = None


def _array(tag: int, text: str) -> dict[str, object]:
    """What codecs know of a joint array: the number of its field in a message, and what it is."""
    return {"tag": tag, "text": text}


@dataclass(frozen=True, slots=True)
class MonitorData:
    """Measured values. `q_cmd` exists in 1.x only, `pose` and `redundancy` in 2.x, `wrench` in 2.7."""

    q: Joints | None = field(default=None, metadata=_array(1, "measured position"))
    tau: Joints | None = field(default=None, metadata=_array(2, "measured torque"))
    q_cmd: Joints | None = field(default=None, metadata=_array(3, "commanded position"))
    tau_cmd: Joints | None = field(default=None, metadata=_array(4, "commanded torque"))
    tau_ext: Joints | None = field(default=None, metadata=_array(5, "external torque"))
    wrench: tuple[float, ...] | None = None
    io: tuple[IoValue, ...] = ()
    pose: Transformation | None = None
    redundancy: Redundancy | None = None
    stamp: TimeStamp | None = None


#: The joint arrays of `MonitorData` by name: number of the field in a message, and what it is. The codecs, the shared
#: memory and the simulator's messages follow this table.
MONITORED: dict[str, tuple[int, str]] = {
    field.name: (field.metadata["tag"], field.metadata["text"])
    for field in fields(MonitorData)
    if "tag" in field.metadata
}


@dataclass(frozen=True, slots=True)
class IpoData:
    """Values of the interpolator, to which the overlay is added."""

    q: Joints | None = None
    pose: Transformation | None = None
    redundancy: Redundancy | None = None
    command_mode: CommandMode | None = None
    overlay: Overlay | None = None
    tracking: float | None = None


@dataclass(frozen=True, slots=True)
class Monitoring:
    """Message from the controller to the client, once per send period."""

    header: Header
    robot: RobotInfo | None = None
    monitor: MonitorData | None = None
    connection: ConnectionInfo | None = None
    ipo: IpoData | None = None
    requested: tuple[Transformation, ...] = ()


@dataclass(frozen=True, slots=True)
class Command:
    """Message from the client to the controller, in answer to a monitoring message."""

    header: Header
    q: Joints | None = None
    wrench: tuple[float, ...] | None = None
    tau: Joints | None = None
    transformations: tuple[Transformation, ...] = ()
    io: tuple[IoValue, ...] = ()
    pose: Transformation | None = None
    redundancy: Redundancy | None = None
