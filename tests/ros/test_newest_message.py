"""Messages without a number."""

from __future__ import annotations

import threading

from heptarm.ros.interface.newest_message import NewestMessage


def test_messages_that_come_together_are_all_counted_and_the_newest_is_handled() -> None:
    handled: list[tuple[str, int]] = []
    busy, free, done = threading.Event(), threading.Event(), threading.Event()

    def handle(message: str, number: int) -> None:
        handled.append((message, number))
        busy.set()
        assert free.wait(5.0)
        if number == 4:
            done.set()

    newest = NewestMessage("/a/topic", handle)
    newest.put("first")
    assert busy.wait(5.0)
    for message in ("second", "third", "fourth"):
        newest.put(message)
    free.set()
    assert done.wait(5.0)
    newest.end()
    newest.put("late")
    assert handled == [("first", 1), ("fourth", 4)]
