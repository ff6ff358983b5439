"""The action `calibrate`: it measures the tip of the tool, the load, or a camera, after it has shown what moves."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeAlias

from heptarm import calibration
from heptarm.calibration.proposal import measuring
from heptarm.errors import CommandRejected, HeptarmError, ShapeError
from heptarm.io.targets import saved_target
from heptarm.ros.interface.action import (
    ActionResult,
    GoalClient,
    GoalWork,
    result_of_failed_task,
    wait_for_task,
)
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.messages import pose_message
from heptarm.ros.trajectory.goal import GoalOutcome

#: Kinds of goals.
TCP, LOAD, EYE = range(3)
#: Asks whether a plan may be carried out, and takes the number of what is done and of all.
Confirm: TypeAlias = Callable[[object], bool]
Progress: TypeAlias = Callable[[int, int], object]


@dataclass(frozen=True, slots=True)
class _Measured:
    """A result as fields of a message, and what saves it with a target under a name."""

    text: str
    fields: dict[str, Any]
    save: Callable[[str, str], object]


#: Measures something.
_Work: TypeAlias = Callable[[Confirm, Progress], _Measured]


def calibrate(context: NodeContext, goal: Any) -> GoalWork:
    """Measure the tip of the tool, the load, or where a camera is."""
    context.check_active()
    kinds = {TCP: _touch, LOAD: _load, EYE: _eye}
    if goal.kind not in kinds:
        raise CommandRejected(
            f"kind must be 0 (TCP), 1 (LOAD) or 2 (EYE), got {goal.kind}", parameter="kind", value=goal.kind
        )
    place = context.driver.configuration.values["target"]
    if goal.save and saved_target(place) is None:
        raise CommandRejected(
            f"the parameter target of the node is no saved target, so that nothing can be saved with it: {place!r}",
            parameter="save",
            value=goal.save,
            hint="heptarm targets add NAME ADDRESS, and start the node with target:=NAME",
        )
    work = kinds[goal.kind](context, goal)
    return partial(_carry_out, context, goal, work, place)


def _carry_out(context: NodeContext, goal: Any, work: _Work, place: str, client: GoalClient) -> ActionResult:
    shown: list[str] = []

    def confirm(plan: object) -> bool:
        shown.append(str(plan))
        client.publish_feedback({"plan": shown[-1]})
        return not goal.dry_run

    def progress(done: int, count: int) -> None:
        client.publish_feedback({"plan": shown[-1], "done": done, "count": count})

    try:
        task = context.driver.run_task("the calibration", partial(work, confirm, progress))
    except HeptarmError as error:
        return ActionResult(GoalOutcome.ABORTED, str(error))
    failure = wait_for_task(task, client, lambda: None)
    if failure is not None:
        if goal.dry_run and shown and not task.end_reason:
            return ActionResult(GoalOutcome.SUCCEEDED, shown[-1])
        return result_of_failed_task(task, client, failure)
    found: _Measured = task.result()
    result = ActionResult(GoalOutcome.SUCCEEDED, found.text, {**found.fields, "saved": bool(goal.save)})
    if goal.save:
        try:
            found.save(place, goal.save)
        except HeptarmError as error:
            fields = {**found.fields, "saved": False}
            return replace(result, outcome=GoalOutcome.ABORTED, text=f"{found.text}; {error}", fields=fields)
    return result


def _given(**values: Any) -> dict[str, Any]:
    """Arguments that are not 0 and not empty: the others have their defaults."""
    return {name: value for name, value in values.items() if value}


def _touch(context: NodeContext, goal: Any) -> _Work:
    place = (goal.surface.x, goal.surface.y, goal.surface.z)
    surface = (
        calibration.KnownSurface.sphere(place, goal.radius)
        if goal.radius
        else calibration.KnownSurface.plane(place)
    )
    how = _given(tip_radius=goal.tip_radius, touches=goal.count, speed=goal.speed)

    def measure(confirm: Confirm, progress: Progress) -> _Measured:
        arm = context.arm
        plan = calibration.touch_plan(arm, surface, **how)
        found = calibration.touch_tcp(arm, plan=plan, confirm=confirm, progress=progress)
        fields = {"pose": pose_message(context.ros, found.pose), "sigma": found.sigma.tolist()}
        return _Measured(
            str(found), fields, lambda target, name: found.save(target, arm.tools.get(name, name))
        )

    return measure


def _load(context: NodeContext, goal: Any) -> _Work:
    how = _given(speed=goal.speed)

    def measure(confirm: Confirm, progress: Progress) -> _Measured:
        arm = context.arm
        plan = calibration.load_plan(arm, excitation="full" if goal.inertia else "rests", **how)
        with measuring(arm):
            found = calibration.load(arm, plan=plan, confirm=confirm, progress=progress)
        fields = {
            "mass": found.mass,
            "com": dict(zip("xyz", found.com.tolist())),
            "moments": found.inertia.tolist(),
            "sigma": [found.sigma_mass, *found.sigma_com.tolist()],
        }
        return _Measured(
            str(found), fields, lambda target, name: found.save(target, arm.tools.get(name, name))
        )

    return measure


def _eye(context: NodeContext, goal: Any) -> _Work:
    board = calibration.Board(
        **_given(columns=goal.columns, rows=goal.rows, square=goal.square, kind=goal.board)
    )
    lens = list(goal.lens)
    if len(lens) not in (0, 4):
        raise ShapeError(f"lens must be fx fy cx cy, got {len(lens)} numbers", parameter="lens", value=lens)
    matrix = [[lens[0], 0.0, lens[2]], [0.0, lens[1], lens[3]], [0.0, 0.0, 1.0]] if lens else None
    how = _given(views=goal.count, speed=goal.speed)

    def measure(confirm: Confirm, progress: Progress) -> _Measured:
        arm = context.arm
        with closing(arm.camera(context.images.read, frame=goal.frame or "flange")) as camera:
            found = calibration.hand_eye(
                arm, camera, board, matrix=matrix, confirm=confirm, progress=progress, **how
            )
        fields = {"pose": pose_message(context.ros, found.pose), "sigma": found.sigma.tolist()}
        return _Measured(str(found), fields, found.save)

    return measure
