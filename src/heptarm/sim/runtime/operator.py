"""The simulated operator beside the virtual robot: emergency stop, enabling switch, pushes, smartPAD.

    emergency_stop          until "clear"
    drive_error 3@2.5       A3's drive trips after 2.5 simulated seconds

Actions may come from any thread; those with a time are executed by the tick.
"""

from __future__ import annotations

import heapq
import logging
import math
import re
import time
from collections.abc import Callable
from itertools import count
from typing import TYPE_CHECKING

import numpy as np

from heptarm.planning.motion import TICK
from heptarm.planning.seam import OperationMode
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.plant.shared_state import NEVER

if TYPE_CHECKING:
    from heptarm.sim.plant.plant import Plant

log = logging.getLogger("heptarm.sim")

#: Actions and their help texts.
WORDS = {
    "emergency_stop": "press the emergency stop of the smartPAD",
    "external_emergency_stop": "press an emergency stop beside the robot",
    "operator_safety": "open the safeguard",
    "protective_stop": "let a safety function request a stop",
    "drive_error [AXIS]": "let a drive trip, 1 to 7",
    "joint_limit [AXIS]": "let the running motion fail at a joint limit",
    "singularity": "let it fail at a singularity",
    "release": "release the enabling switch",
    "enable": "hold the enabling switch",
    "guide": "hold the enabling switch of the hand guiding device",
    "let_go": "release that switch",
    "clear [NAME]": "end one stop, or all, and acknowledge it",
    "t1, t2, aut": "choose the operation mode",
    "override FACTOR": "set the override at the smartPAD, 0 to 1",
    "pause": "press Stop: motions pause on their path",
    "start": "press Start: execution continues",
    "push FX FY FZ [SECONDS]": "push the flange, base axes [N]",
    "where BODY": "show the pose of a body of the scene in the base: x y z [m] and quaternion x y z w",
    "place BODY X Y Z [QX QY QZ QW]": "place a free body of the scene, at rest: in the base [m], quaternion x y z w",
    "reset": "put all free bodies of the scene back where they were at the start",
    "set SIGNAL VALUE": "set a signal of the cabinet: a number, true or false",
    "answer BUTTON": "press a button of the dialog that is shown, from 0",
    "press SLOT [BAR [second]]": "press and release a user key, 0 to 3, or its second half; BAR where several have it",
}
_ALSO = {
    "estop": "emergency_stop",
    "e_stop": "emergency_stop",
    "enabling_switch": "release",
    "gate": "operator_safety",
}
_REQUESTS = tuple(request.value for request in StopRequest)
#: Least and largest number of values of an action.
_COUNTS = {
    **dict.fromkeys(
        (
            *_REQUESTS,
            "singularity",
            "release",
            "enable",
            "guide",
            "let_go",
            "t1",
            "t2",
            "aut",
            "pause",
            "start",
            "reset",
        ),
        (0, 0),
    ),
    **dict.fromkeys(("drive_error", "joint_limit", "clear"), (0, 1)),
    "override": (1, 1),
    "push": (3, 4),
    "where": (1, 1),
    "place": (4, 8),
    "set": (2, 2),
    "press": (1, 20),  # the name of a bar may have blanks
    "answer": (1, 1),
}
#: A tick that began after an action has ended when so many ticks have begun.
SEEN = 2
#: So long a line waits for a tick at most: the simulation may stand still [s].
LONGEST_WAIT = 1.0
#: User keys of a bar; higher numbers are their second halves.
SLOTS = 4
_TRUTH = {"true": 1.0, "false": 0.0}
_TIMED = re.compile(r"(.+?)\s*@\s*([0-9.]+)\s*s?\s*")


def timed(text: str) -> tuple[str, float]:
    """Split "NAME@SECONDS".

    Raises:
        ValueError: it has no time, or there is no such action.
    """
    match = _TIMED.fullmatch(text)
    if match is None:
        raise ValueError(f"a scheduled action must be NAME@SECONDS, as in emergency_stop@5; got {text!r}")
    understood(match[1])
    return match[1], float(match[2])


