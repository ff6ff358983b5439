"""What a client sees that only looks: which arm it is, who controls it, and its states."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from heptarm.arm.connection import Connection
from heptarm.arm.feed import States
from heptarm.arm.groups import GROUPS
from heptarm.errors import StaleState
from heptarm.values.arrays import within
from heptarm.values.robot import RobotModel
from heptarm.values.state import State

#: States a stream of all states keeps for a slow loop.
_STREAM_SIZE = 2000


class Observer:
    """The part of an arm that needs no control."""

    _connection: Connection

    @property
    def robot(self) -> RobotModel:
        """The connected robot and its limits."""
        return self._connection.robot

    @property
    def capabilities(self) -> tuple[str, ...]:
        """What this cabinet can do: "ptp", "lin", ..."""
        return self._connection.welcome.capabilities

    @property
    def is_virtual(self) -> bool:
        """Whether the robot is simulated."""
        return self._connection.welcome.virtual

    @property
    def software(self) -> str:
        """Version of the cabinet application."""
        return self._connection.welcome.software

    @property
    def cabinet(self) -> str:
        """Name of the cabinet."""
        return self._connection.welcome.cabinet

    @property
    def controller(self) -> str:
        """Name of the client that controls the robot; empty: nobody."""
        return self._connection.controller

    @property
    def connected(self) -> bool:
        """Whether the connection stands."""
        return self._connection.stands

    @property
    def pace(self) -> float:
        """Seconds of the robot's time per second of ours: 1 on a robot, N on a simulator that runs N times faster."""
        return self._connection.pace

    # ------------------------------------------------------------------------------------ states

    @property
    def state(self) -> State:
        """The newest pushed state; never a question to the cabinet.

        Raises:
            StaleState: it is too old to act on; the text says how old.
            ConnectionLost: the connection has ended.
        """
        link = self._connection
        sample, rate = link.feed.newest, link.options.rate
        if rate <= 0:
            raise StaleState("no states are subscribed", hint="arm.subscribe(rate=100)")
        limit = max(1.0, 10.0 / (rate * link.pace))
        age = float("inf") if sample is None else (link.clock.nanos() - sample.received) * 1e-9
        if sample is None or age > limit:
            error = link.end()
            if error is not None:
                raise error
            raise StaleState(
                f"the newest state is {age:.2f} s old; allowed is {limit:g} s",
                value=age,
                allowed=f"[0, {limit:g}] s",
                hint="check the connection and the load of this machine",
            )
        return link.build(sample)

    def states(
        self, *, rate: float | None = None, duration: float | None = None, size: int = _STREAM_SIZE
    ) -> States:
        """States one after the other, never one twice.

        Args:
            rate: at most this many per second [Hz], the newest each time; None: every state that is pushed, in order.
            duration: end after this time [s]; None: never.
            size: without a rate, how many states are kept for a slow loop; `States.lost` counts what was dropped.

        Raises:
            LimitError: a rate or duration that is not positive.
        """
        link = self._connection
        link.check_open()
        return States(
            link.feed,
            link.clock,
            build=link.build,
            check=link.end,
            rate=None if rate is None else within(rate, "rate", 0.0, 1e4, above=True, unit="Hz"),
            duration=None if duration is None else within(duration, "duration", 0.0, 1e9, unit="s"),
            size=size,
        )

    def wait_until(self, condition: Callable[[State], object], *, timeout: float = 30.0) -> State:
        """Wait until a condition holds for a pushed state; looked at here, not on the cabinet.

        Args:
            condition: called with each state that is seen.
            timeout: how long to wait [s].

        Returns:
            The state for which it held.

        Raises:
            Timeout: it did not hold in time.
            ConnectionLost: the connection has ended.
        """
        seconds = within(timeout, "timeout", 0.0, 1e9, unit="s")
        with self._connection.stopping_on_interrupt():
            return self._connection.wait_for(condition, seconds)

    def subscribe(self, *, rate: float = 100.0, groups: Sequence[str] = GROUPS) -> None:
        """Choose what is pushed; a new choice replaces the old.

        Args:
            rate: states per second [Hz]; 0: none.
            groups: "joints", "torques", "pose", "wrench", "motion", "safety", "io", "mode".

        Raises:
            CommandRejected: a group that the cabinet does not have.
            LimitError: a rate that the cabinet does not reach.
        """
        self._connection.subscribe(rate, groups)
