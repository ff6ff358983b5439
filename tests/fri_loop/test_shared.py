"""Shared memory: two processes without a lock never read a torn slot."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from heptarm.errors import HeptarmError
from heptarm.io.shared import MemoryBlock, Note, Ring

WIDTH, SLOTS = 16, 4
WRITER = f"""
import sys
import numpy as np
from heptarm.io.shared import MemoryBlock, Ring

ring = Ring(MemoryBlock(path=sys.argv[1]), head=0, start=8, slots={SLOTS}, width={WIDTH})
for value in range(100_000):
    ring.write(np.full({WIDTH} - 1, float(value)))
"""


def test_a_ring_that_is_overrun_by_another_process_is_never_read_torn() -> None:
    block = MemoryBlock(8 + SLOTS * WIDTH)
    ring = Ring(block, head=0, start=8, slots=SLOTS, width=WIDTH)
    writer = subprocess.Popen([sys.executable, "-c", WRITER, block.path])
    seen, last = 0, -1.0
    while writer.poll() is None:
        words = ring.newest()
        if words is not None:
            assert (words[1:] == words[1]).all() and words[1] >= last
            seen, last = seen + 1, words[1]
    block.unlink()
    newest = ring.newest()
    assert writer.returncode == 0
    assert seen > 100 and newest is not None and newest[1] == 99_999.0 and ring.count == 100_000


def test_a_ring_keeps_its_last_slots() -> None:
    block = MemoryBlock(8 + SLOTS * WIDTH)
    block.unlink()
    ring = Ring(block, head=0, start=8, slots=SLOTS, width=WIDTH)
    assert ring.newest() is None and ring.read(0) is None
    for value in range(10):
        ring.write([float(value)])
    kept = [ring.read(tick) for tick in range(10)]
    assert [None if one is None else one[1] for one in kept] == [None] * 6 + [6.0, 7.0, 8.0, 9.0]
    ring.begin()
    assert ring.read(6) is None, "it is being overwritten"
    newest = ring.newest()
    assert newest is not None and newest[1] == 9.0


def test_a_note_stands_until_the_next_one() -> None:
    block = MemoryBlock(64)
    block.unlink()
    note = Note(block, start=0, words=8)
    assert note.read() == ""
    note.write("läuft")
    before = note.tick
    assert note.read() == "läuft"
    note.write("")
    assert note.read() == "" and note.tick != before
    with pytest.raises(ValueError, match="at most 48 bytes, got 49"):
        note.write("x" * 49)


@pytest.mark.skipif(not os.path.isdir("/dev/shm"), reason="this system has no file system in memory")
def test_memory_that_does_not_exist_is_refused_before_it_is_written() -> None:
    about = os.statvfs("/dev/shm")
    before = set(os.listdir("/dev/shm"))
    with pytest.raises(
        HeptarmError, match=r"shared memory cannot be reserved in /dev/shm: no space .*--shm-size"
    ):
        MemoryBlock(about.f_frsize * about.f_blocks // 8 + 1024)
    made = set(os.listdir("/dev/shm")) - before
    assert not [
        name for name in made if os.stat(f"/dev/shm/{name}").st_size > about.f_frsize * about.f_blocks
    ]


@pytest.mark.skipif(not os.path.isdir("/dev/shm"), reason="this system has no file system in memory")
def test_all_of_the_memory_is_reserved() -> None:
    block = MemoryBlock(1 << 17)
    try:
        assert os.stat(block.path).st_blocks * 512 >= 1 << 20
    finally:
        block.unlink()
