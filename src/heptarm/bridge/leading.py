"""Actions with somebody's hand on the arm: guiding, teaching a way, and doing it again."""

from __future__ import annotations

import contextlib
from functools import partial
from math import inf
from typing import Any

from heptarm.arm.handle import MotionHandle
from heptarm.arm.teaching import Replay, trajectory_of
from heptarm.bridge.action import PERIOD, Action, Client, Doing, Ended, Work, end_of, failure, watch
from heptarm.bridge.conditions import condition_of
from heptarm.bridge.driver import Driver
from heptarm.bridge.goal import Outcome
from heptarm.bridge.messages import Ros
from heptarm.bridge.motions import guiding
from heptarm.bridge.order import positions
from heptarm.bridge.task import Task
from heptarm.errors import CommandRejected, HeptarmError
from heptarm.values.arrays import within
from heptarm.values.mode import Mode
from heptarm.values.motion import TOOL, Motion, hold
from heptarm.values.result import Cause
from heptarm.values.state import State
from heptarm.values.trajectory import Trajectory
from heptarm.values.yielding import yielding

#: Under which name a way is kept that was given none, and how many are kept.
_LAST, _MOST = "last", 100
#: How far the points that are kept may lead off the way, unless a goal says so [rad].
_TOLERANCE = 2e-3
#: How long a motion may take to end that was cancelled [s].
_BRAKING = 10.0


class Leading(Doing):
    """Guiding by hand, teaching, replaying; it keeps what was taught."""

    def __init__(self, driver: Driver, ros: Ros) -> None:
        super().__init__(driver, ros)
        self._ways: dict[str, Trajectory] = {}

    # ---------------------------------------------------------------------------------- guiding

    def guide(self, goal: Any) -> Work:
        """Give way to somebody's hand."""
        led = self._lead(goal)
        return partial(self._guide, led)

    def _guide(self, led: _Led, client: Client) -> Ended:
        end = led.follow(client)
        fields = {**end.fields, "position": self._place()}
        return Ended(end.outcome, end.text, fields, success=end.success)

    def teach(self, goal: Any) -> Work:
        """Give way, and record where the arm is led."""
        name = goal.name or _LAST
        if name not in self._ways and len(self._ways) >= _MOST:
            raise CommandRejected(
                f"{_MOST} ways are kept already", parameter="name", value=name, hint="use one of their names"
            )
        tolerance = within(goal.tolerance or _TOLERANCE, "tolerance", 0.0, 1.0, above=True, unit="rad")
        return partial(self._teach, self._lead(goal), name, None if goal.whole else tolerance)

    def _teach(self, led: _Led, name: str, tolerance: float | None, client: Client) -> Ended:
        end = led.follow(client)
        if not end.success:
            return end
        try:
            way = trajectory_of(led.recorded, self._arm.robot.name)
            if tolerance is not None:
                way = way.trimmed().thinned(tolerance=tolerance)
        except HeptarmError as error:
            outcome = Outcome.CANCELED if end.outcome is Outcome.CANCELED else Outcome.ABORTED
            return Ended(outcome, f"{end.text}; {error}", success=False)
        self._ways[name] = way
        fields = {
            **end.fields,
            "name": name,
            "recorded": len(led.recorded),
            "trajectory": {
                "joint_names": list(self._driver.configuration.joints),
                "points": [
                    self._ros.point(positions=q.tolist(), time_from_start=self._ros.duration(float(t)))
                    for t, q in zip(way.times, way.q)
                ],
            },
        }
        text = f"{end.text}; {way.duration:.1f} s in {len(way)} points are kept as {name!r}"
        return Ended(end.outcome, text, fields, success=True)

    def _lead(self, goal: Any) -> _Led:
        """Begin what a goal of Guide or Teach asks for."""
        longest = within(goal.duration, "duration", 0.0, 1e6, unit="s")
        mode: Mode | None = None
        motion: Motion = guiding(goal)
        if goal.free:
            mode, motion = yielding(goal.free, frame=goal.frame or TOOL), hold(inf)
        handle = self._driver.start(motion, mode=mode, until=condition_of(goal.until))
        return _Led(self._driver, handle, longest or inf, goal.key, goal.slot)

    def _place(self) -> list[float]:
        try:
            place: list[float] = self._arm.state.q.tolist()
        except HeptarmError:  # the connection is lost
            return []
        return place

    # -------------------------------------------------------------------------------- replaying

    def replay(self, goal: Any) -> Work:
        """Do again what was taught."""
        way = self._way(goal)
        done: list[float] = [0.0]
        until = condition_of(goal.until)

        def note(share: float) -> None:
            done[0] = share

        call = partial(
            self._arm.replay,
            way,
            by=goal.by or "servo",
            pace=goal.pace or 1.0,
            until=self._driver.guard if until is None else until,
            watchdog=self._driver.configuration.values["servo.watchdog"],
            on_progress=note,
            **({"approach": goal.approach} if goal.approach else {}),
        )
        return partial(self._replay, self._driver.begin("the replay", call), done)

    def _way(self, goal: Any) -> Trajectory:
        points = goal.trajectory.points
        if not len(points):
            name = goal.name or _LAST
            if name not in self._ways:
                raise CommandRejected(
                    f"no way is kept as {name!r}",
                    parameter="name",
                    value=name,
                    allowed=", ".join(sorted(self._ways)) or "none",
                    hint="teach it, or send it as a trajectory",
                )
            return self._ways[name]
        names = goal.trajectory.joint_names
        return Trajectory.of(
            [self._ros.seconds(one.time_from_start) for one in points],
            [positions(self._driver, names, one.positions) for one in points],
        )

    def _replay(self, task: Task, done: list[float], client: Client) -> Ended:
        error = watch(task, client, lambda: client.tell({"progress": done[0]}))
        if error is not None:
            return failure(task, client, error)
        client.tell({"progress": done[0]})
        replay: Replay = task.result()
        result = replay.result
        fields: dict[str, Any] = {"deviation": replay.deviation, "lag": replay.lag}
        if result.cause is Cause.CONDITION:
            fired = "the condition" if result.stopped_by is None else str(result.stopped_by)
            return Ended(Outcome.SUCCEEDED, f"ended by {fired}", {**fields, "stopped_by": fired})
        if result.cause is not Cause.FINISHED:
            return Ended(Outcome.ABORTED, f"the replay was {result.cause.value}", fields)
        return Ended(Outcome.SUCCEEDED, "the way was done again", fields)


