"""Several arms: connect and close them together, start them at the same moment, stop all of them.

::

    with ha.connect_all(left="lab1", right="lab2") as arms:
        left, right = arms
        ha.start_together({left: ha.lin_rel(z=0.1), right: ha.lin_rel(z=-0.1)}).wait()

Each arm has a cabinet of its own and a clock of its own, which this computer compares with its own one by pings. So the
states of all arms have times on the same clock: that of this computer (`State.sampled`).
"""

from __future__ import annotations

import asyncio
import logging
import queue
import threading
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Literal, TypeVar

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.connect import connect
from heptarm.arm.motion.handle import MotionHandle, check_timeout
from heptarm.arm.verbs import camera_feed
from heptarm.errors import CollisionForeseen, CommandRejected, HeptarmError, ModeConflict, ShapeError, Timeout
from heptarm.record.recorder import Recorder
from heptarm.values.camera import Camera
from heptarm.values.checks import choice, flag, instance, shown, within
from heptarm.values.clearance import CollisionWorld
from heptarm.values.files import path_of
from heptarm.values.mode.mode import Mode
from heptarm.values.motion.motion import Motion
from heptarm.values.result import Result
from heptarm.values.sealed import Sealed
from heptarm.values.state import State

_log = logging.getLogger("heptarm.arm")

_Answer = TypeVar("_Answer")
#: Time that cabinets have to plan their programs before they are released [s].
_PLANNING = 0.2
#: Time after which a pause holds what is sent then [s]: a cabinet lowers the speed smoothly.
_PAUSING = 0.5
#: Longest wait for the state after the end of a motion [s].
_SOON = 0.5
#: Largest time between two samples of programs that are checked against each other [s].
_STEP = 0.02
#: Name of an arm without one in the worlds of the others.
_UNNAMED = "this arm"
#: Longest wait until a cabinet has taken up a program [s].
_PATIENCE = 10.0


@dataclass(frozen=True, slots=True)
class StatesOfArms:
    """The states of several arms at about the same moment.

    Attributes:
        time: the moment, on this computer's clock [s].
        states: one for each arm, in their order.
        spread: between the earliest and the latest of them [s].
    """

    time: float
    states: tuple[State, ...]
    spread: float

    def __str__(self) -> str:
        """The states, one below the other, and how far they are apart."""
        head = f"{len(self.states)} arms, sampled within {self.spread * 1e3:.1f} ms"
        return "\n".join([head, *map(str, self.states)])


class Arms(Sealed):
    """Several connected arms; made by `connect_all`.

    A `with` block leaves all of them at rest: however it ends, all are stopped at once, then closed one after the
    other, the last one first. Iterating returns the arms in their order, `arms["left"]` the one of that name.
    """

    def __init__(self, arms: Mapping[str, Arm]) -> None:
        self._arms = dict(arms)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the arms."""
        return tuple(self._arms)

    def __len__(self) -> int:
        """Number of arms."""
        return len(self._arms)

    def __iter__(self) -> Iterator[Arm]:
        """The arms in their order."""
        return iter(self._arms.values())

    def __getitem__(self, name: str) -> Arm:
        """The arm of a name.

        Raises:
            CommandRejected: there is none; the text lists them.
        """
        return choice(name, "name", self._arms)

    def __repr__(self) -> str:
        """Short form."""
        return f"<Arms {', '.join(f'{name}: {arm!r}' for name, arm in self._arms.items())}>"

    def record(
        self,
        path: str | Path,
        *,
        rate: float | None = None,
        camera: Camera | None = None,
        overwrite: bool = False,
    ) -> Recorder:
        """A recording of all arms in one file, with one time line; see `Arm.record`.

        `heptarm.load(path, arm="left")` reads the part of one of them.

        Args:
            path: the file, MCAP.
            rate: have at least so many states of each pushed per second meanwhile [Hz]; None: as many as are.
            camera: a simulated camera in front of each of them, see `Arm.record`; None: no pictures.
            overwrite: replace a file that exists.

        Raises:
            LimitError: a rate outside its range.
            CommandRejected: the file exists. Or it cannot be written, or this machine cannot draw (when the block
                begins).
            MissingExtra: the package mcap is not installed, or those of a camera (when the block begins).
        """
        sources = {name: arm.connection for name, arm in self._arms.items()}
        cameras = (
            {} if camera is None else {name: camera_feed(arm, camera) for name, arm in self._arms.items()}
        )
        return Recorder(sources, path_of(path), rate=rate, cameras=cameras, overwrite=overwrite)

    def close(self) -> None:
        """Stop all arms, then leave each at rest and disconnect it; calling it again has no effect."""
        moving = [arm for arm in self if arm.in_control]
        for error in _of_each(moving, Arm.stop)[1]:
            _log.warning("closing: %s", error)
        for arm in reversed(list(self)):
            arm.close()

    def __enter__(self) -> Arms:
        """The arms themselves."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close them."""
        self.close()


