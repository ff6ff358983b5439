"""Random and mutated frames: the server survives, logs no error, leaks nothing, and serves the next client."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from bench.protocol.garbage import garbage
from heptarm.wire import messages as wire
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer, ptp, run
from tests.long import longer


def _resident(process: int) -> float:
    text = Path(f"/proc/{process}/status").read_text()
    return next(int(line.split()[1]) for line in text.splitlines() if line.startswith("VmRSS")) / 1024


@contextlib.contextmanager
def _reading(peer: Peer) -> Iterator[None]:
    """Reads and answers meanwhile: a slow machine may exceed the cabinet's time limit for silent clients."""
    enough = threading.Event()

    def read() -> None:
        while not enough.is_set():
            peer.read_for(0.3)

    reader = threading.Thread(target=read)
    reader.start()
    try:
        yield
    finally:
        enough.set()
        reader.join()


def test_random_and_mutated_frames(make: Callable[..., FakeCabinet]) -> None:
    frames, cabinet = longer(10_000, 200_000), make()
    idle = cabinet.threads()
    with Peer(cabinet.port, name="watcher") as watcher:
        with _reading(watcher):
            assert garbage(("127.0.0.1", cabinet.port), frames, seed=11) >= frames
        assert isinstance(watcher.ask(wire.Stop()), wire.Accepted)  # it was served, and pinged, all the time
        watcher.take_control(watchdog=5.0)
        watcher.ask(wire.SetOverride(value=1.0))
        watcher.ask(wire.Resume())
        accepted = watcher.ask(run(ptp(0.02)))
        finished = watcher.wait_for(wire.MotionFinished, lambda e: e.id == accepted.id)
        assert finished.cause == wire.Cause.FINISHED
    assert cabinet.errors() == []
    assert _resident(cabinet.process.pid) < 160  # a heap of 64 MB and the JVM itself
    deadline = time.monotonic() + 30.0
    while cabinet.threads() != idle:
        assert time.monotonic() < deadline, cabinet.threads()
        time.sleep(0.05)
    assert cabinet.close() == []
