"""States, events and counts that the loop publishes for the user's process.

`Record` writes them in the loop's process, `Reader` reads them in the user's.
"""

from __future__ import annotations

import json
import math
import struct
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from heptarm.errors import ConnectionLost, NotReady, Timeout
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.user_api import Signals, State, Stats, information
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.fast_codec import Sample
from heptarm.fri.protocol.messages import Quality, SessionState
from heptarm.fri.session.session import Event, Kind, Session
from heptarm.io.shared import Floats as Words
from heptarm.values.arrays import instance, integer, within, word
from heptarm.values.io import SignalValue

NAN7, NAN6 = (math.nan,) * 7, (math.nan,) * 6
_ROW = struct.Struct(f"={at.S_TRACKING - 1}q{at.STATE_WORDS - at.S_TRACKING}d")
_ARRAYS = attrgetter(*at.ARRAYS)
_KINDS = list(Kind)
_NO_SIGNALS = (math.nan,) * m.MAX_IO


@dataclass(slots=True)
class Sent:
    """Command that was sent in a cycle; NaN for quantities that were not commanded.

    Attributes:
        q: positions [rad].
        tau: torques [Nm].
        wrench: wrench [N, Nm].
        pose: pose in FRI's numbers.
        e1: redundancy angle of the pose [rad].
    """

    q: Sequence[float] = NAN7
    tau: Sequence[float] = NAN7
    wrench: Sequence[float] = NAN6
    pose: Sequence[float] = NAN7
    e1: float = math.nan


NOTHING_SENT = Sent()


class Record:
    """Writer of states and events in the shared memory.

    Args:
        layout: the shared memory.
        session: session of the messages.

    Attributes:
        info: robot and connection of the last message, and the values derived from them.
        dq: velocities by differences, shape (7,) [rad/s].
        state: state filled last, as a law sees it.
        flags: flags of the cycle.
        ticks: messages since commands became effective.
        sent: command of the cycle.
        ipo: interpolator's pose in FRI's numbers, in sessions that command poses.
        ipo_e1: its redundancy angle [rad].
        signals: values of the session's signals.
        wrench: external wrench of the message, sent or estimated [N, Nm].
    """

    def __init__(self, layout: at.Layout, session: Session) -> None:
        self._layout, self._session = layout, session
        self._slot = memoryview(bytearray(8 * at.STATE_WORDS))
        self.dq = np.zeros(7)
        self.state = State(np.frombuffer(self._slot, dtype=np.float64), dq=self.dq)
        self.info: tuple[object, object, tuple[int, ...]] = (None, None, ())
        self.flags = 0
        self.ticks = 0
        self.sent = NOTHING_SENT
        self.ipo: Sequence[float] = NAN7
        self.ipo_e1 = math.nan
        self.signals: Sequence[float] = ()
        self.wrench: Sequence[float] = NAN6
        self._trouble = session.trouble
        layout.trouble.write(self._trouble)

    def fill(self, sample: Sample, latency: int) -> None:
        """Fill the state of a message.

        Args:
            sample: the message.
            latency: time from receipt to answer [ns].
        """
        session = self._session
        robot, link = sample.robot, sample.connection
        if self.info[0] is not robot or self.info[1] is not link:
            self.info = (robot, link, information(sample.message))
        seconds, nanos = sample.stamp
        pose: Sequence[float] = NAN7
        e1, strategy = math.nan, at.ABSENT
        if session.version is not None and session.version.traits.quaternions:
            monitor = sample.message.monitor or m.MonitorData()
            pose = monitor.pose.values if monitor.pose is not None else NAN7
            if monitor.redundancy is not None:
                e1, strategy = monitor.redundancy.value, monitor.redundancy.strategy
        overlay, safety, operation, control, drive, multiplier = self.info[2]
        sent, is_commanding = self.sent, session.is_commanding
        _ROW.pack_into(
            self._slot,
            8,
            session.received,
            sample.sequence,
            seconds * 1_000_000_000 + nanos,
            session.state,
            session.quality,
            session.mode,
            overlay,
            safety,
            operation,
            control,
            drive,
            session.period,
            multiplier,
            latency,
            self.flags,
            session.reflected,
            session.sent,
            max(0, self.ticks) if is_commanding else 0,
            strategy,
            sample.tracking,
            *(number for array in _ARRAYS(sample) for number in array or NAN7),
            *self.wrench,
            *pose,
            e1,
            *sent.q,
            *sent.tau,
            *sent.wrench,
            *(self.ipo if is_commanding else NAN7),
            *sent.pose,
            self.ipo_e1 if is_commanding else math.nan,
            sent.e1,
            *self.signals,
            *_NO_SIGNALS[len(self.signals) :],
        )

    def publish(self, sample: Sample, latency: int) -> None:
        """Publish the state of a message at the end of its cycle."""
        self.fill(sample, latency)
        ring = self._layout.states
        slot = ring.begin()
        ring.ints[slot, 1:] = self._slot[8:].cast("q")
        ring.end()

    def report(self, now: int, text: str, kind: Kind = Kind.CLIENT) -> None:
        """Publish an event."""
        ring = self._layout.events
        encoded = text.encode()[: at.EVENT_TEXT].ljust(at.EVENT_TEXT, b"\0")
        slot = ring.begin()
        ring.ints[slot, 1], ring.ints[slot, 2] = now, _KINDS.index(kind)
        ring.ints[slot, 3:] = memoryview(encoded).cast("q")
        ring.end()

    def report_all(self) -> None:
        """Publish the events of the session, and why there is no session."""
        for event in self._session.events():
            self.report(event.at, event.text, event.kind)
        if self._session.trouble != self._trouble:
            self._trouble = self._session.trouble
            self._layout.trouble.write(self._trouble)