def connect_all(*targets: str, settings: Mapping[str, Any] | None = None, **named: str) -> Arms:
    """Connect to several arms; if one does not answer, the others are closed again.

    Args:
        *targets: names of saved targets, or what `connect` takes; each is also the arm's name.
        settings: keywords of `connect` for all of them, such as {"state_rate": 250}.
        **named: more targets by the arm's name: left="sim://iiwa14", right="172.31.1.147".

    Returns:
        The arms; use them in a `with` block, which leaves all of them at rest.

    Raises:
        ConnectFailed: one does not answer; others as `connect`. The text names the arm.
        CommandRejected: no target, or two arms of one name.
    """
    pairs = [*((instance(target, str, "targets"), target) for target in targets), *named.items()]
    if not pairs or len({name for name, _ in pairs}) < len(pairs):
        raise CommandRejected(
            "targets must be one or more arms of different names, got "
            + (", ".join(name for name, _ in pairs) or "none"),
            parameter="targets",
            hint='give them names: connect_all(left="sim://iiwa14", right="sim://iiwa14")',
        )
    arms: dict[str, Arm] = {}
    try:
        for name, target in pairs:
            try:
                arms[name] = connect(instance(target, str, name), **dict(settings or {}))
            except HeptarmError as error:
                _of(name, error)
                raise
            arms[name].name = name
    except BaseException:
        Arms(arms).close()
        raise
    return Arms(arms)


def stop_all(*arms: Arm, kind: Literal["path", "fast", "after_motion"] = "path") -> None:
    """Stop several arms at once; see `Arm.stop`. Each is stopped, also if another one cannot be reached.

    Args:
        *arms: which ones.
        kind: see `Arm.stop`.

    Raises:
        ConnectionLost: an arm could not be reached; the others were stopped.
    """
    chosen = [instance(arm, Arm, "arms") for arm in arms]
    _, errors = _of_each(chosen, lambda arm: arm.stop(kind))
    if errors:
        raise errors[0]


def states_together(*arms: Arm) -> StatesOfArms:
    """The newest states of several arms that were sampled at about the same moment.

    The moment is that of the arm whose newest state is the oldest; of the others the nearest state is taken. Each is
    at most half a period of the pushed states from it, unless states were lost on the way.

    Args:
        *arms: which ones.

    Raises:
        StaleState: the newest state of an arm is too old to act on.
        ConnectionLost: the connection of one has ended.
    """
    newest = [instance(arm, Arm, "arms").state for arm in arms]
    if not newest:
        raise ShapeError("arms must be one or more arms, got none", parameter="arms")
    moment = min(state.sampled for state in newest)
    histories = [(state, *arm.history()) for arm, state in zip(arms, newest, strict=True)]
    chosen = tuple(min(history, key=lambda state: abs(state.sampled - moment)) for history in histories)
    times = [state.sampled for state in chosen]
    return StatesOfArms(moment * 1e-9, chosen, (max(times) - min(times)) * 1e-9)