class _Led:
    """An arm that is led, until something ends that.

    Args:
        driver: whose arm it is.
        handle: of the motion.
        longest: how long at most [s].
        key: what stands on a user key that ends it; empty: none does.
        slot: of that key.

    Attributes:
        recorded: the states since it began.
    """

    def __init__(self, driver: Driver, handle: MotionHandle, longest: float, key: str, slot: int) -> None:
        self.recorded: list[State] = []
        self._arm = driver.arm
        self._handle = handle
        self._longest = longest
        self._key, self._slot = key, slot
        self._pressed = False

    def follow(self, client: Client) -> Ended:
        """Wait until it has ended; that its client ends it is a success."""
        with contextlib.ExitStack() as stack:
            try:
                if self._key:
                    self._arm.pad.set_key(self._slot, self._key, led="green")
                    stack.callback(self._clear_key)
                    stack.callback(self._arm.pad.on_key(self._on_key))
                why = self._watch(client)
            except HeptarmError as error:
                with contextlib.suppress(HeptarmError):
                    self._handle.cancel()
                return Ended(Outcome.ABORTED, str(error), success=False)
        with contextlib.suppress(HeptarmError):  # told below
            self._handle.wait(timeout=_BRAKING)
        end = end_of(self._handle, cancelled=bool(why))
        if end.outcome is Outcome.CANCELED:
            outcome = Outcome.CANCELED if client.has_cancelled() else Outcome.SUCCEEDED
            return Ended(outcome, why, end.fields, success=True)
        arrived = end.outcome is Outcome.SUCCEEDED and not end.fields["stopped_by"]
        text = "the switch was let go" if arrived else end.text
        return Ended(end.outcome, text, end.fields, success=end.outcome is Outcome.SUCCEEDED)

    def _watch(self, client: Client) -> str:
        """Record until the motion has ended, or end it; returns why we have ended it."""
        first = told = 0
        why = ""
        for state in self._arm.states():
            if self._handle.done:
                break
            self.recorded.append(state)
            first = first or (state.stamp if self._handle.started else 0)
            if state.stamp - told >= PERIOD * 1e9:
                told = state.stamp
                safety = state.status
                held = safety is not None and safety.hand_guiding_switch
                client.tell({"position": state.q.tolist(), "held": held, "recorded": len(self.recorded)})
            if why:
                continue
            if client.has_cancelled():
                why = "ended by its client"
            elif self._pressed:
                why = f"ended by the key {self._key!r}"
            elif first and (state.stamp - first) * 1e-9 >= self._longest:
                why = f"ended after {self._longest:g} s"
            if why:
                self._handle.cancel()
        return why

    def _on_key(self, slot: int, down: bool) -> None:
        self._pressed = self._pressed or (down and slot == self._slot)

    def _clear_key(self) -> None:
        with contextlib.suppress(HeptarmError):  # the connection is lost
            self._arm.pad.set_key(self._slot, "", enabled=False)


#: All of them.
LEADING = (
    Action("~/guide", "heptarm_msgs/Guide", Leading.guide),
    Action("~/teach", "heptarm_msgs/Teach", Leading.teach),
    Action("~/replay", "heptarm_msgs/Replay", Leading.replay),
)