#: Largest count of states.
_LARGEST_COUNT = 1 << 62
#: Polling period for a state that is due [s].
_POLL = 1e-4
#: Longest time limit [s].
_LONGEST = 1e9
_NO_MESSAGES = (
    "check that the FRI application runs on the cabinet and sends to this machine's address and this port, that both "
    "are in one network (address and netmask), and that no firewall blocks UDP"
)


class Reader:
    """Reader of states, signals, events and counts of a loop.

    Args:
        layout: the shared memory.
    """

    def __init__(self, layout: at.Layout) -> None:
        self._layout = layout
        self._header = layout.header
        self._seen = self._events_seen = 0
        self._offer: tuple[int, Signals, tuple[str, ...]] = (-1, Signals(), ())

    @property
    def state(self) -> State:
        """State of the newest message.

        Raises:
            NotReady: no message received yet; the text names possible causes.
        """
        words = self._layout.states.newest()
        if words is None:
            raise NotReady(self.trouble, hint=_NO_MESSAGES)
        return State(words, self._signals)

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
        """Why there is no session, as text; empty if there is one."""
        return self._layout.trouble.read() or ""

    @property
    def refused(self) -> list[str]:
        """What the system refused the loop, with the remedies."""
        return (self._layout.refused.read() or "").splitlines()

    @property
    def is_native(self) -> bool:
        """Whether the native part does the frequent cycles of the loop."""
        return bool(self._header[at.NATIVE])

    @property
    def count(self) -> int:
        """Number of states so far."""
        return self._layout.states.count

    def since(self, count: int) -> tuple[Words, int, int]:
        """Get the words of all states from a count on, for those who process many at once; see shared_memory.

        Returns:
            The words, shape (n, 123); the count for the next call; how many states were overwritten before.
        """
        return self._layout.states.since(integer(count, "count", 0, _LARGEST_COUNT))

    def history(self, size: int | None = None) -> list[State]:
        """Get the last states, oldest first, without those that were overwritten in the meantime."""
        if size is not None:
            integer(size, "size", 0, 1 << 20)
        ring = self._layout.states
        count = ring.count
        first = max(0, count - (len(ring.ints) - 1 if size is None else size))
        found = (ring.read(tick) for tick in range(first, count))
        signals = self._signals
        return [State(words, signals) for words in found if words is not None]

    def next(self, *, timeout: float = 5.0) -> State:
        """Wait for the newest state that was not returned before.

        Raises:
            Timeout: no message received; the text names possible causes.
            ConnectionLost: the client is closed, or its loop has ended.
        """
        within(timeout, "timeout", 0.0, _LONGEST, unit="s")
        header, deadline = self._header, time.monotonic() + timeout
        while header[at.STATES] <= self._seen:
            self._check()
            now = time.monotonic()
            if now > deadline:
                known = self._layout.states.newest()
                text = self.trouble or (
                    "the controller has stopped sending" if known is not None else "no message received"
                )
                raise Timeout(f"no FRI message within {timeout:g} s: {text}", hint=_NO_MESSAGES)
            time.sleep(min(self._until_due(), deadline - now + _POLL))
        self._seen = header[at.STATES]
        return self.state

    def _until_due(self) -> float:
        """Expected time until the next state [s]."""
        words = self._layout.states.newest()
        if words is None:
            return 1e-3
        newest = State(words)
        return min(max(newest.period - newest.age, _POLL), 0.05)

    def __iter__(self) -> Iterator[State]:
        """Iterate over the newest states, each once, as long as messages arrive."""
        while True:
            yield self.next()

    def wait(self, session: SessionState | str, *, timeout: float = 10.0) -> State:
        """Wait for a state of the session.

        Args:
            session: the state, or its name such as "COMMANDING_ACTIVE".
            timeout: time limit [s].

        Raises:
            Timeout: the session did not reach the state; the text names possible causes.
        """
        if isinstance(session, str):
            target = SessionState[word(session, "session", SessionState.__members__)]
        else:
            target = instance(session, SessionState, "session")
        within(timeout, "timeout", 0.0, _LONGEST, unit="s")
        deadline = time.monotonic() + timeout
        while (rest := deadline - time.monotonic()) > 0.0:
            state = self.next(timeout=rest)
            if state.session is target:
                return state
        state = self.state
        hint = ""
        if target > state.session:
            if state.session is SessionState.MONITORING_WAIT:
                hint = "the controller waits for quality GOOD; see `stats` for latency and lost messages"
            elif state.session is SessionState.MONITORING_READY:
                hint = "the cabinet's application has started no overlay"
        raise Timeout(
            f"the session is {state.session.name} with quality {state.quality.name} after {timeout:g} s, "
            f"not {target.name}",
            hint=hint,
        )

    # ----------------------------------------------------------------------------------------------- signals

    @property
    def _signals(self) -> Signals:
        """Signals of the session."""
        note = self._layout.offered
        if note.tick != self._offer[0]:
            tick, text = note.tick, note.read()
            if text is not None:
                offer = json.loads(text)
                self._offer = (tick, Signals.read(offer["signals"]), tuple(offer["frames"]))
        return self._offer[1]

    @property
    def inputs(self) -> dict[str, SignalValue]:
        """Current values of the session's inputs of the cabinet, by name."""
        return self._now(is_output=False)

    @property
    def outputs(self) -> dict[str, SignalValue]:
        """Current values of the session's outputs of the cabinet, by name."""
        return self._now(is_output=True)

    def _now(self, *, is_output: bool) -> dict[str, SignalValue]:
        words, signals = self._layout.states.newest(), self._signals
        numbers = [] if words is None else words[at.S_IO : at.S_IO + len(signals)].tolist()
        return signals.values(numbers, is_output=is_output)

    @property
    def wanted_frames(self) -> tuple[str, ...]:
        """Names of the frames that the controller requests."""
        return self._offer[2] if self._signals is not None else ()

    # ------------------------------------------------------------------------------------------------ report

    @property
    def stats(self) -> Stats:
        """Counts, latency and jitter of the client."""
        return Stats.of(self._layout)

    @property
    def limited(self) -> list[str]:
        """What the guards have limited, one line of text for each axis (or part of a pose) and quantity."""
        return at.report_lines(self._layout)

    def events(self) -> list[Event]:
        """Get the events since the last call, oldest first."""
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

    def _check(self) -> None:
        """Check that the loop runs.

        Raises:
            ConnectionLost: the loop has ended.
        """
        if self._header[at.STATUS] in (at.Status.ENDED, at.Status.FAILED):
            raise ConnectionLost(f"the FRI loop has ended: {self.trouble or 'its process has ended'}")
