"""The keyboard of a terminal as an input device.

A terminal reports that a key was pressed, and repeats it while it is held; it never reports a release. So a key counts
as held for a short time after each report: releasing it is the dead-man switch, and a silent connection is a release.
"""

from __future__ import annotations

import os
import select
import sys
from types import TracebackType
from typing import Any

import numpy as np

from heptarm.devices.device import REST, DeviceInput, Roles, gone
from heptarm.errors import NotReady, refuse_windows
from heptarm.io.clock import Clock, RealClock
from heptarm.values.checks import within
from heptarm.values.sealed import Sealed

#: Axis and direction of each key.
KEYS = {
    "w": (0, 1.0),
    "s": (0, -1.0),
    "a": (1, 1.0),
    "d": (1, -1.0),
    "r": (2, 1.0),
    "f": (2, -1.0),
    "l": (3, 1.0),
    "j": (3, -1.0),
    "i": (4, 1.0),
    "k": (4, -1.0),
    "u": (5, 1.0),
    "o": (5, -1.0),
}
#: Keys that are buttons.
_BUTTONS = {" ": "SPACE", "q": "Q", "\x1b": "Q"}
#: What the keys do, for people.
HELP = "w s: x   a d: y   r f: z   j l: about x   i k: about y   u o: about z   space: gripper   q: end"
#: Default of the time for which a key counts as held after its report [s]: terminals repeat 25 to 30 times a second.
HOLD = 0.2


class Keyboard(Sealed):
    """The keyboard of a terminal, which reports keys at once until it is closed.

    Args:
        terminal: file descriptor of the terminal; None: standard input.
        hold: time for which a key counts as held after its report [s], 0.05 to 1.
        clock: its time.

    Raises:
        NotReady: it is no terminal.
    """

    name = "keyboard"
    roles: Roles = Roles(gripper="SPACE", quit="Q")

    def __init__(
        self, terminal: int | None = None, *, hold: float = HOLD, clock: Clock | None = None
    ) -> None:
        refuse_windows("the keyboard of a terminal as an input device")
        import termios
        import tty

        self._hold = round(within(hold, "hold", 0.05, 1.0, unit="s") * 1e9)
        self._clock = RealClock() if clock is None else clock
        self._termios: Any = termios
        self._reported: dict[str, int] = {}  # by key: when it was reported last
        try:
            self._file = sys.stdin.fileno() if terminal is None else terminal
            self._before: Any = termios.tcgetattr(self._file)
            tty.setcbreak(self._file)
        except (OSError, ValueError, termios.error):  # ValueError: a stream without a file
            raise NotReady(
                "the keyboard needs a terminal, and standard input is none",
                hint="run this in a terminal, or use another device",
            ) from None

    def read(self) -> DeviceInput:
        """The keys that count as held now.

        Raises:
            NotReady: the terminal was closed.
        """
        if self._before is None:
            return REST
        now = self._clock.nanos()
        try:
            while select.select([self._file], [], [], 0.0)[0]:
                text = os.read(self._file, 256).decode(errors="ignore").lower()
                if not text:
                    raise OSError("it was closed")
                for key in text:
                    self._reported[key] = now
        except OSError as error:
            self._reported.clear()
            raise gone("terminal", error) from error
        held = [key for key, since in self._reported.items() if now - since <= self._hold]
        twist = np.zeros(6)
        for key in held:
            if key in KEYS:
                axis, sign = KEYS[key]
                twist[axis] += sign
        return DeviceInput.of(twist, {_BUTTONS[key] for key in held if key in _BUTTONS})

    def close(self) -> None:
        """Give the terminal back as it was; calling it again has no effect."""
        before, self._before = self._before, None
        if before is not None:
            try:
                self._termios.tcsetattr(self._file, self._termios.TCSADRAIN, before)
            except (OSError, self._termios.error):
                pass  # the terminal is gone

    def __enter__(self) -> Keyboard:
        """The keyboard itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Give the terminal back."""
        self.close()


def keyboard(*, hold: float = HOLD) -> Keyboard:
    """Open the keyboard of the terminal: w s a d r f move, i k j l u o turn, space is the gripper, q ends.

    Args:
        hold: time for which a key counts as held after its report [s], 0.05 to 1.

    Raises:
        NotReady: standard input is no terminal.
    """
    return Keyboard(hold=hold)
