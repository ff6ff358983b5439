"""FRI sessions: commands up to every millisecond, sent by a process of their own.

::

    def law(s, out, p):
        out.q[6] += p.amplitude * math.sin(s.t)

    with arm.fri("position", period_ms=1, law=law, params={"amplitude": 0.1}) as rt:
        rt.wait(3.0)
        rt.params.amplitude = 0.2

The client listens before the cabinet is asked to open the session, so neither side waits for the other.
"""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from heptarm.arm.fri.diagnosis import advice, early_end, end_text, no_report, summary
from heptarm.arm.fri.settings import FriRequest, check_command
from heptarm.arm.link.connection import Connection
from heptarm.arm.motion.handle import Block, MotionHandle
from heptarm.errors import (
    CollisionDetected,
    CommandRejected,
    ConnectFailed,
    HeptarmError,
    LocalProtocolError,
    ModeConflict,
    MotionAborted,
    NeedsOperator,
    NotReady,
    QualityLost,
    SafetyStop,
    StreamError,
    Timeout,
)
from heptarm.fri.loop.client import Client
from heptarm.fri.loop.cycle import LAW_FAILED
from heptarm.fri.loop.law_interface import LiveMemory
from heptarm.fri.loop.user_api import Params, Stats
from heptarm.fri.loop.user_api import State as FriState
from heptarm.fri.protocol.messages import Quality, Safety, SessionState
from heptarm.fri.session.events import Event, Kind
from heptarm.io.udp import address_to_bind, own_address
from heptarm.record.journal import FRI
from heptarm.values.checks import within
from heptarm.values.condition.collision import Collision
from heptarm.values.io import SignalValue
from heptarm.values.pose import Pose
from heptarm.values.result import Cause, Result
from heptarm.wire import messages as wire

#: Longest wait for the end of a session, and for a message of an open one [s].
_PATIENCE = 5.0
#: Interval of the checks whether the session has ended, while no messages arrive [s].
_CHECK_INTERVAL = 0.05
#: Kinds of sessions whose commands wind the arm's spring; the longest time in which it unwinds at the end [s], what an
#: axis moves in an interval at rest [rad], and torques and wrenches that are left then [Nm, N].
_EFFORTS, _RELEASE, _STILL, _FADED = ("torque", "wrench"), 3.0, 1e-3, 1.0
#: Events that are kept until `events` takes them.
_MAX_EVENTS = 256


