"""The check of a task with contacts: what its functions return, before it is simulated.

It asks a task about two arms at rest, once, and refuses it by the name of the function that is wrong. Nothing here
needs MuJoCo: what the scene has is given.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.rl.contact.task import ContactTask, Moment
from heptarm.values.checks import Array, shown

#: So many arms are asked about.
_ARMS = 2
#: Largest deviation of the rate from the one that is simulated, a fraction: an episode is as much shorter or longer.
_OFF = 0.05
_NUMBERS = 6


@dataclass(frozen=True, slots=True)
class Contents:
    """What a scene has.

    Attributes:
        free: names of the bodies with a freejoint.
        mocaps: names of those with mocap="true".
        joints: names of the other joints.
        has_gripper: whether an actuator `gripper` is there.
    """

    free: Collection[str]
    mocaps: Collection[str]
    joints: Collection[str]
    has_gripper: bool


def check_task(task: ContactTask, scene: Contents) -> None:
    """Refuse a task whose functions do not fit each other or its scene.

    Args:
        task: the task.
        scene: what its scene has.

    Raises:
        ShapeError: a function returns something of another shape.
        LimitError: a number that is not finite or outside its range.
        CommandRejected: the scene, or a function, lacks what the task needs.
    """
    _check_numbers(task)
    if task.has_gripper and not scene.has_gripper:
        raise _lacks(task, "has_gripper", "an actuator `gripper` in the scene", "there is none")
    if task.has_teacher and type(task).teach is ContactTask.teach:
        raise _lacks(task, "has_teacher", "a function `teach`", "it has none of its own")
    random = np.random.default_rng(0)
    target = _returned(task, "targets", (_ARMS, None), task.targets, random, _ARMS)
    starts = _returned(task, "starts", (_ARMS, _NUMBERS), task.starts, random, _ARMS)
    placed = task.bodies(target)
    if not isinstance(placed, Mapping):
        raise ShapeError(
            f"bodies() of the task {task.name} must return a dictionary of poses, got {shown(placed)}",
            parameter="bodies",
        )
    for name, poses in placed.items():
        if name not in scene.free and name not in scene.mocaps:
            there = ", ".join([*scene.free, *scene.mocaps]) or "there is none"
            raise _lacks(
                task,
                "bodies()",
                f'bodies of the scene with a freejoint or mocap="true" ({there})',
                f"got {shown(name)}",
            )
        _returned(task, f"bodies()[{name!r}]", (_ARMS, _NUMBERS), np.asarray, poses)
    now = Moment(
        starts,
        task.begin(starts),
        np.zeros((_ARMS, _NUMBERS)),
        target,
        bodies={name: np.array(placed.get(name, np.zeros((_ARMS, _NUMBERS)))) for name in scene.free},
        joints={name: np.zeros(_ARMS) for name in scene.joints},
        memory=np.zeros((_ARMS, task.memory_size)),
        time=np.zeros(_ARMS),
        friction=np.full(_ARMS, task.friction[0]),
        q=np.zeros((_ARMS, 7)),
    )
    for name, size in (("look", "look_size"), ("hidden", "hidden_size"), ("remember", "memory_size")):
        _returned(task, name, (_ARMS, getattr(task, size)), getattr(task, name), now, size=size)
    for name in ("missing", "reward"):
        _returned(task, name, (_ARMS,), getattr(task, name), now)
    if task.has_teacher:
        _returned(task, "teach", (_ARMS, len(task.axes) + task.has_gripper), task.teach, now, size="axes")


def _check_numbers(task: ContactTask) -> None:
    """Refuse axes, a box or a rate that cannot be."""
    axes = task.axes
    is_listed = isinstance(axes, tuple) and all(type(axis) is int and 0 <= axis < _NUMBERS for axis in axes)
    if not is_listed or not axes or len(set(axes)) < len(axes):
        raise LimitError(
            f"axes of the task {task.name} must be some of 0 to 5, each once, got {shown(axes)}",
            code=2,
            parameter="axes",
            value=axes,
            hint="0, 1, 2 are x, y, z, and 3, 4, 5 the turns about them, as in (0, 1, 2)",
        )
    pair: Any = task.box
    if not isinstance(pair, (tuple, list)) or len(pair) != 2:
        raise ShapeError(
            f"box of the task {task.name} must be two arrays of shape (6,), lowest and highest, got {shown(pair)}",
            parameter="box",
        )
    low, high = (_returned(task, f"box[{end}]", (_NUMBERS,), np.asarray, pair[end]) for end in (0, 1))
    for axis in np.flatnonzero(low > high).tolist():
        unit = "m" if axis < 3 else "rad"
        raise LimitError(
            f"box of the task {task.name} must have lowest numbers that are at most the highest, got "
            f"{low[axis]:g} above {high[axis]:g} {unit} of axis {axis}",
            code=2,
            parameter="box",
            value=float(low[axis]),
        )
    steps = task.frequency / task.rate
    if round(steps) < 1 or abs(round(steps) / steps - 1.0) > _OFF:
        fitting = task.frequency / max(round(steps), 1)
        raise LimitError(
            f"rate of the task {task.name} must divide the {task.frequency:g} Hz of its simulation, within 5 %, got "
            f"{task.rate:g} Hz",
            code=2,
            parameter="rate",
            value=task.rate,
            hint=f"{fitting:.4g} Hz does, or change the task's frequency",
        )


def _returned(
    task: ContactTask,
    name: str,
    shape: tuple[int | None, ...],
    function: Callable[..., Any],
    *arguments: Any,
    size: str = "",
) -> Array:
    """What a function of a task returns, if it has this shape (None: any number) and is finite."""
    called = name if "[" in name else f"{name}()"
    try:
        found = np.asarray(function(*arguments), dtype=np.float64)
    except (TypeError, ValueError) as error:  # NumPy's, about shapes: which function it was
        raise ShapeError(
            f"{called} of the task {task.name} fails for {_ARMS} arms: {error}", parameter=name
        ) from error
    expected = ", ".join("k" if length is None else str(length) for length in shape)
    expected += "," if len(shape) == 1 else ""
    if len(found.shape) != len(shape) or any(
        length not in (None, given) for length, given in zip(shape, found.shape, strict=True)
    ):
        raise ShapeError(
            f"{called} of the task {task.name} must return shape ({expected})"
            f"{f' for {_ARMS} arms' if shape[0] == _ARMS else ''}, got shape {found.shape}",
            parameter=name,
            value=found.shape,
            hint=f"the last number is of `{size}`" if size else "",
        )
    if not np.isfinite(found).all():
        where = np.argwhere(~np.isfinite(found))[0].tolist()
        raise LimitError(
            f"{called} of the task {task.name} must be finite at the start of an episode, got "
            f"{found[tuple(where)]} at {where}",
            code=1,
            parameter=name,
        )
    return found


def _lacks(task: ContactTask, name: str, needed: str, got: str) -> CommandRejected:
    return CommandRejected(f"{name} of the task {task.name} needs {needed}: {got}", parameter=name)