def understood(words: str) -> tuple[str, list[float | str]]:
    """Name and values of an action.

    Raises:
        ValueError: there is no such action, or its values are illegal.
    """
    name, *rest = words.lower().split() or [""]
    name = _ALSO.get(name.replace("-", "_"), name.replace("-", "_"))
    if name not in _COUNTS:
        raise ValueError(f"{words!r} is not understood; actions are: {', '.join(WORDS)}")
    least, most = _COUNTS[name]
    if not least <= len(rest) <= most:
        raise ValueError(f"{words!r}: {name} takes {least} to {most} values, got {len(rest)}")
    if name == "where":
        return name, [words.split()[1]]
    if name in ("set", "press"):
        return name, _word_values(words, name)
    if name == "place":
        return name, [words.split()[1], *_pose_values(words, rest[1:])]
    if name == "clear":
        rest = [_ALSO.get(word.replace("-", "_"), word.replace("-", "_")) for word in rest]
        if rest and rest[0] not in _REQUESTS:
            raise ValueError(f"{words!r}: clear takes one of {', '.join(_REQUESTS)}")
        return name, list(rest)
    try:
        values = [float(word) for word in rest]
    except ValueError:
        raise ValueError(f"{words!r}: the values of {name} must be numbers") from None
    if name in ("drive_error", "joint_limit") and any(value not in range(1, 8) for value in values):
        raise ValueError(f"{words!r}: axis must be 1 to 7, got {values[0]:g}")
    if name == "override" and not 0.0 <= values[0] <= 1.0:
        raise ValueError(f"{words!r}: override must be in [0, 1], got {values[0]:g}")
    return name, list(values)


def _pose_values(words: str, rest: list[str]) -> list[float | str]:
    """Position and unit quaternion of a place; upright where only the position is given."""
    try:
        values = [float(word) for word in rest]
    except ValueError:
        values = []
    place, quat = values[:3], values[3:] or [0.0, 0.0, 0.0, 1.0]
    norm = math.hypot(*quat)
    if len(quat) != 4 or not all(map(math.isfinite, values)) or abs(norm - 1.0) > 1e-3 or len(place) != 3:
        raise ValueError(f"{words!r}: a place must be three numbers, or seven with a unit quaternion")
    return [*place, *(part / norm for part in quat)]


def _word_values(words: str, name: str) -> list[float | str]:
    """Values of an action that names a signal or a bar of keys; these are case-sensitive."""
    first, *rest = words.split()[1:]
    if name == "press":
        if first not in ("0", "1", "2", "3"):
            raise ValueError(f"{words!r}: slot must be 0 to 3, got {first}")
        half = rest[-1:] if rest[-1:] == ["second"] else []
        return [float(first), " ".join(rest[: len(rest) - len(half)]), *half]
    value = rest[0].lower()
    try:
        return [first, _TRUTH[value] if value in _TRUTH else float(value)]
    except ValueError:
        raise ValueError(
            f"{words!r}: the value of a signal must be a number, true or false, got {rest[0]}"
        ) from None