class MotionOfArms(Sealed):
    """Programs of several arms that began together; made by `start_together`.

    Attributes:
        handles: the program of each arm.
        skew: upper bound of the time between the first and the last arm that was released [s]: from the first request
            that was sent to the last one that was answered.
    """

    handles: Final[Mapping[Arm, MotionHandle]]
    skew: Final[float]

    def __init__(self, handles: Mapping[Arm, MotionHandle], *, skew: float, stops_others: bool) -> None:
        self.handles = dict(handles)
        self.skew = skew
        self._stops_others = stops_others
        self._first: HeptarmError | None = None
        self._ended: queue.SimpleQueue[Arm] = queue.SimpleQueue()
        for arm, handle in self.handles.items():
            handle.add_done_callback(lambda _, arm=arm: self._ended.put(arm))  # type: ignore[misc]
        self._watcher = threading.Thread(target=self._watch, name="heptarm-together", daemon=True)
        self._watcher.start()

    def __repr__(self) -> str:
        """Short form."""
        return f"<MotionOfArms {', '.join(map(repr, self.handles.values()))}, skew {self.skew * 1e3:.1f} ms>"

    @property
    def done(self) -> bool:
        """Whether the programs of all arms have ended."""
        return all(handle.done for handle in self.handles.values())

    def cancel(self) -> None:
        """End all programs: those that run brake on their paths."""
        for error in _of_each(list(self.handles.values()), MotionHandle.cancel)[1]:
            raise error

    def wait(self, *, timeout: float | None = None) -> dict[Arm, Result]:
        """Wait until the programs of all arms have ended.

        Args:
            timeout: longest wait for each [s]; None: that of `MotionHandle.wait`.

        Returns:
            How each ended.

        Raises:
            HeptarmError: the error of the arm that failed first, as of `MotionHandle.wait`.
            Timeout: one has not ended in time; all go on.
        """
        results: dict[Arm, Result] = {}
        for arm, handle in self.handles.items():
            try:
                results[arm] = handle.wait(timeout=timeout)
            except Timeout:
                raise
            except HeptarmError as error:
                _log.debug("one of several arms: %s", error)  # the watcher knows which one was the first
        self._watcher.join(_PATIENCE)
        if self._first is not None:
            raise self._first
        return results

    def __await__(self) -> Generator[Any, None, dict[Arm, Result]]:
        """Wait in asyncio, as `wait` does without a timeout; if that is cancelled or times out, all arms brake."""
        return self._all_ended().__await__()

    async def _all_ended(self) -> dict[Arm, Result]:
        # exceptions are results here: otherwise the first arm's ends the wait for the others, which brake as well
        await asyncio.gather(*map(_awaited, self.handles.values()), return_exceptions=True)
        return self.wait()

    def _watch(self) -> None:
        """Stop the other arms when one has failed; in a thread of its own, since a callback must not wait."""
        waiting = set(self.handles)
        while waiting:
            arm = self._ended.get()
            waiting.discard(arm)
            error = self.handles[arm].error
            if error is None or self._first is not None:
                continue
            self._first = _of(arm.name, error)
            if self._stops_others and waiting:
                _log.warning("one of %d arms failed, the others are stopped: %s", len(self.handles), error)
                for failure in _of_each(sorted(waiting, key=list(self.handles).index), Arm.stop)[1]:
                    _log.error("an arm could not be stopped: %s", failure)


async def _awaited(handle: MotionHandle) -> Result:
    return await handle


