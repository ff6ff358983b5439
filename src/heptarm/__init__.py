"""Control a KUKA LBR iiwa from Python, with or without a robot on the desk.

::

    import heptarm as ha

    with ha.connect("sim://iiwa14") as arm:
        arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)))
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from heptarm.arm.arm import Arm
    from heptarm.arm.connect import connect
    from heptarm.arm.feed import States
    from heptarm.arm.fri import Fri
    from heptarm.arm.handle import MotionHandle
    from heptarm.arm.servo import JointServo, PoseServo, ServoStats
    from heptarm.arm.target import target_from_env
    from heptarm.arm.teaching import Replay
    from heptarm.errors import (
        ArrivalError,
        CollisionDetected,
        CommandRejected,
        ConnectFailed,
        ConnectionLost,
        HeptarmError,
        LimitError,
        LocalProtocolError,
        MissingExtra,
        ModeConflict,
        MotionAborted,
        MotionError,
        NeedsOperator,
        NoContact,
        NotInControl,
        NotReady,
        ProtocolError,
        QualityLost,
        RemoteProtocolError,
        SafetyStop,
        ShapeError,
        StaleState,
        Starved,
        StreamError,
        Timeout,
        Unreachable,
        VersionMismatch,
    )
    from heptarm.values.collision import Collision, CollisionGuard
    from heptarm.values.contact import Contact
    from heptarm.values.event import MotionEvent
    from heptarm.values.motion import (
        arc,
        circ,
        ellipse,
        hand_guide,
        hold,
        lin,
        lin_rel,
        ptp,
        ptp_home,
        spl,
        spline,
        spline_joints,
    )
    from heptarm.values.pose import Pose, deg
    from heptarm.values.recovery import Recovery
    from heptarm.values.redundancy import Redundancy
    from heptarm.values.result import Cause, Result
    from heptarm.values.state import State
    from heptarm.values.tool import Tool, Workpiece
    from heptarm.values.trajectory import Trajectory
    from heptarm.values.trigger import Trigger

__version__ = "0.1.0"

__all__ = [
    "Arm",
    "ArrivalError",
    "Cause",
    "Collision",
    "CollisionDetected",
    "CollisionGuard",
    "CommandRejected",
    "ConnectFailed",
    "ConnectionLost",
    "Contact",
    "Fri",
    "HeptarmError",
    "JointServo",
    "LimitError",
    "LocalProtocolError",
    "MissingExtra",
    "ModeConflict",
    "MotionAborted",
    "MotionError",
    "MotionEvent",
    "MotionHandle",
    "NeedsOperator",
    "NoContact",
    "NotInControl",
    "NotReady",
    "Pose",
    "PoseServo",
    "ProtocolError",
    "QualityLost",
    "Recovery",
    "Redundancy",
    "RemoteProtocolError",
    "Replay",
    "Result",
    "SafetyStop",
    "ServoStats",
    "ShapeError",
    "StaleState",
    "Starved",
    "State",
    "States",
    "StreamError",
    "Timeout",
    "Tool",
    "Trajectory",
    "Trigger",
    "Unreachable",
    "VersionMismatch",
    "Workpiece",
    "__version__",
    "arc",
    "circ",
    "connect",
    "deg",
    "ellipse",
    "hand_guide",
    "hold",
    "lin",
    "lin_rel",
    "ptp",
    "ptp_home",
    "spl",
    "spline",
    "spline_joints",
    "target_from_env",
]

#: Where the names live; they are imported when they are used, so that `import heptarm` costs nothing.
_HOMES = {
    "Arm": "arm.arm",
    "connect": "arm.connect",
    "States": "arm.feed",
    "Fri": "arm.fri",
    "MotionHandle": "arm.handle",
    "JointServo": "arm.servo",
    "PoseServo": "arm.servo",
    "ServoStats": "arm.servo",
    "target_from_env": "arm.target",
    "arc": "values.motion",
    "circ": "values.motion",
    "ellipse": "values.motion",
    "spl": "values.motion",
    "spline": "values.motion",
    "spline_joints": "values.motion",
    "hand_guide": "values.motion",
    "hold": "values.motion",
    "lin": "values.motion",
    "lin_rel": "values.motion",
    "ptp": "values.motion",
    "ptp_home": "values.motion",
    "Collision": "values.collision",
    "CollisionGuard": "values.collision",
    "Contact": "values.contact",
    "Replay": "arm.teaching",
    "Trajectory": "values.trajectory",
    "Pose": "values.pose",
    "deg": "values.pose",
    "Recovery": "values.recovery",
    "Redundancy": "values.redundancy",
    "MotionEvent": "values.event",
    "Trigger": "values.trigger",
    "Cause": "values.result",
    "Result": "values.result",
    "State": "values.state",
    "Tool": "values.tool",
    "Workpiece": "values.tool",
}


def __getattr__(name: str) -> Any:
    """A public name, imported at its first use."""
    if name not in __all__:
        raise AttributeError(f"module 'heptarm' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"heptarm.{_HOMES.get(name, 'errors')}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)
