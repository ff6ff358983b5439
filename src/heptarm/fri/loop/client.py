"""Client of an FRI controller, in the user's process."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping
from dataclasses import asdict
from types import TracebackType
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from heptarm.errors import (
    CommandRejected,
    ConnectFailed,
    ConnectionLost,
    ShapeError,
    refuse_windows,
)
from heptarm.fri.guard.collision_watch import as_numbers
from heptarm.fri.guard.fallback import Policy
from heptarm.fri.guard.joint_guard import Limits
from heptarm.fri.guard.pose_guard import PoseLimits
from heptarm.fri.loop import process
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.compiled import WITH_MEMORY, CompiledLaw, arity
from heptarm.fri.loop.cycle import Law
from heptarm.fri.loop.law_interface import Given, Initial, LiveMemory, flat
from heptarm.fri.loop.law_limit import LawWatch
from heptarm.fri.loop.parameters import merged, rates
from heptarm.fri.loop.telemetry import Reader
from heptarm.fri.loop.user_api import Params
from heptarm.fri.loop.wrench import chain_of
from heptarm.fri.protocol.version import Version
from heptarm.io.shared import MemoryBlock
from heptarm.io.udp import ALL_INTERFACES, own_address
from heptarm.model.dynamics import ROTOR, rigid_bodies
from heptarm.values.arrays import array, callback, finite, flag, instance, integer, within
from heptarm.values.condition.collision import CollisionGuard
from heptarm.values.frames import check_name
from heptarm.values.io import SignalValue
from heptarm.values.pose import Pose
from heptarm.values.robot import Body, RobotModel, robot
from heptarm.values.sealed import Sealed

#: Default UDP port of FRI.
PORT = 30200
#: Longest `busy_poll` [s]. It counts before and after the moment at which a message is due: half of the shortest period
#: in all, so that Linux does not hold up the loop as a runaway realtime thread.
BUSY_POLL = 0.25e-3
#: Longest time limit [s].
LONGEST = 1e9
#: Further time for the start of the loop's process if it has to compile a law [s].
COMPILING = 120.0


def check_settings(
    *,
    version: str | None,
    limits: Limits | None,
    pose_limits: PoseLimits | None,
    policy: Policy | None,
    law: Law | CompiledLaw | None,
    params: Mapping[str, Initial] | None,
    memory: Mapping[str, Given] | None,
    collision: CollisionGuard | None,
    history: int,
    realtime: bool,
    cpu: int | None,
    busy_poll: float,
) -> None:
    """Check the settings of a loop; see `Client`.

    Raises:
        ShapeError: one is of another type.
        CommandRejected: one is outside its range.
    """
    if version is not None:
        try:
            Version.of(instance(version, str, "version"))
        except ValueError as error:
            if isinstance(error, CommandRejected):
                raise
            raise CommandRejected(str(error), parameter="version", value=version) from None
    for value, kind, name in (
        (limits, Limits, "limits"),
        (pose_limits, PoseLimits, "pose_limits"),
        (policy, Policy, "policy"),
        (collision, CollisionGuard, "collision"),
    ):
        if value is not None:
            instance(value, kind, name)
    if law is not None and not isinstance(law, CompiledLaw):
        callback(law, "law")
    if params is not None:
        Params.flat(params)
    if memory is not None:
        flat(memory, "memory")
        if not isinstance(law, CompiledLaw) and (law is None or arity(law) < WITH_MEMORY):
            raise ShapeError(
                "memory needs a law with four arguments",
                parameter="memory",
                hint="write it as law(s, out, p, m): m has what memory= names",
            )
    integer(history, "history", 16, 1 << 20)
    flag(realtime, "realtime")
    if cpu is not None:
        integer(cpu, "cpu", 0, 65535)
    within(busy_poll, "busy_poll", 0.0, BUSY_POLL, unit="s")


class Client(Sealed, Reader):
    """Client that answers a controller from a separate process; close it, or use it in a `with` block.

    It works over any number of sessions: the application of the cabinet may end and start again.

    Args:
        port: UDP port to bind.
        host: own address to bind; "0.0.0.0" for all. None: that of the interface to `remote`; all without a remote.
        remote: address of the controller; None accepts any.
        version: FRI release such as "1.15"; None recognises it from the first datagram.
        model: robot, for the limits.
        load: on the flange, for the guard of torques, which computes with the robot's inertia; None: none.
        limits: limits of joint commands; None for limits slightly inside the robot's.
        pose_limits: limits of pose commands; None for 0.25 m/s and 1 rad/s.
        policy: behaviour without fresh commands.
        law: `law(state, out, params)` or `law(state, out, params, memory)`, called in the loop's process in every cycle
            of COMMANDING_ACTIVE; the guard limits its output. With `heptarm.law` or `heptarm.law_from` the native loop
            calls it. None: commands come from `command`.
        params: parameters of the law, numbers and arrays by name, or declarations with `heptarm.param`.
        memory: what the law keeps from call to call, numbers and arrays by name with their initial values.
        collision: bands of the external torques; at a torque outside its band the arm brakes at once, and the client
            commands nothing more: `collision` names the joint. None: no such bands.
        history: number of states that are kept.
        realtime: request real-time priority and locked memory.
        cpu: processor of the loop; None for any.
        busy_poll: how long before a message is due the loop polls for it instead of sleeping [s], at most 0.25 ms;
            0.2 ms is longer than most machines take to wake a thread. The answer then waits for no thread to wake, and
            a processor is busy meanwhile. 0: never.
        timeout: time limit for the start of the loop's process [s], beside the compilation of a law.

    Attributes:
        params: parameters of the law; assign to change them while it runs.
        memory: memory of the law; read it and assign to it while it runs.
        port: bound UDP port.
        model: the robot.

    Raises:
        ConnectFailed: the port cannot be bound, or the loop did not start.
        CommandRejected: an argument is outside its range, or the law cannot be compiled or loaded.
    """

    params: Final[Params]
    memory: Final[LiveMemory]
    port: Final[int]
    model: Final[RobotModel]

    def __init__(
        self,
        port: int = PORT,
        *,
        host: str | None = None,
        remote: str | None = None,
        version: str | None = None,
        model: str | RobotModel = "iiwa14",
        load: Body | None = None,
        limits: Limits | None = None,
        pose_limits: PoseLimits | None = None,
        policy: Policy | None = None,
        law: Law | CompiledLaw | None = None,
        params: Mapping[str, Initial] | None = None,
        memory: Mapping[str, Given] | None = None,
        collision: CollisionGuard | None = None,
        history: int = 2048,
        realtime: bool = True,
        cpu: int | None = None,
        busy_poll: float = 0.0,
        timeout: float = 30.0,
    ) -> None:
        refuse_windows("FRI")
        check_settings(
            version=version,
            limits=limits,
            pose_limits=pose_limits,
            policy=policy,
            law=law,
            params=params,
            memory=memory,
            collision=collision,
            history=history,
            realtime=realtime,
            cpu=cpu,
            busy_poll=busy_poll,
        )
        integer(port, "port", 0, 65535)
        for address, what in ((host, "host"), (remote, "remote")):
            if address is not None:
                instance(address, str, what)
        within(timeout, "timeout", 0.0, LONGEST, above=True, unit="s")
        arm = robot(model) if isinstance(model, str) else instance(model, RobotModel, "model")
        if load is not None:
            instance(load, Body, "load")
        self.model = arm
        self._limits = limits or Limits.of(arm)
        name = process.importable(law)
        sent = b"" if law is None or name else process.by_value(law)
        declared = merged(law.parameters(arm) if isinstance(law, CompiledLaw) else {}, params)
        values, schema = Params.flat(declared)
        known: Mapping[str, Given] = law.memory if isinstance(law, CompiledLaw) else {}
        remembered, kept = flat({**known, **(memory or {})}, "memory")
        wire = None if version is None else Version.of(version).value
        self._values = values
        sizes = {"history": history, "params": values.size, "memory": remembered.size}
        block = MemoryBlock(at.Layout.words(**sizes))
        super().__init__(at.Layout(block, **sizes))
        self._header[at.HISTORY], self._header[at.SIZE] = history, values.size
        self._header[at.MEMORY_SIZE] = remembered.size
        self._layout.config.write(
            json.dumps(
                {
                    "port": port,
                    "host": _own(remote) if host is None else host,
                    "remote": remote,
                    "version": wire,
                    "limits": asdict(self._limits),
                    "positions": (arm.q_min.tolist(), arm.q_max.tolist()),
                    "chain": chain_of(arm),
                    "links": rigid_bodies(arm, load, rotor=ROTOR).tolist(),
                    "pose_limits": asdict(pose_limits or PoseLimits()),
                    "policy": _plain(policy or Policy()),
                    "collision": None if collision is None else as_numbers(collision),
                    "law": name,
                    "params": schema,
                    "rates": rates(declared).tolist(),
                    "memory": kept,
                    "remembered": remembered.tolist(),
                    "size": values.size,
                    "parent": os.getpid(),
                    "realtime": realtime,
                    "cpu": cpu,
                    "busy_poll": busy_poll,
                }
            )
        )
        self.params = Params(values, schema, changed=self._send_params, declared=declared)
        self._send_params()
        self.memory = LiveMemory(
            remembered, kept, newest=self._newest_memory, write=self._layout.memory_set.write
        )
        self._outputs: dict[str, tuple[int, int | float]] = {}
        self._frames: dict[str, list[float]] = {}
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
        ints[at.C_AT], ints[at.C_GIVEN] = time.monotonic_ns(), given
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
        full, number = self._signals.output(name, value)
        count = 1 + max((one[0] for one in self._outputs.values()), default=0)
        self._outputs[full] = (
            count,
            number,
        )  # with a count, because the loop may read several writes at once
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
        self._frames[name] = (
            given if isinstance(given, Pose) else Pose.of(given[:3], given[3:])
        ).array.tolist()
        self._send_outputs()

    def _send_outputs(self) -> None:
        self._check()
        self._layout.outputs.write(json.dumps({"io": self._outputs, "frames": self._frames}))

    # --------------------------------------------------------------------------------------------------- end

    def _check(self) -> None:
        if self._closed:
            raise ConnectionLost("the FRI client is closed")
        super()._check()
        if not self._worker.is_alive():
            raise ConnectionLost(f"the FRI loop has ended: {self.trouble}")

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


def _plain(policy: Policy) -> dict[str, Any]:
    return {"missing": policy.missing.value, "patience": policy.patience, "over": policy.over}
