"""What a loop leaves in the shared memory, as the user's process reads it."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator

import numpy as np

from heptarm.errors import ConnectionLost, NotReady, Timeout
from heptarm.fri.event import Event, Kind
from heptarm.fri.messages import Quality, SessionState
from heptarm.rt import layout as at
from heptarm.rt import limited
from heptarm.rt.signals import Signals
from heptarm.rt.state import State
from heptarm.rt.stats import Stats
from heptarm.values.io import SignalValue

#: A state is looked for this often once it is due [s].
_LOOK = 1e-4
_KINDS = list(Kind)
_NOBODY = (
    "is the FRI application running on the cabinet, does it send to this machine's address and this port, are both in "
    "one network (address and netmask), and does a firewall let UDP through?"
)


class Reader:
    """Reads states, signals, events and counts of a loop.

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
        """The newest message.

        Raises:
            NotReady: none has come yet; the text says what may be the cause.
        """
        words = self._layout.states.newest()
        if words is None:
            raise NotReady(self.trouble, hint=_NOBODY)
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

    def history(self, size: int | None = None) -> list[State]:
        """The last states, oldest first; the very oldest may be overwritten meanwhile and are left out."""
        ring = self._layout.states
        count = ring.count
        first = max(0, count - (len(ring.ints) - 1 if size is None else size))
        found = (ring.read(tick) for tick in range(first, count))
        signals = self._signals
        return [State(words, signals) for words in found if words is not None]

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

    # ----------------------------------------------------------------------------------------------- signals

    @property
    def _signals(self) -> Signals:
        """Those that the session carries."""
        note = self._layout.offered
        if note.tick != self._offer[0]:
            tick, text = note.tick, note.read()
            if text is not None:
                told = json.loads(text)
                self._offer = (tick, Signals.read(told["signals"]), tuple(told["frames"]))
        return self._offer[1]

    @property
    def inputs(self) -> dict[str, SignalValue]:
        """The cabinet's inputs that the session carries, as they are now, by name."""
        return self._now(is_output=False)

    @property
    def outputs(self) -> dict[str, SignalValue]:
        """The cabinet's outputs that the session carries, as the cabinet shows them now, by name."""
        return self._now(is_output=True)

    def _now(self, *, is_output: bool) -> dict[str, SignalValue]:
        words, signals = self._layout.states.newest(), self._signals
        numbers = [] if words is None else words[at.S_IO : at.S_IO + len(signals)].tolist()
        return signals.values(numbers, is_output=is_output)

    @property
    def wanted_frames(self) -> tuple[str, ...]:
        """Names of the frames that the controller asks for."""
        return self._offer[2] if self._signals is not None else ()

    # ------------------------------------------------------------------------------------------------ report

    @property
    def stats(self) -> Stats:
        """Counts, latency and jitter so far."""
        return Stats.of(self._layout)

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

    def _check(self) -> None:
        """Whether more can come.

        Raises:
            ConnectionLost: the loop has ended.
        """
        if self._header[at.STATUS] in (at.Status.ENDED, at.Status.FAILED):
            raise ConnectionLost(
                f"the FRI loop has ended: {self._layout.trouble.read() or 'its process is gone'}"
            )
