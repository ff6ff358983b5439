"""Requests over TCP, in one call of C and as without the GIL: threads, states in between, Ctrl-C at any moment."""

from __future__ import annotations

import random
import signal
import sys
import threading
import time
from collections.abc import Iterator

import pytest

import heptarm as ha
from heptarm.io.tcp import connect, listening
from heptarm.io.transport import Transport
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.arm.peer import Peer


class TcpPeer(Peer):
    """A scripted cabinet behind a real socket."""

    def dial(self) -> Transport:  # type: ignore[override]
        with listening() as listener:
            ours = connect("127.0.0.1", listener.port)
            self.serve(listener.accept())
        return ours


@pytest.fixture(params=["C", "no lock"])
def peer(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[Peer]:
    if request.param == "no lock":
        monkeypatch.setattr(sys, "_is_gil_enabled", lambda: False, raising=False)
    made = TcpPeer()
    yield made
    made.close()


def test_a_refused_request(peer: Peer) -> None:
    text = "too fast \x1b[2J\u202e"
    refusal = wire.Rejected(code=int(Code.OUT_OF_RANGE), parameter="value", text=text, value="1", allowed="")
    peer.expect(wire.SetOverride, refusal).expect(wire.SetOverride, wire.Accepted(id=0))
    with peer.arm() as arm:
        with pytest.raises(ha.HeptarmError, match=r"too fast \[2J") as caught:
            arm.set_override(0.5)
        assert "\x1b" not in str(caught.value) and "\u202e" not in str(caught.value)
        arm.set_override(0.5)


def test_an_answer_of_a_wrong_type(peer: Peer) -> None:
    peer.expect(wire.SetOverride, wire.DatagramToken(token=bytes(32)))
    with peer.arm() as arm, pytest.raises(ha.RemoteProtocolError, match="SetOverride with DatagramToken"):
        arm.set_override(0.5)


def test_an_answer_that_comes_late(peer: Peer) -> None:
    """Later than the socket's time-out, with states before it."""
    peer.expect(
        wire.SetOverride, lambda client, request: threading.Timer(0.3, later, (client, request)).start()
    )

    def later(client, request) -> None:  # type: ignore[no-untyped-def]
        client.say(wire.Accepted(id=0), request)

    with peer.arm() as arm:
        begin = time.monotonic()
        arm.set_override(0.5)
        assert time.monotonic() - begin > 0.25


def test_requests_of_several_threads_beside_states(peer: Peer) -> None:
    with peer.arm(rate=1000.0) as arm:
        problems: list[BaseException] = []

        def ask() -> None:
            try:
                for _ in range(150):
                    arm.stop()
            except BaseException as error:
                problems.append(error)

        threads = [threading.Thread(target=ask) for _ in range(3)]
        for thread in threads:
            thread.start()
        stamps = [state.stamp for state in arm.states(duration=0.3)]
        for thread in threads:
            thread.join()
        assert not problems and stamps == sorted(set(stamps))
        assert sum(isinstance(message, wire.Stop) for message in peer.seen) == 450
        assert not arm.connection.link._requests.by_id and not arm.connection.link._session.waiting


class CtrlC:
    """A handler of SIGINT that raises KeyboardInterrupt, once for each time that it is allowed to."""

    may_raise = False

    def __call__(self, number: int, frame: object) -> None:
        if self.may_raise:
            self.may_raise = False
            raise KeyboardInterrupt


# Python ignores what is raised while it calls back because an object has died, and reports it.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_ctrl_c_at_any_moment_leaves_a_sound_link(peer: Peer) -> None:
    chance, main = random.Random(1), threading.main_thread().ident
    asked, interrupted, over = 0, 0, threading.Event()

    def interrupt() -> None:
        while not over.wait(chance.uniform(1e-4, chance.choice((1e-3, 2e-2)))):
            signal.pthread_kill(main, signal.SIGINT)  # type: ignore[arg-type]

    handler = CtrlC()
    before = signal.signal(signal.SIGINT, handler)
    thread = threading.Thread(target=interrupt)
    try:
        with peer.arm() as arm:
            thread.start()
            end = time.monotonic() + 60.0
            while min(asked, interrupted) < 500 and time.monotonic() < end:
                try:
                    handler.may_raise = True
                    arm.stop()
                    handler.may_raise = False
                    asked += 1
                except KeyboardInterrupt:
                    interrupted += 1
            over.set()
            thread.join()
            arm.stop()
            assert arm.connected and min(asked, interrupted) >= 500, (asked, interrupted)
            link = arm.connection.link
            assert not link._turns.lock.locked() and not link._sending.locked()
    finally:
        over.set()
        signal.signal(signal.SIGINT, before)
