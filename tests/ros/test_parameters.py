"""Parameters of the nodes: what the elbow does in servo topics, and names that no node has."""

from __future__ import annotations

import time

import numpy as np
import pytest

import heptarm as ha
from heptarm import model
from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.ros.node.parameters import PARAMETERS, NodeConfiguration, unknown_text
from heptarm.ros.node.target_stream import TargetStream
from heptarm.values.robot import robot
from tests.conftest import RunningCabinet

SPEED = 1.0  # targets by the clock of this machine
HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
#: The same pose of the flange with the elbow to the side.
ASIDE = model.solve(robot("iiwa14"), model.forward(robot("iiwa14"), HOME), e1=-0.5, near=HOME)


def test_an_unknown_name_states_what_was_meant() -> None:
    with pytest.raises(
        CommandRejected, match=r"unknown parameter 'servo\.elbo'.*did you mean 'servo\.elbow'\?"
    ):
        NodeConfiguration.of({"servo.elbo": "center"})
    names = [one.name for one in PARAMETERS]
    text = unknown_text(["State_rate", "qwertz"], names)
    assert text == "unknown parameters: State_rate: did you mean 'state_rate'?; qwertz"


def test_a_posture_is_seven_numbers() -> None:
    assert NodeConfiguration.of({}).posture is None
    given = NodeConfiguration.of({"servo.posture": " ".join(map(str, ASIDE))}).posture
    assert given is not None and (given == ASIDE).all()
    for text in ("0 0.5 0", "0 0 0 0 0 0 nan", "a b c d e f g", "0,0,0,0,0,0,0"):
        with pytest.raises(ShapeError, match=r"servo\.posture must be .* seven numbers"):
            NodeConfiguration.of({"servo.posture": text})


def test_twists_of_a_topic_follow_the_posture(cabinet: RunningCabinet) -> None:
    configuration = NodeConfiguration.of({"servo.posture": " ".join(map(str, ASIDE)), "command_timeout": 2.0})
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        arm.move(ha.ptp(HOME), speed=1.0)
        start = arm.state
        servo = configuration.servo
        with pytest.raises(LimitError, match="A1 must be in"):
            TargetStream(arm, posture=np.full(7, 3.0), timeout=2.0, options=servo)
        stream = TargetStream(arm, posture=configuration.posture, timeout=2.0, options=servo)
        deadline = time.monotonic() + 60.0
        while abs(arm.state.q[2] + 0.5) > 0.05 and time.monotonic() < deadline:
            stream.twist(np.zeros(6))
            time.sleep(0.02)
        stream.close()
        assert np.abs(arm.state.q - ASIDE).max() < 0.1, "the joints go to the posture"
        assert arm.state.pose.distance_to(start.pose) < 1e-2, "velocities hold no pose exactly"
        stream.pose(start.pose)
        assert (stream._opened["posture"] == ASIDE).all()
        stream.close()