def start_together(
    motions: Mapping[Arm, Motion | Sequence[Motion]],
    *,
    speed: float | None = None,
    mode: Mode | None = None,
    planning_time: float = _PLANNING,
    stop_others: bool = True,
    collision_check: CollisionWorld | None = None,
) -> MotionOfArms:
    """Begin motions of several arms at the same moment, and return then.

    Each cabinet gets its program while it is paused, so that it has planned it when all are released at once. What is
    left is the time by which the releases arrive at different times: `MotionOfArms.skew`.

    Args:
        motions: for each arm a motion, or several as one batch.
        speed: ceiling for all of them, (0, 1]; see `Arm.start`.
        mode: control mode of all of them; see `Arm.start`.
        planning_time: time that the cabinets have to plan [s], 0 to 10.
        stop_others: if one arm fails, or its connection is lost, stop the others.
        collision_check: the world of one of the arms, which has the others by their names, see
            `heptarm.CollisionModel.with_arm`: before anything moves, the programs are planned, with what each arm
            carries, and refused where arms would touch at any time. Other bodies are what `Arm.collision_check` is for.
            It is no safety function, and the arms begin up to `skew` apart; give the world a margin. None: no check.

    Returns:
        The programs, all of them released.

    Raises:
        CollisionForeseen: two arms would touch; nothing has moved.
        CommandRejected: a program was refused, or could not be planned; nothing has moved.
        ModeConflict: an arm has not come to rest.
        NotInControl: this client does not control an arm.
    """
    if not isinstance(motions, Mapping) or not motions or not all(isinstance(arm, Arm) for arm in motions):
        raise ShapeError(
            f"motions must be a motion for each arm, got {shown(motions)}",
            parameter="motions",
            hint="for example {left: ha.lin_rel(z=0.1), right: ha.lin_rel(z=-0.1)}",
        )
    flag(stop_others, "stop_others")
    seconds = within(planning_time, "planning_time", 0.0, 10.0, unit="s")
    arms = list(motions)
    for arm in arms:
        try:  # the last state may be older than the end of the last motion
            arm.wait_until(_is_idle, timeout=_SOON)
        except Timeout:
            raise ModeConflict(
                f"{arm.name or 'an arm'} still moves, so that it could not begin with the others",
                parameter="motions",
                hint="wait until all arms rest: arm.wait_for_rest()",
            ) from None
        except HeptarmError as error:
            _of(arm.name, error)
            raise
    if collision_check is not None:
        _check_together(collision_check, motions, speed=speed, mode=mode)
    handles: dict[Arm, MotionHandle] = {}
    try:
        _raise_first(_of_each(arms, Arm.pause))
        for arm in arms:
            _wait_until_braked(arm)
        for arm in arms:
            try:
                handles[arm] = arm.start(motions[arm], speed=speed, mode=mode, when="reject")
            except HeptarmError as error:
                _of(arm.name, error)
                raise
        for arm in arms:
            _wait_until_taken(arm, handles[arm])
        time.sleep(seconds)
        for arm, handle in handles.items():
            if handle.error is not None:
                raise _of(arm.name, handle.error)
    except BaseException:
        _withdraw(arms, handles)
        raise
    moments, errors = _of_each(arms, _released)
    if errors:
        _of_each(arms, Arm.stop)
        raise errors[0]
    skew = max(answered for _, answered in moments) - min(sent for sent, _ in moments)
    return MotionOfArms(handles, skew=skew, stops_others=stop_others)


def _check_together(
    world: CollisionWorld,
    motions: Mapping[Arm, Motion | Sequence[Motion]],
    *,
    speed: float | None,
    mode: Mode | None,
) -> None:
    """Plan the programs of all arms, and refuse them if two arms would touch at any time.

    Raises:
        CollisionForeseen: they would.
        CommandRejected: a program cannot be planned, or the world has not all arms but one.
    """
    if not isinstance(world, CollisionWorld):
        raise ShapeError(
            f"collision_check must be a world of several arms, got {shown(world)}",
            parameter="collision_check",
            value=world,
            hint='for example heptarm.CollisionModel("iiwa14", scene="two-arms").with_arm("right")',
        )
    own = [arm for arm in motions if arm.name not in world.arms]
    if len(own) != 1:
        given = ", ".join(arm.name or "an arm without a name" for arm in motions)
        raise CommandRejected(
            f"collision_check must have all arms but one, which it is made for, by their names: got a world with "
            f"{', '.join(world.arms) or 'none'} for {given}",
            parameter="collision_check",
            hint="name the arms by connect_all(left=..., right=...), and add them by world.with_arm",
        )
    names = {arm: arm.name or _UNNAMED for arm in [*own, *(arm for arm in motions if arm not in own)]}
    previews = {}
    for arm in names:
        try:
            plan = arm.plan(motions[arm], speed=speed, mode=mode, step=_STEP)
        except HeptarmError as error:
            _of(arm.name, error)
            raise
        previews[arm] = (plan, plan.t / _override(arm))
    t = np.unique(np.concatenate([times for _, times in previews.values()]))
    paths = {
        arm: np.stack([np.interp(t, times, column) for column in plan.q.T], axis=1)
        for arm, (plan, times) in previews.items()
    }
    world, seen = own[0].loaded(world), own[0]
    for arm in [*names][1:]:  # each gives it what it carries
        world, seen = arm.loaded(world.seen_by(names[arm], own=names[seen])), arm
    for arm in [*names][:-1]:
        if arm is not seen:
            world, seen = world.seen_by(names[arm], own=names[seen]), arm
        others = {names[other]: path for other, path in paths.items() if other is not arm}
        touch = world.first_together(t, paths[arm], others)
        if touch is not None:
            raise CollisionForeseen(
                f"{names[arm]}: {touch.clearance} after {touch.t:.2f} s",
                touch=touch,
                parameter="motions",
                value=round(touch.clearance.distance, 4),
                hint="let one of the arms begin later, or choose another path, see Arm.find_path",
            )


