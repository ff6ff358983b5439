"""The operator of the virtual cabinet: commands, their times, and unknown commands."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from heptarm.planning import seam
from heptarm.planning.seam import OperationMode, SafetyFlags, StateWords
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.scene import Scene
from heptarm.sim.runtime.operator import WORDS, SimulatedOperator, timed, understood
from tests.sim.driving import Ear, ready
from tests.sim.ideal import KINDS, begin


@pytest.mark.parametrize("words", sorted(WORDS))
def test_every_word_of_the_help_is_understood(words: str) -> None:
    for one in words.split(","):
        name = one.split()[0]
        values = {
            "override": ["0.5"],
            "push": ["1", "2", "3"],
            "set": ["Cell.Door", "true"],
            "where": ["peg"],
            "place": ["peg", "0.5", "0", "0.3"],
            "press": ["0"],
            "answer": ["1"],
        }.get(name, [])
        assert understood(" ".join([name, *values]))[0] == name


@pytest.mark.parametrize(
    ("words", "expected_text"),
    [
        ("", "actions are"),
        ("explode", "emergency_stop"),
        ("override", "1 to 1 values"),
        ("override 2", "must be in \\[0, 1\\]"),
        ("override half", "numbers"),
        ("drive_error 8", "1 to 7"),
        ("push 1 2", "3 to 4"),
        ("clear everything", "emergency_stop"),
        ("t1 now", "0 to 0 values"),
        ("set Cell.Door", "2 to 2"),
        ("set Cell.Door ajar", "true or false"),
        ("set Cell.Door 1", "unknown or ambiguous"),
        ("press 4", "slot must be"),
        ("press 1 heptarm third", "no user key 1 in a bar 'heptarm third'"),
        ("press 1", "no user key 1 that only one bar has.*there are: none"),
        ("answer 0", "no open dialog"),
        ("place peg 1 2", "4 to 8 values"),
        ("place peg 1 2 here", "three numbers, or seven with a unit quaternion"),
        ("place peg 1 2 3 0 0 0 2", "three numbers, or seven with a unit quaternion"),
        ("place peg 1 2 3", "there is no scene"),
    ],
)
def test_what_is_not_understood_changes_nothing(words: str, expected_text: str) -> None:
    plant = ready()
    with pytest.raises(ValueError, match=expected_text):
        SimulatedOperator(plant).do(words)
    assert not plant.safety.latched and plant.safety.mode is OperationMode.AUT


def test_faults_come_at_their_time_and_go() -> None:
    plant = begin("hold")
    operator = SimulatedOperator(plant)
    operator.schedule("clear@0.3")
    operator.schedule("e-stop @ 0.1 s")
    halted = []
    for _ in range(400):
        operator.tick()
        plant.tick()
        halted.append(plant.safety.stop_requested)
    assert halted.index(True) in range(98, 102) and sum(halted) == 200
    with pytest.raises(ValueError, match="NAME@SECONDS"):
        timed("emergency_stop")
    with pytest.raises(ValueError, match="not understood"):
        operator.schedule("explode@1")


def test_two_stops_are_cleared_one_by_one() -> None:
    plant = ready()
    operator = SimulatedOperator(plant)
    operator.do("gate")
    operator.do("external_emergency_stop")
    plant.step()
    flags = int(plant.shared.ints[1, StateWords.FLAGS])
    assert flags & SafetyFlags.EXTERNAL_STOP and flags & SafetyFlags.SAFEGUARD_OPEN
    operator.do("clear gate")
    assert plant.safety.stop_requests == {StopRequest.EXTERNAL_EMERGENCY_STOP}
    operator.do("clear")
    assert not plant.safety.stop_requests and plant.safety.latched
    operator.do("start")
    assert not plant.safety.latched


@pytest.mark.parametrize(
    ("words", "text"),
    [("joint_limit 4", "limit A4"), ("singularity", "singularity"), ("drive_error 3", "drive error in A3")],
)
def test_errors_end_what_runs_off_its_path(words: str, text: str) -> None:
    plant, ear = begin("hold"), Ear()
    operator = SimulatedOperator(plant)
    operator.do(words)  # nothing runs but the hold
    plant.stop()
    plant.safety.withdraw()
    plant.resume()
    while not plant.idle:
        plant.tick()
    plant.submit(MotionCommand(2, KINDS["ptp"].motion, listener=ear))
    for _ in range(400):
        plant.tick()
    fast = np.abs(plant.speed).max()
    operator.do(words)
    while not plant.idle:
        plant.tick()
    assert ear.causes == ["started", "error"] and text in ear.heard[-1][1] and fast > 0.5


def test_a_push_ends_by_itself() -> None:
    plant = ready()
    SimulatedOperator(plant).do("push 0 20 0 0.1")
    plant.step(80)
    assert plant.snapshot.wrench[1] == pytest.approx(20.0, abs=0.5)
    plant.step(100)
    assert np.abs(plant.snapshot.wrench).max() < 0.5


def test_signals_are_set_and_keys_pressed_also_at_a_time() -> None:
    plant = ready()
    operator = SimulatedOperator(plant)
    place = plant.signals.place("Cell.Door", is_output=False)
    plant.signals.place("Flange.Door", is_output=False)
    pressed: list[tuple[str, int]] = []
    operator.press = lambda bar, slot: not pressed.append((bar, slot))
    operator.schedule("set cell.door true@0.01")
    operator.schedule("set Cell.Lid true@0.01")  # there is none: the arm continues
    for _ in range(20):
        operator.tick()
        plant.tick()
    assert plant.shared.signals[place] == plant.signals.get("Cell.Door") == 1.0
    with pytest.raises(ValueError, match="ambiguous"):
        operator.do("set Door 0")
    operator.do("press 2")
    operator.do("press 0 heptarm")
    operator.do("press 1 heptarm second")
    operator.do("press 1 My keys")
    assert pressed == [("", 2), ("heptarm", 0), ("heptarm", 5), ("My keys", 1)]
    assert plant.signals.names == ("Cell.Door", "Flange.Door")


def test_signals_that_are_set_at_once_are_edges_all_the_same() -> None:
    plant = ready()
    operator = SimulatedOperator(plant)
    place = plant.signals.place("Station.Start", is_output=False)
    edges: list[bool] = []
    plant.condition_monitor.observe(seam.SignalIs(place=place, value=True), edges.append, at_once=False)
    plant.step()

    def type_lines() -> None:
        for value in (1, 0) * 5:
            operator.do(f"set Station.Start {value}")
            operator.await_tick()

    typing = threading.Thread(target=type_lines)
    typing.start()
    while typing.is_alive():
        plant.step()
        time.sleep(0.005)  # a machine with other work
    plant.step(2)
    assert edges == [True, False] * 5


def test_after_an_action_the_robots_flags_are_known() -> None:
    plant, flags = Plant(), list[int]()
    plant.on_safety = lambda new, _: flags.append(new)
    operator = SimulatedOperator(plant)
    plant.step()
    choosing = threading.Thread(target=lambda: (operator.do("t1"), operator.await_tick()))
    choosing.start()
    while choosing.is_alive():
        plant.step()
        time.sleep(0.005)  # a machine with other work
    assert flags[-1] & SafetyFlags.PAUSED


def test_free_bodies_are_placed_and_put_back() -> None:
    plant = Plant(scene=Scene.of("table"))
    operator = SimulatedOperator(plant)
    start = plant.body_pose("cube")
    operator.do("place cube 0.6 0.05 0.3 0 0 0.70710678 0.70710678")
    operator.do("place can 0.65 -0.2 0.236")
    plant.step(2)
    np.testing.assert_allclose(
        plant.body_pose("cube"), (0.6, 0.05, 0.3, 0, 0, 0.70710678, 0.70710678), atol=1e-4
    )
    np.testing.assert_allclose(plant.body_pose("can")[:3], (0.65, -0.2, 0.236), atol=1e-4)
    plant.step(300)
    assert abs(plant.body_pose("cube")[2] - 0.22) < 1e-3, "it fell onto the table"
    operator.do("reset")
    plant.step(2)
    np.testing.assert_allclose(plant.body_pose("cube"), start, atol=1e-4)
    with pytest.raises(ValueError, match=r"table is fixed in the scene .*free are: cube, block, can"):
        operator.do("place table 0 0 0")
