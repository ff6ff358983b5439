#!/usr/bin/env python3
"""Swing joint 5 with a stream of targets; when the script ends or hangs, the arm brakes by itself."""

import math

import rospy
from sensor_msgs.msg import JointState

rospy.init_node("servo")
servo = rospy.Publisher("/heptarm/servo/joint", JointState, queue_size=1, tcp_nodelay=True)
here = rospy.wait_for_message("/joint_states", JointState)
while not servo.get_num_connections():
    rospy.sleep(0.01)

rate = rospy.Rate(100)
begin = rospy.Time.now()
while not rospy.is_shutdown() and (t := (rospy.Time.now() - begin).to_sec()) < 4.0:
    servo.publish(JointState(name=["A5"], position=[here.position[4] + 0.2 * math.sin(math.pi * t / 2)]))
    rate.sleep()
there = rospy.wait_for_message("/joint_states", JointState)
print(f"A5 was at {here.position[4]:.3f} rad and is at {there.position[4]:.3f} rad")
