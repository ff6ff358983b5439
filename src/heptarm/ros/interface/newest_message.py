"""Messages without a number are counted here, and the newest one is handled.

ROS 1 numbers only messages with a header. But its connections lose none on the way: if every message that arrives is
counted, also those that a busy machine delivers in one burst, the count is their number.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any


class NewestMessage:
    """Counts messages where they arrive, and handles the newest in a thread of its own.

    Args:
        name: of the topic.
        handle: handles a message; its second argument is how many have arrived with it.
    """

    def __init__(self, name: str, handle: Callable[[Any, int], None]) -> None:
        self._handle = handle
        self._changed = threading.Condition()
        self._newest: tuple[Any, int] | None = None
        self._count = 0
        self._ending = False
        self._thread = threading.Thread(
            target=self._run, name=f"heptarm{name.replace('/', '-')}", daemon=True
        )
        self._thread.start()

    def put(self, message: Any) -> None:
        """Take a message that has arrived."""
        with self._changed:
            self._count += 1
            self._newest = message, self._count
            self._changed.notify()

    def end(self) -> None:
        """Handle no more messages; returns when the last one is handled."""
        with self._changed:
            self._ending = True
            self._changed.notify()
        self._thread.join()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._ending or self._newest is not None)
                newest, self._newest = self._newest, None
                if self._ending or newest is None:
                    return
            self._handle(*newest)
