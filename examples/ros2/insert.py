#!/usr/bin/env python3
"""Take a peg out of its holder, and let a learned policy insert it into a hole whose place is known to 2 mm.

It needs the virtual cabinet with a scene, the driver with a gripper, and the node of the policy:

    heptarm sim --scene peg-in-hole
    ros2 run heptarm_ros2 heptarm_node --ros-args -p target:=sim://127.0.0.1 -p gripper.open:=OutputX3Pin1
        -p gripper.close:=OutputX3Pin2 -p gripper.is_open:=InputX3Pin3 -p gripper.is_closed:=InputX3Pin4
    ros2 run heptarm_ros2 reach --ros-args -p policy:=peg-in-hole
"""

import math
import time
from typing import Any

import rclpy
from control_msgs.action import GripperCommand
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from heptarm_msgs.action import MoveJoints, MovePose
from heptarm_msgs.srv import AttachTool
from rcl_interfaces.srv import GetParameters
from rclpy.action import ActionClient
from rclpy.task import Future
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

BEFORE = [math.radians(angle) for angle in (0, 25, 0, -90, 0, 65, 0)]
HEAD, HOLE = (0.6, -0.1, 0.265), (0.6, 0.1, 0.24)  # of the peg in its holder, and the middle of the rim [m]
DOWN = Quaternion(x=0.0, y=1.0, z=0.0, w=0.0)
LONGEST = 30.0  # [s]

rclpy.init()
node = rclpy.create_node("insert")


def discover(name: str) -> None:
    """Until a node has discovered this one, its answers are lost: ask for nothing, and again after a second."""
    client, answer = node.create_client(GetParameters, f"{name}/get_parameters"), Future()
    while not answer.done():
        answer = client.call_async(GetParameters.Request())
        rclpy.spin_until_future_complete(node, answer, timeout_sec=1.0)


def do(kind: Any, action: str, **goal: Any) -> Any:
    """Return the result of a goal."""
    client = ActionClient(node, kind, f"heptarm/{action}")
    client.wait_for_server()
    sent = client.send_goal_async(kind.Goal(**goal))
    rclpy.spin_until_future_complete(node, sent)
    if not sent.result().accepted:
        raise SystemExit(f"{action} is rejected: see the node's log")
    ended = sent.result().get_result_async()
    rclpy.spin_until_future_complete(node, ended)
    return ended.result().result


def call(kind: Any, service: str, **request: Any) -> None:
    """Call a service."""
    client = node.create_client(kind, f"heptarm/{service}")
    client.wait_for_service()
    answer = client.call_async(kind.Request(**request))
    rclpy.spin_until_future_complete(node, answer)
    if not answer.result().success:
        raise SystemExit(answer.result().message)


def at(x: float, y: float, z: float) -> PoseStamped:
    """A pose of the tool that points downwards."""
    return PoseStamped(pose=Pose(position=Point(x=x, y=y, z=z), orientation=DOWN))


def move(x: float, y: float, z: float, path: int = MovePose.Goal.LIN, speed: float = 0.1) -> None:
    """Move the tool there."""
    moved = do(
        MovePose, "move_pose", pose=at(x, y, z), path=path, speed_mps=speed * (path == MovePose.Goal.LIN)
    )
    if not moved.success:
        raise SystemExit(moved.message)


def tool(name: str, length: float, mass: float) -> None:
    """Attach a tool whose tip is so far in front of the flange."""
    tcp = Pose(position=Point(z=length), orientation=Quaternion(w=1.0))
    call(AttachTool, "attach_tool", name=name, mass=mass, com=Point(z=0.07), tcp=tcp)


def grip(position: float) -> Any:
    """Open or close the gripper."""
    goal = GripperCommand.Goal()
    goal.command.position = position
    return do(GripperCommand, "gripper_cmd", command=goal.command)


discover("heptarm")
discover("reach")
tool("two-finger", 0.16, 1.0)
grip(0.1)
if not do(MoveJoints, "move_joints", position=BEFORE, speed=0.5).success:
    raise SystemExit("the arm did not move: see the node's log")
move(HEAD[0], HEAD[1], HEAD[2] + 0.1, path=MovePose.Goal.PTP)
move(*HEAD)
if not grip(0.0).stalled:
    raise SystemExit("the gripper holds no peg")
call(Trigger, "detach_tool")
tool("gripper with peg", 0.225, 1.19)  # from now on the peg's end is the tool frame
move(HEAD[0], HEAD[1], 0.3)

presumed = (HOLE[0] - 0.002, HOLE[1] + 0.001, HOLE[2])  # as a camera would have found it
move(presumed[0], presumed[1], presumed[2] + 0.02)
move(presumed[0], presumed[1], presumed[2] + 0.004)  # where an episode of the policy begins

missing: list[float] = []  # [m]
node.create_subscription(Float64, "reach/distance", lambda message: missing.append(message.data), 10)
target = node.create_publisher(PoseStamped, "reach/target", 1)
while not target.get_subscription_count():
    rclpy.spin_once(node, timeout_sec=0.1)
target.publish(at(*presumed))
begun = time.monotonic()
while time.monotonic() - begun < LONGEST and not (missing and missing[-1] < 0.0015):
    rclpy.spin_once(node, timeout_sec=0.1)
took = time.monotonic() - begun
time.sleep(1.0)  # the episode is over half a second later, and the arm comes to rest
print(
    f"{1e3 * missing[-1] if missing else math.nan:.1f} mm are missing after {time.monotonic() - begun - 1.0:.1f} s"
)
move(
    presumed[0], presumed[1], presumed[2] + 0.05
)  # still compliant: the impedance stays until another mode is chosen
call(Trigger, "mode/position")
node.destroy_node()
rclpy.shutdown()
