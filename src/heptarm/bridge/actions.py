"""Actions of the nodes but for trajectories, free of ROS: one table for both, and what each does.

A node makes an action of every row of `ACTIONS`; the fields of a goal are those of the row's type::

    actions = Actions(driver, ros)
    work = actions.begin(row, goal)     # raises HeptarmError: refused
    ended = work(client)                # in a thread of its own: it returns when the goal has ended
"""

from __future__ import annotations

import logging
import threading
from functools import partial
from typing import Any

from heptarm.bridge.action import Action, Client, Ended, Work
from heptarm.bridge.driver import Driver
from heptarm.bridge.goal import Outcome
from heptarm.bridge.leading import LEADING, Leading
from heptarm.bridge.messages import Ros
from heptarm.bridge.moves import MOVES, Moves
from heptarm.bridge.touching import TOUCHING, Touching
from heptarm.errors import NotReady

_log = logging.getLogger("heptarm.bridge")


#: Goals that may be under way, those that wait for others included: each takes a thread.
MOST = 8


class Actions(Moves, Touching, Leading):
    """What the actions do with an arm."""

    def __init__(self, driver: Driver, ros: Ros) -> None:
        super().__init__(driver, ros)
        self._places = threading.BoundedSemaphore(MOST)

    def begin(self, row: Action, goal: Any) -> Work:
        """Begin what a goal asks for; the work has to be called.

        Args:
            row: which action.
            goal: of its type.

        Raises:
            HeptarmError: refused; the text says why.
        """
        if not self._places.acquire(blocking=False):
            raise NotReady(f"{MOST} goals are under way", hint="wait for one of them, or cancel it")
        try:
            work = row.begin(self, goal)
        except BaseException:
            self._places.release()
            raise
        return partial(self._carry_out, work)

    def _carry_out(self, work: Work, client: Client) -> Ended:
        try:
            return work(client)
        except Exception as error:  # a goal that does not end would bind its client for ever
            _log.exception("carrying a goal out")
            return Ended(Outcome.ABORTED, f"the node failed: {error!r}")
        finally:
            self._places.release()


#: All of them.
ACTIONS = (*MOVES, *TOUCHING, *LEADING)
