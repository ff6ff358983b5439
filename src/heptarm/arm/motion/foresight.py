"""The collision check and the workspace of an arm: the paths of its motions are checked before they are sent."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from heptarm.arm.devices.tools import Tooling
from heptarm.arm.link.connection import Connection
from heptarm.errors import CollisionForeseen
from heptarm.model.boundary import TOLERANCE, Boundary
from heptarm.model.joint_path import PathGeometry, joint_paths
from heptarm.values.arrays import Array
from heptarm.values.clearance import CollisionCheck
from heptarm.values.frames import TOOL
from heptarm.values.motion.motion import Motion
from heptarm.values.tool import unknown
from heptarm.values.workspace import Workspace

#: Largest movement of a joint between two checks of the workspace [rad].
_STEP = 0.02


class Foresight:
    """Refuses motions on whose paths bodies would touch, or that leave the workspace.

    Args:
        connection: to the cabinet.
        tooling: the attached tool and its frames.

    Attributes:
        check: answers where bodies touch; None: nothing is checked.
        workspace: where tool and joints may be; None: anywhere.
    """

    def __init__(self, connection: Connection, tooling: Tooling) -> None:
        self._connection = connection
        self._tooling = tooling
        self._end: Array | None = None  # where the last program that was checked ends
        self.check: CollisionCheck | None = None
        self.workspace: Workspace | None = None

    def boundary(self) -> Boundary | None:
        """The boundary of the workspace for the attached tool; None: there is no workspace.

        Raises:
            CommandRejected: its frame is no fixed frame.
        """
        workspace = self.workspace
        if workspace is None:
            return None
        frame = self._tooling.in_base(workspace.frame)
        if frame is None:
            raise unknown(workspace.frame, "frame", ("base", *self._tooling.taught))
        return Boundary(workspace, self._connection.robot, frame, self._tooling.on_flange(TOOL))

    def examine(self, motions: Sequence[Motion], when: str) -> None:
        """Check the paths of motions that are about to be sent.

        Args:
            motions: in their order.
            when: while another program runs: "queue", "replace" or "reject"; a queued one starts where that one ends.

        Raises:
            CollisionForeseen: bodies would touch.
            OutsideWorkspace: a motion leaves the workspace.
            StaleState: the newest state is too old, or lacks the joints.
        """
        boundary = self.boundary()
        if self.check is None and boundary is None:
            return
        state = self._connection.fresh()
        is_busy = state.motion is not None and (state.motion.active or state.motion.queued > 0)
        start = self._end if is_busy and when == "queue" and self._end is not None else state.q
        geometry = PathGeometry(self._connection.robot, self._tooling.on_flange, self._tooling.in_base)
        paths = joint_paths(geometry, np.asarray(start), motions)
        for index, path in enumerate(paths):
            name = f"motions[{index}]" if len(motions) > 1 else "motion"
            if boundary is not None:
                _check_inside(path, boundary, name)
            touch = None if self.check is None else self.check.first_on(path)
            if touch is not None:
                of = f"motions[{index}]: " if len(motions) > 1 else ""
                raise CollisionForeseen(
                    f"{of}{touch.clearance} after {touch.at:.0%} of the path",
                    touch=touch,
                    motion=index,
                    parameter=name,
                    value=round(touch.clearance.distance, 4),
                    hint="choose another path; or arm.collision_check = None, if the model of the scene is wrong",
                )
        self._end = paths[-1][-1]


def _check_inside(path: Array, boundary: Boundary, name: str) -> None:
    """Check that a joint path stays inside; one that starts outside may end inside.

    Raises:
        OutsideWorkspace: it leaves the workspace, or ends outside.
    """
    least = boundary.excess(path[0])
    for first, last in pairwise(path):
        count = max(1, int(np.ceil(np.abs(last - first).max() / _STEP)))
        for number in range(1, count + 1):
            q = first + number / count * (last - first)
            excess = boundary.excess(q)
            if excess > least + TOLERANCE:
                raise boundary.refusal(q, name, parameter=name)
            least = min(least, excess)
    if len(path) > 1 and least > TOLERANCE:
        raise boundary.refusal(path[-1], f"the end of {name}", parameter=name)
