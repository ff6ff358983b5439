"""`arm.fri("pose")` as a 2.x cabinet would offer it: the session's object before a tiny controller."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import heptarm as ha
from heptarm.arm.fri import Fri
from heptarm.arm.fri_settings import Request
from heptarm.fri import Missing, Policy
from heptarm.fri.messages import CommandMode
from heptarm.fri.version import Version
from heptarm.rt import Client
from heptarm.wire import messages as wire
from tests.rt.controller import Controller


class Cabinet:
    """A connection to a cabinet that opens every session at once."""

    def __init__(self) -> None:
        self.controller: Controller | None = None
        self.link = SimpleNamespace(peer="127.0.0.1:30000")
        self.clock = SimpleNamespace(nanos=time.monotonic_ns, sleep=time.sleep)
        self.handle = SimpleNamespace(id=7, done=False, wait=lambda timeout: None)

    def run(self, message: wire.FriOpen, programs: int, timeout: float) -> object:
        self.controller = Controller(message.port, wire=Version.V2_5, mode=CommandMode.CARTESIAN_POSE)
        self.running = self.controller.running()
        self.running.__enter__()
        self.controller.active()
        return self.handle

    def request(self, message: wire.FriClose) -> None:
        self.handle.done = True
        self.running.__exit__(None, None, None)


def test_a_session_of_kind_pose_takes_poses_and_nothing_else() -> None:
    message = wire.FriOpen(
        host="127.0.0.1",
        period=2e-3,
        receive_multiplier=1,
        command=wire.FriCommandMode.POSE,
        mode=None,
        timeout=10.0,
    )
    keep = Policy(Missing.HOLD)
    request = Request("pose", message, lambda: Client(0, realtime=False, policy=keep), has_law=False)
    with Fri(cast(Any, Cabinet()), request) as rt:
        goal = ha.Pose.at(0.0, 0.0, 0.01) @ rt.start.pose
        with pytest.raises(ha.ModeConflict, match=r'q is not commanded .* "pose"') as refused:
            rt.command(q=np.zeros(7))
        assert refused.value.allowed == "pose, e1"
        rt.command(pose=goal)
        deadline = time.monotonic() + 20.0
        while time.monotonic() < deadline:
            state = rt.next()
            if state is not None and state.is_answered and state.pose_sent.distance_to(goal) < 1e-9:
                break
        assert state is not None and state.pose_sent.distance_to(goal) < 1e-9
    assert any("flange: velocity limited" in line for line in rt.limited)
