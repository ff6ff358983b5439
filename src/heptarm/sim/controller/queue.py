"""The queue of a simulated controller: orders that were accepted and have not begun, planned one behind the other."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel
from heptarm.virtual.order import Order, PlanError
from heptarm.virtual.planner import Plan
from heptarm.virtual.route import plan


class Accepted(NamedTuple):
    """An order that waits.

    Attributes:
        serial: its number among all accepted orders.
        order: the order.
        plan: from the end of the one before it; None: where that is is not known.
    """

    serial: int
    order: Order
    plan: Plan | None


class Cancellation(NamedTuple):
    """A wish that the next tick carries out.

    Attributes:
        newest: serial of the newest order at that time; later ones are not concerned.
        order_id: which one; None: all.
        fast: what runs leaves its path.
    """

    newest: int
    order_id: int | None
    fast: bool

    def concerns(self, serial: int, order: Order) -> bool:
        """Whether it is about an order."""
        return serial <= self.newest and self.order_id in (None, order.id)


class Queue:
    """Orders that wait; they come and are cancelled from any thread, and are taken by the tick's.

    Args:
        robot: the robot.
        rest: set-point of an arm that has nothing to do, shape (7,) [rad].
    """

    def __init__(self, robot: RobotModel, rest: Callable[[], Array]) -> None:
        self._robot, self._rest = robot, rest
        self._planning = threading.Lock()  # one caller plans at a time; the tick never waits for it
        self._lock = threading.Lock()  # held for a few instructions only
        self._serial = 0  # of the newest accepted order
        self._inbox: deque[Accepted] = deque()
        self._cancels: deque[Cancellation] = deque()
        self._tail: Array | None = None  # where the last accepted order ends; None: not known
        self._open = 0  # accepted orders that have not ended
        self._cancel_count = 0

    @property
    def idle(self) -> bool:
        """No order is running or waiting."""
        return self._open == 0

    def submit(self, order: Order) -> None:
        """Plan an order from the end of what is queued and append it.

        While the arm brakes, the place it will come to rest at is not known; then the order is planned when
        its turn comes, and a planning error reaches its listener.

        Raises:
            PlanError: it cannot be planned; nothing has changed.
        """
        with self._planning:
            with self._lock:
                start = self._rest() if self._open == 0 else self._tail
                cancels = self._cancel_count
            planned = None if start is None else plan(self._robot, order, start)
            with self._lock:
                if cancels != self._cancel_count:
                    planned = None  # where the arm comes to rest is not known any more
                self._tail = None if planned is None else planned.end
                self._open += 1
                self._serial += 1
                self._inbox.append(Accepted(self._serial, order, planned))

    def cancel(self, order_id: int | None, *, fast: bool) -> None:
        """Wish the end of an order (None: of all)."""
        with self._lock:
            self._tail = None
            self._cancel_count += 1
            self._cancels.append(Cancellation(self._serial, order_id, fast))

    # ------------------------------------------------------------------------------ from the tick's thread

    def cancelled(self) -> Cancellation | None:
        """The next wish to carry out; None: there is none."""
        return self._cancels.popleft() if self._cancels else None

    def drop(self, wish: Cancellation) -> None:
        """Drop what waits and is cancelled."""
        dropped: list[Order] = []
        with self._lock:
            for _ in range(len(self._inbox)):
                one = self._inbox.popleft()
                if wish.concerns(one.serial, one.order):
                    dropped.append(one.order)
                else:
                    self._inbox.append(one._replace(plan=None))
        for order in dropped:
            self.close(order, "cancelled", "")

    def diverge(self) -> None:
        """The running order will not end where it was planned to."""
        with self._lock:
            self._tail = None

    def take(self) -> Accepted | None:
        """The next order; None: none waits."""
        return self._inbox.popleft() if self._inbox else None

    def planned(self, one: Accepted, here: Array) -> Plan | None:
        """The plan of an order whose turn has come, from where the arm is [rad]; None: it has ended for want of one."""
        if one.plan is not None and float(np.abs(one.plan.start - here).max()) <= 1e-9:
            return one.plan
        try:
            planned = plan(self._robot, one.order, here.copy())
        except PlanError as error:
            self.close(one.order, "error", str(error))
            return None
        with self._lock:
            if one.serial == self._serial:
                self._tail = planned.end
        return planned

    def close(self, order: Order, cause: str, text: str) -> None:
        """An order has ended: tell its listener."""
        with self._lock:
            self._open -= 1
        if order.listener is not None:
            order.listener.finished(cause, text)
