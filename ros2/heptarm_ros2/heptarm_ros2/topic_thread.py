"""A thread of its own for subscriptions.

rclpy's executor with several threads looks at every entity of the node before and after each message: with the topics,
services and timers of this node that takes milliseconds, in which a stream of 100 messages per second is held up for
tenths of a second. Here nothing is waited for but messages.
"""

from __future__ import annotations

import contextlib
import threading
import traceback
from collections.abc import Callable, Iterable
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.guard_condition import GuardCondition
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.subscription import Subscription

#: Handles a message, with what the middleware knows of it.
Callback = Callable[[Any, Any], None]
#: How often the thread looks whether ROS was shut down [ns], and how long to wait for it when it ends [s].
_LOOK, _PATIENCE = 500_000_000, 5.0


class LeftAlone(CallbackGroup):
    """Callback group of subscriptions that no executor serves."""

    def can_execute(self, entity: Any) -> bool:
        """False: the executor never waits for them."""
        return False

    def beginning_execution(self, entity: Any) -> bool:
        """False: see `can_execute`."""
        return False

    def ending_execution(self, entity: Any) -> None:
        """Nothing has begun."""


class TopicThread:
    """Takes the messages of subscriptions, one at a time.

    Args:
        node: of the subscriptions.
        subscriptions: in a `LeftAlone` group; their callbacks take message and info.
    """

    def __init__(self, node: Node, subscriptions: Iterable[Subscription]) -> None:
        self._context, self._log = node.context, node.get_logger()
        self._subscriptions = list(subscriptions)
        self._ended = GuardCondition(None, None, self._context)
        self._ending = False
        self._thread = threading.Thread(target=self._serve, name="heptarm-topics", daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Take no more messages; returns when the last one is handled. Calling it again has no effect."""
        if self._ending:
            return
        self._ending = True
        with contextlib.suppress(InvalidHandle):
            self._ended.trigger()
        self._thread.join(_PATIENCE)
        self._ended.destroy()

    def _serve(self) -> None:
        """Serve the topics; an end that nobody asked for is reported."""
        try:
            self._run()
        except Exception:
            if not self._ending and self._context.ok():
                self._log.fatal(f"no topic is handled any more; restart the node: {traceback.format_exc()}")

    def _run(self) -> None:
        handle = self._context.handle
        if handle is None:
            return
        with contextlib.suppress(InvalidHandle), handle, contextlib.ExitStack() as held:
            for subscription in self._subscriptions:
                held.enter_context(subscription.handle)
            waiting = rclpy_implementation.WaitSet(len(self._subscriptions), 1, 0, 0, 0, 0, handle)
            while not self._ending and self._context.ok():
                waiting.clear_entities()
                for subscription in self._subscriptions:
                    waiting.add_subscription(subscription.handle)
                waiting.add_guard_condition(self._ended.handle)
                waiting.wait(_LOOK)
                ready = waiting.get_ready_entities("subscription")
                for subscription in self._subscriptions:
                    if subscription.handle.pointer in ready and not self._ending:
                        self._take(subscription)

    def _take(self, subscription: Subscription) -> None:
        taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
        if taken is None:
            return
        try:
            subscription.callback(*taken)
        except Exception:  # the other topics, above all the next message of this one, must not die of it
            self._log.error(f"{subscription.topic_name}: {traceback.format_exc()}")
