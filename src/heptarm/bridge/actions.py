"""Actions of the nodes but for trajectories, free of ROS: one table for both, and what each does.

A node makes an action of every row of `ACTIONS`; the fields of a goal are those of the row's type::

    actions = Actions(driver, ros)
    work = actions.begin(row, goal)     # raises HeptarmError: refused
    ended = work(client)                # in a thread of its own: it returns when the goal has ended
"""

from __future__ import annotations

import logging
from functools import partial
from typing import Any

from heptarm.bridge.action import Action, Client, Ended, Work
from heptarm.bridge.goal import Outcome
from heptarm.bridge.leading import LEADING, Leading
from heptarm.bridge.moves import MOVES, Moves
from heptarm.bridge.touching import TOUCHING, Touching

_log = logging.getLogger("heptarm.bridge")


class Actions(Moves, Touching, Leading):
    """What the actions do with an arm."""

    def begin(self, row: Action, goal: Any) -> Work:
        """Begin what a goal asks for.

        Args:
            row: which action.
            goal: of its type.

        Raises:
            HeptarmError: refused; the text says why.
        """
        return partial(_carried_out, row.begin(self, goal))


def _carried_out(work: Work, client: Client) -> Ended:
    try:
        return work(client)
    except Exception as error:  # a goal that does not end would bind its client for ever
        _log.exception("carrying a goal out")
        return Ended(Outcome.ABORTED, f"the node failed: {error!r}")


#: All of them.
ACTIONS = (*MOVES, *TOUCHING, *LEADING)
