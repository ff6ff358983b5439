"""Looks ahead of the motions of an arm: previews, and the checks for collisions and workspace before one is sent.

Both plan with the planner of the virtual cabinet, which needs `pip install 'heptarm[sim]'`, but no simulator.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise, takewhile
from typing import TYPE_CHECKING

import numpy as np

from heptarm.arm.devices.tools import Tooling
from heptarm.arm.link.connection import Connection
from heptarm.arm.motion.preview import PreviewedMotion, ProgramPreview
from heptarm.arm.motion.program_request import CheckedProgram, ProgramTerms, checked
from heptarm.errors import (
    CollisionForeseen,
    CommandRejected,
    ModeConflict,
    ShapeError,
    Timeout,
    require,
    system_errors,
)
from heptarm.model.batch import forward_batch
from heptarm.model.boundary import TOLERANCE, Boundary
from heptarm.model.dynamics import inverse_dynamics
from heptarm.planning.search import Goal, Keep, find_path
from heptarm.values.checks import Array, frozen, shown
from heptarm.values.clearance import CollisionCheck, CollisionWorld, ForeseenCollision, TouchOnPath
from heptarm.values.frames import TOOL
from heptarm.values.motion.motion import Motion
from heptarm.values.motion.planned_path import Path
from heptarm.values.pose import quaternion
from heptarm.values.state import State
from heptarm.values.tool import unknown
from heptarm.values.workspace import Workspace
from heptarm.wire import messages as wire

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
#: Stands for a hold, which may have no end.
_BRIEF = wire.Item(motion=wire.Hold(duration=0.01), frame="", until=wire.Condition())


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

    def examine(self, program: CheckedProgram) -> None:
        """Check the paths of a program that is about to be sent.

        A hold needs no check, and what follows hand guiding cannot be checked.

        Args:
            program: a queued one starts where the one before ends.

        Raises:
            CollisionForeseen: bodies would touch.
            OutsideWorkspace: a motion leaves the workspace.
            CommandRejected: a motion cannot be planned; LimitError and Unreachable are such errors.
            StaleState: the newest state is too old, or lacks the joints.
            MissingExtra: the planner is not installed.
        """
        boundary = self.boundary()
        has_path = any(isinstance(motion, Path) for motion in program.motions)
        if self.check is None and boundary is None and not has_path:
            return
        state = self._connection.fresh()
        queues = program.terms.when == "queue"
        start = self._end if _is_busy(state) and queues and self._end is not None else state.q
        items = list(takewhile(lambda item: not isinstance(item.motion, wire.HandGuide), program.items))
        self._end = None
        if not items:
            return
        finite = [_BRIEF if isinstance(item.motion, wire.Hold) else item for item in items]
        ahead = self._planned(finite, np.asarray(start), _STEP)
        for index, path in enumerate(_paths(ahead)):
            name = f"motions[{index}]" if len(program.items) > 1 else "motion"
            if boundary is not None:
                _check_inside(path, boundary, name)
            checks = self._checks(program.motions[index], self.check)
            touches = (self._tooling.loaded(check).first_on(path) for check in checks)
            touch = next(filter(None, touches), None)
            if touch is not None:
                of = f"motions[{index}]: " if len(program.items) > 1 else ""
                raise CollisionForeseen(
                    f"{of}{touch.clearance} after {touch.at:.0%} of the path",
                    touch=touch,
                    motion=index,
                    parameter=name,
                    value=round(touch.clearance.distance, 4),
                    hint="choose another path; or arm.collision_check = None, if the model of the scene is wrong",
                )
        self._end = ahead.q[-1] if len(items) == len(program.items) else None

    @staticmethod
    def _checks(motion: Motion, check: CollisionCheck | None) -> list[CollisionCheck]:
        """What checks a motion: a model, and of a path the world around which it was found, as it is now."""
        world = motion.world if isinstance(motion, Path) else None
        return [model for model in (check, world if world is not check else None) if model is not None]

    def find_path(
        self,
        goal: Goal,
        *,
        start: Array | None = None,
        avoid: CollisionWorld | None,
        keep: Keep | None,
        speed: float,
        tcp_speed: float | None,
        timeout: float,
        states: int,
        improve: int,
        seed: int,
        known: Path | None = None,
        stop: Callable[[], bool] | None,
        progress: Callable[[int, float], object] | None,
    ) -> Path:
        """Find a path; see `Arm.find_path`. It begins at `start`, shape (7,) [rad]; None: where the arm rests."""
        world = self.check if avoid is None else avoid
        if not isinstance(world, CollisionWorld):
            raise ShapeError(
                f"avoid must be a model of bodies, got {shown(world)}",
                parameter="avoid",
                value=world,
                hint='for example heptarm.CollisionModel("iiwa14", scene="table"); None: arm.collision_check',
            )
        if world.robot.name != self._connection.robot.name:
            raise CommandRejected(
                f"avoid must be a model of this robot, the {self._connection.robot.name}, got one of the "
                f"{world.robot.name}",
                parameter="avoid",
                value=world.robot.name,
                hint="heptarm.CollisionModel(arm.robot.name, ...)",
            )
        found = find_path(
            self._tooling.loaded(world),
            start=self._rest() if start is None else start,
            goal=goal,
            tcp=self._tooling.on_flange(TOOL),
            keep=keep,
            speed=speed,
            tcp_speed=tcp_speed,
            load=self._tooling.load,
            timeout=timeout,
            states=states,
            improve=improve,
            seed=seed,
            known=known,
            stop=stop,
            progress=progress,
        )
        # it is checked with what the arm carries when it is sent, and with the world as it is then
        return replace(found, world=world)

    def preview(
        self,
        motions: tuple[Motion, ...],
        terms: ProgramTerms,
        *,
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
        program = checked(self._connection, tooling, motions, terms, start=start)
        ahead = self._planned(program.items, start, step)
        boundary = self.boundary()
        if boundary is not None:
            for index, path in enumerate(_paths(ahead)):
                _check_inside(path, boundary, f"motions[{index}]" if len(motions) > 1 else "motion")
        load = tooling.load
        every = max(1, -(-len(ahead.t) // _MOST_TORQUES))
        kept = np.unique(np.append(np.arange(0, len(ahead.t), every), len(ahead.t) - 1))
        rows = ((ahead.q[k], ahead.dq[k], ahead.ddq[k]) for k in kept.tolist())
        torques = np.array([inverse_dynamics(robot, *row, load=load) for row in rows])
        tau = np.array([np.interp(ahead.t, ahead.t[kept], column) for column in torques.T]).T
        checks = [self._checks(motion, self.check if check is None else check) for motion in motions]
        return ProgramPreview(
            robot,
            ahead.t,
            ahead.q,
            ahead.dq,
            ahead.ddq,
            frozen(tau),
            self._poses(ahead.q),
            tuple(_listed(motions, ahead)),
            tuple(self._collisions(ahead, checks)),
            all(checks),
            terms.until,
        )

    def _collisions(
        self, program: PlannedProgram, checks: Sequence[Sequence[CollisionCheck]]
    ) -> Iterator[ForeseenCollision]:
        """The first touch on the path of each motion, by each of its checks."""
        bounds = zip(_bounds(program), _paths(program), strict=True)
        for index, ((first, last), path) in enumerate(bounds):
            for check in checks[index]:
                touch = self._tooling.loaded(check).first_on(path)
                if touch is not None:
                    t = _time_of(touch, program.t[first : last + 1], path)
                    yield ForeseenCollision(touch.clearance, t, index, touch.q)

    def _planned(self, items: Sequence[wire.Item], start: Array, step: float) -> PlannedProgram:
        """The program as the controller would plan it."""
        require("ruckig", extra="sim")
        with system_errors("the planner cannot be loaded"):
            from heptarm.planning.lookahead import FramesOfArm, look_ahead

        frames = FramesOfArm(self._tooling.on_flange, self._tooling.in_base)
        return look_ahead(self._connection.robot, start, items, frames, step=step)

    def _rest(self) -> Array:
        """Where the arm rests: the commanded position, from which the controller plans."""
        state = self._connection.fresh()
        try:  # the last state may be older than the end of the last motion
            state = (
                self._connection.wait_for(lambda state: not _is_busy(state), _SOON)
                if _is_busy(state)
                else state
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
    return [
        PreviewedMotion(type(motion).__name__, begin, end - begin, flows)
        for motion, begin, end, flows in rows
    ]


def _time_of(touch: TouchOnPath, t: Array, path: Array) -> float:
    """When a touch happens [s]: its place counts by the movement of the fastest joint."""
    moved = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path, axis=0)).max(axis=1))])
    return float(np.interp(touch.at * moved[-1], moved, t))
