"""Messages of a state: only those of topics with a subscriber are made, of groups that are decoded for them alone."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from heptarm.ros.interface.state_messages import StateMessages
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values.state import Groups, Joints, State, Torques

ZEROS = np.zeros(7)
TOPICS = ("joint_states", "external_torques", "pose", "wrench", "state")


class Source:
    """The groups of a received state; notes which ones are made."""

    stamp = 1

    def __init__(self) -> None:
        self.made: list[str] = []

    def make(self, name: str) -> Any:
        self.made.append(name)
        kind = {"joints": Joints, "torques": Torques}.get(name)
        return None if kind is None else kind(1, ZEROS, ZEROS, ZEROS)


def message(**fields: Any) -> SimpleNamespace:
    return SimpleNamespace(header=SimpleNamespace(), **fields)


@pytest.mark.parametrize(
    ("wanted", "made"),
    [
        ((), {"joints"}),  # for their time stamp
        (("joint_states",), {"joints", "torques"}),
        (("external_torques",), {"joints", "torques"}),
        (("pose",), {"joints", "pose"}),
        (("wrench",), {"joints", "wrench"}),
    ],
)
def test_what_has_no_subscriber_is_not_made(wanted: tuple[str, ...], made: set[str]) -> None:
    ros: Any = SimpleNamespace(joint_state=message, now=lambda: 10**9, time=lambda stamp: stamp, doubles=list)
    messages = StateMessages(
        ros, NodeConfiguration.of({}), stamped=(message, message), state=message, status=message
    )
    source, asked = Source(), []

    def is_wanted(topic: str) -> bool:
        asked.append(topic)
        return topic in wanted

    state = State(Groups.of(source), 1, lambda: 1)
    found = [name for name, _ in messages.states(state, is_wanted)]
    assert found == [name for name in wanted if name in ("joint_states", "external_torques")]
    assert set(source.made) == made and len(source.made) == len(made)
    assert tuple(asked) == TOPICS