class SimulatedOperator:
    """Acts on a plant as an operator does.

    Args:
        plant: the plant.
    """

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._due: list[tuple[int, int, str]] = []
        self._numbers = count()
        self._ticks, self._acted_at = 0, -SEEN  # calls of `tick`, now and at the last action
        self._verbs: dict[str, Callable[..., str | None]] = {
            **{request.value: self._requesting(request) for request in StopRequest},
            **{mode.name.lower(): self._choosing(mode) for mode in OperationMode},
            "drive_error": self._drive_error,
            "joint_limit": self._joint_limit,
            "singularity": lambda: plant.abort(0, "the path passes a singularity"),
            "release": plant.safety.release,
            "enable": plant.safety.enable,
            "guide": plant.safety.guide,
            "let_go": plant.safety.let_go,
            "clear": self._clear,
            "override": self._override,
            "pause": plant.pause,
            "start": plant.resume,
            "push": self._push,
            "where": self._where,
            "place": lambda body, *pose: plant.bodies.place(body, np.array(pose)),
            "reset": plant.bodies.reset,
            "set": self._set,
            "press": self._press,
            "answer": self._answer,
        }
        #: Presses a key of a bar of the smartPAD, "" for the only one that has it; returns whether there is one.
        self.press: Callable[[str, int], bool] = lambda bar, slot: False
        #: What can be pressed, for people.
        self.keys: Callable[[], str] = lambda: ""
        #: Presses a button of the open dialog; returns whether there is one.
        self.answer: Callable[[int], bool] = lambda button: False
        #: Called after each action, in its thread.
        self.on_action: Callable[[], None] = lambda: None

    def schedule(self, text: str) -> None:
        """Schedule an action at a plant time: "NAME@SECONDS".

        Raises:
            ValueError: there is no such action, or it has no time.
        """
        words, seconds = timed(text)
        heapq.heappush(self._due, (round(seconds * 1000), next(self._numbers), words))

    @property
    def next_due(self) -> int:
        """Tick before which the next scheduled action is executed; `NEVER` if there is none."""
        return self._due[0][0] if self._due else NEVER

    def tick(self) -> None:
        """Execute the actions that are due; called before each tick of the plant, or several at once."""
        self._ticks += 1
        due = self._due
        while due and due[0][0] <= self._plant.tick_count:
            words = heapq.heappop(due)[2]
            try:
                self.do(words)
            except ValueError as error:  # no such signal or key: the simulation continues
                log.warning("%s: %s", words, error)

    def do(self, words: str) -> str:
        """Execute an action now, or at a plant time: "NAME@SECONDS".

        Returns:
            What it shows; "" if it shows nothing, or nothing yet.

        Raises:
            ValueError: there is no such action, or its values are illegal; nothing has changed.
        """
        if _TIMED.fullmatch(words):
            self.schedule(words)
            self.on_action()
            return ""
        name, values = understood(words)
        shown = self._verbs[name](*values) or ""
        self._acted_at = self._ticks
        self.on_action()
        return shown

    def await_tick(self) -> None:
        """Wait until the robot's flags and the conditions of motions have been evaluated with the last action.

        Two lines that come at once, `set Start 0` and `set Start 1`, are a rising edge then, and a program that has
        chosen T1 sees the pause which that causes. The ticks never call this.
        """
        until = time.monotonic() + LONGEST_WAIT
        while self._ticks < self._acted_at + SEEN and time.monotonic() < until:
            time.sleep(0.5 * TICK)

    def _set(self, name: str, value: float) -> None:
        self._plant.signals.set(name, value)

    def _requesting(self, request: StopRequest) -> Callable[[], None]:
        return lambda: self._plant.safety.request_stop(request)

    def _choosing(self, mode: OperationMode) -> Callable[[], None]:
        return lambda: self._plant.safety.choose(mode)

    def _drive_error(self, axis: float = 1) -> None:
        self._plant.trip(f"drive error in A{int(axis)}: the drives are off")

    def _joint_limit(self, axis: float = 1) -> None:
        self._plant.abort(0, f"Command Position violates limit A{int(axis)}")

    def _clear(self, name: str = "") -> None:
        self._plant.safety.withdraw(*([StopRequest(name)] if name else []))

    def _override(self, factor: float) -> None:
        self._plant.safety.manual = factor

    def _answer(self, button: float) -> None:
        if not self.answer(int(button)):
            raise ValueError(f"no open dialog has a button {int(button)}")

    def _where(self, body: str) -> str:
        return " ".join(f"{value:.6f}" for value in self._plant.body_pose(body))

    def _press(self, slot: float, bar: str, half: str = "") -> None:
        if not self.press(bar, int(slot) + (SLOTS if half else 0)):
            where = f"in a bar {bar!r}" if bar else "that only one bar has"
            raise ValueError(
                f"there is no user key {int(slot)} {where}, or it is disabled; there are: {self.keys() or 'none'}"
            )

    def _push(self, x: float, y: float, z: float, seconds: float = float("inf")) -> None:
        self._plant.apply_wrench((x, y, z), duration=seconds)
