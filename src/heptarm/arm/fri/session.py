"""FRI sessions: commands every millisecond, answered by a process of their own.

::

    def law(s, out, p):
        out.q[6] += p.amplitude * math.sin(s.t)

    with arm.fri("position", period_ms=1, law=law, params={"amplitude": 0.1}) as rt:
        rt.wait(3.0)
        rt.params.amplitude = 0.2

The client listens before the cabinet is asked to open the session, so nobody waits for anybody.
"""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING

import numpy.typing as npt

from heptarm.arm.block import Block
from heptarm.arm.fri_advice import advice, summary
from heptarm.arm.fri_ends import ended, explained, nothing_told
from heptarm.arm.fri_settings import Request, check_command
from heptarm.arm.handle import MotionHandle
from heptarm.errors import (
    CommandRejected,
    ConnectFailed,
    HeptarmError,
    LocalProtocolError,
    ModeConflict,
    MotionAborted,
    NeedsOperator,
    NotReady,
    SafetyStop,
    StreamError,
    Timeout,
)
from heptarm.fri.event import Event, Kind
from heptarm.fri.messages import Quality, SessionState
from heptarm.io.udp import own_address
from heptarm.rt import Client, Params, Stats
from heptarm.rt import State as FriState
from heptarm.rt.cycle import LAW_FAILED
from heptarm.values.arrays import within
from heptarm.values.io import SignalValue
from heptarm.values.pose import Pose
from heptarm.values.result import Cause, Result
from heptarm.wire import messages as wire

if TYPE_CHECKING:
    from heptarm.arm.connection import Connection

#: How long to wait for the end of a session, and for a message of a session that stands [s].
_PATIENCE = 5.0
#: How often the end of a session is looked for without messages [s].
_LOOK = 0.05
#: Events kept until somebody takes them.
_EVENTS = 256