class Fri(Block):
    """An FRI session; made by `Arm.fri`, used once, in a `with` block.

    Leaving the block ends overlay and session, and the arm comes to rest. An error that ended the session earlier is
    raised there. `arm.fri(...)` opens the next session.

    Args:
        connection: to the cabinet.
        request: the checked request.
        on_collision: called with a collision, as soon as the program looks at the session.
    """

    what = "FRI session"

    def __init__(
        self,
        connection: Connection,
        request: FriRequest,
        *,
        on_collision: Callable[[Collision], None] | None = None,
    ) -> None:
        self._on_collision = on_collision
        self._collision: Collision | None = None
        self._connection = connection
        self._request = request
        self._host = request.message.host
        self._client: Client | None = None
        self._handle: MotionHandle | None = None
        self._number = 0
        self._start: FriState | None = None
        self._before: dict[str, int] = {}  # messages by quality before the start
        self._result: Result | None = None
        self._events: deque[Event] = deque(maxlen=_MAX_EVENTS)
        self._law_error = ""
        self._closed = False
        self._limited: list[str] = []

    @property
    def kind(self) -> str:
        """The commanded quantity: "position", "torque", "wrench" or "pose"; or "monitor"."""
        return self._request.kind

    # ------------------------------------------------------------------------------------ life

    def __enter__(self) -> Fri:
        """Open the session and wait until commands are effective, or until monitoring is ready.

        Raises:
            CommandRejected: refused; ModeConflict if another motion runs.
            ConnectFailed: the port is in use, or the session did not open; the hint gives the likely cause.
        """
        if self._client is not None:
            raise LocalProtocolError("an FRI session is used once", hint="make another one with arm.fri(...)")
        self._connection.check_may_wait("the with block of arm.fri()")
        link = self._connection.link
        self._host = self._host or own_address(link.peer.rpartition(":")[0])
        client = self._client = self._request.make(address_to_bind(self._host))
        self._connection.journal.begin_session(client)
        message = replace(self._request.message, host=self._host, port=client.port)
        try:
            if self.kind == "monitor":
                self._number = link.request(
                    message, wire.Accepted, timeout=self._connection.options.timeout
                ).id
            else:
                self._handle = MotionHandle.send(self._connection, message)
                self._number = self._handle.id
            self._start = self._wait_open(client)
            self._before = client.stats.quality
            if self._handle is not None:
                self._connection.enter_block(self._handle, "arm.fri()")
        except BaseException:
            with contextlib.suppress(HeptarmError):  # the first error explains more
                self._end()
            raise
        return self

    def _wait_open(self, client: Client) -> FriState:
        """Wait for the session state in which commands are effective, or monitoring is ready."""
        target = SessionState.MONITORING_READY if self.kind == "monitor" else SessionState.COMMANDING_ACTIVE
        clock = self._connection.clock
        deadline = clock.nanos() + round((self._request.message.timeout + _PATIENCE) * 1e9)
        while clock.nanos() < deadline:
            is_open = self._is_open  # before waiting for a message, so that an end meanwhile is not missed
            with contextlib.suppress(Timeout):
                state = client.next(timeout=_CHECK_INTERVAL)
                if state.session >= target and is_open:
                    return state
            if not is_open:
                self._raise_open_error(client)
        raise ConnectFailed(
            f"the FRI session stays in {client.session.name} and does not reach {target.name}",
            hint=advice(client, host=self._host),
        )

    def _raise_open_error(self, client: Client) -> None:
        """Raise the error because of which the session did not open."""
        hint = advice(client, host=self._host)
        lost = self._connection.final_error()
        if self._handle is not None:
            try:
                self._handle.wait(timeout=_PATIENCE)
            except (NeedsOperator, SafetyStop):
                raise
            except (MotionAborted, NotReady) as error:
                if isinstance(error, MotionAborted) and error.cause is not Cause.FAILED:
                    raise  # stopped meanwhile
                raise ConnectFailed(error.text, code=error.code, hint=hint or error.hint) from error
        elif lost is not None:
            raise lost
        raise ConnectFailed(
            self._last_report().text or end_text(in_control=self._connection.in_control), hint=hint
        )

    def close(self) -> None:
        """End overlay and session and release the port; raises the error that ended it early.

        Calling it again has no effect.

        Raises:
            QualityLost: the quality of the connection became too bad; the hint gives the likely cause.
            MotionAborted: the cabinet ended the motion, by a safety stop for instance.
            StreamError: the law raised an error, or the cabinet closed a monitoring session.
            CollisionDetected: the external torque of a joint left its band.
            SafetyStop: the block ends while a safety function stops the robot.
            ConnectionLost: the connection to the cabinet has ended.
        """
        if self._closed or self._client is None:
            return
        was_open = self._is_open
        stop = self._safety_stop()
        hint = "" if was_open else advice(self.client, host=self._host)
        try:
            self._end()
        except MotionAborted as error:
            if self._collision is not None:
                raise self._collided(error.result) from error
            early = self._early_end(error, hint)
            if self._law_error and isinstance(early, QualityLost):  # the law kept the loop from answering
                raise StreamError(self._law_error, hint="the cabinet stopped the arm") from error
            raise early from error
        if self._collision is not None:
            raise self._collided(self._result)
        if self._law_error:
            raise StreamError(self._law_error, hint="the guard braked the arm within its limits")
        if self.kind != "monitor" and (stop := stop or self._safety_stop()):
            raise SafetyStop(
                f"the FRI session ended in a safety stop: {stop}",
                hint="remove its cause, then arm.recover(); arm.state.safety has the state",
            )
        if self.kind == "monitor" and not was_open:
            raise self._connection.final_error() or self._early_end(None, hint)

    def _safety_stop(self) -> str:
        """The safety stop in which the robot is, as text; empty: none is known."""
        newest = self._connection.newest()
        safety = None if newest is None else newest.groups.safety
        if safety is not None and (
            safety.emergency_stop or safety.operator_safety_open or safety.protective_stop
        ):
            return ", ".join(safety.stops)
        with contextlib.suppress(HeptarmError):  # no message has arrived
            found = self.client.state.safety
            if found is not None and found is not Safety.NORMAL_OPERATION:
                return found.name.lower().replace("_", " ")
        return ""

    def _end(self) -> None:
        client, self._closed = self.client, True
        if self._handle is not None:
            self._connection.leave_block(self._handle)  # first: the link may fail in what follows
        # taken now: the law runs once more when the overlay is off, and the guard limits that
        self._limited = client.limited
        try:
            if self._start is not None and self._is_open and self.kind in _EFFORTS:
                with contextlib.suppress(HeptarmError):  # the end of the session explains more
                    self._release()
            if self._number and self._is_open:
                with contextlib.suppress(CommandRejected):  # it has just ended by itself
                    self._connection.request(wire.FriClose(session=self._number))
            if self._handle is not None:
                self._result = self._handle.wait(timeout=_PATIENCE)
        finally:
            self._take_events()
            client.close()
            self._connection.journal.end_session(client)

    def _release(self) -> None:
        """Let the guard unwind the spring that torques or a wrench have wound: at once it would throw the arm."""
        client, clock = self.client, self._connection.clock
        client.release()
        deadline, before = clock.nanos() + round(_RELEASE * 1e9), client.state.q
        while self._is_open and clock.nanos() < deadline:
            clock.sleep(_CHECK_INTERVAL)
            state = client.state
            sent = state.tau_sent if self.kind == "torque" else state.wrench_sent
            moves, acts = np.abs(state.q - before).max() > _STILL, np.abs(sent).max() > _FADED
            if not (moves or acts):  # nor where this version of FRI sends no positions
                return
            before = state.q

    def _early_end(self, error: MotionAborted | None, hint: str) -> HeptarmError:
        """The error of a session that ended early."""
        return early_end(
            error,
            self._last_report(),
            hint=hint,
            in_control=self._connection.in_control,
            limited=self.client.limited,
        )

    def _collided(self, result: Result | None) -> CollisionDetected:
        """The error of a session that ended at a collision."""
        return CollisionDetected(
            f"collision at {self._collision}",
            collision=self._collision,
            result=result,
            history=self._connection.history(),
            hint="the guard braked the arm within its limits; check what the arm has hit",
        )

    def _last_report(self) -> wire.FriChanged:
        """The cabinet's last report on this session."""
        return self._connection.events.fri_change(self._number) or no_report(self._number)

    @property
    def _is_open(self) -> bool:
        """Whether the session is open, as far as the cabinet reported."""
        if self._handle is not None:
            return not self._handle.done
        if self._connection.final_error() is not None:
            return False
        report = self._connection.events.fri_change(self._number)
        return report is None or report.state is not wire.FriSessionState.IDLE

    @property
    def active(self) -> bool:
        """Whether the session is open, without a collision, and its law, if it has one, has not failed."""
        self._take_events()
        has_failed = self._law_error or self._collision is not None
        return not self._closed and not has_failed and self._is_open

    @property
    def result(self) -> Result | None:
        """How the overlay's motion ended, after the block; None for a monitoring session."""
        return self._result

    # --------------------------------------------------------------------------------- the loop

    @property
    def client(self) -> Client:
        """The client behind the session: the loop's process, its shared memory and its port."""
        if self._client is None:
            raise _not_begun()
        return self._client

    @property
    def start(self) -> FriState:
        """The first state of the block."""
        if self._start is None:
            raise _not_begun()
        return self._start

    @property
    def state(self) -> FriState:
        """The newest message received from the cabinet."""
        return self.client.state

    def next(self) -> FriState | None:
        """Wait for a message newer than the last one returned; None when the session has ended.

        Raises:
            Timeout: no message arrives any more.
            ConnectionLost: the loop's process has ended.
        """
        clock, commands = self._connection.clock, self.kind != "monitor"
        deadline = clock.nanos() + round(_PATIENCE * 1e9)
        while self.active:
            try:
                state = self.client.next(timeout=_CHECK_INTERVAL)
            except Timeout:
                if clock.nanos() > deadline:
                    raise
                continue
            if state.is_commanding or not commands:
                return state
        return None

    def __iter__(self) -> Iterator[FriState]:
        """Iterate over messages, always the newest and each at most once, while the session is open."""
        while (state := self.next()) is not None:
            yield state

    def wait(self, seconds: float) -> bool:
        """Wait while the law, or the last command, is in effect.

        Returns:
            Whether the session is still open; if not, the end of the block raises why.
        """
        clock = self._connection.clock
        deadline = clock.nanos() + round(within(seconds, "seconds", 0.0, 1e9, unit="s") * 1e9)
        while self.active and (rest := (deadline - clock.nanos()) * 1e-9) > 0.0:
            clock.sleep(min(rest, _CHECK_INTERVAL))
        return self.active

    def command(
        self,
        *,
        q: npt.ArrayLike | None = None,
        tau: npt.ArrayLike | None = None,
        wrench: npt.ArrayLike | None = None,
        pose: Pose | npt.ArrayLike | None = None,
        e1: float | None = None,
    ) -> None:
        """Send a command; it is in effect until the next one, or until the policy's time for a missing one has passed.

        The guard limits it, and `limited` reports that. NaN keeps the last target of an axis, None that of a quantity.
        After the end of the session it has no effect.

        Args:
            q: joint positions, shape (7,) [rad].
            tau: torques on top of the control mode's, shape (7,) [Nm]; "torque" only.
            wrench: wrench on top of the control mode's, shape (6,) [N, Nm]; "wrench" only.
            pose: pose of the flange in the base, or x y z [m] and quaternion x y z w, shape (7,); "pose" only.
            e1: redundancy angle of the pose [rad]; "pose" only.

        Raises:
            ModeConflict: this session commands another quantity, or a law commands.
            ShapeError: an array of another shape.
            ConnectionLost: the loop's process has ended.
        """
        check_command(self.kind, {"q": q, "tau": tau, "wrench": wrench, "pose": pose, "e1": e1})
        if self._request.has_law:
            raise ModeConflict(
                "the law commands in this session, so that command() is refused",
                hint="change rt.params, or open the session without a law",
            )
        if self._is_open:
            self.client.command(q=q, tau=tau, wrench=wrench, pose=pose, e1=e1)

    @property
    def params(self) -> Params:
        """Parameters of the law; assign to one to change it while the law runs."""
        return self.client.params

    @property
    def memory(self) -> LiveMemory:
        """Memory of the law; read it, or assign to it, while the law runs."""
        return self.client.memory

    @property
    def inputs(self) -> dict[str, SignalValue]:
        """Current values of the inputs named in `io=`, by name; `state.io` has them for every message."""
        return self.client.inputs

    @property
    def outputs(self) -> dict[str, SignalValue]:
        """Current values of the outputs named in `io=`, as the cabinet reports them, by name."""
        return self.client.outputs

    def output(self, name: str, value: SignalValue) -> None:
        """Write an output named in `io=`; see `heptarm.fri.Client.output`."""
        self.client.output(name, value)

    # ------------------------------------------------------------------------------- the report

    @property
    def session(self) -> SessionState:
        """State of the session."""
        return self.client.session

    @property
    def quality(self) -> Quality:
        """Quality of the connection, as the cabinet names it."""
        return self.client.quality

    @property
    def stats(self) -> Stats:
        """Counts, latency and jitter so far; also after the block."""
        return self.client.stats

    @property
    def limited(self) -> list[str]:
        """What the guard limited, one line per axis and quantity; also after the block."""
        return self._limited if self._closed else self.client.limited

    @property
    def refused(self) -> list[str]:
        """What the operating system refused the loop, such as real-time priority, each with its remedy."""
        return self.client.refused

    @property
    def report(self) -> str:
        """Summary so far in a few lines; also after the block."""
        return "\n".join(summary(self.client, before=self._before))

    def events(self) -> list[Event]:
        """Events since the last call, oldest first."""
        self._take_events()
        taken = list(self._events)
        self._events.clear()
        return taken

    def _take_events(self) -> None:
        if self._collision is None and (found := self.client.collision) is not None:
            self._collision = found
            if self._on_collision is not None:
                self._on_collision(found)
        for event in self.client.events():
            self._events.append(event)
            self._connection.journal.add(FRI, event.text, at=event.at)
            if event.kind is Kind.CLIENT and event.text.startswith(LAW_FAILED):
                self._law_error = self._law_error or event.text

    def history(self, size: int | None = None) -> list[FriState]:
        """The last messages, oldest first."""
        return self.client.history(size)

    def __repr__(self) -> str:
        """Short form."""
        if self._client is None:
            return f"<Fri {self.kind}, not begun>"
        return f"<Fri {self.kind}, {'closed' if self._closed else self.session.name}>"


def _not_begun() -> LocalProtocolError:
    return LocalProtocolError(
        "the FRI session has not begun", hint="use it in a with block: with arm.fri(...) as session"
    )
