"""What a node offers: heptarm's own topics, services and actions, and those of the driver that `names` selects.

A node subscribes to every topic and serves every service::

    table = offered(values)
    topics, services = TopicDispatcher(context), ServiceDispatcher(context)
    for row in table.topics:
        ...                       # under row.name with row.type: topics.handle(row, message, PublishInfo());
                                  # log a refusal
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from heptarm.ros.interface.action import RosAction
from heptarm.ros.interface.actions import ACTIONS
from heptarm.ros.interface.messages import is_installed
from heptarm.ros.interface.names import PRESETS, NameRole, PresetName
from heptarm.ros.interface.planning import moveit
from heptarm.ros.interface.presets import controller_manager, iiwa_stack
from heptarm.ros.interface.presets.libiiwa import LibiiwaServer
from heptarm.ros.interface.service import Service
from heptarm.ros.interface.services import SERVICES
from heptarm.ros.interface.topics import Topic, topics_of

#: The package with the types of MoveIt.
_MOVEIT = "moveit_msgs"


@dataclass(frozen=True, slots=True)
class OfferedInterface:
    """Rows of the tables that a node offers.

    Attributes:
        topics: that it subscribes to.
        services: that it serves.
        missing: packages with types of the other driver, or of MoveIt, that are not installed; what needs them is left
            out.
    """

    topics: tuple[Topic, ...]
    services: tuple[Service, ...]
    missing: tuple[str, ...]


def offered(values: Mapping[str, Any]) -> OfferedInterface:
    """List what a node offers.

    Args:
        values: of its parameters: `names` adds the names of another driver, `moveit` those of move_group, and
            `forward_controllers` leaves topics out.
    """
    preset = PRESETS[values["names"]]
    topics, services = list(topics_of(values)), list(SERVICES)
    server = LibiiwaServer()
    for entry in preset.entries:
        if entry.role is NameRole.JOINT:
            topics.append(Topic(entry.name, entry.type, server.joint))
        elif entry.role is NameRole.CARTESIAN:
            topics.append(Topic(entry.name, entry.type, server.pose))
        elif entry.role is NameRole.OWN_COMMAND and entry.is_available:
            topics.append(Topic(entry.name, entry.type, iiwa_stack.TOPICS[entry.last]))
        elif entry.role is NameRole.SERVICE and entry.is_available:
            services.append(_service(server, entry))
    missing = preset.missing()
    if values["moveit"] and not is_installed(_MOVEIT):
        missing = (*missing, _MOVEIT)
    elif values["moveit"]:
        topics += moveit.TOPICS
        services += moveit.SERVICES
    return OfferedInterface(tuple(topics), tuple(services), missing)


def _service(libiiwa: LibiiwaServer, entry: PresetName) -> Service:
    """The row of a service of another driver: of iiwa_stack, of lbr_stack's controller manager, or of libiiwa."""
    if entry.package == controller_manager.PACKAGE:
        return Service(entry.name, entry.type, controller_manager.SERVICES[entry.last])
    if entry.package == "iiwa_msgs":
        return Service(entry.name, entry.type, iiwa_stack.SERVICES[entry.last])
    return libiiwa.service(entry.last, entry.type)


def offered_actions(names: str, *, with_moveit: bool) -> tuple[RosAction, ...]:
    """List the actions that a node serves, except those for trajectories.

    Args:
        names: the parameter of that name; an unknown one adds nothing.
        with_moveit: the parameter `moveit`.
    """
    preset = PRESETS.get(names, PRESETS["heptarm"])
    others = moveit.ACTIONS if with_moveit and is_installed(_MOVEIT) else ()
    return (*ACTIONS, *others) + tuple(
        RosAction(entry.name, entry.type, iiwa_stack.ACTIONS[entry.last])
        for entry in preset.entries
        if entry.role is NameRole.ACTION and entry.is_available
    )
