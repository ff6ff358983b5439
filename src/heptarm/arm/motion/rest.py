"""When an arm counts as being at rest, and how long that may take."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from heptarm.arm.link.connection import Connection
from heptarm.errors import HeptarmError, StaleState
from heptarm.values.result import Cause, Result
from heptarm.values.state import State

#: Below this speed of every axis the arm is at rest [rad/s].
REST_SPEED = 0.01
#: Longest time that a braking arm may need to come to rest, unless the user gives another [s].
REST_TIMEOUT = 10.0
#: Number of consecutive states at rest, since a single one may be the turning point of an oscillation.
_STATES = 2


#: Longest wait, after the end of a motion, for a state that shows the arm at rest [s].
_SETTLING = 0.5


def settle(connection: Connection, number: int, result: Result) -> Result:
    """Wait after the end of a motion until the pushed states show the arm at rest, so that `arm.state` does.

    The wait is short: in impedance control the arm may be pushed and never rest. It is left out if another program
    runs, and if the subscribed states cannot show rest.

    Args:
        connection: to the cabinet.
        number: of the program that has ended.
        result: how it ended.

    Returns:
        The result, with the first state at rest, or else the last state seen.
    """
    options = connection.options
    if result.cause is Cause.REPLACED or options.rate <= 0 or not {"joints", "motion"} <= {*options.groups}:
        return result
    joints = None if result.state is None else result.state.groups.joints
    before = 0 if joints is None else joints.stamp
    goes_on, last = False, result.state

    def rests(state: State) -> bool:
        nonlocal goes_on, last
        joints, motion = state.groups.joints, state.groups.motion
        if joints is None or motion is None or joints.stamp <= before:
            return False
        last = state
        goes_on = motion.queued > 0 or (motion.active and motion.id != number)
        return goes_on or (not motion.active and bool((np.abs(joints.dq) < REST_SPEED).all()))

    with suppress(HeptarmError):  # the motion has ended: what comes now cannot change its result
        connection.wait_for(rests, _SETTLING)
    return result if goes_on else replace(result, state=last)


class RestDetector:
    """A condition for `Connection.wait_for`: nothing runs, nothing waits and no axis turns in consecutive states.

    It counts only states sampled after its construction, since older ones say nothing about a motion just sent.

    Args:
        connection: whose states it judges.
    """

    def __init__(self, connection: Connection) -> None:
        newest = connection.newest()
        self._first = 0 if newest is None else newest.stamp
        self._count = 0

    def __call__(self, state: State) -> bool:
        """Judge the next state.

        Raises:
            StaleState: the state lacks the joints or the motion.
        """
        if state.joints is None or state.motion is None:
            raise StaleState(
                'waiting for rest needs the state groups "joints" and "motion"',
                hint='arm.subscribe(groups=("joints", "motion"))',
            )
        speeds = np.abs(state.dq[np.isfinite(state.dq)])
        is_idle = not state.motion.active and not state.motion.queued
        rests = is_idle and bool((speeds < REST_SPEED).all()) and state.joints.stamp > self._first
        self._count = self._count + 1 if rests else 0
        return self._count >= _STATES
