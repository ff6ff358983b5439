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
from heptarm.ros.trajectory.goal import Tolerance, TrajectoryGoal
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


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"joint_names": [f"A{i}" for i in range(1, 7)]}, "seven different names, got A1, A2"),
        ({"joint_names": ["A1"] * 7}, "seven different names, got A1, A1"),
        ({"joint_names": []}, "seven different names, got none"),
        ({"target": "sim://iiwa99"}, "target must be an address or a simulator"),
        ({"target": "robot:port"}, "target must be an address or a simulator"),
    ],
)
def test_what_no_other_attempt_mends_is_refused_before_the_first(
    values: dict[str, object], words: str
) -> None:
    with pytest.raises(ha.HeptarmError, match=words):
        NodeConfiguration.of(values)


@pytest.mark.parametrize("own", ["lbr_A", "A", "left_joint_"])
def test_joints_of_lbr_stack_have_their_names_of_all_its_versions(own: str) -> None:
    names = [f"{own}{i}" for i in range(1, 8)]
    configuration = NodeConfiguration.of({"names": "lbr_stack", "joint_names": names})
    for sent in ("lbr_A", "A", own):
        assert configuration.own([f"{sent}{i}" for i in range(7, 0, -1)]) == tuple(reversed(names))
    assert configuration.own(["A8", "x"]) == ("A8", "x")
    assert NodeConfiguration.of({}).own(["lbr_A1", "A1"]) == ("lbr_A1", "A1"), "of lbr_stack alone"

    goal = TrajectoryGoal(
        tuple(f"A{i}" for i in range(1, 8)), (), goal_tolerance=(Tolerance("A7", position=0.1),)
    ).renamed(configuration.own)
    assert goal.joints == tuple(names) and goal.goal_tolerance == (Tolerance(names[6], position=0.1),)


def test_twists_of_a_topic_follow_the_posture(cabinet: RunningCabinet) -> None:
    configuration = NodeConfiguration.of({"servo.posture": " ".join(map(str, ASIDE)), "command_timeout": 2.0})
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        arm.move(ha.ptp(HOME), speed=1.0)
        start = arm.state
        servo = configuration.servo
        with pytest.raises(LimitError, match="A1 must be in"):
            TargetStream(arm, posture=np.full(7, 3.0), timeout=2.0, options=servo, shortest=0.13)
        stream = TargetStream(arm, posture=configuration.posture, timeout=2.0, options=servo, shortest=0.13)
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
