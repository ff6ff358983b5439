"""Launch files: read by roslaunch, and the node started by it."""

from __future__ import annotations

import subprocess
from pathlib import Path

from heptarm_msgs.msg import Status
from sensor_msgs.msg import JointState

from tests.conformance.stage import Stage
from tests.ros1.peer import collect, until


def roslaunch(*words: str) -> str:
    done = subprocess.run(["roslaunch", *words], capture_output=True, text=True, timeout=200, check=True)
    return done.stdout


def test_two_arms_are_two_nodes(ros: None) -> None:
    said = roslaunch("--nodes", "heptarm_ros1", "two_arms.launch")
    assert {"/left/heptarm", "/right/heptarm"} <= set(said.split())


def test_arguments_are_explained(ros: None) -> None:
    said = roslaunch("--ros-args", "heptarm_ros1", "heptarm.launch")
    for argument in ("target", "key_file", "prefix", "names", "params"):
        assert f"  {argument}" in said, said


def test_the_node_is_started_with_its_parameters(ros: None, spare: Stage, tmp_path: Path) -> None:
    values = tmp_path / "arm.yaml"
    values.write_text("state_rate: 50.0\nservo:\n  rate: 50.0\n")
    command = ["roslaunch", "--wait", "heptarm_ros1", "heptarm.launch"]
    command += [
        "description:=false",
        f"target:={spare.target}",
        "name:=launched",
        "prefix:=l_",
        f"params:={values}",
    ]
    process = subprocess.Popen(
        [*command, "__ns:=launch"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        status = collect("/launch/launched/status", Status)
        states = collect("/launch/joint_states", JointState)
        until(lambda: status and status[-1].active and states, "the node does not start")
        assert states[-1].name == [f"l_A{i}" for i in range(1, 8)]
    finally:
        process.terminate()
        process.wait(60)
