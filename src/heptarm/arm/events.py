"""What the cabinet tells unasked: handed to those whom it concerns, or kept for those who ask later."""

from __future__ import annotations

import contextlib
import logging
from collections import deque
from collections.abc import Callable

from heptarm.arm.handle import MotionHandle
from heptarm.errors import HeptarmError
from heptarm.wire import messages as wire
from heptarm.wire.messages import Message

_log = logging.getLogger("heptarm.arm")

#: FRI sessions whose last change is remembered.
_FRI_SESSIONS = 64
#: What becomes of a program.
_OF_PROGRAMS = (
    wire.MotionStarted,
    wire.SegmentReached,
    wire.ItemReached,
    wire.TriggerFired,
    wire.ConditionFired,
    wire.MotionFinished,
)
_LEVELS = {
    wire.Severity.INFO: logging.INFO,
    wire.Severity.WARNING: logging.WARNING,
    wire.Severity.ERROR: logging.ERROR,
}


class Events:
    """Events of a connection, and the programs under way that they tell of.

    Args:
        on_control: told who controls the robot.

    Attributes:
        key_listeners: told of the user keys of the smartPAD: which, and whether it is down.
    """

    def __init__(self, on_control: Callable[[wire.ControlChanged], None]) -> None:
        self._on_control = on_control
        self._handles: dict[int, MotionHandle] = {}
        self._unclaimed: deque[Message] = deque(maxlen=256)
        self._servo_status: wire.ServoStatus | None = None
        self._fri_changes: dict[int, wire.FriChanged] = {}
        self.key_listeners: list[Callable[[int, bool], None]] = []

    def take(self, message: Message) -> None:
        """An event came."""
        if isinstance(message, _OF_PROGRAMS):
            handle = self._handles.get(message.id)
            if handle is None:
                self._unclaimed.append(message)  # its Accepted may still be on its way
            else:
                self._hand_over(handle, message)
        elif isinstance(message, wire.ServoStatus):
            self._servo_status = message
        elif isinstance(message, wire.KeyPressed):
            for listener in list(self.key_listeners):
                listener(message.slot, message.down)
        elif isinstance(message, wire.FriChanged):
            self._note_fri(message)
        elif isinstance(message, wire.ControlChanged):
            self._on_control(message)
        elif isinstance(message, wire.SafetyChanged):
            _log.info("safety: %s", message.text)
        elif isinstance(message, wire.Notice):
            _log.log(_LEVELS[message.severity], "cabinet: %s", message.text)

    # ---------------------------------------------------------------------------------- programs

    def claim(self, handle: MotionHandle, number: int) -> None:
        """A program was accepted under a number; its handle hears what was told of it and what will be."""
        handle.accepted(number)
        self._handles[number] = handle
        for message in list(self._unclaimed):
            if message.id == number:  # type: ignore[union-attr]
                self._hand_over(handle, message)

    def awaits(self, handle: MotionHandle) -> bool:
        """Whether the end of a program has not been told."""
        return handle.id in self._handles

    def pending(self) -> float:
        """How long the programs under way may take, all together [s]."""
        return sum(handle.limit for handle in list(self._handles.values()))

    def forget(self) -> None:
        """A new link: what was told of programs over the old one means nothing now."""
        self._unclaimed.clear()

    def lose(self, error: HeptarmError) -> None:
        """Nothing more will be told of the programs under way: they end by an error."""
        while self._handles:
            with contextlib.suppress(KeyError):  # it has just ended by itself
                self._handles.popitem()[1].lose(error)

    def _hand_over(self, handle: MotionHandle, message: Message) -> None:
        if isinstance(message, wire.MotionFinished):
            self._handles.pop(message.id, None)
        handle.on_event(message)

    # ----------------------------------------------------------------------------- servo and FRI

    def servo_status(self, number: int) -> wire.ServoStatus | None:
        """What the cabinet said last of a servo motion's stream."""
        told = self._servo_status
        return told if told is not None and told.servo == number else None

    def fri_change(self, number: int) -> wire.FriChanged | None:
        """What the cabinet said last of an FRI session; its end is the last word."""
        return self._fri_changes.get(number)

    def _note_fri(self, message: wire.FriChanged) -> None:
        _log.info(
            "FRI session %d: %s, %s %s",
            message.session,
            message.state.name,
            message.quality.name,
            message.text,
        )
        changes, known = self._fri_changes, self._fri_changes.get(message.session)
        if known is None or known.state is not wire.FriSessionState.IDLE:
            changes[message.session] = message
        while len(changes) > _FRI_SESSIONS:
            del changes[next(iter(changes))]
