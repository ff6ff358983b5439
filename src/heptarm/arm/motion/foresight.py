"""Looks ahead of the motions of an arm: previews, and the checks for collisions and workspace before one is sent.

Both plan with the planner of the virtual cabinet, which needs `pip install 'heptarm[sim]'`, but no simulator.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import isinf
from typing import TYPE_CHECKING

import numpy as np

from heptarm.arm.devices.tools import Tooling
from heptarm.arm.link.connection import Connection
from heptarm.arm.motion.preview import PreviewedMotion, ProgramPreview
from heptarm.arm.motion.program import checked, resolved
from heptarm.errors import CollisionForeseen, ModeConflict, Timeout, require
from heptarm.model.batch import forward_batch
from heptarm.model.boundary import TOLERANCE, Boundary
from heptarm.model.dynamics import inverse_dynamics
from heptarm.values.arrays import Array, frozen
from heptarm.values.clearance import CollisionCheck, ForeseenCollision, TouchOnPath
from heptarm.values.condition.condition import Condition
from heptarm.values.condition.reaction import Reaction
from heptarm.values.frames import TOOL
from heptarm.values.mode.mode import Mode
from heptarm.values.motion.hand_guiding import HandGuide
from heptarm.values.motion.motion import Hold, Motion, hold
from heptarm.values.pose import quaternion
from heptarm.values.state import State
from heptarm.values.tool import unknown
from heptarm.values.workspace import Workspace

if TYPE_CHECKING:
    from heptarm.planning.lookahead import PlannedProgram

#: Largest time between two samples of a path that is checked [s].
_STEP = 0.02
#: Largest movement of a joint between two checks of the workspace [rad].
_TURN = 0.02
#: Most samples at which torques are computed; between them they are interpolated.
_MOST_TORQUES = 600
#: Longest wait for the state after the end of a motion [s].
_SOON = 0.5
_BRIEF = hold(0.01)


class Foresight:
    """Looks ahead of motions that are about to be sent, or might be.

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

    def examine(self, motions: Sequence[Motion], when: str, ceiling: float) -> None:
        """Check the paths of motions that are about to be sent.

        A hold needs no check, and what follows hand guiding cannot be checked.

        Args:
            motions: in their order.
            when: while another program runs: "queue", "replace" or "reject"; a queued one starts where that one ends.
            ceiling: no joint is faster than this fraction of its maximum, (0, 1].

        Raises:
            CollisionForeseen: bodies would touch.
            OutsideWorkspace: a motion leaves the workspace.
            CommandRejected: a motion cannot be planned; LimitError and Unreachable are such errors.
            StaleState: the newest state is too old, or lacks the joints.
            MissingExtra: the planner is not installed.
        """
        boundary = self.boundary()
        if self.check is None and boundary is None:
            return
        state = self._connection.fresh()
        start = self._end if _is_busy(state) and when == "queue" and self._end is not None else state.q
        guided = next((k for k, one in enumerate(motions) if isinstance(one, HandGuide)), len(motions))
        self._end = None
        if guided == 0:
            return
        finite = [
            _BRIEF if isinstance(one, Hold) and isinf(one.duration) else one for one in motions[:guided]
        ]
        program = self._planned(finite, np.asarray(start), ceiling, _STEP)
        check = None if self.check is None else self._tooling.loaded(self.check)
        for index, path in enumerate(_paths(program)):
            name = f"motions[{index}]" if len(motions) > 1 else "motion"
            if boundary is not None:
                _check_inside(path, boundary, name)
            touch = None if check is None else check.first_on(path)
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
        self._end = program.q[-1] if guided == len(motions) else None

    def preview(
        self,
        motions: Sequence[Motion],
        *,
        ceiling: float,
        mode: Mode | None,
        until: Condition | None,
        then: Reaction,
        start: Array | None,
        step: float,
        check: CollisionCheck | None,
    ) -> ProgramPreview:
        """Look ahead; see `Arm.plan`."""
        robot, tooling = self._connection.robot, self._tooling
        if start is None:
            start = self._rest()
        else:
            robot.check(start, "start")
        motions = resolved(self._connection, tooling, tuple(motions), start)
        checked(self._connection, tooling, motions, ceiling=ceiling, mode=mode, until=until, then=then)
        program = self._planned(motions, start, ceiling, step)
        boundary = self.boundary()
        if boundary is not None:
            for index, path in enumerate(_paths(program)):
                _check_inside(path, boundary, f"motions[{index}]" if len(motions) > 1 else "motion")
        load = tooling.load
        every = max(1, -(-len(program.t) // _MOST_TORQUES))
        kept = np.unique(np.append(np.arange(0, len(program.t), every), len(program.t) - 1))
        rows = ((program.q[k], program.dq[k], program.ddq[k]) for k in kept.tolist())
        torques = np.array([inverse_dynamics(robot, *row, load=load) for row in rows])
        tau = np.array([np.interp(program.t, program.t[kept], column) for column in torques.T]).T
        used = self.check if check is None else check
        used = None if used is None else tooling.loaded(used)
        return ProgramPreview(
            robot,
            program.t,
            program.q,
            program.dq,
            program.ddq,
            frozen(tau),
            self._poses(program.q),
            tuple(_listed(motions, program)),
            () if used is None else tuple(_collisions(program, used)),
            used is not None,
            until,
        )

    def _planned(
        self, motions: Sequence[Motion], start: Array, ceiling: float, step: float
    ) -> PlannedProgram:
        """The program as the controller would plan it."""
        require("ruckig", extra="sim")
        from heptarm.planning.lookahead import FramesOfArm, look_ahead

        frames = FramesOfArm(self._tooling.on_flange, self._tooling.in_base)
        limited = [one.limited_to(ceiling) for one in motions]
        return look_ahead(self._connection.robot, start, limited, frames, step=step)

    def _rest(self) -> Array:
        """Where the arm rests: the commanded position, from which the controller plans."""
        state = self._connection.fresh()
        try:  # the last state may be older than the end of the last motion
            state = (
                self._connection.wait_for(lambda one: not _is_busy(one), _SOON) if _is_busy(state) else state
            )
        except Timeout:
            raise ModeConflict(
                "a motion runs, so that the arm does not rest where a preview could begin",
                parameter="start",
                hint="wait for its end, or give start, the joint positions at which the program would begin",
            ) from None
        commanded = state.q_cmd
        return np.where(np.isnan(commanded), state.q, commanded)

    def _poses(self, q: Array) -> Array:
        """Poses of the tool frame, shape (n, 7)."""
        tip = self._tooling.on_flange(TOOL)
        frames = forward_batch(self._connection.robot, q)
        places = frames[:, :3, 3] + frames[:, :3, :3] @ tip.xyz
        turns = frames[:, :3, :3] @ tip.rotation
        return frozen(np.hstack([places, [quaternion(turn) for turn in turns]]))


def _check_inside(path: Array, boundary: Boundary, name: str) -> None:
    """Check that a joint path stays inside; one that starts outside may end inside.

    Raises:
        OutsideWorkspace: it leaves the workspace, or ends outside.
    """
    least = boundary.excess(path[0])
    for first, last in pairwise(path):
        count = max(1, int(np.ceil(np.abs(last - first).max() / _TURN)))
        for number in range(1, count + 1):
            q = first + number / count * (last - first)
            excess = boundary.excess(q)
            if excess > least + TOLERANCE:
                raise boundary.refusal(q, name, parameter=name)
            least = min(least, excess)
    if least > TOLERANCE and np.abs(path[-1] - path[0]).max() > TOLERANCE:
        raise boundary.refusal(path[-1], f"the end of {name}", parameter=name)


def _is_busy(state: State) -> bool:
    return state.motion is not None and (state.motion.active or state.motion.queued > 0)


def _bounds(program: PlannedProgram) -> list[tuple[int, int]]:
    """First and last sample of each motion."""
    marks = np.searchsorted(program.t, [*program.begins, program.t[-1]]).tolist()
    return list(pairwise(marks))


def _paths(program: PlannedProgram) -> list[Array]:
    """Joint positions along each motion, where it begins and ends included."""
    return [program.q[first : last + 1] for first, last in _bounds(program)]


def _listed(motions: Sequence[Motion], program: PlannedProgram) -> list[PreviewedMotion]:
    ends = [*program.begins[1:], program.duration]
    rows = zip(motions, program.begins, ends, program.is_blended, strict=True)
    return [PreviewedMotion(type(one).__name__, begin, end - begin, flows) for one, begin, end, flows in rows]


def _collisions(program: PlannedProgram, check: CollisionCheck) -> list[ForeseenCollision]:
    """The first touch on the path of each motion."""
    found = []
    for index, ((first, last), path) in enumerate(zip(_bounds(program), _paths(program), strict=True)):
        touch = check.first_on(path)
        if touch is not None:
            t = _time_of(touch, program.t[first : last + 1], path)
            found.append(ForeseenCollision(touch.clearance, t, index, touch.q))
    return found


def _time_of(touch: TouchOnPath, t: Array, path: Array) -> float:
    """When a touch happens [s]: its place counts by the movement of the fastest joint."""
    moved = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path, axis=0)).max(axis=1))])
    return float(np.interp(touch.at * moved[-1], moved, t))
