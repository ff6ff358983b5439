"""The client of an FRI controller, as the user's process sees it."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import (
    CommandRejected,
    ConnectFailed,
    ConnectionLost,
    NotReady,
    Timeout,
)
from heptarm.fri.event import Event, Kind
from heptarm.fri.guard import Limits
from heptarm.fri.messages import Quality, SessionState
from heptarm.fri.policy import Policy
from heptarm.fri.pose_guard import PoseLimits
from heptarm.fri.statistics import Counters, Histogram
from heptarm.fri.version import Version
from heptarm.io.shared import Block
from heptarm.rt import launch, limited
from heptarm.rt import layout as at
from heptarm.rt.cycle import Law
from heptarm.rt.state import Params, State
from heptarm.values.arrays import array
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel, robot

#: FRI's own port.
PORT = 30200
#: A state is looked for this often once it is due [s].
_LOOK = 1e-4
_KINDS = list(Kind)
_NOBODY = (
    "is the FRI application running on the cabinet, does it send to this machine's address and this port, are both in "
    "one network (address and netmask), and does a firewall let UDP through?"
)


@dataclass(frozen=True, slots=True)
class Stats:
    """How well it goes; counts are over all sessions of the client.

    Attributes:
        received: messages of the controller.
        answered: answers sent.
        lost: messages that never came.
        missed: answers that the controller did not take in time.
        duplicated: messages that came twice.
        reordered: messages overtaken by later ones.
        malformed: datagrams that were no message.
        restarts: sessions that began anew.
        commanded: answers whose commands were effective.
        filled: of those, made by the policy without a fresh command.
        limited: of those, changed by the guard.
        quality: messages by the quality that they named.
        latency: receipt to answer, [s]: median, 99 %, 99.9 %, longest.
        jitter: deviation from the send period, [s]: median, 99 %, 99.9 %, longest.
    """

    received: int
    answered: int
    lost: int
    missed: int
    duplicated: int
    reordered: int
    malformed: int
    restarts: int
    commanded: int
    filled: int
    limited: int
    quality: dict[str, int]
    latency: tuple[float, ...]
    jitter: tuple[float, ...]


class Client:
    """A client that answers a controller from a process of its own; close it, or use it in a `with` block.

    It stays through any number of sessions: the cabinet's application may end and begin again.

    Args:
        port: own UDP port.
        host: own address; "0.0.0.0" for all.
        remote: listen to this controller's address only; None to anybody's.
        version: FRI release such as "1.15"; None takes it from the first datagram.
        model: robot, for the limits.
        limits: what the guard keeps; None for the robot's, a little inside.
        pose_limits: what it keeps of commanded poses; None for 0.25 m/s and 1 rad/s.
        policy: what is sent while fresh commands stay away.
        law: `law(state, out, params)`, called in the loop's process in every cycle of COMMANDING_ACTIVE; the guard
            still limits what it wants. None: commands come from `command`.
        params: of the law: numbers and arrays by name.
        history: states that are kept.
        realtime: ask for real-time priority and locked memory.
        cpu: processor of the loop; None for any.
        timeout: how long the loop's process may take to start [s].

    Attributes:
        params: of the law; assign to change them while it runs.
        port: own UDP port.

    Raises:
        ConnectFailed: the port cannot be had, or the loop did not start.
        CommandRejected: an argument is illegal.
    """

    def __init__(
        self,
        port: int = PORT,
        *,
        host: str = "0.0.0.0",
        remote: str | None = None,
        version: str | None = None,
        model: str | RobotModel = "iiwa14",
        limits: Limits | None = None,
        pose_limits: PoseLimits | None = None,
        policy: Policy | None = None,
        law: Law | None = None,
        params: Mapping[str, npt.ArrayLike] | None = None,
        history: int = 2048,
        realtime: bool = True,
        cpu: int | None = None,
        timeout: float = 30.0,
    ) -> None:
        self._limits = limits or Limits.of(robot(model) if isinstance(model, str) else model)
        if not 16 <= history <= 1 << 20:
            raise CommandRejected(
                f"history is {history}; 16 to {1 << 20} states are legal", parameter="history", value=history
            )
        values, schema = Params.flat(params or {})
        try:
            wire = None if version is None else Version.of(version).value
        except ValueError as error:
            raise CommandRejected(str(error), parameter="version", value=version) from None
        self._values = values
        block = Block(at.Layout.words(history=history, params=values.size))
        self._layout = at.Layout(block, history=history, params=values.size)
        self._header = self._layout.header
        self._header[at.HISTORY], self._header[at.SIZE] = history, values.size
        self._layout.config.write(
            json.dumps(
                {
                    "port": port,
                    "host": host,
                    "remote": remote,
                    "version": wire,
                    "limits": asdict(self._limits),
                    "pose_limits": asdict(pose_limits or PoseLimits()),
                    "policy": _plain(policy or Policy()),
                    "law": launch.importable(law),
                    "params": schema,
                    "size": values.size,
                    "parent": os.getpid(),
                    "realtime": realtime,
                    "lock": law is None or launch.importable(law) is not None,
                    "cpu": cpu,
                }
            )
        )
        self.params = Params(values, schema, changed=self._send_params)
        self._send_params()
        self._seen = self._events_seen = 0
        self._outputs: dict[str, float] = {}
        self._frames: dict[str, list[float]] = {}
        self._closed = False
        try:
            self._worker = launch.start(block.path, law)
            self._wait_for_loop(timeout)
        finally:
            block.unlink()
        self.port = int(self._header[at.PORT])

    def _wait_for_loop(self, timeout: float) -> None:
        deadline = time.monotonic() + timeout
        while self._header[at.STATUS] == at.Status.STARTING:
            if not self._worker.is_alive() or time.monotonic() > deadline:
                self._worker.kill()
                raise ConnectFailed(f"the loop's process did not start within {timeout:g} s")
            time.sleep(2e-3)
        if self._header[at.STATUS] == at.Status.FAILED:
            self._worker.join(1.0)
            raise ConnectFailed(self._layout.trouble.read() or "the loop's process did not start")

    # ------------------------------------------------------------------------------------------------ states

    @property
    def state(self) -> State:
        """The newest message.

        Raises:
            NotReady: none has come yet; the text says what may be the cause.
        """
        words = self._layout.states.newest()
        if words is None:
            raise NotReady(self.trouble, hint=_NOBODY)
        return State(words)

    @property
    def session(self) -> SessionState:
        """State of the session; IDLE before the first message."""
        words = self._layout.states.newest()
        return SessionState.IDLE if words is None else State(words).session

    @property
    def quality(self) -> Quality:
        """Quality of the connection; POOR before the first message."""
        words = self._layout.states.newest()
        return Quality.POOR if words is None else State(words).quality

    @property
    def trouble(self) -> str:
        """Why no session stands, in words; empty if one does."""
        return self._layout.trouble.read() or ""

    @property
    def refused(self) -> list[str]:
        """What the system refused the loop, in words with the remedy."""
        return (self._layout.refused.read() or "").splitlines()

    @property
    def is_native(self) -> bool:
        """The loop's frequent turns are done by the native part."""
        return bool(self._header[at.NATIVE])

    @property
    def is_running(self) -> bool:
        """The loop's process runs, or the client was closed in order."""
        return self._closed or self._worker.is_alive()

    def history(self, size: int | None = None) -> list[State]:
        """The last states, oldest first; the very oldest may be overwritten meanwhile and are left out."""
        ring = self._layout.states
        count = ring.count
        first = max(0, count - (len(ring.ints) - 1 if size is None else size))
        found = (ring.read(tick) for tick in range(first, count))
        return [State(words) for words in found if words is not None]

    def next(self, *, timeout: float = 5.0) -> State:
        """The newest state that was not returned before; waits for one.

        Raises:
            Timeout: none came; the text says what may be the cause.
            ConnectionLost: the client is closed, or its loop has ended.
        """
        header, deadline = self._header, time.monotonic() + timeout
        while header[at.STATES] <= self._seen:
            self._check()
            now = time.monotonic()
            if now > deadline:
                known = self._layout.states.newest()
                text = self.trouble or (
                    "the controller sends no more" if known is not None else "nothing has arrived"
                )
                raise Timeout(f"no FRI message within {timeout:g} s: {text}", hint=_NOBODY)
            time.sleep(min(self._until_due(), deadline - now + _LOOK))
        self._seen = header[at.STATES]
        return self.state

    def _until_due(self) -> float:
        """Time until the next state is likely to be there [s]."""
        words = self._layout.states.newest()
        if words is None:
            return 1e-3
        newest = State(words)
        return min(max(newest.period - newest.age, _LOOK), 0.05)

    def __iter__(self) -> Iterator[State]:
        """Every newest state, never one twice, as long as messages come."""
        while True:
            yield self.next()

    def wait(self, session: SessionState | str, *, timeout: float = 10.0) -> State:
        """Wait for a state of the session.

        Args:
            session: the state, or its name such as "COMMANDING_ACTIVE".
            timeout: how long [s].

        Raises:
            Timeout: it did not come; the text says what stands in the way.
        """
        wanted = SessionState[session] if isinstance(session, str) else session
        deadline = time.monotonic() + timeout
        while (rest := deadline - time.monotonic()) > 0.0:
            state = self.next(timeout=rest)
            if state.session is wanted:
                return state
        state = self.state
        hint = ""
        if wanted > state.session:
            if state.session is SessionState.MONITORING_WAIT:
                hint = "the controller wants quality GOOD first; see `stats` for latency and lost messages"
            elif state.session is SessionState.MONITORING_READY:
                hint = "the cabinet's application has started no overlay"
        raise Timeout(
            f"the session is {state.session.name} with quality {state.quality.name} after {timeout:g} s, "
            f"not {wanted.name}",
            hint=hint,
        )

    # ---------------------------------------------------------------------------------------------- commands

    def command(
        self,
        *,
        q: npt.ArrayLike | None = None,
        tau: npt.ArrayLike | None = None,
        wrench: npt.ArrayLike | None = None,
        pose: Pose | npt.ArrayLike | None = None,
    ) -> None:
        """Give a command; it stands until the next one, or until the policy's patience ends.

        The guard limits it. NaN entries keep the last wish of their axis or coordinate, or of the rotation. What is
        None stays as it was.

        Args:
            q: joint position, shape (7,) [rad].
            tau: superposed torques, shape (7,) [Nm].
            wrench: superposed wrench, shape (6,) [N, Nm].
            pose: of the flange in the base, or x y z [m] and unit quaternion x y z w, shape (7,); in sessions that
                command poses.

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
        self._check()
        ints = parts.view(np.int64)
        ints[at.C_AT], ints[at.C_GIVEN] = time.monotonic_ns(), given
        self._layout.commands.write(parts[1:])

    def _send_params(self) -> None:
        self._layout.params.write(self._values)

    @property
    def inputs(self) -> dict[str, float]:
        """The signals that the controller sends, by name."""
        return dict(json.loads(self._layout.inputs.read() or "{}"))

    def output(self, name: str, value: float) -> None:
        """Set an output of the controller, in COMMANDING_ACTIVE.

        Args:
            name: "Group.Signal".
            value: 0 or 1, an integer, or a number, as the signal is.
        """
        self._outputs[name] = value
        self._send_outputs()

    def transformation(self, name: str, values: npt.ArrayLike) -> None:
        """Answer the controller's request for a transformation from now on.

        Args:
            name: of the requested frame.
            values: 12 numbers (3x4, mm) for FRI 1.x; 7 (x y z [mm], qw qx qy qz) for 2.x.
        """
        numbers = np.asarray(values, dtype=np.float64).reshape(-1)
        self._frames[name] = array(numbers, 12 if numbers.size == 12 else 7, name).tolist()
        self._send_outputs()

    def _send_outputs(self) -> None:
        self._check()
        self._layout.outputs.write(json.dumps({"io": self._outputs, "transformations": self._frames}))

    # ------------------------------------------------------------------------------------------------ report

    @property
    def stats(self) -> Stats:
        """Counts, latency and jitter so far."""
        counts = Counters()
        counts.load(self._header, at.COUNTS)
        latency, jitter = Histogram(self._layout.latency), Histogram(self._layout.jitter)
        shares = (0.5, 0.99, 0.999)
        return Stats(
            received=counts.received,
            answered=counts.answered,
            lost=counts.lost,
            missed=counts.missed,
            duplicated=counts.duplicated,
            reordered=counts.reordered,
            malformed=counts.malformed,
            restarts=counts.restarts,
            commanded=counts.commanded,
            filled=counts.filled,
            limited=counts.limited,
            quality={name: getattr(counts, name) for name in ("poor", "fair", "good", "excellent")},
            latency=(*latency.percentiles(*shares), latency.longest),
            jitter=(*jitter.percentiles(*shares), jitter.longest),
        )

    @property
    def limited(self) -> list[str]:
        """What the guard has limited, one line for each axis (or part of a pose) and quantity, in words."""
        return limited.lines(self._layout)

    def events(self) -> list[Event]:
        """What happened since the last call, oldest first."""
        ring, found = self._layout.events, []
        count = ring.count
        for tick in range(max(self._events_seen, count - len(ring.ints)), count):
            words = ring.read(tick)
            if words is not None:
                ints = words.view(np.int64)
                text = words[3:].tobytes().rstrip(b"\0").decode(errors="replace")
                found.append(Event(_KINDS[int(ints[2])], text, int(ints[1])))
        self._events_seen = count
        return found

    # --------------------------------------------------------------------------------------------------- end

    def _check(self) -> None:
        if self._closed:
            raise ConnectionLost("the FRI client is closed")
        if self._header[at.STATUS] in (at.Status.ENDED, at.Status.FAILED) or not self._worker.is_alive():
            raise ConnectionLost(
                f"the FRI loop has ended: {self._layout.trouble.read() or 'its process is gone'}"
            )

    def close(self, *, timeout: float = 5.0) -> None:
        """Brake the arm to a stop and end the loop. Closing twice is legal."""
        if self._closed:
            return
        self._closed = True
        self._header[at.STOP] = 1
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
    """The numbers of a pose, shape (7,); only those that are given have to be some."""
    if isinstance(pose, Pose):
        return pose.array
    values = array(pose, 7, "pose", nan=True)
    if not np.isnan(values[3:]).any():
        Pose.of((0.0, 0.0, 0.0), values[3:])  # says what is wrong with its norm
    return values


def _plain(policy: Policy) -> dict[str, Any]:
    return {"missing": policy.missing.value, "patience": policy.patience, "over": policy.over}