def _override(arm: Arm) -> float:
    """Speed override of an arm, by which its program takes longer, (0, 1]."""
    motion = arm.state.motion
    return 1.0 if motion is None else max(motion.override, 0.01)


def _released(arm: Arm) -> tuple[float, float]:
    """End the pause of an arm; returns when that was requested and when it was answered [s]."""
    sent = time.monotonic()
    arm.resume()
    return sent, time.monotonic()


def _withdraw(arms: Sequence[Arm], handles: Mapping[Arm, MotionHandle]) -> None:
    """Cancel programs that have not been released, and end the pause of each arm whose program has ended."""
    _of_each(list(handles.values()), MotionHandle.cancel)
    deadline = time.monotonic() + _PATIENCE
    while not all(handle.done for handle in handles.values()) and time.monotonic() < deadline:
        time.sleep(0.005)
    waiting = [arm for arm, handle in handles.items() if not handle.done]
    for arm in waiting:
        _log.error("%r stays paused: its program could not be cancelled", arm)
    _of_each([arm for arm in arms if arm not in waiting], Arm.resume)


def _is_idle(state: State) -> bool:
    return state.motion is None or not (state.motion.active or state.motion.queued)


def _wait_until_braked(arm: Arm) -> None:
    """Wait until the speed override of a paused arm has come down, by its own clock."""
    ready = arm.state.stamp + round(_PAUSING * 1e9)
    arm.wait_until(lambda state: state.stamp >= ready, timeout=check_timeout(_PATIENCE))


def _wait_until_taken(arm: Arm, handle: MotionHandle) -> None:
    """Wait until a cabinet has taken up a program, or refused it."""
    deadline = time.monotonic() + check_timeout(_PATIENCE)
    while not handle.done and time.monotonic() < deadline:
        status = arm.state.motion
        if status is None or status.id == handle.id:
            return
        time.sleep(0.005)


def _of_each(
    these: Sequence[Any], action: Callable[[Any], _Answer]
) -> tuple[list[_Answer], list[HeptarmError]]:
    """Carry out an action for each at the same moment; returns the answers and the errors."""
    if not these:
        return [], []
    barrier = threading.Barrier(len(these))

    def act(arm: Any) -> _Answer:
        barrier.wait()
        return action(arm)

    answers: list[_Answer] = []
    errors: list[HeptarmError] = []
    with ThreadPoolExecutor(len(these), thread_name_prefix="heptarm-together") as pool:
        for arm, future in [(arm, pool.submit(act, arm)) for arm in these]:
            try:
                answers.append(future.result())
            except HeptarmError as error:
                errors.append(_of(arm.name, error) if isinstance(arm, Arm) else error)
    return answers, errors


def _of(name: str, error: HeptarmError) -> HeptarmError:
    """The error, whose text begins with the name of its arm."""
    if name and not error.text.startswith(f"{name}: "):
        error.text = f"{name}: {error.text}"
        error.args = (error.text,)
    return error


def _raise_first(outcome: tuple[list[Any], list[HeptarmError]]) -> None:
    for error in outcome[1]:
        raise error
