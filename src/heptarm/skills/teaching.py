"""Teaching: guide the arm by hand, and record the trajectory."""

from __future__ import annotations

import threading
from collections.abc import Sequence

import numpy as np

from heptarm.arm.verbs import ArmVerbs
from heptarm.errors import CommandRejected, StaleState
from heptarm.values.checks import Array, within
from heptarm.values.condition.condition import Condition
from heptarm.values.frames import TOOL
from heptarm.values.mode.compliance import compliance
from heptarm.values.mode.mode import Mode
from heptarm.values.motion.hand_guiding import hand_guide
from heptarm.values.motion.motion import Motion, hold
from heptarm.values.motion.trajectory import Trajectory
from heptarm.values.result import Result
from heptarm.values.state import State

#: Default of the longest time for teaching [s].
PATIENCE = 300.0
#: Longest time from cancelling the motion to its end [s].
_END_TIMEOUT = 30.0


def guide_precisely(
    arm: ArmVerbs,
    free: str,
    *,
    frame: str = TOOL,
    seconds: float = 60.0,
    until: Condition | None = None,
    speed: float | None = None,
) -> Result:
    """Let a person guide the arm by hand along some directions only, and hold it stiffly in all others.

    It needs no hand guiding device; the arm is compliant from the beginning, so somebody should stand there. It is a
    hold under `heptarm.modes.compliance`, which has more options.

    Args:
        arm: in control.
        free: the compliant directions: "z" a line, "xy" a plane, "a" rotation about z, "b" about y, "c" about x.
        frame: whose axes: "tool" (the motion frame's own at the start), "base", or the name of a frame.
        seconds: duration [s].
        until: break condition that ends it earlier, such as `io.user_button`.
        speed: bound of the speed along the free axes [m/s]; None: 0.25.
    """
    return arm.move(hold(seconds), mode=compliance(free, frame=frame, speed=speed), until=until)


def teach(
    arm: ArmVerbs,
    motion: Motion | None = None,
    *,
    mode: Mode | None = None,
    until: Condition | None = None,
    timeout: float = PATIENCE,
) -> Trajectory:
    """Record the trajectory while somebody guides the arm by hand.

    Args:
        arm: in control.
        motion: the motion meanwhile; None: `hand_guide()`, which lasts while the switch of the hand guiding device is
            held. Without such a device: `hold(30.0)` with `mode=compliance("xyzabc")`.
        mode: its control mode.
        until: break condition that ends it.
        timeout: longest duration [s]; then it ends with what was recorded.

    Returns:
        Positions of every state that was pushed, from start to end. See `Trajectory.trimmed` and `thinned`.

    Raises:
        CommandRejected: as `start` does; or it ended before two states were received.
        MotionAborted: a stop or an error ended it.
    """
    seconds = within(timeout, "timeout", 0.0, 1e6, above=True, unit="s")
    if arm.state_rate <= 0 or "joints" not in arm.groups:
        raise StaleState(
            'teaching needs the state group "joints"', hint='arm.subscribe(rate=100, groups=(..., "joints"))'
        )
    handle = arm.start(hand_guide() if motion is None else motion, mode=mode, until=until, when="reject")
    latest = threading.Timer(seconds, handle.cancel)
    latest.daemon = True
    latest.start()
    try:
        recorded = list(handle.states())  # to the end, also those that are read late
    finally:
        latest.cancel()
        handle.cancel()
    handle.wait(timeout=_END_TIMEOUT)
    return trajectory_of(recorded, arm.robot.name)


def trajectory_of(recorded: Sequence[State], name: str) -> Trajectory:
    """Make a trajectory of recorded states; states without a new joint position are skipped.

    Args:
        recorded: states in the order received.
        name: model of the robot.

    Raises:
        CommandRejected: fewer than two positions.
    """
    rows: dict[int, Array] = {}
    for state in recorded:
        if state.joints is not None:
            rows.setdefault(state.joints.stamp, state.joints.q)
    if len(rows) < 2:
        raise CommandRejected(
            f"a trajectory needs at least 2 positions, {len(rows)} were recorded",
            parameter="motion",
            hint="the motion ended at once; check its result",
        )
    stamps = sorted(rows)
    times = np.array([(stamp - stamps[0]) * 1e-9 for stamp in stamps])
    return Trajectory.of(times, [rows[stamp] for stamp in stamps], robot=name)
