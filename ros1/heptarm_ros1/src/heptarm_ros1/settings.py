"""The node's parameters on ROS' parameter server, where names have slashes instead of dots."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import rospy

from heptarm.bridge import parameters
from heptarm.bridge.names import PRESETS

#: What others keep below the node's name.
_FOREIGN = ("follow_joint_trajectory",)


def read() -> tuple[dict[str, Any], tuple[str, ...]]:
    """The private parameters that are set, with the defaults of another driver's names under them.

    Returns:
        Those that the node has, by their names with dots; and the names that it does not know.
    """
    found = dict(_flat(rospy.get_param("~", {})))
    preset = PRESETS.get(str(found.get("names", "")))
    if preset is not None:
        found = {**preset.defaults, **found}
    known = {one.name for one in parameters.PARAMETERS}
    joints = found.get(
        "joint_names", next(one.default for one in parameters.PARAMETERS if one.name == "joint_names")
    )
    if isinstance(joints, list):
        known |= {one.name for one in parameters.of_joints([str(joint) for joint in joints])}
    strange = tuple(sorted(set(found) - known))
    return {name: value for name, value in found.items() if name in known}, strange


def _flat(tree: Mapping[str, Any], above: str = "") -> list[tuple[str, Any]]:
    out: list[tuple[str, Any]] = []
    for name, value in tree.items():
        if isinstance(value, dict):
            if above or name not in _FOREIGN:
                out += _flat(value, f"{above}{name}.")
        else:
            out.append((above + name, value))
    return out
