"""Runs the node until it is told to end; the arm is at rest then."""

from __future__ import annotations

import contextlib
import sys

import rclpy
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor

from heptarm_ros2.node import HeptarmNode

#: A goal, a cancellation, a stop and a diagnosis may come at once.
_THREADS = 8


def main(arguments: list[str] | None = None) -> int:
    """Run the node; returns the process' exit code."""
    rclpy.init(args=sys.argv if arguments is None else arguments)
    node = HeptarmNode()
    executor = MultiThreadedExecutor(num_threads=_THREADS)
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.close()
        executor.shutdown()
        with contextlib.suppress(Exception):  # ROS may have gone first
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
