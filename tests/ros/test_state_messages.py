"""Messages of a state: only those of topics with a subscriber are made, of groups that are decoded for them alone."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from heptarm.fri import CommandMode, Quality, SessionState
from heptarm.fri import State as FriState
from heptarm.fri.loop import shared_memory
from heptarm.ros.interface.names import PRESETS, NameRole
from heptarm.ros.interface.state_messages import StateMessages, preset_message
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


def test_lbr_state_has_the_open_fri_session() -> None:
    words = np.zeros(shared_memory.STATE_WORDS)
    numbers = words.view(np.int64)
    numbers[shared_memory.S_SESSION] = SessionState.COMMANDING_ACTIVE
    numbers[shared_memory.S_QUALITY] = Quality.EXCELLENT
    numbers[shared_memory.S_MODE] = CommandMode.POSITION
    numbers[shared_memory.S_PERIOD] = 5_000_000
    words[shared_memory.S_TRACKING] = 0.9
    words[shared_memory.ARRAYS["q_ipo"]] = np.arange(7.0)
    entry = next(one for one in PRESETS["lbr_stack"].entries if one.role is NameRole.LBR_STATE)
    ros: Any = SimpleNamespace(now=lambda: 10**9, time=lambda stamp: stamp)
    state = State(Groups.of(Source()), 1, lambda: 1)

    def made(fri: FriState | None) -> SimpleNamespace:
        lbr: SimpleNamespace = preset_message(
            ros, entry, lambda: message(session_state=0), state, NodeConfiguration.of({}), fri
        )
        return lbr

    assert made(None).session_state == 0
    found = made(FriState(words))
    assert (found.session_state, found.connection_quality, found.client_command_mode) == (4, 3, 1)
    assert (found.sample_time, found.tracking_performance) == (0.005, 0.9)
    assert found.ipo_joint_position == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
