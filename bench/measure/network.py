"""A bad network between two namespaces of this machine, with real TCP and UDP: packets get lost, late and out of order.

Each namespace has a TUN device; a thread carries IP packets between the two devices and impairs them. It needs root and
/dev/net/tun; nothing outside the two namespaces changes.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import fcntl
import heapq
import os
import queue
import random
import select
import socket
import struct
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Literal, TypeVar

T = TypeVar("T")
Side = Literal["client", "cabinet"]
Protocol = Literal["tcp", "udp"]

ADDRESSES: dict[Side, str] = {"client": "10.77.0.1", "cabinet": "10.77.0.2"}
_NUMBERS: dict[int, Protocol] = {6: "tcp", 17: "udp"}
_NEW_NETWORK = 0x40000000
_TUN_SET_INTERFACE, _TUN_WITHOUT_HEADER = 0x400454CA, 0x1001
_SET_FLAGS, _SET_ADDRESS, _SET_MASK, _UP = 0x8914, 0x8916, 0x891C, 0x1 | 0x40
_DEVICE = b"ha0"
_PACKET = 65536
_PRIORITY = 5


@dataclass(frozen=True)
class Impairment:
    """What the network does to each packet, in each direction.

    Attributes:
        loss: fraction of the packets that are lost.
        delay: mean delay [s].
        jitter: the delay is uniform in delay ± jitter, so packets overtake each other [s].
        cut: protocols of which nothing gets through.
    """

    loss: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0
    cut: frozenset[Protocol] = frozenset()


#: One packet in ten is lost in each direction, and all are 15 to 25 ms late.
BAD = Impairment(loss=0.1, delay=0.02, jitter=0.005)
CUT = Impairment(cut=frozenset(("tcp", "udp")))


class _Namespace:
    """A network namespace, as that of a thread that runs functions in it."""

    def __init__(self, side: Side) -> None:
        self._side = side
        self._work: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name=f"network-{side}", daemon=True)
        self._thread.start()
        self.device: int = self.call(self._open)

    def call(self, function: Callable[[], T]) -> T:
        done: queue.SimpleQueue[tuple[T | None, BaseException | None]] = queue.SimpleQueue()

        def work() -> None:
            try:
                done.put((function(), None))
            except BaseException as error:
                done.put((None, error))

        self._work.put(work)
        result, error = done.get()
        if error is not None:
            raise error
        return result  # type: ignore[return-value]

    def _run(self) -> None:
        while (work := self._work.get()) is not None:
            work()

    def _open(self) -> int:
        libc = ctypes.CDLL(None, use_errno=True)
        if libc.unshare(_NEW_NETWORK) != 0:
            number = ctypes.get_errno()
            raise OSError(number, f"no network namespace: {os.strerror(number)}")
        device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
        try:
            fcntl.ioctl(device, _TUN_SET_INTERFACE, struct.pack("16sH22x", _DEVICE, _TUN_WITHOUT_HEADER))
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
                for request, address in ((_SET_ADDRESS, ADDRESSES[self._side]), (_SET_MASK, "255.255.255.0")):
                    value = struct.pack("HH4s8x", socket.AF_INET, 0, socket.inet_aton(address))
                    fcntl.ioctl(control, request, struct.pack("16s16s", _DEVICE, value))
                for name in (_DEVICE, b"lo"):
                    fcntl.ioctl(control, _SET_FLAGS, struct.pack("16sH14x", name, _UP))
        except BaseException:
            os.close(device)
            raise
        return device

    def close(self) -> None:
        self._work.put(None)
        self._thread.join(10.0)
        os.close(self.device)


def why_not() -> str:
    """Why this process may not make such a network; empty: it may."""
    try:
        _Namespace("client").close()
    except OSError as error:
        return str(error)
    return ""


class BadNetwork:
    """Two namespaces, "client" and "cabinet", and the packets between them.

    Args:
        impairment: at the start; may be replaced at any time.
        seed: of what happens to the packets.

    Attributes:
        impairment: the present one.
        passed: packets that arrived.
        lost: packets that did not.
        stall: longest time by which a packet was later than it had to be, because this machine was busy [s].
    """

    def __init__(self, impairment: Impairment, *, seed: int = 1) -> None:
        self.impairment = impairment
        self.passed = self.lost = 0
        self.stall = 0.0
        self._random = random.Random(seed)
        self._sides = {side: _Namespace(side) for side in ADDRESSES}
        self._ends = os.pipe()
        self._thread = threading.Thread(target=self._carry, name="network", daemon=True)
        self._thread.start()

    def on(self, side: Side, function: Callable[[], T]) -> T:
        """Call a function on one side: its sockets, threads and processes belong to that side."""
        return self._sides[side].call(function)

    def _carry(self) -> None:
        with contextlib.suppress(OSError):  # a network does not wait for the load of this machine
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
        client, cabinet = self._sides["client"].device, self._sides["cabinet"].device
        other = {client: cabinet, cabinet: client}
        waiting: list[tuple[float, int, int, bytes]] = []
        count = 0
        while True:
            rest = max(0.0, waiting[0][0] - time.monotonic()) if waiting else None
            ready = select.select([client, cabinet, self._ends[0]], [], [], rest)[0]
            if self._ends[0] in ready:
                return
            for device in ready:
                with contextlib.suppress(BlockingIOError):
                    packet = os.read(device, _PACKET)
                    arrival = self._due(packet)
                    if arrival is not None:
                        count += 1
                        heapq.heappush(waiting, (arrival, count, other[device], packet))
            now = time.monotonic()
            while waiting and waiting[0][0] <= now:
                due, _, device, packet = heapq.heappop(waiting)
                self.stall = max(self.stall, now - due)
                self._write(device, packet)

    def _due(self, packet: bytes) -> float | None:
        """When a packet arrives; None: never."""
        if packet[0] >> 4 != 4:
            return None
        impairment = self.impairment
        if _NUMBERS.get(packet[9]) in impairment.cut or self._random.random() < impairment.loss:
            self.lost += 1
            return None
        jitter = self._random.uniform(-impairment.jitter, impairment.jitter)
        return time.monotonic() + impairment.delay + jitter

    def _write(self, device: int, packet: bytes) -> None:
        try:
            os.write(device, packet)
            self.passed += 1
        except OSError as error:
            if error.errno not in (errno.EAGAIN, errno.ENOBUFS, errno.EIO):
                raise
            self.lost += 1

    def __enter__(self) -> BadNetwork:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.write(self._ends[1], b".")
        self._thread.join(10.0)
        for side in self._sides.values():
            side.close()
        for end in self._ends:
            os.close(end)
