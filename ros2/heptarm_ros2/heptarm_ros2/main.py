"""Runs the node until it is told to end; the arm is at rest then."""

from __future__ import annotations

import sys

from heptarm.bridge.actions import MOST
from heptarm_ros2.node import HeptarmNode
from heptarm_ros2.process import run

#: As many goals as the bridge takes, and beside them a cancellation, a stop and a diagnosis may come at once.
_THREADS = MOST + 8


def main(arguments: list[str] | None = None) -> int:
    """Run the node; returns the process' exit code."""
    return run(HeptarmNode, arguments, threads=_THREADS, close=HeptarmNode.close)


if __name__ == "__main__":
    sys.exit(main())
