"""What passes beside the motion, in the loop: signals that are read and written, frames that are asked for."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from heptarm.fri import messages as m
from heptarm.fri.setpoint import Setpoint
from heptarm.fri.template import Sample
from heptarm.fri.version import Version
from heptarm.rt import layout as at
from heptarm.rt.signals import Outputs, Signals
from heptarm.values.pose import Pose

#: An output is written until the cabinet shows it, but in no more answers than this.
REPEATS = 50
#: An analog output, which the cabinet may round, is written this often, since an answer may be lost.
REPEATS_ANALOG = 10


class Exchange:
    """Signals and frames of the loop's session.

    Args:
        layout: the shared memory.

    Attributes:
        signals: of the session.
        numbers: their values in the last message.
        outputs: what a law writes.
        outputs_seen: tick of the user's outputs and frames that were taken.
    """

    def __init__(self, layout: at.Layout) -> None:
        self._layout = layout
        self.signals = Signals()
        self.numbers: Sequence[float] = ()
        self.outputs = Outputs()
        self.outputs_seen = layout.outputs.tick
        self._known: dict[str, m.IoValue] = {}
        self._asked: tuple[m.Transformation, ...] = ()
        self._pending: dict[str, tuple[int | float, int]] = {}  # value, and how often it may still be written
        self._taken: dict[str, int] = {}  # by output, count of the user's last word
        self._frames: dict[str, tuple[tuple[float, ...], m.TimeStamp | None]] = {}
        self._told: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())
        layout.offered.write(json.dumps({"signals": self.signals.text, "frames": []}))

    @property
    def is_idle(self) -> bool:
        """The session carries no signals and asks for no frames, and nothing waits to be sent."""
        return not self._known and not self._asked and not self._pending

    def look(self, sample: Sample) -> None:
        """Take the signals and requests of a message."""
        if not sample.is_full:
            if not self.is_idle:
                self._known, self._asked, self.numbers = {}, (), ()
                self._tell(())
            return
        full = sample.message
        io = full.monitor.io if full.monitor is not None else ()
        self._known = {one.name: one for one in io}
        self._asked = full.requested
        self.numbers = [float(one.value) for one in io]
        self._tell(io)

    def _tell(self, io: tuple[m.IoValue, ...]) -> None:
        """Leave for the user's process which there are, when others come or go."""
        names = tuple(self._known), tuple(one.name for one in self._asked)
        if names == self._told:
            return
        self._told = names
        self.signals = self.outputs.signals = Signals.of(io)
        self._pending = {name: one for name, one in self._pending.items() if name in self._known}
        self._layout.offered.write(json.dumps({"signals": self.signals.text, "frames": names[1]}))

    def take(self) -> None:
        """The outputs and frames that the user's process has left since the last time."""
        note = self._layout.outputs
        if note.tick == self.outputs_seen:
            return
        text = note.read()
        if text is None:  # just being written: next time
            return
        self.outputs_seen = note.tick
        given = json.loads(text)
        for name, (count, value) in given["io"].items():
            if count > self._taken.get(name, 0):
                self._taken[name] = count
                self._want(name, value)
        stamp = next((one.stamp for one in self._asked), None)
        for name, numbers in given["frames"].items():
            if name not in self._frames or self._frames[name][0] != tuple(numbers):
                self._frames[name] = (tuple(numbers), stamp)

    def write(self) -> None:
        """What the law has written: sent where the cabinet shows something else."""
        for name, value in self.outputs.wanted.items():
            known, pending = self._known.get(name), self._pending.get(name)
            if (pending is None or pending[0] != value) and (known is None or known.value != value):
                self._want(name, value)
        self.outputs.wanted.clear()

    def _want(self, name: str, value: int | float) -> None:
        known = self._known.get(name)
        is_analog = known is not None and known.type is m.IoType.ANALOG
        self._pending[name] = (value, REPEATS_ANALOG if is_analog else REPEATS)

    def add(self, setpoint: Setpoint, version: Version, tell: Callable[[str], None]) -> Setpoint:
        """A setpoint with the outputs and frames that are to be sent.

        Args:
            setpoint: what it is without them.
            version: wire format.
            tell: hears of an output that the cabinet does not take.
        """
        if not self._pending and not (self._frames and self._asked):
            return setpoint
        io = []
        for name, (value, left) in list(self._pending.items()):
            known = self._known.get(name)
            if known is None:  # the session has changed since it was checked
                del self._pending[name]
                tell(f"{name!r} is no output of this FRI session any more")
                continue
            shown = known.value == value and left < REPEATS
            if shown or not left:
                del self._pending[name]
                if not shown and known.type is not m.IoType.ANALOG:
                    tell(f"the cabinet does not take {name} = {value}: it shows {known.value}")
                continue
            self._pending[name] = (value, left - 1)
            io.append(m.IoValue(name, known.type, m.IoDirection.OUTPUT, value))
        names = [one.name for one in self._asked]
        frames = tuple(
            m.Transformation(name, on_wire(numbers, version), stamp)
            for name, (numbers, stamp) in self._frames.items()
            if name in names
        )
        return replace(setpoint, io=tuple(io), transformations=frames)

    def forget(self) -> None:
        """Nothing of what waits is to be sent any more."""
        self._pending.clear()


def on_wire(pose: Sequence[float], version: Version) -> tuple[float, ...]:
    """A frame as a version has it.

    Args:
        pose: x y z [m], quaternion x y z w.
        version: wire format.

    Returns:
        12 numbers (3x4 row by row, translation in mm) in 1.x; x y z [mm], w x y z in 2.x.
    """
    x, y, z, qx, qy, qz, qw = pose
    if version.traits.quaternions:
        return (1e3 * x, 1e3 * y, 1e3 * z, qw, qx, qy, qz)
    matrix = Pose.of((1e3 * x, 1e3 * y, 1e3 * z), np.array((qx, qy, qz, qw))).matrix
    return tuple(matrix[:3].reshape(-1).tolist())
