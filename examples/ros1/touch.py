#!/usr/bin/env python3
"""Measure the height of a table: move down until contact, retract, move down again slowly, and up."""

import math
from typing import Any

import actionlib
import rospy
from heptarm_msgs.msg import MoveJointsAction, MoveJointsGoal, TouchAction, TouchGoal

HOME = [math.radians(angle) for angle in (0, 30, 0, -90, 0, 60, 0)]

rospy.init_node("touch")


def do(kind: type, name: str, goal: Any) -> Any:
    """Return the result of a goal."""
    client = actionlib.SimpleActionClient(name, kind)
    client.wait_for_server()
    client.send_goal_and_wait(goal)
    return client.get_result()


moved = do(MoveJointsAction, "heptarm/move_joints", MoveJointsGoal(position=HOME, speed=0.3))
if not moved.success:
    raise SystemExit(moved.message)
felt = do(
    TouchAction,
    "heptarm/touch",
    TouchGoal(
        direction="-z", frame="base", distance=0.2, force=10.0, twice=True, retreat=True, retreat_m=0.05
    ),
)
if felt.contact:
    print(f"the table is {felt.pose.pose.position.z:.4f} m high, felt with {felt.force.z:.1f} N")
else:
    print(felt.message)
