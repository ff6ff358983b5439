"""Reads the node's parameters from the parameter server, where names have slashes instead of dots."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import rospy

from heptarm.ros.interface.names import PRESETS, Preset
from heptarm.ros.node.parameters import PARAMETERS, joint_parameters, unknown_text

#: Names below the node's own that belong to others.
_FOREIGN = ("follow_joint_trajectory",)


def read() -> tuple[dict[str, Any], str]:
    """Read the private parameters, with the defaults of the preset `names`.

    Returns:
        Known parameters by their names with dots, and a warning that names unknown ones; "" if there are none.
    """
    found = {**preset().defaults, **dict(_flat(rospy.get_param("~", {})))}
    known = {one.name for one in PARAMETERS}
    joints = found.get("joint_names", next(one.default for one in PARAMETERS if one.name == "joint_names"))
    if isinstance(joints, list):
        known |= {one.name for one in joint_parameters([str(joint) for joint in joints])}
    unknown = sorted(set(found) - known)
    warning = unknown_text(unknown, known) if unknown else ""
    return {name: value for name, value in found.items() if name in known}, warning


def preset() -> Preset:
    """Look up the preset of the parameter `names`; an unknown name is refused later, with the other parameters."""
    return PRESETS.get(str(rospy.get_param("~names", "heptarm")), PRESETS["heptarm"])


def _flat(tree: Mapping[str, Any], above: str = "") -> list[tuple[str, Any]]:
    out: list[tuple[str, Any]] = []
    for name, value in tree.items():
        if isinstance(value, dict):
            if above or name not in _FOREIGN:
                out += _flat(value, f"{above}{name}.")
        else:
            out.append((above + name, value))
    return out
