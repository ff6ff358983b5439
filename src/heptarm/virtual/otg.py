"""Online trajectory generation: limited trajectories to targets, planned anew from wherever the last one has led."""

from __future__ import annotations

import numpy as np
from ruckig import ControlInterface, InputParameter, Result, Ruckig, RuckigError, Synchronization, Trajectory

from heptarm.values.arrays import Array

#: Position, velocity and acceleration.
State = tuple[Array, Array, Array]


class Otg:
    """The trajectory that a servo motion is on, and its time.

    Args:
        axes: how many numbers a position has.
        synchronization: how they come to a target together.
        halting: how they come to rest together.

    Attributes:
        time: since the trajectory began [s].
    """

    def __init__(self, axes: int, *, synchronization: Synchronization, halting: Synchronization) -> None:
        self._axes = axes
        self._planner = Ruckig(axes)
        self._wanted = InputParameter(axes)
        self._synchronization, self._halting = synchronization, halting
        self._plan: Trajectory | None = None
        self.time = 0.0

    def limit(self, acceleration: Array, jerk: Array, *, velocity: Array | None = None) -> None:
        """Take other limits of each axis for the next plans; without a velocity its limit stays."""
        if velocity is not None:
            self._wanted.max_velocity = velocity.tolist()
        self._wanted.max_acceleration, self._wanted.max_jerk = acceleration.tolist(), jerk.tolist()

    @property
    def has_begun(self) -> bool:
        """Whether there is a trajectory."""
        return self._plan is not None

    @property
    def over(self) -> float:
        """Time since the end of the trajectory, negative before it [s]; without one forever."""
        return float("inf") if self._plan is None else self.time - self._plan.duration

    @property
    def remaining(self) -> float:
        """Time until the target is reached [s]; NaN without one."""
        return float("nan") if self._plan is None else max(0.0, -self.over)

    def at(self, time: float) -> State:
        """Where the trajectory leads at a time [s]."""
        assert self._plan is not None
        q, dq, ddq = self._plan.at_time(time)
        return np.array(q), np.array(dq), np.array(ddq)

    def aim(self, state: State, target: Array, *, speed: Array, minimum: float) -> bool:
        """Lead from a state to a target.

        Args:
            state: where it begins.
            target: where it leads.
            speed: at which it gets there.
            minimum: it takes no less time [s].

        Returns:
            False if that cannot be planned: the last trajectory goes on.
        """
        wanted = self._wanted
        wanted.control_interface, wanted.synchronization = ControlInterface.Position, self._synchronization
        wanted.target_position, wanted.target_velocity = target.tolist(), speed.tolist()
        wanted.minimum_duration = minimum
        return self._start(state)

    def halt(self, state: State) -> bool:
        """Lead from a state to rest, wherever that is; returns as `aim` does."""
        wanted = self._wanted
        wanted.control_interface, wanted.synchronization = ControlInterface.Velocity, self._halting
        wanted.target_velocity = [0.0] * self._axes
        wanted.minimum_duration = None
        return self._start(state)

    def _start(self, state: State) -> bool:
        wanted = self._wanted
        wanted.current_position, wanted.current_velocity, wanted.current_acceleration = (
            values.tolist() for values in state
        )
        plan = Trajectory(self._axes)
        try:
            result = self._planner.calculate(wanted, plan)
        except RuckigError:
            return False
        if result not in (Result.Working, Result.Finished):
            return False
        self._plan, self.time = plan, 0.0
        return True
