#!/usr/bin/env python3
"""How high is the table? Down until something is touched, back a little, down again slowly, and up."""

import math

import rclpy
from heptarm_msgs.action import MoveJoints, Touch
from rclpy.action import ActionClient

HOME = [math.radians(angle) for angle in (0, 30, 0, -90, 0, 60, 0)]

rclpy.init()
node = rclpy.create_node("touch")


def do(kind, name: str, **goal):
    """A goal's result."""
    client = ActionClient(node, kind, name)
    client.wait_for_server()
    sent = client.send_goal_async(kind.Goal(**goal))
    rclpy.spin_until_future_complete(node, sent)
    if not sent.result().accepted:
        raise SystemExit(f"{name} is rejected: the node's log says why")
    ended = sent.result().get_result_async()
    rclpy.spin_until_future_complete(node, ended)
    return ended.result().result


moved = do(MoveJoints, "heptarm/move_joints", position=HOME, speed=0.3)
if not moved.success:
    raise SystemExit(moved.message)
felt = do(
    Touch,
    "heptarm/touch",
    direction="-z",
    frame="base",
    distance=0.2,
    force=10.0,
    twice=True,
    retreat=True,
    retreat_m=0.05,
)
if felt.contact:
    print(f"the table is {felt.pose.pose.position.z:.4f} m high, felt with {felt.force.z:.1f} N")
else:
    print(felt.message)
node.destroy_node()
rclpy.shutdown()
