#!/usr/bin/env python3
"""Measure the height of a table: move down until contact, retract, move down again slowly, and up."""

import math
from typing import Any

import rclpy
from heptarm_msgs.action import MoveJoints, Touch
from rcl_interfaces.srv import GetParameters
from rclpy.action import ActionClient
from rclpy.task import Future

HOME = [math.radians(angle) for angle in (0, 30, 0, -90, 0, 60, 0)]

rclpy.init()
node = rclpy.create_node("touch")


def discover(name: str) -> None:
    """Until a node has discovered this one, its answers are lost: ask for nothing, and again after a second."""
    client, answer = node.create_client(GetParameters, f"{name}/get_parameters"), Future()
    while not answer.done():
        answer = client.call_async(GetParameters.Request())
        rclpy.spin_until_future_complete(node, answer, timeout_sec=1.0)


def do(kind: Any, name: str, **goal: Any) -> Any:
    """Return the result of a goal."""
    client = ActionClient(node, kind, name)
    client.wait_for_server()
    discover("heptarm")
    sent = client.send_goal_async(kind.Goal(**goal))
    rclpy.spin_until_future_complete(node, sent)
    if not sent.result().accepted:
        raise SystemExit(f"{name} is rejected: see the node's log")
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
