"""`arm.fri("pose")` as a 2.x cabinet would offer it: the session object with a minimal controller."""

from __future__ import annotations

import time
from contextlib import AbstractContextManager, nullcontext
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import heptarm as ha
from heptarm.arm.fri.session import Fri
from heptarm.arm.fri.settings import FriRequest
from heptarm.arm.link.state_stream import StateFeed
from heptarm.arm.motion.handle import MotionHandle
from heptarm.arm.translate.state import read_result
from heptarm.fri.guard.fallback import Missing, Policy
from heptarm.fri.loop.client import Client
from heptarm.fri.protocol.messages import CommandMode
from heptarm.fri.protocol.version import Version
from heptarm.io.clock import RealClock
from heptarm.record.journal import Journal
from heptarm.wire import messages as wire
from tests.fri_loop.controller import Controller


class Cabinet:
    """A connection to a cabinet that opens every session at once."""

    def __init__(self) -> None:
        self.controller: Controller | None = None
        self.link = SimpleNamespace(peer="127.0.0.1:30000")
        self.clock = SimpleNamespace(nanos=time.monotonic_ns, sleep=time.sleep)
        self.journal = Journal(time.monotonic_ns)
        self.feed = StateFeed(RealClock())

    def check_may_wait(self, call: str) -> None:
        """No callback waits here."""

    def newest(self) -> None:
        """No state arrives here."""

    def enter_block(self, program: object, what: str) -> None:
        """No other block is open here."""

    def leave_block(self, program: object) -> None:
        """No other block is open here."""

    def run(self, message: wire.FriOpen, program: MotionHandle) -> None:
        self.controller = Controller(message.port, wire=Version.V2_5, mode=CommandMode.CARTESIAN_POSE)
        self.running = self.controller.running()
        self.running.__enter__()
        self.controller.active()
        self.program = program
        program.on_accepted(7)

    def request(self, message: wire.FriClose) -> None:
        end = wire.MotionFinished(
            id=message.session,
            cause=wire.Cause.CANCELLED,
            item=0,
            residual=0.0,
            duration=0.0,
            q=(0.0,) * 7,
            code=0,
        )
        self.program.on_event(end)
        self.running.__exit__(None, None, None)

    def result_of(self, message: wire.MotionFinished) -> ha.Result:
        return read_result(message, None)

    def stopping_on_interrupt(self) -> AbstractContextManager[None]:
        return nullcontext()


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
    request = FriRequest("pose", message, lambda _: Client(0, realtime=False, policy=keep), has_law=False)
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
