#!/usr/bin/env python3
"""Swing joint 5 with a stream of targets; when the script ends or hangs, the arm brakes by itself."""

import math
import time

import rclpy
from rclpy.wait_for_message import wait_for_message
from sensor_msgs.msg import JointState

rclpy.init()
node = rclpy.create_node("servo")
servo = node.create_publisher(JointState, "/heptarm/servo/joint", 1)
found, here = wait_for_message(JointState, node, "/joint_states", time_to_wait=10.0)
while not servo.get_subscription_count():
    time.sleep(0.01)

begin = time.monotonic()
while (t := time.monotonic() - begin) < 4.0:
    servo.publish(JointState(name=["A5"], position=[here.position[4] + 0.2 * math.sin(math.pi * t / 2)]))
    time.sleep(0.01)
found, there = wait_for_message(JointState, node, "/joint_states", time_to_wait=10.0)
print(f"A5 was at {here.position[4]:.3f} rad and is at {there.position[4]:.3f} rad")
node.destroy_node()
rclpy.shutdown()
