"""An FRI client as the source of a recording: its cycles at their own rate, and the events of its loop."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path

from heptarm import __version__
from heptarm.errors import CommandRejected
from heptarm.fri.loop.client import Client
from heptarm.record.journal import FRI, Journal
from heptarm.record.recorder import Recorder
from heptarm.record.samples import SampleQueue, StateSample
from heptarm.values.checks import instance
from heptarm.values.files import path_of


class ClientSource:
    """What a recording of an FRI client takes; there are no pushed states.

    Args:
        client: in the whole recording open.
    """

    def __init__(self, client: Client) -> None:
        self._reader = client.follower()
        self._reader.events()  # those before the recording do not count
        self._model = client.model
        self._journal = Journal(time.monotonic_ns)
        self._journal.begin_session(self._reader)

    @property
    def journal(self) -> Journal:
        """Events of the loop up to now, and its cycles."""
        for event in self._reader.events():
            self._journal.add(FRI, event.text, at=event.at)
        return self._journal

    @property
    def facts(self) -> Mapping[str, str]:
        """Texts about the robot."""
        return {
            "robot": self._model.name,
            "title": self._model.title,
            "cabinet": "FRI",
            "heptarm": __version__,
            "rate": f"{self.state_rate:g}",
        }

    @property
    def signal_names(self) -> tuple[str, ...]:
        """None: a cycle has the values of the session's signals by their places."""
        return ()

    @property
    def state_rate(self) -> float:
        """Cycles per second that a chunk of the file is made for [Hz]."""
        return 1000.0

    def raise_rate(self, rate: float) -> Callable[[], None]:
        """Refuse: the cabinet's application sets the rate of FRI.

        Raises:
            CommandRejected: always.
        """
        raise CommandRejected(
            "the cabinet's application sets the rate of FRI",
            parameter="rate",
            value=rate,
            hint="leave out the rate: every message is recorded",
        )

    def nanos(self) -> int:
        """Our clock [ns]."""
        return time.monotonic_ns()

    def to_ours(self, stamp: int) -> int:
        """Not used: there are no pushed states."""
        return stamp

    def open_samples(self, size: int) -> SampleQueue:
        """A queue that stays empty."""
        return SampleQueue(size)

    def close_samples(self, queue: SampleQueue) -> None:
        """End such a queue."""

    def kept_samples(self) -> list[StateSample]:
        """None."""
        return []


def record_client(client: Client, path: str | Path, *, overwrite: bool = False) -> Recorder:
    """A recording of an FRI client while the `with` block runs: every message, every answer, and events.

    The cycles are signals such as "fri.q" and "fri.q_sent", at up to 1 kHz. Sessions of `arm.fri` are in the recording
    of `arm.record` already.

    Args:
        client: open during the block.
        path: the file, MCAP.
        overwrite: replace a file that exists.

    Raises:
        CommandRejected: the file exists; or it cannot be written (when the block begins).
        MissingExtra: the package mcap is not installed (when the block begins).
    """
    source = ClientSource(instance(client, Client, "client"))
    return Recorder({"": source}, path_of(path), overwrite=overwrite)
