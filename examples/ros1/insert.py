#!/usr/bin/env python3
"""Take a peg out of its holder, and let a learned policy insert it into a hole whose place is known to 2 mm.

It needs the virtual cabinet with a scene, the driver with a gripper, and the node of the policy:

    heptarm sim --scene peg-in-hole
    rosrun heptarm_ros1 heptarm_node _target:=sim://127.0.0.1 _gripper/open:=OutputX3Pin1 _gripper/close:=OutputX3Pin2
        _gripper/is_open:=InputX3Pin3 _gripper/is_closed:=InputX3Pin4
    rosrun heptarm_ros1 reach _policy:=peg-in-hole
"""

import math
import time
from typing import Any

import actionlib
import rospy
from control_msgs.msg import GripperCommandAction, GripperCommandGoal
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from heptarm_msgs.msg import MoveJointsAction, MoveJointsGoal, MovePoseAction, MovePoseGoal
from heptarm_msgs.srv import AttachTool
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

BEFORE = [math.radians(angle) for angle in (0, 25, 0, -90, 0, 65, 0)]
HEAD, HOLE = (0.6, -0.1, 0.265), (0.6, 0.1, 0.24)  # of the peg in its holder, and the middle of the rim [m]
DOWN = Quaternion(x=0.0, y=1.0, z=0.0, w=0.0)
LONGEST = 30.0  # [s]

rospy.init_node("insert")


def do(kind: type, action: str, goal: Any) -> Any:
    """Return the result of a goal."""
    client = actionlib.SimpleActionClient(f"heptarm/{action}", kind)
    client.wait_for_server()
    client.send_goal_and_wait(goal)
    return client.get_result()


def call(kind: type, service: str, **request: Any) -> None:
    """Call a service."""
    rospy.wait_for_service(f"heptarm/{service}")
    answer = rospy.ServiceProxy(f"heptarm/{service}", kind)(**request)
    if not answer.success:
        raise SystemExit(answer.message)


def at(x: float, y: float, z: float) -> PoseStamped:
    """A pose of the tool that points downwards."""
    return PoseStamped(pose=Pose(position=Point(x=x, y=y, z=z), orientation=DOWN))


def move(x: float, y: float, z: float, path: int = MovePoseGoal.LIN) -> None:
    """Move the tool there."""
    speed = 0.1 if path == MovePoseGoal.LIN else 0.0
    moved = do(MovePoseAction, "move_pose", MovePoseGoal(pose=at(x, y, z), path=path, speed_mps=speed))
    if not moved.success:
        raise SystemExit(moved.message)


def tool(name: str, length: float, mass: float) -> None:
    """Attach a tool whose tip is so far in front of the flange."""
    tcp = Pose(position=Point(z=length), orientation=Quaternion(w=1.0))
    call(AttachTool, "attach_tool", name=name, mass=mass, com=Point(z=0.07), tcp=tcp)


def grip(position: float) -> Any:
    """Open or close the gripper."""
    goal = GripperCommandGoal()
    goal.command.position = position
    return do(GripperCommandAction, "gripper_cmd", goal)


tool("two-finger", 0.16, 1.0)
grip(0.1)
if not do(MoveJointsAction, "move_joints", MoveJointsGoal(position=BEFORE, speed=0.5)).success:
    raise SystemExit("the arm did not move: see the node's log")
move(HEAD[0], HEAD[1], HEAD[2] + 0.1, path=MovePoseGoal.PTP)
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
rospy.Subscriber("reach/distance", Float64, lambda message: missing.append(message.data))
target = rospy.Publisher("reach/target", PoseStamped, queue_size=1)
while not target.get_num_connections():
    rospy.sleep(0.1)
target.publish(at(*presumed))
begun = time.monotonic()
while time.monotonic() - begun < LONGEST and not (missing and missing[-1] < 0.0015):
    time.sleep(0.1)
took = time.monotonic() - begun
time.sleep(1.0)  # the episode is over half a second later, and the arm comes to rest
print(f"{1e3 * missing[-1] if missing else math.nan:.1f} mm are missing after {took:.1f} s")
move(
    presumed[0], presumed[1], presumed[2] + 0.05
)  # still compliant: the impedance stays until another is chosen
call(Trigger, "mode/position")
