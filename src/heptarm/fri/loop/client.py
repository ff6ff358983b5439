"""Client of an FRI controller, in the user's process."""

from __future__ import annotations

import json
import os
import time
from dataclasses import replace
from types import TracebackType
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, ConnectFailed, ConnectionLost, refuse_windows
from heptarm.fri.loop import process
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.compiled import CompiledLaw
from heptarm.fri.loop.law_interface import LiveMemory
from heptarm.fri.loop.law_limit import LawWatch
from heptarm.fri.loop.native import library
from heptarm.fri.loop.settings import ClientKeywords, LoopSettings
from heptarm.fri.loop.telemetry import Reader
from heptarm.fri.loop.user_api import Params
from heptarm.io.shared import MemoryBlock
from heptarm.io.udp import ALL_INTERFACES, own_address
from heptarm.values.checks import array, finite, instance, integer, within
from heptarm.values.frames import check_name, check_printable
from heptarm.values.io import SignalValue
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.values.sealed import Sealed

if TYPE_CHECKING:
    from typing_extensions import Unpack

#: Default UDP port of FRI.
PORT = 30200
#: Longest time limit [s].
LONGEST = 1e9
#: Further time for the start of the loop's process if it has to compile a law [s].
COMPILING = 120.0


class Client(Sealed, Reader):
    """Client that answers a controller from a separate process; close it, or use it in a `with` block.

    It works over any number of sessions: the application of the cabinet may end and start again.

    Args:
        port: UDP port to bind.
        host: own address to bind; "0.0.0.0" for all. None: that of the interface to `remote`; all without a remote.
        remote: address of the controller; None accepts any.
        timeout: time limit for the start of the loop's process [s], beside the compilation of a law.
        settings: settings of the loop; None for the defaults.
        **keywords: fields of `LoopSettings`, in place of those of `settings`.

    Attributes:
        params: parameters of the law; assign to change them while it runs.
        memory: memory of the law; read it and assign to it while it runs.
        port: bound UDP port.
        model: the robot.
        settings: settings of the loop.

    Raises:
        ConnectFailed: the port cannot be bound, or the loop did not start.
        CommandRejected: an argument is outside its range, or the law cannot be compiled or loaded.
        Unavailable: the compiled part of heptarm is missing.
    """

    params: Final[Params]
    memory: Final[LiveMemory]
    port: Final[int]
    model: Final[RobotModel]
    settings: Final[LoopSettings]

    def __init__(
        self,
        port: int = PORT,
        *,
        host: str | None = None,
        remote: str | None = None,
        timeout: float = 30.0,
        settings: LoopSettings | None = None,
        **keywords: Unpack[ClientKeywords],
    ) -> None:
        refuse_windows("FRI")
        library()
        self.settings = LoopSettings(**keywords) if settings is None else replace(settings, **keywords)
        integer(port, "port", 0, 65535)
        for address, what in ((host, "host"), (remote, "remote")):
            if address is not None:
                check_printable(instance(address, str, what), what)
        within(timeout, "timeout", 0.0, LONGEST, above=True, unit="s")
        self.model, law = self.settings.arm, self.settings.law
        place = process.Place(port, _own(remote) if host is None else host, remote, os.getpid())
        sent = process.packed(self.settings, place)
        values, schema = self.settings.law_params
        remembered, kept = self.settings.law_memory
        self._values = values
        block = MemoryBlock(at.Layout.words(**self.settings.sizes))
        super().__init__(at.Layout(block, **self.settings.sizes))
        self._header[at.HISTORY] = self.settings.history
        self._header[at.SIZE], self._header[at.MEMORY_SIZE] = values.size, remembered.size
        self.params = Params(values, schema, changed=self._send_params, declared=self.settings.declared)
        self._send_params()
        self.memory = LiveMemory(
            remembered, kept, newest=self._newest_memory, write=self._layout.memory_set.write
        )
        self._outputs: dict[str, tuple[int, int | float]] = {}
        self._frames: dict[str, list[float]] = {}
        self._writes = 0
        self._closed = False
        try:
            self._worker = process.Worker(block.path, sent)
            try:
                self._wait_for_loop(timeout + (COMPILING if isinstance(law, CompiledLaw) else 0.0))
            except BaseException:
                self._worker.kill()
                raise
        finally:
            block.unlink()
        self.port = int(self._header[at.PORT])
        is_python = law is not None and not isinstance(law, CompiledLaw)
        self._watch = LawWatch(self._layout, self._worker.kill) if is_python else None

    def _wait_for_loop(self, timeout: float) -> None:
        deadline = time.monotonic() + timeout
        while self._header[at.STATUS] == at.Status.STARTING:
            if not self._worker.is_alive():
                raise ConnectFailed(
                    f"the loop's process ended while it started: {self._worker.printed() or 'it printed nothing'}"
                )
            if time.monotonic() > deadline:
                self._worker.kill()  # ends what it prints
                printed = self._worker.printed()
                raise ConnectFailed(
                    f"the loop's process did not start within {timeout:g} s"
                    + (f": {printed}" if printed else "")
                )
            time.sleep(2e-3)
        if self._header[at.STATUS] == at.Status.BAD_LAW:
            self._worker.join(1.0)
            text, hint = json.loads(self._layout.trouble.read() or '["the law cannot be loaded", ""]')
            raise CommandRejected(text, parameter="law", hint=hint)
        if (status := self._header[at.STATUS]) in (at.Status.FAILED, at.Status.NO_PORT):
            self._worker.join(1.0)
            raise ConnectFailed(
                self._layout.trouble.read() or "the loop's process did not start",
                parameter="port" if status == at.Status.NO_PORT else "",
            )

    @property
    def is_running(self) -> bool:
        """Whether the loop's process runs, or the client was closed."""
        return self._closed or self._worker.is_alive()

    @property
    def trouble(self) -> str:
        """Why there is no session, or why the loop has ended, as text; empty if there is a session."""
        if self._closed or self._worker.is_alive():
            return super().trouble
        failed = self._header[at.STATUS] == at.Status.FAILED
        return (super().trouble if failed else "") or self._worker.ending

    # ---------------------------------------------------------------------------------------------- commands

    def command(
        self,
        *,
        q: npt.ArrayLike | None = None,
        tau: npt.ArrayLike | None = None,
        wrench: npt.ArrayLike | None = None,
        pose: Pose | npt.ArrayLike | None = None,
        e1: float | None = None,
    ) -> None:
        """Send a command to the loop; it is valid until the next one, or until the policy's patience ends.

        A command is for the session of the state that was read last from this client (`state`, `session`, `next`,
        `wait`). In a session of which no state was read it is not executed, `events` reports it, `stats.stale` counts
        it: a place that was computed in an older session may be far from where the arm now is.

        The guard limits it. NaN entries keep the last target of their axis or coordinate, or of the rotation. Arguments
        that are None keep their last values.

        Args:
            q: joint position, shape (7,) [rad].
            tau: superposed torques, shape (7,) [Nm].
            wrench: superposed wrench, shape (6,) [N, Nm].
            pose: of the flange in the base, or x y z [m] and unit quaternion x y z w, shape (7,); in sessions that
                command poses.
            e1: redundancy angle of the pose [rad]; in sessions that command poses. None: the last one, initially the
                interpolator's.

        Raises:
            ShapeError: an array has another shape, or the quaternion's norm is further than 1e-3 from 1.
            ConnectionLost: the client is closed, or its loop has ended.
        """
        given, parts = 0, np.zeros(at.COMMAND_WORDS)
        for value, bit, start, size, name in (
            (q, at.GIVEN_Q, at.C_Q, 7, "q"),
            (tau, at.GIVEN_TAU, at.C_TAU, 7, "tau"),
            (wrench, at.GIVEN_WRENCH, at.C_WRENCH, 6, "wrench"),
        ):
            if value is not None:
                parts[start : start + size] = array(value, size, name, nan=True)
                given |= bit
        if pose is not None:
            parts[at.C_POSE : at.C_POSE + 7] = _seven(pose)
            given |= at.GIVEN_POSE
        if e1 is not None:
            parts[at.C_E1] = finite(e1, "e1", unit="rad")
            given |= at.GIVEN_E1
        self._check()
        ints = parts.view(np.int64)
        ints[at.C_AT], ints[at.C_GIVEN], ints[at.C_EPOCH] = time.monotonic_ns(), given, self._epoch
        self._layout.commands.write(parts[1:])

    def _newest_memory(self) -> npt.NDArray[np.float64] | None:
        words = self._layout.memory.newest()
        return None if words is None else words[1:]

    def _send_params(self) -> None:
        self._layout.params.write(self._values)

    def output(self, name: str, value: SignalValue) -> None:
        """Write an output of the cabinet; it is sent until the cabinet shows it, in any state of the session.

        Args:
            name: "Group.Signal", or the part behind the point if it is unambiguous.
            value: True or False, or a number.

        Raises:
            CommandRejected: the session has no such output.
            LimitError: the value is outside the range of the output.
            ConnectionLost: the client is closed, or its loop has ended.
        """
        signals = self._signals
        full, number = signals.output(name, value)
        self._writes += 1  # with a count, because the loop may read several writes at once
        outputs = {name: write for name, write in self._outputs.items() if name in signals.names}
        self._outputs = {**outputs, full: (self._writes, number)}
        self._send_outputs()

    def frame(self, name: str, pose: Pose | npt.ArrayLike) -> None:
        """Set the pose of a frame that the controller requests; it is valid until the next call.

        Args:
            name: of the frame, one of `wanted_frames`.
            pose: of the frame, or x y z [m] and unit quaternion x y z w, shape (7,).

        Raises:
            CommandRejected: the controller does not request such a frame.
            ShapeError: the array does not have seven numbers, or the quaternion's norm is further than 1e-3 from 1.
            ConnectionLost: the client is closed, or its loop has ended.
        """
        check_name(name, "name")
        requested = self.wanted_frames
        if name not in requested:
            raise CommandRejected(
                f"the controller requests no frame {name!r}",
                parameter="name",
                value=name,
                allowed=", ".join(requested) or "none",
                hint="the application of the cabinet has to register it with registerTransformationProvider",
            )
        given = pose if isinstance(pose, Pose) else array(pose, 7, "pose")
        placed = given if isinstance(given, Pose) else Pose.of(given[:3], given[3:])
        frames = {name: numbers for name, numbers in self._frames.items() if name in requested}
        self._frames = {**frames, name: placed.array.tolist()}
        self._send_outputs()

    def _send_outputs(self) -> None:
        self._check()
        self._layout.outputs.write(self._outputs, self._frames)

    # --------------------------------------------------------------------------------------------------- end

    def _check(self) -> None:
        if self._closed:
            raise ConnectionLost("the FRI client is closed")
        super()._check()
        if not self._worker.is_alive():
            raise ConnectionLost(f"the FRI loop has ended: {self.trouble}")

    def release(self) -> None:
        """End all commands: the arm brakes, and torques and wrenches fade; the loop goes on answering."""
        self._header[at.RELEASE] = 1

    def close(self, *, timeout: float = 5.0) -> None:
        """Brake the arm to a stop and end the loop. Closing twice is allowed."""
        within(timeout, "timeout", 0.0, LONGEST, unit="s")
        if self._closed:
            return
        self._closed = True
        self._header[at.STOP] = 1
        if self._watch is not None:
            self._watch.close()
        self._worker.join(timeout)
        if self._worker.is_alive():
            self._worker.kill()

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _seven(pose: Pose | npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Convert a pose to an array, shape (7,); numbers may be NaN."""
    if isinstance(pose, Pose):
        return pose.array
    values = array(pose, 7, "pose", nan=True)
    if not np.isnan(values[3:]).any():
        Pose.of((0.0, 0.0, 0.0), values[3:])  # raises the error about its norm
    return values


def _own(remote: str | None) -> str:
    """Address to bind: datagrams of the controller arrive there."""
    return ALL_INTERFACES if remote is None else own_address(remote)
