"""Teleoperation with synthetic devices: dead-man switch, gripper, frames, walls, and the command line on a terminal."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import devices, model, skills
from heptarm.errors import NotReady
from tests.conftest import RunningCabinet
from tests.retry import busy, retry
from tests.simulators import FASTER

pytestmark = pytest.mark.slow
SPEED = FASTER

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
LEFT = [0, 1.0, 0, 0, 0, 0]
ROLES = devices.Roles(dead_man="LB", gripper="A", quit="START")


@pytest.fixture(scope="module")
def arm(cabinet: RunningCabinet) -> Iterator[ha.Arm]:
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        yield arm


@pytest.fixture(autouse=True)
def at_home(arm: ha.Arm) -> None:
    arm.workspace = None
    if np.abs(arm.state.q - HOME).max() > 1e-3:
        arm.move(ha.ptp(HOME), speed=1.0)


class Person(devices.SyntheticDevice):
    """A person who decides by what has happened: called with the number of the reading."""

    readings: int

    def __init__(self, decide: Callable[[int], devices.DeviceInput]) -> None:
        self.readings = 0

        def play(_: float) -> devices.DeviceInput:
            self.readings += 1
            return decide(self.readings)

        super().__init__(play, roles=ROLES)


class Recorder:
    """A gripper that notes what it was commanded."""

    def __init__(self) -> None:
        self.is_open, self.commands = True, list[str]()

    def open(self) -> None:
        self.is_open = True
        self.commands.append("open")

    def close(self) -> None:
        self.is_open = False
        self.commands.append("close")

    @property
    def holds_something(self) -> bool:
        return False


def of(twist: list[float], *buttons: str) -> devices.DeviceInput:
    return devices.DeviceInput.of(twist, buttons)


def test_the_arm_moves_while_the_dead_man_button_is_held_and_ends_by_the_quit_button(arm: ha.Arm) -> None:
    y, speed = arm.state.pose.y, 0.1
    looks: list[float] = []

    def decide(reading: int) -> devices.DeviceInput:
        looks.append(time.monotonic())
        if reading < 20:
            assert abs(arm.state.pose.y - y) < 1e-3, "the stick alone moves nothing"
            return of(LEFT)
        return of(LEFT, "LB") if arm.state.pose.y < y + 0.03 else of(LEFT, "START", "LB")

    stats = skills.teleoperate(arm, Person(decide), scale=speed, watchdog=2.0, duration=60.0)
    moved = arm.wait_for_rest().pose
    # a target that comes late is passed and come back to, and the arm moves on while nobody looks
    unseen = speed * float(np.diff(looks).max())
    assert 0.02 < moved.y - y < 0.06 + unseen and abs(moved.z - arm.state.pose.z) < 2e-3
    assert stats.sent > 0 and stats.refused == 0


def test_a_dead_man_button_that_is_stuck_moves_nothing_until_it_was_released(arm: ha.Arm) -> None:
    y = arm.state.pose.y
    released: list[float] = []

    def decide(reading: int) -> devices.DeviceInput:
        if reading < 30:
            return of(LEFT, "LB")
        if not released:
            released.append(arm.state.pose.y)
            return of(LEFT)
        return of(LEFT, "LB") if arm.state.pose.y < y + 0.01 else of(LEFT, "START")

    skills.teleoperate(arm, Person(decide), watchdog=2.0, duration=60.0)
    assert abs(released[0] - y) < 1e-3 and arm.state.pose.y > y + 0.009


def test_the_gripper_button_works_once_per_press(arm: ha.Arm) -> None:
    gripper = Recorder()
    script = [of(LEFT)] + 3 * [of(LEFT, "A")] + 2 * [of(LEFT)] + 3 * [of(LEFT, "A")] + [of(LEFT, "START")]
    person = Person(lambda reading: script[min(reading, len(script)) - 1])
    skills.teleoperate(arm, person, gripper=gripper, watchdog=2.0, duration=60.0)
    assert gripper.commands == ["close", "open"]


def test_a_wall_that_refuses_does_not_end_it(arm: ha.Arm) -> None:
    x, y, z = arm.state.pose.xyz
    arm.workspace = ha.Workspace(((x - 0.2, y - 0.2, z - 0.2), (x + 0.2, y + 0.02, z + 0.2)), mode="refuse")
    still: list[float] = []

    def decide(_: int) -> devices.DeviceInput:
        still.append(arm.state.pose.y)
        rests = len(still) > 40 and still[-1] > y + 0.01 and abs(still[-1] - still[-20]) < 1e-4
        return of(LEFT, "START") if rests else of(LEFT)

    skills.teleoperate(arm, Person(decide), scale=0.1, dead_man="", watchdog=2.0, duration=60.0)
    assert max(still) < y + 0.022


def test_a_device_that_is_gone_is_an_error_and_the_arm_rests(arm: ha.Arm) -> None:
    y = arm.state.pose.y

    def decide(_: int) -> devices.DeviceInput:
        if arm.state.pose.y > y + 0.01:
            raise NotReady("the gamepad cannot be read: No such device")
        return of(LEFT)

    with pytest.raises(NotReady, match="gamepad"):
        skills.teleoperate(arm, Person(decide), scale=0.1, dead_man="", watchdog=2.0, duration=60.0)
    assert np.abs(arm.wait_for_rest().dq).max() < 2e-3


def test_the_elbow_follows_a_posture(arm: ha.Arm) -> None:
    start = arm.state.pose
    posture = model.solve(arm.robot, start, e1=-0.5, near=HOME)

    def decide(_: int) -> devices.DeviceInput:
        state = arm.state
        is_there = (
            state.q[2] < -0.49 and np.abs(state.dq).max() < 0.01
        )  # a stop on the way would leave the pose
        return of([0.0] * 6, *(["START"] if is_there else []))

    skills.teleoperate(
        arm,
        Person(decide),
        dead_man="",
        posture=posture,
        watchdog=2.0,
        duration=60.0,
    )
    assert arm.state.q[2] < -0.49 and arm.state.pose.distance_to(start) < 1e-2
    with pytest.raises(ha.HeptarmError, match="elbow"):
        skills.teleoperate(arm, Person(lambda _: of(LEFT)), elbow="sideways")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("settings", "word"),
    [({"scale": 0.0}, "scale"), ({"turn_scale": 9.0}, "turn_scale"), ({"duration": -1.0}, "duration")],
)
def test_bad_settings_are_refused_by_name(arm: ha.Arm, settings: dict[str, Any], word: str) -> None:
    with pytest.raises(ha.LimitError, match=word):
        skills.teleoperate(arm, Person(lambda _: of(LEFT)), **settings)
    with pytest.raises(ha.ShapeError, match="device must be an input device"):
        skills.teleoperate(arm, "gamepad")  # type: ignore[arg-type]


def test_heptarm_jog_moves_by_the_keys_of_a_terminal(arm: ha.Arm, cabinet: RunningCabinet) -> None:
    command = [sys.executable, "-m", "heptarm.cli.main", "jog", "--target", cabinet.target, "--scale", "0.1"]
    command += ["--elbow", "center"]

    def attempt() -> subprocess.CompletedProcess[str]:
        y = arm.state.pose.y
        person, terminal = os.openpty()
        child = subprocess.Popen(
            command, stdin=terminal, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        try:
            assert child.stdout is not None and "w s: x" in child.stdout.readline()
            deadline = time.monotonic() + 60.0
            while arm.state.pose.y < y + 0.02 and time.monotonic() < deadline and child.poll() is None:
                os.write(person, b"a")
                select.select([person], [], [], 0.04)
            moved = arm.state.pose.y > y + 0.02
            os.write(person, b"q")
            output, complaint = child.communicate(timeout=60.0)
            assert moved or child.returncode != 0
            return subprocess.CompletedProcess(command, child.returncode, output, complaint)
        finally:
            child.kill()
            child.wait()
            os.close(person)
            os.close(terminal)

    arm.release_control()
    try:
        done = retry(attempt, busy)
        assert done.returncode == 0 and "sent" in done.stdout, done.stderr
    finally:
        arm.take_control()
