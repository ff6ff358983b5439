"""What the panel does to an arm, without a browser: every action is seen by a second client."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm.arm.watchdog import TARGETS
from heptarm.errors import (
    CollisionForeseen,
    CommandRejected,
    LimitError,
    ModeConflict,
    MotionAborted,
    NoPath,
)
from heptarm.model.kinematics import forward
from heptarm.panel.jog import Jog, JointJog, PoseJog, TwistJog
from heptarm.panel.model import PanelArm
from heptarm.panel.process import PanelOptions, model_of, shapes_of
from heptarm.record.mcap_file import RecordingFile
from heptarm.sim.plant.scene import Scene
from heptarm.values.pose import Pose
from heptarm.values.state import State
from tests.cli.running import run

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
PATIENCE = 30.0


@pytest.fixture(scope="module")
def started(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PanelArm]:
    options = PanelOptions(
        recordings=tmp_path_factory.mktemp("recordings"),
        gripper="open=MediaFlange.OutputX3Pin1",
        scene="table",
    )
    with (
        pytest.MonkeyPatch.context() as patch,
        ha.connect("sim://iiwa14?speed=2", control=False, watchdog=5.0, timeout=PATIENCE) as arm,
    ):
        patch.setattr(
            "heptarm.arm.motion.servo.TARGETS", replace(TARGETS, default=2.0)
        )  # as on a busy machine
        model = model_of(arm, "sim://iiwa14?speed=2", options)
        yield model
        model.close()


@pytest.fixture(scope="module")
def observer(started: PanelArm) -> Iterator[ha.Arm]:
    with ha.connect(address(started), control=False, watchdog=5.0, timeout=PATIENCE) as arm:
        yield arm


@pytest.fixture
def model(started: PanelArm) -> Iterator[PanelArm]:
    """The panel's arm in control and at home, with an empty list of points."""
    started.operate("clear")
    if not started.arm.in_control:
        started.take_control()
    started.recover()
    until(lambda: not started.poll().is_jogging)
    if abs(started.arm.state.q - HOME).max() > 1e-3:
        started.arm.move(ha.ptp(HOME))
    for point in tuple(started.points):
        started.points.delete(point.name)
    yield started


def address(model: PanelArm) -> str:
    cabinet = model.arm.connection.cabinet
    assert cabinet is not None
    return f"sim://{cabinet.host}:{cabinet.port}"


