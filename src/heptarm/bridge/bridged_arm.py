"""What every bridge does with an arm: one motion or one stream of targets at a time, and a stop that always works.

The controllers that these protocols were made for keep going to the last target of a servo motion until another one
comes. heptarm's servo motions end when targets stop; so the last target is sent again here, for as long as the bridge
runs and its program is connected. If the bridge itself dies, the cabinet's watchdog stops the arm.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Literal

from heptarm.arm.arm import Arm
from heptarm.arm.motion.handle import MotionHandle
from heptarm.arm.motion.servo import Servo
from heptarm.errors import HeptarmError, NotInControl, NotReady, StaleState
from heptarm.skills.control import keep_control
from heptarm.values.checks import Array
from heptarm.values.condition.condition import Condition
from heptarm.values.mode.mode import Mode
from heptarm.values.motion.motion import Motion
from heptarm.values.pose import Pose
from heptarm.values.result import Cause, Result
from heptarm.values.state import State

_log = logging.getLogger("heptarm.bridge")

#: Time between two times that the newest target is sent, and the watchdog of these targets, the longest that there is:
#: it ends the motion of a bridge that hangs; the loss of its connection ends that of one that dies [s].
_AGAIN, _WATCHDOG = 0.1, 2.0
#: Targets per second that programs send [Hz]: trajectories to a target take a period and 5 ms.
_RATE = 50.0
#: Longest wait for the end of a motion that brakes, and time between two looks for an interruption [s].
_BRAKING, _LOOK = 10.0, 0.02


class BridgedArm:
    """The arm of a bridge.

    Args:
        arm: in control.
    """

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self._lock = threading.RLock()  # of the stream
        self._handle: MotionHandle | None = None
        self._servo: Servo | None = None
        self._kind = ""
        self._again: Callable[[], object] | None = None
        self._ended = threading.Event()  # ends the thread that sends the newest target again
        self._fired: Condition | None = None
        self._stopped = ""  # why somebody else, or the safety controller, ended the stream

    def in_control(self, carry_out: Callable[[], object]) -> None:
        """Carry out a command of the program; take control again before, if it was lost and nobody else has taken it.

        A machine that stands still for longer than the watchdog of the arm loses it: the arm brakes.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        self._keep_control()
        try:
            carry_out()
        except NotInControl:
            if not self._keep_control():  # the loss was known before
                raise
            carry_out()

    def _keep_control(self) -> bool:
        is_taken = keep_control(self.arm)
        if is_taken:
            _log.warning("the bridge had lost control and took it again; the arm had been stopped")
        return is_taken

    # ---------------------------------------------------------------------------------- motions

    def start(self, motion: Motion, *, mode: Mode, until: Condition | None = None) -> MotionHandle:
        """Start a motion in place of what runs.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        self._end_stream()
        self._fired, self._stopped = None, ""
        self._handle = self.arm.start(motion, mode=mode, until=until, when="replace")
        return self._handle

    def finish(self, handle: MotionHandle, *, interrupted: Callable[[], bool]) -> Result:
        """Wait for the end of a motion; end it as soon as it is interrupted.

        Args:
            handle: of the motion.
            interrupted: looks whether the program stops it, or has gone.

        Returns:
            How it ended.

        Raises:
            HeptarmError: it was ended early.
        """
        ended = threading.Event()
        handle.add_done_callback(lambda _: ended.set())
        while not ended.wait(_LOOK):
            if interrupted():
                self._end_motion()
        return handle.wait()

    def follow(
        self,
        target: Array | Pose,
        kind: Literal["joint", "pose", "lin", "velocity"],
        *,
        settings: Callable[[], dict[str, Any]],
    ) -> None:
        """Follow a target, until another one or the end.

        Args:
            target: joint positions or velocities, shape (7,) [rad, rad/s], or a pose of the motion frame in the base.
            kind: as in `Arm.servo`.
            settings: keywords of `Arm.servo`; called when this target opens a servo motion.

        Raises:
            HeptarmError: refused; NotReady if a condition, another client or a safety stop has ended the servo motion,
                and `halt` was not called since.
        """
        with self._lock:
            if self._servo is None or self._kind != kind or not self._servo.active:
                self._open(kind, settings)
            servo: Any = self._servo
            servo.set(target)
            # velocities end soon after the last one: nobody knows how far they may go
            self._again = None if kind == "velocity" else lambda: servo.set(target)

    def _open(
        self, kind: Literal["joint", "pose", "lin", "velocity"], settings: Callable[[], dict[str, Any]]
    ) -> None:
        self._end_stream()
        if self._fired is not None:
            raise NotReady(
                f"the servo motion was ended by its condition: {self._fired}",
                hint="stop, or set the condition again",
            )
        if self._stopped:  # a program that goes on sending must not undo a stop
            raise NotReady(
                f"the arm was stopped: {self._stopped}",
                hint="end the servo motion in the program, and begin it again",
            )
        self._end_motion()
        keywords = {"rate": _RATE, "watchdog": _WATCHDOG, **settings()}
        servo: Any = self.arm.servo(kind, **keywords)
        self._servo, self._kind = servo.__enter__(), kind
        self._ended = threading.Event()
        threading.Thread(
            target=self._repeat, args=(self._ended,), name="heptarm-bridge-targets", daemon=True
        ).start()

    def _repeat(self, ended: threading.Event) -> None:
        """Send the newest target again and again."""
        while not ended.wait(_AGAIN):
            with self._lock:
                servo = self._servo
                if ended.is_set() or servo is None or not servo.active:
                    return
                if self._again is not None:
                    with suppress(HeptarmError):  # the next target of the program raises it
                        self._again()

    def change(self, mode: Mode) -> None:
        """Change the values of the mode of an open servo motion; has no effect without one.

        Raises:
            ModeConflict: it has another kind of mode.
        """
        with self._lock:
            if self._servo is not None and self._servo.active:
                self._servo.change(mode)

    # ------------------------------------------------------------------------------------- ends

    def halt(self) -> None:
        """End what runs, and wait until it has ended; a condition that has fired, or a stop, counts no more."""
        self._end_stream()
        self._end_motion()
        self._handle, self._fired, self._stopped = None, None, ""

    def stop(self) -> None:
        """Stop the arm, whatever client moves it.

        Raises:
            ConnectionLost: the cabinet cannot be reached.
        """
        self.arm.stop()
        self.halt()

    def _end_motion(self) -> None:
        handle = self._handle
        if handle is not None and not handle.done:
            handle.cancel()
            with suppress(HeptarmError):  # how it ends is known to who waits for it
                handle.wait(timeout=_BRAKING)

    def _end_stream(self) -> None:
        with self._lock:
            servo, self._servo, self._again = self._servo, None, None
            self._ended.set()
            if servo is None:
                return
            try:
                servo.close()
            except HeptarmError as error:
                _log.warning("the servo motion ended early: %s", error)
                if getattr(error, "cause", None) in (Cause.STOPPED, Cause.SAFETY):
                    self._stopped = error.text
            if servo.result is not None and servo.result.cause is Cause.CONDITION:
                self._fired = servo.result.stopped_by

    # ------------------------------------------------------------------------------------ state

    def state(self) -> State:
        """The newest state; on a machine that is busy or a network that stutters, the next one.

        Raises:
            Timeout: none comes.
            ConnectionLost: the connection to the cabinet has ended.
        """
        try:
            return self.arm.state
        except StaleState:
            return self.arm.wait_until(lambda _: True, timeout=_BRAKING)

    def has_fired(self) -> bool:
        """Look whether a condition has ended the last motion or servo motion."""
        servo, handle = self._servo, self._handle
        if servo is not None and not servo.active:
            self._end_stream()
        result = None if handle is None else handle.result
        return self._fired is not None or (result is not None and result.cause is Cause.CONDITION)

    def moves(self, state: State) -> bool:
        """Whether a motion or a servo motion of the program runs; also while this state is older than its end."""
        servo, handle = self._servo, self._handle
        if (servo is not None and servo.active) or (handle is not None and not handle.done):
            return True
        result = None if handle is None else handle.result
        return result is not None and result.state is not None and state.stamp < result.state.stamp
