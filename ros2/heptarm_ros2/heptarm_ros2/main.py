"""Runs the node until shutdown is requested; it leaves the arm at rest."""

from __future__ import annotations

from typing import NoReturn

from heptarm.ros.interface.action import MAX_GOALS
from heptarm_ros2.node import HeptarmNode
from heptarm_ros2.process import run

#: One for each active goal, and some for a cancellation, a stop and diagnostics at the same time.
_THREADS = MAX_GOALS + 8


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the node, and end the process."""
    run(HeptarmNode, arguments, threads=_THREADS, close=HeptarmNode.close)


if __name__ == "__main__":
    main()
