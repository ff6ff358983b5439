"""Runs the node until shutdown is requested; it leaves the arm at rest."""

from __future__ import annotations

import logging
import sys

import rospy

from heptarm.errors import HeptarmError
from heptarm_ros1.node import HeptarmNode


class RosLogHandler(logging.Handler):
    """Forwards heptarm's log to the ROS log."""

    def emit(self, record: logging.LogRecord) -> None:
        """Forward one record."""
        log = rospy.loginfo
        if record.levelno >= logging.ERROR:
            log = rospy.logerr
        elif record.levelno >= logging.WARNING:
            log = rospy.logwarn
        log("%s", self.format(record))


def main() -> int:
    """Run the node; returns the exit code of the process."""
    rospy.init_node("heptarm")
    log = logging.getLogger("heptarm")
    log.addHandler(RosLogHandler(logging.WARNING))
    log.propagate = False
    try:
        node = HeptarmNode()
    except HeptarmError as error:  # of a parameter
        rospy.logfatal(str(error))
        return 1
    rospy.on_shutdown(node.close)
    rospy.spin()
    return 0


if __name__ == "__main__":
    sys.exit(main())
