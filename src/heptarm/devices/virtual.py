"""Input devices without hardware: a function of time, a recording of a device, and its replay."""

from __future__ import annotations

import json
from bisect import bisect_right
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Final, TextIO

import numpy.typing as npt

from heptarm.devices.device import REST, DeviceInput, InputDevice, Roles
from heptarm.errors import CommandRejected
from heptarm.io.clock import Clock, RealClock
from heptarm.values.checks import callback, finite, flag, instance
from heptarm.values.files import path_of, read_text, refuse_existing, unreadable, unwritable
from heptarm.values.sealed import Sealed

#: The first line of a file of inputs.
_FORMAT = "heptarm input 1"


class SyntheticDevice(Sealed):
    """A function of time as an input device; it rests when the function returns None.

    Args:
        function: called with the time since the first reading [s]; returns a `DeviceInput`, six deflections, or None.
        roles: what its buttons are for.
        clock: its time.
    """

    name = "synthetic"
    roles: Roles

    def __init__(
        self,
        function: Callable[[float], DeviceInput | npt.ArrayLike | None],
        *,
        roles: Roles | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._function = callback(function, "function")
        self.roles = Roles() if roles is None else instance(roles, Roles, "roles")
        self._clock = RealClock() if clock is None else clock
        self._began: int | None = None

    def read(self) -> DeviceInput:
        """The function's value now."""
        now = self._clock.nanos()
        self._began = now if self._began is None else self._began
        value = self._function((now - self._began) * 1e-9)
        if value is None:
            return REST
        return value if isinstance(value, DeviceInput) else DeviceInput.of(value)

    def close(self) -> None:
        """Has no effect."""


class RecordedDevice(Sealed):
    """A recorded stream of inputs; it begins with the first reading, and rests after its end.

    Args:
        inputs: each with its time [s], ascending.
        roles: what its buttons are for.
        clock: its time.

    Raises:
        CommandRejected: no inputs, or times that descend.
    """

    name = "recording"
    roles: Roles

    def __init__(
        self,
        inputs: Sequence[tuple[float, DeviceInput]],
        *,
        roles: Roles | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._times = [finite(time, "time", unit="s") for time, _ in inputs]
        self._inputs = [instance(reading, DeviceInput, "inputs") for _, reading in inputs]
        if not self._times or sorted(self._times) != self._times:
            raise CommandRejected(
                "inputs must be at least one, at ascending times",
                parameter="inputs",
                hint="heptarm.devices.recording writes such a file",
            )
        self.roles = Roles() if roles is None else instance(roles, Roles, "roles")
        self._clock = RealClock() if clock is None else clock
        self._began: int | None = None

    @property
    def inputs(self) -> list[tuple[float, DeviceInput]]:
        """The inputs, each with its time [s]."""
        return list(zip(self._times, self._inputs))

    @property
    def duration(self) -> float:
        """Time of its last input [s]."""
        return self._times[-1] - self._times[0]

    def read(self) -> DeviceInput:
        """The input that was the newest at this time."""
        now = self._clock.nanos()
        self._began = now if self._began is None else self._began
        time = self._times[0] + (now - self._began) * 1e-9
        return REST if time > self._times[-1] else self._inputs[bisect_right(self._times, time) - 1]

    def close(self) -> None:
        """Has no effect."""


class RecordingDevice(Sealed):
    """Another device, whose inputs are written to a file while it is read.

    Args:
        device: to read and record.
        path: the file; it is replaced.
        clock: its time.

    Raises:
        CommandRejected: the file cannot be written.
    """

    name: Final[str]
    roles: Roles

    def __init__(self, device: InputDevice, path: str | Path, *, clock: Clock | None = None) -> None:
        self.name, self.roles = device.name, device.roles
        self._device = device
        self._clock = RealClock() if clock is None else clock
        self._began: int | None = None
        try:
            self._file: TextIO | None = Path(path).open("w", encoding="utf-8")  # noqa: SIM115 (closed by close)
        except OSError as error:
            raise unwritable(Path(path), error) from error
        roles = self.roles
        head = {"format": _FORMAT, "roles": [roles.dead_man, roles.gripper, roles.quit]}
        self._file.write(json.dumps(head) + "\n")

    def read(self) -> DeviceInput:
        """What the device reports now; raises as it does."""
        reading = self._device.read()
        now = self._clock.nanos()
        self._began = now if self._began is None else self._began
        if self._file is not None:
            line = [(now - self._began) * 1e-9, reading.twist.tolist(), sorted(reading.buttons)]
            self._file.write(json.dumps(line) + "\n")
        return reading

    def close(self) -> None:
        """Close the file and the device; calling it again has no effect."""
        file, self._file = self._file, None
        if file is not None:
            file.close()
        self._device.close()

    def __enter__(self) -> RecordingDevice:
        """The recording itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Close the file and the device."""
        self.close()


def synthetic(
    function: Callable[[float], DeviceInput | npt.ArrayLike | None], *, roles: Roles | None = None
) -> SyntheticDevice:
    """An input device that a function of time plays, for tests and demonstrations.

    Args:
        function: called with the time since the first reading [s]; returns six deflections in [-1, 1], a `DeviceInput`
            that has buttons as well, or None: at rest.
        roles: what its buttons are for.

    Raises:
        ShapeError: no function.
    """
    return SyntheticDevice(function, roles=roles)


def recording(device: InputDevice, path: str | Path, *, overwrite: bool = False) -> RecordingDevice:
    """Write what a device reports to a file, while it is read as before; `recorded` replays it.

    Args:
        device: to read and record.
        path: the file, a line of JSON for each reading.
        overwrite: replace a file that exists.

    Raises:
        CommandRejected: the file exists or cannot be written.
    """
    return RecordingDevice(device, refuse_existing(path_of(path), overwrite=flag(overwrite, "overwrite")))


def recorded(path: str | Path) -> RecordedDevice:
    """Replay a file that `recording` has written, with its timing, as an input device.

    Raises:
        CommandRejected: the file cannot be read, or is no recording of inputs.
    """
    file = path_of(path)
    lines, number, rows = read_text(file).splitlines(), 1, []
    try:
        about = json.loads(lines[0] if lines else "")
        if about["format"] != _FORMAT:
            raise ValueError(f"its format is {about['format']}")
        for line in lines[1:]:
            number += 1
            time, twist, buttons = json.loads(line)
            rows.append((time, DeviceInput.of(twist, buttons)))
        return RecordedDevice(rows, roles=Roles(*about["roles"]))
    except Exception as error:  # of any values in place of a reading's
        raise unreadable(
            file,
            f"line {number}: {error or type(error).__name__}",
            what="a recording of inputs",
            hint="heptarm.devices.recording writes one",
        ) from None