class Fri(Block):
    """An FRI session; made by `Arm.fri`, used once, in a `with` block.

    Leaving the block ends overlay and session, and the arm rests. What ended it earlier rises there as an error. The
    next session needs nothing but another `arm.fri(...)`.

    Args:
        connection: to the cabinet.
        request: what is asked for.
    """

    what = "FRI session"

    def __init__(self, connection: Connection, request: Request) -> None:
        self._connection = connection
        self._request = request
        self._host = request.message.host
        self._made: Client | None = None
        self._handle: MotionHandle | None = None
        self._number = 0
        self._start: FriState | None = None
        self._before: dict[str, int] = {}  # messages by quality until then
        self._result: Result | None = None
        self._events: deque[Event] = deque(maxlen=_EVENTS)
        self._failure = ""  # of the law
        self._closed = False
        self._limited: list[str] = []

    @property
    def kind(self) -> str:
        """What is commanded: "position", "torque", "wrench", "pose"; or "monitor"."""
        return self._request.kind

    # ------------------------------------------------------------------------------------ life

    def __enter__(self) -> Fri:
        """Open the session; waits until commands are effective, or until monitoring is ready.

        Raises:
            CommandRejected: refused; ModeConflict if another motion runs.
            ConnectFailed: the port is taken, or no session came to stand; the text says what to do.
        """
        if self._made is not None:
            raise LocalProtocolError("an FRI session is used once; make another one with arm.fri(...)")
        link = self._connection.link
        self._host = self._host or own_address(link.peer.rpartition(":")[0])
        client = self._made = self._request.make()
        message = replace(self._request.message, host=self._host, port=client.port)
        try:
            if self.kind == "monitor":
                self._number = link.accept(message, timeout=self._connection.options.timeout)
            else:
                self._handle = self._connection.run(message, 1, inf)
                self._number = self._handle.id
            self._start = self._await(client)
            self._before = client.stats.quality
        except BaseException:
            with contextlib.suppress(HeptarmError):  # the first error tells more
                self._end()
            raise
        return self

    def _await(self, client: Client) -> FriState:
        """The first state in which the session is what it is meant to be."""
        wanted = SessionState.MONITORING_READY if self.kind == "monitor" else SessionState.COMMANDING_ACTIVE
        clock = self._connection.clock
        deadline = clock.nanos() + round((self._request.message.timeout + _PATIENCE) * 1e9)
        while clock.nanos() < deadline:
            stands = self._stands  # before the look, so that nothing is missed between
            with contextlib.suppress(Timeout):
                state = client.next(timeout=_LOOK)
                if state.session >= wanted and stands:
                    return state
            if not stands:
                self._raise(client)
        raise ConnectFailed(
            f"the FRI session is {client.session.name} and does not become {wanted.name}",
            hint=advice(client, host=self._host),
        )

    def _raise(self, client: Client) -> None:
        """Tell why the session never stood."""
        hint = advice(client, host=self._host)
        trouble = self._connection.end()
        if self._handle is not None:
            try:
                self._handle.wait(timeout=_PATIENCE)
            except (NeedsOperator, SafetyStop):
                raise
            except (MotionAborted, NotReady) as error:
                if isinstance(error, MotionAborted) and error.cause is not Cause.FAILED:
                    raise  # stopped meanwhile
                raise ConnectFailed(error.text, code=error.code, hint=hint or error.hint) from error
        elif trouble is not None:
            raise trouble
        raise ConnectFailed(self._last_words().text or ended(controls=self._connection.controls), hint=hint)

    def close(self) -> None:
        """End overlay and session, and give the port back; raises what ended it early. Closing twice is legal.

        Raises:
            QualityLost: the connection became too bad; the text says what spoilt it, as far as this side can tell.
            MotionAborted: the cabinet ended the motion, by a safety stop for instance.
            StreamError: the law failed, or the cabinet closed a session that monitors.
            ConnectionLost: the connection to the cabinet has ended.
        """
        if self._closed or self._made is None:
            return
        stood = self._stands
        hint = "" if stood else self._why()
        try:
            self._end()
        except MotionAborted as error:
            raise self._explained(error, hint) from error
        if self._failure:
            raise StreamError(self._failure, hint="the arm braked by the guard's limits and rested")
        if self.kind == "monitor" and not stood:
            raise self._connection.end() or self._explained(None, hint)

    def _end(self) -> None:
        client, self._closed = self.client, True
        self._limited = client.limited  # the law is called a last time when the overlay is off, and asks for too much
        try:
            if self._number and self._stands:
                with contextlib.suppress(CommandRejected):  # it has just ended by itself
                    self._connection.request(wire.FriClose(session=self._number))
            if self._handle is not None:
                self._result = self._handle.wait(timeout=_PATIENCE)
        finally:
            self._listen()
            client.close()

    def _explained(self, error: MotionAborted | None, hint: str) -> HeptarmError:
        """What ended a session early, with what this side knows of it."""
        controls = self._connection.controls
        return explained(
            error, self._last_words(), hint=hint, controls=controls, limited=self.client.limited
        )

    def _last_words(self) -> wire.FriChanged:
        """The last that the cabinet told of this session."""
        return self._connection.events.fri_change(self._number) or nothing_told(self._number)

    def _why(self) -> str:
        """What spoilt the session, as far as this side can tell."""
        return advice(self.client, host=self._host)

    @property
    def _stands(self) -> bool:
        """Whether the session stands, as far as the cabinet has told."""
        if self._handle is not None:
            return not self._handle.done
        if self._connection.end() is not None:
            return False
        told = self._connection.events.fri_change(self._number)
        return told is None or told.state is not wire.FriSessionState.IDLE

    @property
    def active(self) -> bool:
        """Whether the session stands and the law, if there is one, has not failed."""
        self._listen()
        return not self._closed and not self._failure and self._stands

    @property
    def result(self) -> Result | None:
        """How the overlay's motion ended, after the block; None for a session that only monitors."""
        return self._result

    # --------------------------------------------------------------------------------- the loop

    @property
    def client(self) -> Client:
        """The client behind the session: the loop's process, its shared memory and its port."""
        if self._made is None:
            raise LocalProtocolError("the FRI session has not begun; use it in a with block")
        return self._made

    @property
    def start(self) -> FriState:
        """The first state of the block."""
        if self._start is None:
            raise LocalProtocolError("the FRI session has not begun; use it in a with block")
        return self._start

    @property
    def state(self) -> FriState:
        """The newest message of the cabinet; never a question to it."""
        return self.client.state

    def next(self) -> FriState | None:
        """The newest message that was not returned before; waits for one. None when the session has ended.

        Raises:
            Timeout: the cabinet sends nothing any more.
            ConnectionLost: the loop's process has ended.
        """
        clock, commands = self._connection.clock, self.kind != "monitor"
        deadline = clock.nanos() + round(_PATIENCE * 1e9)
        while self.active:
            try:
                state = self.client.next(timeout=_LOOK)
            except Timeout:
                if clock.nanos() > deadline:
                    raise
                continue
            if state.is_commanding or not commands:
                return state
        return None

    def __iter__(self) -> Iterator[FriState]:
        """Every newest message, never one twice, for as long as the session stands."""
        while (state := self.next()) is not None:
            yield state

    def wait(self, seconds: float) -> bool:
        """Let the law, or the last command, work for a while.

        Returns:
            Whether the session still stands; why not rises at the end of the block.
        """
        clock = self._connection.clock
        deadline = clock.nanos() + round(within(seconds, "seconds", 0.0, 1e9, unit="s") * 1e9)
        while self.active and (rest := (deadline - clock.nanos()) * 1e-9) > 0.0:
            clock.sleep(min(rest, _LOOK))
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
        """Give a command; it stands until the next one, or until the policy's patience ends.

        The guard limits it; `limited` says what. NaN keeps an axis' last wish. What is None stays as it was. After the
        session has ended it does nothing.

        Args:
            q: joint positions, shape (7,) [rad].
            tau: torques on top of the control mode's, shape (7,) [Nm]; "torque" only.
            wrench: wrench on top of the control mode's, shape (6,) [N, Nm]; "wrench" only.
            pose: of the flange in the base, or x y z [m] and quaternion x y z w, shape (7,); "pose" only.
            e1: redundancy angle of the pose [rad]; "pose" only.

        Raises:
            ModeConflict: this session commands something else, or a law does it.
            ShapeError: an array has another shape.
            ConnectionLost: the loop's process has ended.
        """
        check_command(self.kind, {"q": q, "tau": tau, "wrench": wrench, "pose": pose, "e1": e1})
        if self._request.has_law:
            raise ModeConflict(
                "the law commands in this session", hint="change rt.params, or open it without a law"
            )
        if self._stands:
            self.client.command(q=q, tau=tau, wrench=wrench, pose=pose, e1=e1)

    @property
    def params(self) -> Params:
        """Parameters of the law; assign to one to change it while the law runs."""
        return self.client.params

    @property
    def inputs(self) -> dict[str, SignalValue]:
        """The inputs that `io=` named, as they are now, by name; `state.io` has them for every message."""
        return self.client.inputs

    @property
    def outputs(self) -> dict[str, SignalValue]:
        """The outputs that `io=` named, as the cabinet shows them now, by name."""
        return self.client.outputs

    def output(self, name: str, value: SignalValue) -> None:
        """Write an output that `io=` named; see `heptarm.fri.Client.output`."""
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
        """What the guard has limited, one line for each axis and quantity; also after the block."""
        return self._limited if self._closed else self.client.limited

    @property
    def refused(self) -> list[str]:
        """What the system refused the loop, such as real-time priority, in words with the remedy."""
        return self.client.refused

    @property
    def report(self) -> str:
        """How it went so far, in some lines for a person; also after the block."""
        return "\n".join(summary(self.client, before=self._before))

    def events(self) -> list[Event]:
        """What happened since the last call, oldest first."""
        self._listen()
        taken = list(self._events)
        self._events.clear()
        return taken

    def _listen(self) -> None:
        for event in self.client.events():
            self._events.append(event)
            if event.kind is Kind.CLIENT and event.text.startswith(LAW_FAILED):
                self._failure = self._failure or event.text

    def history(self, size: int | None = None) -> list[FriState]:
        """The last messages, oldest first."""
        return self.client.history(size)

    def __repr__(self) -> str:
        """Short form."""
        if self._made is None:
            return f"<Fri {self.kind}, not begun>"
        return f"<Fri {self.kind}, {'closed' if self._closed else self.session.name}>"
