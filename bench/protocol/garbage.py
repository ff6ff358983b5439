"""Random and mutated frames on the port; the application survives them."""

from __future__ import annotations

import os
import random
import socket
from collections.abc import Iterator

import heptarm as ha
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from heptarm.wire import messages

FRAMES = int(os.environ.get("BENCH_FRAMES", "1000000" if os.environ.get("LONG") else "100000"))
_PER_CONNECTION = 250


def _frame(number: int, body: bytes, request: int, seq: int) -> bytes:
    return messages.HEADER.pack(messages.MAGIC, messages.MAJOR, 0, number, len(body), seq, request, 0) + body


def _seeds() -> list[tuple[int, bytes]]:
    pose = messages.Pose(xyz=(0.5, 0.0, 0.5), quat=(0.0, 1.0, 0.0, 0.0))
    free = messages.Redundancy(e1=float("nan"), status=-1, turn=-1)
    items = [
        messages.Item(motion=messages.Ptp(q=(0.1,) * 7)),
        messages.Item(motion=messages.PtpPose(target=pose, redundancy=free)),
        messages.Item(motion=messages.Lin(target=pose, redundancy=free)),
        messages.Item(motion=messages.LinRel(offset=pose)),
    ]
    legal: list[messages.Message] = [
        messages.Run(items=tuple(items)),
        messages.Subscribe(groups=messages.Groups.JOINTS, rate=100.0),
        messages.TakeControl(),
        messages.Stop(),
        messages.Cancel(id=0),
        messages.SetOverride(value=0.5),
        messages.Ping(sent=1),
    ]
    return [(message.TYPE, message.encode()) for message in legal]


def garbage(target: tuple[str, int], frames: int, seed: int = 3) -> int:
    """Send frames that are random, mutated, cut, or of wrong types; returns how many were sent."""
    chance = random.Random(seed)
    seeds = _seeds()
    greeting = messages.Hello(major=messages.MAJOR, minor=0, name="garbage", nonce=bytes(messages.NONCE))
    hello = _frame(messages.Hello.TYPE, greeting.encode(), 0, 0)
    sent = 0
    while sent < frames:
        with socket.create_connection(target, timeout=5) as peer:
            peer.settimeout(5)
            greeted = chance.random() < 0.8
            if greeted:
                peer.sendall(hello)
            try:
                # what follows bytes that are no frame, or a refused greeting, is discarded and would prove nothing
                for seq in range(1, 1 + _PER_CONNECTION) if greeted else range(2):
                    data, is_frame = _one(chance, seeds, seq)
                    peer.sendall(data)
                    sent += 1
                    if sent >= frames or not is_frame:
                        break
                peer.shutdown(socket.SHUT_WR)
                while peer.recv(65536):
                    pass
            except OSError:
                continue  # the cabinet has closed this connection
    return sent


def _one(chance: random.Random, seeds: list[tuple[int, bytes]], seq: int) -> tuple[bytes, bool]:
    number, body = chance.choice(seeds)
    kind = chance.random()
    if kind < 0.005:
        return b"\0" + chance.randbytes(chance.randrange(30, 200)), False
    if kind < 0.2:
        return _frame(
            chance.randrange(200), chance.randbytes(chance.randrange(0, 300)), chance.randrange(5), seq
        ), True
    changed = bytearray(body)
    for _ in range(chance.randrange(1, 6)):
        if changed:
            changed[chance.randrange(len(changed))] = chance.randrange(256)
    if kind < 0.4:
        changed = changed[: chance.randrange(len(changed) + 1)]
    return _frame(number, bytes(changed), chance.randrange(1, 2**32), seq), True


@benchmark("garbage")
def survive() -> Iterator[Figure]:
    """Random and mutated frames on the port; then a real client moves the arm."""
    with Cabinet() as cabinet:
        sent = garbage(("127.0.0.1", cabinet.port), FRAMES)
        with ha.connect(cabinet.target) as arm:
            arm.set_override(1.0)
            result = arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.5)
            alive = cabinet.process.poll() is None and result.cause is ha.Cause.FINISHED
    yield Figure("garbage_survived", sent if alive else 0, "count", limit=FRAMES, at_least=True)