def until(condition: Callable[[], object], *, meanwhile: Callable[[], object] = lambda: None) -> None:
    """Wait until a condition holds, doing something ten times a second as a held button does."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "it never happened"
        meanwhile()
        time.sleep(0.05)


def held(model: PanelArm, jog: Jog, condition: Callable[[], object], owner: object = None) -> None:
    until(condition, meanwhile=lambda: model.jog(jog, owner))


def resting(model: PanelArm, observer: ha.Arm) -> State:
    """What the second client sees once the arm rests, not what it saw while its states were still on the way."""
    rest = model.arm.wait_for_rest(timeout=PATIENCE)
    until(lambda: observer.state.stamp >= rest.stamp)
    return observer.state


def at_rest(model: PanelArm, observer: ha.Arm) -> State:
    until(lambda: not model.poll().is_jogging)
    return resting(model, observer)


# ------------------------------------------------------------------------------------------- looking


def test_it_shows_what_a_second_client_sees(model: PanelArm, observer: ha.Arm) -> None:
    until(lambda: model.poll().is_connected)
    seen = resting(model, observer)
    readout = model.poll()
    assert readout.state is not None and readout.tcp is not None
    assert readout.state.q == pytest.approx(seen.q, abs=1e-4)
    assert readout.tcp.distance_to(seen.pose) < 1e-3
    assert readout.is_virtual and readout.in_control and readout.stands == ()
    assert set(readout.state.io) == set(observer.io)


def test_the_history_of_the_force_has_a_push(model: PanelArm) -> None:
    model.operate("push 0 0 -25 2")
    until(lambda: model.forces[1].size and model.forces[1].max() > 15.0, meanwhile=model.poll)
    times, forces = model.forces
    assert (
        times.shape == forces.shape and (np.diff(times) >= 0).all() and times[0] >= -10.5 and times[-1] <= 0.0
    )
    model.operate("push 0 0 0 0.01")


def test_it_takes_and_gives_control(model: PanelArm, observer: ha.Arm) -> None:
    name = model.arm.connection.options.name
    until(lambda: observer.controller == name)
    model.release_control()
    until(lambda: observer.controller == "")
    assert not model.poll().in_control
    model.take_control()
    until(lambda: observer.controller == name)


# ------------------------------------------------------------------------------------------- jogging


def test_a_joint_turns_while_its_button_is_held_and_no_longer(model: PanelArm, observer: ha.Arm) -> None:
    velocity = np.zeros(7)
    velocity[3] = 0.2
    before = resting(model, observer).q
    held(model, JointJog(velocity), lambda: observer.state.q[3] > before[3] + 0.05)
    assert model.poll().is_jogging
    rest = at_rest(model, observer)  # nobody released it: silence is enough
    assert rest.q[3] > before[3] + 0.05
    assert np.delete(rest.q - before, 3) == pytest.approx(np.zeros(6), abs=2e-3)
    assert len(model.path) > 1


@pytest.mark.parametrize(("frame", "axis"), [("base", (0, 0, 1)), ("tool", (0, 0, 1))])
def test_the_tcp_moves_along_the_axes_of_a_frame(
    model: PanelArm, observer: ha.Arm, frame: str, axis: tuple[int, ...]
) -> None:
    before = resting(model, observer).pose
    along = (before.rotation if frame == "tool" else np.eye(3)) @ np.array(axis)
    jog = TwistJog(np.array((*(-0.1 * np.array(axis)), 0, 0, 0)), frame)
    poses: list[Pose] = []

    def has_moved() -> bool:
        poses.append(observer.state.pose)
        return bool((poses[-1].xyz - before.xyz) @ along < -0.02)

    held(model, jog, has_moved)
    model.end_jog()
    after = at_rest(model, observer).pose
    for pose, off, turned in (
        (poses[-1], 2e-3, 0.01),
        (after, 5e-3, 0.05),
    ):  # each axis brakes by itself at the end
        moved = pose.xyz - before.xyz
        assert np.linalg.norm(moved - along * (moved @ along)) < off and pose.angle_to(before) < turned


def test_the_tcp_turns_about_its_own_origin(model: PanelArm, observer: ha.Arm) -> None:
    before = resting(model, observer).pose
    held(
        model,
        TwistJog(np.array((0, 0, 0, 0, 0, 0.3)), "tool"),
        lambda: observer.state.pose.angle_to(before) > 0.1,
    )
    model.end_jog()
    after = at_rest(model, observer).pose
    assert after.distance_to(before) < 3e-3
    turned = before.rotation.T @ after.rotation  # about z of the tool
    assert turned[2, 2] == pytest.approx(1.0, abs=1e-3) and turned[1, 0] > 0.05


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """A button counts as held for so long after each message that a busy machine does not release it."""
    monkeypatch.setattr("heptarm.panel.jog.HOLD", 5.0)


@pytest.mark.usefixtures("patient")
def test_it_goes_to_a_pose_and_stays_there(model: PanelArm, observer: ha.Arm) -> None:
    goal = resting(model, observer).pose.shifted(0.02, 0.03, -0.02).rotated(a=0.1)

    def is_there() -> bool:
        state = observer.state
        is_still = abs(state.dq).max() < 5e-3
        return is_still and state.pose.distance_to(goal) < 1e-3 and state.pose.angle_to(goal) < 5e-3

    held(model, PoseJog(goal, 0.5), is_there)
    model.end_jog()
    assert at_rest(model, observer).pose.distance_to(goal) < 2e-3


@pytest.mark.usefixtures("patient")
def test_only_one_page_jogs(model: PanelArm, observer: ha.Arm) -> None:
    jog = JointJog(np.array((0.1, 0, 0, 0, 0, 0, 0)))
    held(model, jog, lambda: model.poll().is_jogging, owner=1)
    with pytest.raises(CommandRejected, match="another page is moving the arm"):
        model.jog(jog, 2)
    model.end_jog(2)  # closing the other page ends nothing
    model.jog(jog, 1)
    model.end_jog(1)
    at_rest(model, observer)


@pytest.mark.usefixtures("patient")
def test_jogging_without_control_is_one_message_for_a_press(model: PanelArm) -> None:
    model.release_control()
    jog = JointJog(np.array((0.1, 0, 0, 0, 0, 0, 0)))
    held(
        model,
        jog,
        lambda: (m := model.poll().message) is not None and "control" in m.what and m.level == "error",
    )
    first = model.poll().message
    for _ in range(5):
        model.jog(jog)
        time.sleep(0.05)
    assert model.poll().message is first
    assert not model.poll().is_jogging


@pytest.mark.parametrize(
    "make",
    [
        lambda: JointJog(np.array((0.6, 0, 0, 0, 0, 0, 0))),
        lambda: TwistJog(np.array((0.3, 0, 0, 0, 0, 0))),
        lambda: TwistJog(np.array((0, 0, 0, 0.7, 0, 0))),
    ],
)
def test_what_is_too_fast_is_refused(make: Callable[[], Jog]) -> None:
    with pytest.raises(LimitError, match=r"must be in \[-0\.\d+, 0\.\d+\]"):
        make()


# ------------------------------------------------------------------------------------------ stopping


def test_stop_works_without_control(
    model: PanelArm, observer: ha.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    model.release_control()
    with ha.connect(address(model), name="program", watchdog=5.0, timeout=PATIENCE) as program:
        handle = program.start(ha.ptp(ha.deg(90, 30, 0, -90, 0, 60, 0), speed=0.05))
        observer.wait_until(lambda state: state.q[0] > 0.02, timeout=PATIENCE)
        ended: list[str] = []
        monkeypatch.setattr(model.wizard, "end", lambda: ended.append("a measurement"))
        model.stop()
        assert ended, "between two of its motions there is none that could be stopped"
        with pytest.raises(MotionAborted):
            handle.wait(timeout=PATIENCE)
        assert observer.wait_for_rest(timeout=PATIENCE).q[0] < 1.0
    last = model.poll().last_stop
    assert last is not None and "panel" in last.what


@pytest.mark.usefixtures("patient")
def test_stop_ends_jogging_although_the_button_is_held(model: PanelArm, observer: ha.Arm) -> None:
    jog = JointJog(np.array((0.2, 0, 0, 0, 0, 0, 0)))
    held(model, jog, lambda: observer.state.q[0] > 0.02, "somebody")
    model.stop()
    for _ in range(8):
        model.jog(jog, "somebody")
        time.sleep(0.05)
    until(lambda: not model.poll().is_jogging, meanwhile=lambda: model.jog(jog, "somebody"))
    assert observer.wait_for_rest(timeout=PATIENCE).q[0] < 1.0


def test_an_emergency_stop_is_explained_and_recovered(model: PanelArm, observer: ha.Arm) -> None:
    model.operate("emergency_stop")
    until(lambda: model.poll().stands)
    (why, *_) = model.poll().stands
    assert why.what == "Emergency stop" and "Clear" in why.remedy
    last = model.poll().last_stop
    assert last is not None and last.what.startswith("Emergency stop")
    model.operate("clear")
    until(lambda: all(one.what != "Emergency stop" for one in model.poll().stands))
    model.resume()
    model.recover()
    until(lambda: model.poll().stands == ())
    assert observer.wait_until(lambda state: state.safety.ready_to_move, timeout=PATIENCE)
    assert model.poll().last_stop is not None


def test_the_operation_mode_and_the_enabling_switch(model: PanelArm, observer: ha.Arm) -> None:
    model.operate("t1")
    observer.wait_until(lambda state: state.safety.mode.value == "t1", timeout=PATIENCE)
    model.operate("release")
    until(lambda: any("Enabling" in one.what and "Enable" in one.remedy for one in model.poll().stands))
    model.operate("enable")
    observer.wait_until(lambda state: state.safety.enabling_switch, timeout=PATIENCE)
    model.operate("aut")
    observer.wait_until(lambda state: state.safety.mode.value == "aut", timeout=PATIENCE)


# -------------------------------------------------------------------------------------------- points


def test_points_are_taught_and_visited(model: PanelArm, observer: ha.Arm) -> None:
    first = model.teach()
    model.arm.move(ha.ptp(HOME + 0.1))
    second = model.teach("above", straight=True)
    assert model.points.names == ("P1", "above") and first.q == pytest.approx(HOME, abs=1e-3)
    model.run("P1", speed=0.5)
    assert model.poll().running == "P1" and model.poll().target == first.pose
    with pytest.raises(ModeConflict):
        model.run("above")
    observer.wait_until(lambda state: abs(state.q - first.q).max() < 1e-3, timeout=PATIENCE)
    until(lambda: model.poll().running == "")
    model.run(speed=0.5)
    observer.wait_until(lambda state: abs(state.q - second.q).max() < 1e-3, timeout=PATIENCE)
    until(lambda: (m := model.poll().message) is not None and m.what == "Arrived at above")


def test_a_run_can_be_cancelled(model: PanelArm, observer: ha.Arm) -> None:
    model.arm.move(ha.ptp(HOME + 0.4))
    model.teach()
    model.arm.move(ha.ptp(HOME))
    model.run(speed=0.05)
    observer.wait_until(lambda state: state.q[0] > 0.01, timeout=PATIENCE)
    model.end_run()
    assert observer.wait_for_rest(timeout=PATIENCE).q[0] < 0.35


def test_the_list_is_edited_and_survives_a_file(model: PanelArm) -> None:
    for name in ("a", "b", "c"):
        model.teach(name)
    points = model.points
    points.shift("c", -2)
    points.rename("a", "first")
    points.delete("b")
    points.approach("first", straight=True)
    assert points.names == ("c", "first")
    text = points.to_json()
    points.delete("c")
    points.load(text)
    assert points.names == ("c", "first") and [point.straight for point in points] == [False, True]
    assert next(iter(points)).q == pytest.approx(HOME, abs=1e-3)
    for wrong in (
        "",
        "[]",
        '{"kind": "heptarm points"}',
        text.replace("iiwa14", "iiwa7"),
        text.replace('"ptp"', "7"),
    ):
        with pytest.raises(CommandRejected, match="no taught points"):
            points.load(wrong)
    content = json.loads(text)
    content["points"][0]["q"][0] = 9.0
    with pytest.raises(LimitError, match="A1 must be in"):
        points.load(json.dumps(content))
    assert points.names == ("c", "first")
    for name, why in (("c", "named 'c' already"), ("", "printable"), ("x" * 65, "printable")):
        with pytest.raises(CommandRejected, match=why):
            points.rename("first", name)
    with pytest.raises(CommandRejected, match="no point is named"):
        model.run("nowhere")


def test_points_of_another_tool_are_refused(model: PanelArm) -> None:
    model.teach("bare")
    with model.arm.tool(ha.Tool("stick", mass=0.1, tcp=ha.Pose.at(z=0.1))):
        until(lambda: model.arm.state.tool == "stick")
        for verb in (model.run, model.preview):
            with pytest.raises(CommandRejected, match="taught with no tool, attached is stick"):
                verb("bare")
        assert model.plan is None


# ------------------------------------------------------------------------------- plans and the gripper


def test_the_motion_to_the_points_is_planned_and_shown(model: PanelArm, observer: ha.Arm) -> None:
    with pytest.raises(CommandRejected, match="list of points is empty"):
        model.preview()
    model.teach("here")
    model.arm.move(ha.ptp(HOME + 0.1))
    before = resting(model, observer).q
    model.preview(speed=0.5)
    plan = model.plan
    assert plan is not None and plan.q[-1] == pytest.approx(HOME, abs=2e-3) and plan.robot == "iiwa14"
    assert 0.0 <= model.plan_time <= plan.t[-1]
    message = model.poll().message
    assert message is not None and message.what.startswith("Planned: ")
    assert observer.state.q == pytest.approx(before, abs=2e-3), "nothing moves"
    model.hide_plan()
    assert model.plan is None and model.plan_time == 0.0


def test_a_path_to_the_handle_is_shown_first_and_driven_where_bodies_leave_it_free(
    model: PanelArm, observer: ha.Arm
) -> None:
    there = HOME.copy()
    there[0] = 0.7
    goal = Pose.from_matrix(forward(model.arm.robot, there))
    around = {"block": goal @ Pose.at(0.0, 0.0, 0.05)}  # in the palm of the gripper
    with pytest.raises(NoPath, match="block"):
        model.plan_to(goal, places=around)
    with pytest.raises(CommandRejected, match="no path is shown"):
        model.drive(places={})
    away = {"block": Pose.at(0.0, 0.6, 0.3)}
    with pytest.raises(NoPath, match="contradicts keep"):
        model.plan_to(goal, places=away, keep=ha.OnPlane((0.0, 0.0, 0.0)))
    model.plan_to(goal, places=away, speed=0.5, keep=ha.Upright("z"))
    assert model.has_path and model.plan is not None
    message = model.poll().message
    assert message is not None and "waypoint" in message.what
    assert abs(resting(model, observer).q - HOME).max() < 1e-3, "a plan moves nothing"
    with pytest.raises(CollisionForeseen, match="block"):
        model.drive(places=around)
    assert model.has_path
    model.drive(places=away)
    assert not model.has_path and model.plan is None
    until(lambda: (found := model.poll().message) is not None and found.what == "Arrived at the handle")
    assert resting(model, observer).pose.distance_to(goal) < 2e-3


def test_the_gripper_opens_and_closes(model: PanelArm, observer: ha.Arm) -> None:
    def said(words: str) -> None:
        until(lambda: (m := model.poll().message) is not None and m.what == words)

    is_open, is_closed = "InputX3Pin3", "InputX3Pin4"
    model.arm.operator.set_signal(is_open, True)
    model.open_gripper()
    said("The gripper is open")
    assert observer.io["OutputX3Pin1"]
    model.close_gripper()
    with pytest.raises(ModeConflict, match="gripper moves"):
        model.open_gripper()
    observer.io.wait("OutputX3Pin2", timeout=PATIENCE)
    model.arm.operator.set_signal(is_open, False)
    model.arm.operator.set_signal(is_closed, True)
    said("The gripper is closed on nothing")
    model.gripper, gripper = None, model.gripper
    with pytest.raises(CommandRejected, match="knows no gripper"):
        model.close_gripper()
    model.gripper = gripper


def test_a_gripper_is_that_of_the_options_or_of_the_scene(model: PanelArm) -> None:
    target = address(model)
    bins = model_of(model.arm, target, PanelOptions(scene="bins"))
    assert bins.gripper is not None
    assert model_of(model.arm, target, PanelOptions(scene="bins", read_only=True)).gripper is None
    assert model_of(model.arm, target, PanelOptions()).gripper is None
    for options, why in ((PanelOptions(scene="none"), "none"), (PanelOptions(meshes="nowhere"), "nowhere")):
        with pytest.raises(CommandRejected, match=why):
            shapes_of(options)
    with pytest.raises(CommandRejected, match="signals of a gripper must be"):
        model_of(model.arm, target, PanelOptions(gripper="fingers=DO1"))
    with pytest.raises(CommandRejected, match="Nothing"):
        model_of(model.arm, target, PanelOptions(gripper="open=Nothing.Here"))


# --------------------------------------------------------------------------------- the other actions


def test_override_outputs_and_tools(model: PanelArm, observer: ha.Arm) -> None:
    model.set_override(0.4)
    observer.wait_until(
        lambda state: state.motion is not None and state.motion.override == 0.4, timeout=PATIENCE
    )
    model.set_override(1.0)
    (name, *_) = [
        one for one, signal in observer.io.signals.items() if signal.is_output and signal.kind == "boolean"
    ]
    wanted = not observer.io[name]
    model.set_output(name, wanted)
    observer.io.wait(name, wanted, timeout=PATIENCE)
    model.arm.attach_tool(ha.Tool("probe", mass=0.2, tcp=ha.Pose.at(z=0.15)))
    model.attach_tool("")
    observer.wait_until(lambda state: state.tool == "", timeout=PATIENCE)
    model.attach_tool("probe")
    observer.wait_until(lambda state: state.tool == "probe", timeout=PATIENCE)
    model.attach_tool("")


def test_a_recording_has_states(model: PanelArm) -> None:
    pytest.importorskip("mcap")
    path = model.start_recording()
    assert model.poll().recording == path.name
    with pytest.raises(CommandRejected, match="a recording runs"):
        model.start_recording()
    seen = model.arm.state.stamp
    model.arm.wait_until(lambda state: state.stamp > seen + 100_000_000, timeout=PATIENCE)
    model.stop_recording()
    assert model.poll().recording == "" and len(ha.load(path)) > 1


def test_a_recording_that_the_disk_ends_is_reported_and_no_longer_shown(
    model: PanelArm, monkeypatch: pytest.MonkeyPatch
) -> None:
    def states(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(RecordingFile, "states", states)
    path = model.start_recording()
    until(lambda: not model.poll().recording)
    message = model.poll().message
    assert message is not None and message.level == "error"
    assert f"{path} ends early: No space left" in message.what and "free some space" in message.remedy
    model.stop_recording()  # nothing is left to stop


def test_a_panel_that_only_shows_refuses_all_but_stop(model: PanelArm) -> None:
    model.teach("a")
    halted: list[bool] = []
    shows = PanelArm(model.arm, halt=lambda: halted.append(True), operate=lambda _: "", may_control=False)
    actions: tuple[Callable[[], object], ...] = (
        shows.take_control,
        shows.recover,
        shows.pause,
        shows.resume,
        shows.teach,
        shows.run,
        shows.start_recording,
        lambda: shows.set_override(0.5),
        lambda: shows.set_output("LEDBlue", True),
        lambda: shows.attach_tool(""),
        shows.open_gripper,
        lambda: shows.operate("emergency_stop"),
        lambda: shows.jog(JointJog(np.zeros(7))),
        lambda: shows.drive(places={}),
    )
    for action in actions:
        with pytest.raises(CommandRejected, match="only shows"):
            action()
    shows.stop()
    assert halted == [True] and not shows.has_operator
    shows.close()


@pytest.mark.parametrize(
    ("host", "words", "may"),
    [
        ("127.0.0.1", {}, True),
        ("localhost", {}, True),
        ("::1", {}, True),
        ("127.0.0.1", {"read_only": True}, False),
        ("0.0.0.0", {}, False),
        ("192.168.1.5", {}, False),
        ("robot-pc", {}, False),
        ("0.0.0.0", {"allow_control": True}, True),
    ],
)
def test_who_may_control(host: str, words: dict[str, Any], may: bool) -> None:
    assert PanelOptions(host=host, **words).may_control is may


def test_a_recording_that_cannot_be_written_is_refused(model: PanelArm, tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    lost = PanelArm(model.arm, halt=lambda: None, folder=tmp_path / "taken")
    with pytest.raises(CommandRejected):
        lost.start_recording()
    assert lost.poll().recording == ""
    lost.close()


def test_a_page_of_two_arms_draws_both_and_its_stop_stops_both(model: PanelArm) -> None:
    pytest.importorskip("viser")
    from heptarm.panel.process import Panel

    halted: list[str] = []
    arms = [
        PanelArm(model.arm, halt=lambda: halted.append("left"), operate=lambda _: ""),
        PanelArm(model.arm, halt=lambda: halted.append("right"), may_control=False),
    ]
    panel = Panel(arms, PanelOptions(port=0, scene="table"))
    try:
        for count in (0, 1):  # with texts and without
            panel.draw(count)
        panel.stop()
        assert sorted(halted) == ["left", "right"]
    finally:
        panel.close()


def test_control_that_a_late_heartbeat_has_lost_is_taken_by_one_press(model: PanelArm) -> None:
    model.release_control()
    with ha.connect(address(model), control=False, watchdog=0.3, timeout=PATIENCE) as arm:
        page = PanelArm(arm, halt=lambda: None)
        page.take_control()
        assert page.poll().in_control
        heartbeat = arm.connection.link._heartbeat
        heartbeat.due = time.monotonic_ns() + 10**12
        until(lambda: not page.poll().in_control)
        heartbeat.due = 0
        page.take_control()
        assert page.poll().in_control
        arm.move(ha.hold(0.1))
        page.release_control()


def test_the_weight_of_a_tool_that_is_not_attached_is_no_external_force(model: PanelArm) -> None:
    mounted = Scene.of("table").load
    assert mounted is not None and mounted.mass == pytest.approx(1.0) and 0.02 < mounted.com[2] < 0.1
    seen = PanelArm(model.arm, halt=lambda: None, mounted=mounted)
    until(lambda: seen.poll().wrench is not None)
    shown = seen.poll()
    state, wrench = shown.state, shown.wrench
    assert state is not None and wrench is not None
    assert shown.undeclared == pytest.approx(9.81)
    assert wrench.force - state.wrench.force == pytest.approx([0, 0, 9.81])
    lever = state.pose.rotation @ mounted.com
    assert wrench.torque - state.wrench.torque == pytest.approx(np.cross(lever, [0, 0, 9.81]))
    with model.arm.tool(ha.Tool("gripper", mass=1.0, com=mounted.com)):
        until(lambda: seen.poll().undeclared == 0.0)
    assert Scene.of("cage").load is None, "nothing is mounted"


def test_a_page_draws_the_world_of_a_program_and_plans_around_it(
    model: PanelArm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("viser")
    from heptarm.panel.process import Panel

    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    arm = PanelArm(model.arm, halt=lambda: None)
    panel = Panel([arm], PanelOptions(port=0))
    page = panel._pages[0]

    def drawn(*names: str) -> bool:
        panel.draw(0)
        return set(page._bodies._bodies) == set(names)

    try:
        panel.draw(0)
        world = ha.CollisionModel("iiwa14", scene="table")
        ball = ha.shapes.sphere(0.1)
        world.add("ball", ball, at=Pose.at(0.5, 0.4, 0.4), color=(1.0, 0.2, 0.0, 0.5))
        world.add_points([[0.6, -0.5, 0.5]], radius=0.02)
        assert world.show()
        until(lambda: drawn("ball", "points"))
        frame, mesh, label = page._bodies._bodies["ball"][1]
        assert tuple(frame.position) == (0.5, 0.4, 0.4) and label.text == "ball"
        assert tuple(mesh.color) == (255, 51, 0) and mesh.opacity == 0.5
        assert np.ptp(mesh.vertices, axis=0) == pytest.approx([0.2] * 3, abs=2e-3)
        assert "block" in page._world.places, "the scene of the program is drawn, too"

        # a change of place moves what is drawn; the free bodies of the scene are where the program has them
        world.place("block", Pose.at(0.4, 0.5, 0.3))
        world.place("ball", Pose.at(0.55, 0.3, 0.5))
        until(lambda: drawn("ball", "points") and tuple(frame.position) == (0.55, 0.3, 0.5))
        assert page._bodies._bodies["ball"][1][1] is mesh
        assert page._world.places["block"].distance_to(Pose.at(0.4, 0.5, 0.3)) < 1e-9

        # what the arm holds moves with it; what is in the way is planned around
        world.hold("block", Pose.at(0.0, 0.0, 0.1))
        held = Pose.from_matrix(forward(model.arm.robot, model.arm.state.q)) @ Pose.at(0.0, 0.0, 0.1)
        until(lambda: drawn("ball", "points") and page._world.places["block"].distance_to(held) < 1e-3)
        there = HOME.copy()
        there[0] = 0.7
        goal = Pose.from_matrix(forward(model.arm.robot, there))
        world.place("ball", goal)
        until(lambda: drawn("ball", "points") and tuple(frame.position) == tuple(goal.xyz))
        with pytest.raises(NoPath, match="ball"):
            arm.plan_to(goal, places=page._world.places)

        # other bodies, another arm, nothing
        world.remove("points")
        world.become(world.with_arm("right", at=Pose.at(1.4, 0.0, 0.0), q=HOME))
        until(lambda: drawn("ball") and set(page._bodies._arms) == {"right"})
        world.hide()
        until(lambda: drawn() and not page._bodies._arms and not page._world.places)
    finally:
        panel.close()
        arm.close()


def test_the_command_refuses_what_contradicts_itself() -> None:
    done = run("panel", "--read-only", "--allow-control", "--target", "sim://localhost:1")
    assert done.returncode == 1 and "contradict" in done.stderr
