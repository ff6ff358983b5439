"""Runs the node until it is told to end; the arm is at rest then."""

from __future__ import annotations

import logging
import sys

import rospy

from heptarm_ros1.node import HeptarmNode


class ToRos(logging.Handler):
    """Takes what heptarm says to ROS' log."""

    def emit(self, record: logging.LogRecord) -> None:
        """One message."""
        say = rospy.loginfo
        if record.levelno >= logging.ERROR:
            say = rospy.logerr
        elif record.levelno >= logging.WARNING:
            say = rospy.logwarn
        say("%s", self.format(record))


def main() -> int:
    """Run the node; returns the process' exit code."""
    rospy.init_node("heptarm")
    log = logging.getLogger("heptarm")
    log.addHandler(ToRos(logging.WARNING))
    log.propagate = False
    node = HeptarmNode()
    rospy.on_shutdown(node.close)
    rospy.spin()
    return 0


if __name__ == "__main__":
    sys.exit(main())
