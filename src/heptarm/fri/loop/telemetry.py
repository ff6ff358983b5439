"""States, events and counts that the loop publishes, as the user's process reads them."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from heptarm.errors import ConnectionLost, NotReady, Timeout
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.user_api import Signals, State, Stats
from heptarm.fri.protocol.messages import Quality, SessionState
from heptarm.fri.session.events import Event, Kind
from heptarm.io.shared import Floats
from heptarm.values.checks import instance, integer, within, word
from heptarm.values.condition.collision import Collision
from heptarm.values.io import SignalValue

_KINDS = list(Kind)
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
        #: Number of the session of which a state was read last: what a command is computed from.
        self._epoch = 0
        self._offer: tuple[int, Signals, tuple[str, ...]] = (-1, Signals(), ())

    def follower(self) -> Reader:
        """Make another reader of the same loop, which counts the events and states that it has read by itself."""
        return Reader(self._layout)

    def _newest(self) -> Floats | None:
        """Words of the newest state, of whose session commands are from now on; None: there is none."""
        epoch = self._header[at.EPOCH]  # the loop writes it after a state of that session
        words = self._layout.states.newest()
        if words is not None:
            self._epoch = epoch
        return words

    @property
    def state(self) -> State:
        """State of the newest message.

        Raises:
            NotReady: no message received yet; the text names possible causes.
        """
        words = self._newest()
        if words is None:
            raise NotReady(self.trouble, hint=_NO_MESSAGES)
        return State(words, self._signals)

    @property
    def session(self) -> SessionState:
        """State of the session; IDLE before the first message."""
        words = self._newest()
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
    def count(self) -> int:
        """Number of states so far."""
        return self._layout.states.count

    def since(self, count: int) -> tuple[Floats, int, int]:
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
            tick, offer = note.tick, note.read()
            if offer is not None:
                self._offer = (tick, Signals.of(offer[0]), offer[1])
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

    @property
    def collision(self) -> Collision | None:
        """The collision at which the loop began to brake; None: there was none."""
        return at.read_collision(self._layout)

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
