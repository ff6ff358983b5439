"""A stand-in for ros2_control's controller manager, which graphical tools ask what there is to command.

heptarm's topics and actions are always there: the controllers of lbr_stack whose names they have are listed, and none
is loaded, unloaded or switched.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from heptarm.errors import CommandRejected
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.messages import class_of, put
from heptarm.ros.interface.service import ServiceResponse

#: The package of its types.
PACKAGE = "controller_manager_msgs"
#: Types of the controllers by their names, and whether they command positions.
_CONTROLLERS: Mapping[str, tuple[str, bool]] = MappingProxyType(
    {
        "joint_trajectory_controller": ("joint_trajectory_controller/JointTrajectoryController", True),
        "forward_position_controller": ("forward_command_controller/ForwardCommandController", True),
        "force_torque_broadcaster": ("force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster", False),
        "joint_state_broadcaster": ("joint_state_broadcaster/JointStateBroadcaster", False),
    }
)


def list_controllers(context: NodeContext, _: Any) -> ServiceResponse:
    """List what the node follows and publishes, as controllers: active while it accepts commands."""
    kind = class_of(f"{PACKAGE}/ControllerState", "msg")
    positions = [f"{joint}/position" for joint in context.joints]
    found = []
    for name, (type_name, commands) in _CONTROLLERS.items():
        active = context.driver.active or not commands
        message = kind()
        put(
            message,
            {
                "name": name,
                "type": type_name,
                "state": "active" if active else "inactive",
                "claimed_interfaces": positions if commands and active else [],
                "required_command_interfaces": positions if commands else [],
            },
        )
        found.append(message)
    return ServiceResponse(True, "", {"controller": found})


def list_types(_: NodeContext, __: Any) -> ServiceResponse:
    """List the types of these controllers."""
    types = [type_name for type_name, _ in _CONTROLLERS.values()]
    return ServiceResponse(
        True, "", {"types": types, "base_classes": ["controller_interface::ControllerInterface"] * len(types)}
    )


def _refuse(_: NodeContext, __: Any) -> ServiceResponse:
    raise CommandRejected(
        "the controllers of heptarm are always loaded, and none is switched",
        hint="each topic and action is followed when something comes; ~/deactivate ends all",
    )


#: Handlers by the names of the services without their namespace.
SERVICES: Mapping[str, Callable[[NodeContext, Any], ServiceResponse]] = MappingProxyType(
    {
        "list_controllers": list_controllers,
        "list_controller_types": list_types,
        "load_controller": _refuse,
        "unload_controller": _refuse,
        "switch_controller": _refuse,
        "reload_controller_libraries": _refuse,
    }
)
