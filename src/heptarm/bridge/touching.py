"""Actions that feel: touching once or twice, and taps on the resting arm."""

from __future__ import annotations

from functools import partial
from typing import Any

from heptarm.bridge.action import PERIOD, Action, Client, Doing, Ended, Work, failure, watch
from heptarm.bridge.goal import Outcome
from heptarm.bridge.messages import pose_message
from heptarm.bridge.task import Task
from heptarm.errors import HeptarmError, NotReady, ShapeError
from heptarm.values.arrays import within
from heptarm.values.contact import Contact, TapWatch, direction_of
from heptarm.values.motion import TOOL
from heptarm.values.pose import Pose

#: What a goal means that says nothing [N, s].
_TAPS, _TAP, _GAP, _TIMEOUT = 2, 8.0, 1.0, 60.0


class Touching(Doing):
    """Contacts and taps."""

    def touch(self, goal: Any) -> Work:
        """Move straight on until something is touched."""
        vector = [goal.vector.x, goal.vector.y, goal.vector.z]
        if goal.direction and any(vector):
            raise ShapeError("both direction and vector are given", parameter="vector", hint="give one")
        ahead = direction_of(goal.direction or (vector if any(vector) else "z"))
        how: dict[str, Any] = {
            "distance": goal.distance,
            "force": goal.force,
            "frame": goal.frame or TOOL,
            "retreat": goal.retreat_m if goal.retreat else None,
            "baseline": goal.baseline or "rest",
        }
        names = (
            {"speed_mps": "fast_mps", "slow_mps": "slow_mps", "back": "back"}
            if goal.twice
            else {"speed_mps": "speed_mps", "retreat_mps": "retreat_mps"}
        )
        how |= {name: getattr(goal, ours) for ours, name in names.items() if getattr(goal, ours)}
        arm = self._arm
        call = arm.touch_twice if goal.twice else arm.touch
        start = arm.state.pose
        task = self._driver.begin("the touch", partial(call, ahead, **how))
        return partial(self._feel, task, start)

    def _feel(self, task: Task, start: Pose, client: Client) -> Ended:
        def tell() -> None:
            client.tell({"travel": start.distance_to(self._arm.state.pose)})

        error = watch(task, client, tell)
        if error is not None:
            return failure(task, client, error)
        contact: Contact = task.result()
        frame = self._driver.configuration.frame("base")
        fields = {
            "contact": True,
            "pose": {
                "header": {"frame_id": frame, "stamp": self._ros.time(self._ros.now())},
                "pose": pose_message(self._ros, contact.pose),
            },
            "force": dict(zip("xyz", contact.force.tolist())),
            "travel": float(contact.travel),
            "position": contact.q.tolist(),
            "spread": float(contact.spread),
        }
        return Ended(Outcome.SUCCEEDED, f"contact after {contact.travel * 1e3:.1f} mm", fields)

    def taps(self, goal: Any) -> Work:
        """Wait until somebody taps the arm."""
        wanted = goal.count or _TAPS
        taps = TapWatch(force=goal.force or _TAP, gap=goal.gap or _GAP)
        seconds = within(goal.timeout or _TIMEOUT, "timeout", 0.0, 1e6, unit="s")
        motion = self._arm.state.motion
        if motion is not None and motion.active:
            raise NotReady("a motion is under way", hint="the arm has to rest while it is tapped")
        return partial(self._wait, taps, wanted, seconds)

    def _wait(self, taps: TapWatch, wanted: int, seconds: float, client: Client) -> Ended:
        count, told, first = 0, 0.0, None
        try:
            for state in self._arm.states(duration=seconds):
                seen = state.wrench
                count = taps.see(seen.stamp * 1e-9, seen.force)
                if count >= wanted:
                    return Ended(Outcome.SUCCEEDED, f"tapped {count} times", {"position": state.q.tolist()})
                if first is None or seen.stamp * 1e-9 - told >= PERIOD:
                    first, told = seen, seen.stamp * 1e-9
                    client.tell({"count": count})
                    if client.has_cancelled():
                        return Ended(Outcome.CANCELED, "cancelled")
        except HeptarmError as error:
            return Ended(Outcome.ABORTED, str(error))
        return Ended(Outcome.ABORTED, f"the arm was not tapped {wanted} times within {seconds:g} s")


#: All of them.
TOUCHING = (
    Action("~/touch", "heptarm_msgs/Touch", Touching.touch),
    Action("~/wait_for_taps", "heptarm_msgs/WaitForTaps", Touching.taps),
)
