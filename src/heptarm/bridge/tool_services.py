"""Services of what hangs on the flange, and of the frames that it brings."""

from __future__ import annotations

from typing import Any

from heptarm.bridge.driver import Driver
from heptarm.bridge.motions import pose_of
from heptarm.bridge.service import Offer, Service, Told, names
from heptarm.errors import NotReady
from heptarm.values.motion import TOOL
from heptarm.values.pose import Pose
from heptarm.values.tool import BASE, Tool, Workpiece


class Tools(Offer):
    """Tools, workpieces, frames."""

    def __init__(self, driver: Driver) -> None:
        super().__init__(driver)
        self._workpiece: Workpiece | None = None

    def attach_tool(self, request: Any) -> str:
        """Tell the cabinet what hangs on the flange."""
        self._rest()
        tool: Tool | str = request.name
        if not request.known:
            tool = Tool(tcp=pose_of(request.tcp), **_carried(request))
        self._arm.attach_tool(tool, frame=request.frame or None)
        return f"{request.name} is attached"

    def detach_tool(self, request: Any) -> str:
        """Tell the cabinet that nothing hangs on the flange."""
        self._rest()
        self._arm.detach_tool()
        self._workpiece = None
        return "nothing is attached"

    def attach_workpiece(self, request: Any) -> str:
        """Tell the cabinet what the tool holds."""
        self._rest()
        workpiece = Workpiece(**_carried(request))
        self._arm.attach_workpiece(workpiece)
        self._workpiece = workpiece
        return f"{request.name} is held"

    def detach_workpiece(self, request: Any) -> str:
        """Tell the cabinet that the tool does not hold it any more."""
        if self._workpiece is None:
            raise NotReady("nothing that this node attached is held")
        self._rest()
        self._arm.detach_workpiece(self._workpiece)
        self._workpiece = None
        return "nothing is held"

    def tools(self, request: Any) -> Told:
        """Tools that can be attached by name."""
        return names(tuple(self._arm.tools))

    def frames(self, request: Any) -> Told:
        """Taught frames of the project."""
        return names(tuple(self._arm.frames))

    def pose(self, request: Any) -> Told:
        """Pose of a frame as seen from another."""
        frame, reference = request.frame or TOOL, request.reference or BASE
        pose = self._arm.pose(frame, reference=reference)
        return Told(True, f"{frame} as seen from {reference}", {"pose": _pose_fields(pose)})

    def wrench(self, request: Any) -> Told:
        """External force and torque at the origin of a frame."""
        frame, axes = request.frame or TOOL, request.axes or BASE
        wrench = self._arm.wrench(frame, axes=axes)
        fields = {
            "force": dict(zip("xyz", wrench.force.tolist())),
            "torque": dict(zip("xyz", wrench.torque.tolist())),
        }
        inaccuracy = [*wrench.force_inaccuracy.tolist(), *wrench.torque_inaccuracy.tolist()]
        return Told(True, f"at {frame}, in axes of {axes}", {"wrench": fields, "inaccuracy": inaccuracy})


def _carried(request: Any) -> dict[str, Any]:
    com = request.com
    carried: dict[str, Any] = {
        "name": request.name,
        "mass": request.mass,
        "com": (com.x, com.y, com.z),
        "frames": {frame.name: pose_of(frame.pose) for frame in request.frames},
    }
    return carried | ({"inertia": list(request.inertia)} if len(request.inertia) else {})


def _pose_fields(pose: Pose) -> dict[str, Any]:
    return {"position": dict(zip("xyz", pose.xyz.tolist())), "orientation": dict(zip("xyzw", pose.quat.tolist()))}


_TRIGGER, _NAMES = "std_srvs/Trigger", "heptarm_msgs/GetNames"
#: All of them.
TOOLS = (
    Service("~/attach_tool", "heptarm_msgs/AttachTool", Tools.attach_tool),
    Service("~/detach_tool", _TRIGGER, Tools.detach_tool),
    Service("~/attach_workpiece", "heptarm_msgs/AttachWorkpiece", Tools.attach_workpiece),
    Service("~/detach_workpiece", _TRIGGER, Tools.detach_workpiece),
    Service("~/tools", _NAMES, Tools.tools, at_once=True),
    Service("~/frames", _NAMES, Tools.frames, at_once=True),
    Service("~/get_pose", "heptarm_msgs/GetPose", Tools.pose, at_once=True),
    Service("~/get_wrench", "heptarm_msgs/GetWrench", Tools.wrench, at_once=True),
)
