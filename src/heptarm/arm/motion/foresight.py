"""The collision check of an arm: the paths of its motions are checked before they are sent."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from heptarm.arm.devices.tools import Tooling
from heptarm.arm.link.connection import Connection
from heptarm.errors import CollisionForeseen
from heptarm.model.joint_path import PathGeometry, joint_paths
from heptarm.values.arrays import Array
from heptarm.values.clearance import CollisionCheck
from heptarm.values.motion.motion import Motion


class Foresight:
    """Refuses motions on whose paths bodies would touch.

    Args:
        connection: to the cabinet.
        tooling: the attached tool and its frames.

    Attributes:
        check: answers where bodies touch; None: nothing is checked.
    """

    def __init__(self, connection: Connection, tooling: Tooling) -> None:
        self._connection = connection
        self._tooling = tooling
        self._end: Array | None = None  # where the last program that was checked ends
        self.check: CollisionCheck | None = None

    def examine(self, motions: Sequence[Motion], when: str) -> None:
        """Check the paths of motions that are about to be sent.

        Args:
            motions: in their order.
            when: while another program runs: "queue", "replace" or "reject"; a queued one starts where that one ends.

        Raises:
            CollisionForeseen: bodies would touch.
            StaleState: the newest state is too old, or lacks the joints.
        """
        if self.check is None:
            return
        state = self._connection.fresh()
        is_busy = state.motion is not None and (state.motion.active or state.motion.queued > 0)
        start = self._end if is_busy and when == "queue" and self._end is not None else state.q
        geometry = PathGeometry(self._connection.robot, self._tooling.on_flange, self._tooling.in_base)
        paths = joint_paths(geometry, np.asarray(start), motions)
        for index, path in enumerate(paths):
            touch = self.check.first_on(path)
            if touch is not None:
                of = f"motions[{index}]: " if len(motions) > 1 else ""
                raise CollisionForeseen(
                    f"{of}{touch.clearance} after {touch.at:.0%} of the path",
                    touch=touch,
                    motion=index,
                    parameter=f"motions[{index}]" if len(motions) > 1 else "motion",
                    value=round(touch.clearance.distance, 4),
                    hint="choose another path; or arm.collision_check = None, if the model of the scene is wrong",
                )
        self._end = paths[-1][-1]
