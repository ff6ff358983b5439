"""A process with one node and an orderly shutdown."""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NoReturn, TypeVar

import rclpy
from rclpy.executors import Executor, InvalidHandle, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from heptarm.errors import HeptarmError

One = TypeVar("One", bound=Node)

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def _on_signal(*_: Any) -> None:
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_IGN)  # shutdown has begun
    raise KeyboardInterrupt


def _leave(code: int) -> NoReturn:
    """End the process at once, after everything that mattered has been closed.

    Python would now take apart what rclpy has left, in any order and beside threads of its executor and of the
    middleware, and crashes at times (SIGSEGV in the garbage collector: an exit code that speaks of a failure).
    """
    logging.shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def run(
    make: Callable[[], One],
    arguments: list[str] | None = None,
    *,
    threads: int = 1,
    close: Callable[[One], None] = lambda _: None,
) -> NoReturn:
    """Run a node until a signal comes or a callback fails, and end the process; its exit code is 1 after a failure.

    A node that refuses its parameters is a failure, which is logged.

    The signal handlers of ROS would shut it down immediately, while the executor and the node still use it.

    Args:
        make: makes the node.
        arguments: of the command line; None: those of the process.
        threads: of the executor.
        close: ends the work of the node while ROS still publishes; called twice, the second time without callbacks.
    """
    rclpy.init(
        args=sys.argv if arguments is None else arguments, signal_handler_options=SignalHandlerOptions.NO
    )
    node: One | None = None
    executor: Executor = (
        SingleThreadedExecutor() if threads == 1 else MultiThreadedExecutor(num_threads=threads)
    )
    over: Future[None] = Future()
    failed = threading.Event()

    def spin() -> None:
        try:
            while not over.done():
                # while rclpy collects what to wait for, a clean-up may destroy a publisher: ros2/rclpy issue 1284
                with suppress(InvalidHandle):
                    executor.spin_until_future_complete(over)
        finally:
            if not over.done():
                failed.set()

    spinner = threading.Thread(target=spin, name="heptarm-ros")
    try:
        for number in _SIGNALS:
            signal.signal(number, _on_signal)
        node = make()
        executor.add_node(node)
        spinner.start()
        failed.wait()
    except KeyboardInterrupt:
        pass
    except HeptarmError as error:  # of a parameter
        get_logger("heptarm").fatal(str(error))
        failed.set()
    if node is not None:
        close(node)
    over.set_result(None)
    if spinner.ident is not None:
        spinner.join()
    executor.shutdown()
    if node is not None:
        close(node)
        node.destroy_node()
    rclpy.try_shutdown()
    _leave(int(failed.is_set()))
