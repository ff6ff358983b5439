"""Tools, workpieces and the names of frames in the core."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer, ptp, run

NAN, INF = math.nan, math.inf
HERE = wire.Pose(xyz=(0.0, 0.0, 0.12), quat=(0.0, 0.0, 0.0, 1.0))
BALL = (1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0)
EMPTY = wire.ToolInfo(name="part", mass=0.5, com=(0.0,) * 3, inertia=(0.0,) * 6, frames=())
GRIPPER = replace(
    EMPTY,
    name="gripper",
    inertia=BALL,
    frames=(wire.FrameInfo(name="tcp", pose=HERE), wire.FrameInfo(name="pad", pose=HERE)),
)
SPRING = wire.CartesianImpedance(
    stiffness=(1000.0,) * 3 + (100.0,) * 3,
    damping=(0.7,) * 6,
    nullspace_stiffness=0.0,
    nullspace_damping=0.7,
    additional_force=(0.0,) * 6,
    frame="",
)


def frames(*names: str) -> tuple[wire.FrameInfo, ...]:
    return tuple(wire.FrameInfo(name=name, pose=HERE) for name in names)


@pytest.fixture
def peer(cabinet: FakeCabinet) -> Iterator[Peer]:
    with Peer(cabinet.port) as peer:
        peer.take_control()
        peer.ask(wire.AttachTool(name="", frame=""))
        yield peer
        peer.ask(wire.Stop())
        rest(peer)
        assert isinstance(peer.ask(wire.AttachTool(name="", frame="")), wire.Accepted)


def rest(peer: Peer) -> None:
    """Waits until no motion runs: only then may the load change."""
    accepted = peer.ask(run(replace(ptp(), motion=wire.Hold(duration=0.01))))
    peer.wait_for(wire.MotionFinished, lambda event: event.id == accepted.id)


def mode(peer: Peer) -> wire.ModeState:
    """Mode and tools in the next state."""
    since = len(peer.seen)
    peer.ask(wire.Subscribe(groups=wire.Groups.MODE, rate=100.0))
    state = peer.wait(lambda _, message: isinstance(message, wire.State), since=since)
    peer.ask(wire.Subscribe(groups=wire.Groups.NONE, rate=0.0))
    assert isinstance(state, wire.State) and state.mode is not None
    return state.mode


def fitted(peer: Peer) -> tuple[str, str, str]:
    """Tool, workpiece and motion frame in the next state."""
    seen = mode(peer)
    return seen.tool, seen.workpiece, seen.frame


def held(peer: Peer) -> tuple[str, str]:
    """Workpiece and safety workpiece in the next state."""
    seen = mode(peer)
    return seen.workpiece, seen.safety_workpiece


FAR = wire.Pose(xyz=(2.1, 0.0, 0.0), quat=(0.0, 0.0, 0.0, 1.0))


def shape(
    kind: wire.ShapeKind = wire.ShapeKind.BOX,
    size: tuple[float, float, float] = (0.1, 0.1, 0.1),
    pose: wire.Pose = HERE,
) -> wire.Shape:
    return wire.Shape(kind=kind, size=size, pose=pose)


#: Invalid fields of tools: what the client refuses in tests/values/test_tool.py, with the same codes.
BAD: list[tuple[dict[str, Any], int, str]] = [
    ({"name": ""}, Code.BAD_LENGTH, "name"),
    ({"name": "x" * 65}, Code.BAD_LENGTH, "name"),
    ({"name": "a/b"}, Code.OUT_OF_RANGE, "name"),
    ({"mass": -0.1}, Code.OUT_OF_RANGE, "mass"),
    ({"mass": 50.1}, Code.OUT_OF_RANGE, "mass"),
    ({"mass": NAN}, Code.NOT_FINITE, "mass"),
    ({"mass": INF}, Code.NOT_FINITE, "mass"),
    ({"com": (0.0, NAN, 0.0)}, Code.NOT_FINITE, "com[1]"),
    ({"com": (0.0, 0.0, 2.1)}, Code.OUT_OF_RANGE, "com[2]"),
    ({"inertia": (NAN, *BALL[1:])}, Code.NOT_FINITE, "inertia[0]"),
    ({"shapes": (shape(size=(0.1, 0.0, 0.1)),)}, Code.OUT_OF_RANGE, "shapes[0].size[1]"),
    ({"shapes": (shape(), shape(size=(0.1, 0.1, 4.1)))}, Code.OUT_OF_RANGE, "shapes[1].size[2]"),
    ({"shapes": (shape(size=(0.1, NAN, 0.1)),)}, Code.NOT_FINITE, "shapes[0].size[1]"),
    ({"shapes": (shape(wire.ShapeKind.SPHERE),)}, Code.OUT_OF_RANGE, "shapes[0].size[1]"),
    ({"shapes": (shape(wire.ShapeKind.CAPSULE),)}, Code.OUT_OF_RANGE, "shapes[0].size[2]"),
    ({"shapes": (shape(pose=FAR),)}, Code.OUT_OF_RANGE, "shapes[0].pose.xyz[0]"),
    ({"shapes": (shape(),) * 17}, Code.BAD_LENGTH, "shapes"),
    ({"inertia": (-1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0)}, Code.OUT_OF_RANGE, "inertia"),
    ({"inertia": (1e-3, 1e-3, 3e-3, 0.0, 0.0, 0.0)}, Code.OUT_OF_RANGE, "inertia"),
    ({"inertia": (1e-3, 1e-3, 1e-3, 2e-3, 0.0, 0.0)}, Code.OUT_OF_RANGE, "inertia"),
    ({"frames": frames("")}, Code.BAD_LENGTH, "frames[0].name"),
    ({"frames": frames("tip", "flange")}, Code.OUT_OF_RANGE, "frames[1].name"),
    ({"frames": frames("base")}, Code.OUT_OF_RANGE, "frames[0].name"),
    ({"frames": frames("tool")}, Code.OUT_OF_RANGE, "frames[0].name"),
    ({"frames": frames("a/b")}, Code.OUT_OF_RANGE, "frames[0].name"),
    ({"frames": frames("tip", "tip")}, Code.OUT_OF_RANGE, "frames[1].name"),
    ({"frames": frames(*map(str, range(33)))}, Code.BAD_LENGTH, "frames"),
    (
        {"frames": (wire.FrameInfo(name="tip", pose=replace(HERE, quat=(0.0, 0.0, 0.0, 2.0))),)},
        Code.NOT_NORMALISED,
        "frames[0].pose.quat",
    ),
]


@pytest.mark.parametrize("case", range(len(BAD)))
def test_what_no_tool_has_is_refused_when_the_client_is_bypassed(peer: Peer, case: int) -> None:
    fields, code, parameter = BAD[case]
    bad = replace(EMPTY, **fields)
    refused = peer.ask(wire.DefineTool(tool=bad))
    assert (refused.code, refused.parameter) == (code, f"tool.{parameter}")
    refused = peer.ask(wire.AttachLoad(load=bad, attached=True))
    assert (refused.code, refused.parameter) == (code, f"load.{parameter}")
    assert fitted(peer) == ("", "", "flange")


def test_tools_come_and_go_and_the_state_reports_it(peer: Peer) -> None:
    assert isinstance(peer.ask(wire.DefineTool(tool=GRIPPER)), wire.Accepted)
    assert fitted(peer) == ("", "", "flange")
    peer.ask(wire.AttachTool(name="gripper", frame=""))
    assert fitted(peer) == ("gripper", "", "tcp")
    peer.ask(wire.AttachLoad(load=EMPTY, attached=True))
    assert fitted(peer) == ("gripper", "part", "tcp")
    peer.ask(wire.AttachLoad(load=EMPTY, attached=False))
    assert fitted(peer) == ("gripper", "", "tcp")
    peer.ask(wire.AttachLoad(load=EMPTY, attached=True))
    peer.ask(wire.AttachTool(name="gripper", frame="pad"))
    assert fitted(peer) == ("gripper", "", "pad")  # the workpiece was detached with the tool
    peer.ask(wire.DefineTool(tool=replace(GRIPPER, mass=2.0)))
    assert fitted(peer) == ("gripper", "", "pad")
    peer.ask(wire.DefineTool(tool=replace(GRIPPER, frames=frames("tip"))))
    assert fitted(peer) == ("gripper", "", "tip")
    peer.ask(wire.AttachTool(name="", frame=""))
    assert fitted(peer) == ("", "", "flange")


def test_a_safety_workpiece_is_one_until_it_or_its_tool_is_detached(peer: Peer) -> None:
    counted = wire.AttachLoad(load=EMPTY, attached=True, safety=True)
    assert held(peer) == ("", "")
    assert isinstance(peer.ask(counted), wire.Accepted)
    assert held(peer) == ("part", "part")
    refused = peer.ask(wire.AttachLoad(load=replace(EMPTY, name="other"), attached=True))
    assert refused.code == Code.BUSY and held(peer) == ("part", "part")
    peer.ask(wire.AttachLoad(load=EMPTY, attached=False))
    assert held(peer) == ("", "")
    peer.ask(wire.AttachLoad(load=EMPTY, attached=True))
    assert held(peer) == ("part", "")
    peer.ask(wire.AttachTool(name="", frame=""))
    peer.ask(counted)
    peer.ask(wire.DefineTool(tool=GRIPPER))
    peer.ask(wire.AttachTool(name="gripper", frame=""))
    assert held(peer) == ("", "")


def test_a_robot_that_does_not_take_a_safety_workpiece_holds_none(peer: Peer) -> None:
    heavy = replace(EMPTY, mass=12.0)
    refused = peer.ask(wire.AttachLoad(load=heavy, attached=True, safety=True))
    assert (refused.code, refused.parameter, refused.allowed) == (Code.OUT_OF_RANGE, "safety", "false")
    assert held(peer) == ("", "")
    assert isinstance(peer.ask(wire.AttachLoad(load=heavy, attached=True)), wire.Accepted)
    assert held(peer) == ("part", "")


def test_the_workpiece_of_a_template_is_attached_by_its_name(cabinet: FakeCabinet, peer: Peer) -> None:
    block = replace(EMPTY, name="block", mass=0.0)
    with Peer(cabinet.port) as other:
        at = len(other.seen)
        peer.ask(wire.AttachLoad(load=block, attached=True, template=True, safety=True))
        event = other.wait(lambda _, message: isinstance(message, wire.ToolChanged), since=at)
    assert event.workpiece is not None and event.workpiece.mass == 0.2  # the template's
    assert held(peer) == ("block", "block")
    peer.ask(wire.AttachLoad(load=block, attached=False))
    refused = peer.ask(wire.AttachLoad(load=EMPTY, attached=True, template=True))
    assert (refused.code, refused.parameter, refused.value) == (Code.UNKNOWN_NAME, "load.name", "part")
    assert held(peer) == ("", "")


def test_every_client_receives_what_is_attached(cabinet: FakeCabinet, peer: Peer) -> None:
    pen = replace(GRIPPER, name="pen", shapes=(shape(), shape(wire.ShapeKind.SPHERE, (0.1, 0.0, 0.0))))
    with Peer(cabinet.port) as other:
        seen: list[tuple[wire.ToolInfo | None, wire.ToolInfo | None]] = []

        def changed(since: int) -> int:
            event = other.wait(lambda _, message: isinstance(message, wire.ToolChanged), since=since)
            seen.append((event.tool, event.workpiece))
            return len(other.seen)

        at = len(other.seen)
        peer.ask(wire.DefineTool(tool=pen))
        peer.ask(wire.AttachTool(name="pen", frame=""))
        at = changed(at)
        peer.ask(wire.AttachLoad(load=EMPTY, attached=True))
        at = changed(at)
        peer.ask(wire.AttachTool(name="", frame=""))
        changed(at)
    assert seen == [(pen, None), (pen, EMPTY), (None, None)]


def test_templates_of_the_project_are_tools_too(cabinet: FakeCabinet, peer: Peer) -> None:
    peer.ask(wire.DefineTool(tool=GRIPPER))
    with Peer(cabinet.port) as other:
        known = {tool.name: tool for tool in other.welcome.tools}
    assert known["listed"].frames[0].name == "tip"
    assert known["gripper"] == GRIPPER
    assert "hidden" not in known
    for name in ("listed", "hidden"):
        peer.ask(wire.AttachTool(name=name, frame="tip"))
        assert fitted(peer) == (name, "", "tip")
    refused = peer.ask(wire.DefineTool(tool=replace(GRIPPER, name="hidden")))
    assert (refused.code, refused.parameter) == (Code.OUT_OF_RANGE, "tool.name")


def test_names_of_nothing_are_refused_with_those_there_are(peer: Peer) -> None:
    peer.ask(wire.DefineTool(tool=GRIPPER))
    refused = peer.ask(wire.AttachTool(name="hammer", frame=""))
    assert (refused.code, refused.parameter) == (Code.UNKNOWN_NAME, "name")
    assert "gripper" in refused.allowed
    refused = peer.ask(wire.AttachTool(name="gripper", frame="tip"))
    assert (refused.code, refused.parameter, refused.allowed) == (Code.UNKNOWN_NAME, "frame", "tcp, pad")
    refused = peer.ask(wire.AttachLoad(load=EMPTY, attached=False))
    assert (refused.code, refused.parameter) == (Code.UNKNOWN_NAME, "load.name")
    assert fitted(peer) == ("", "", "flange")


def test_a_robot_that_does_not_take_a_tool_keeps_what_it_has(peer: Peer) -> None:
    peer.ask(wire.DefineTool(tool=GRIPPER))
    peer.ask(wire.DefineTool(tool=replace(GRIPPER, name="unlucky", mass=13.0)))
    peer.ask(wire.AttachTool(name="gripper", frame=""))
    assert peer.ask(wire.AttachTool(name="unlucky", frame="")).code == Code.EXECUTION_FAILED
    assert (
        peer.ask(wire.AttachLoad(load=replace(EMPTY, mass=13.0), attached=True)).code == Code.EXECUTION_FAILED
    )
    assert fitted(peer) == ("gripper", "", "tcp")


def test_nothing_changes_while_something_runs_or_waits(peer: Peer) -> None:
    peer.ask(wire.DefineTool(tool=GRIPPER))
    accepted = peer.ask(run(replace(ptp(), motion=wire.Hold(duration=NAN))))
    for message in (
        wire.DefineTool(tool=GRIPPER),
        wire.AttachTool(name="gripper", frame=""),
        wire.AttachLoad(load=EMPTY, attached=True),
    ):
        assert peer.ask(message).code == Code.BUSY
    peer.ask(wire.Cancel(id=accepted.id))
    peer.wait_for(wire.MotionFinished, lambda event: event.id == accepted.id)
    peer.ask(wire.AttachLoad(load=EMPTY, attached=True))
    refused = peer.ask(wire.AttachLoad(load=replace(EMPTY, name="other"), attached=True))
    assert refused.code == Code.BUSY
    assert "part" in refused.text


def test_an_observer_changes_nothing(cabinet: FakeCabinet, peer: Peer) -> None:
    with Peer(cabinet.port) as observer:
        assert observer.ask(wire.AttachTool(name="", frame="")).code == Code.NOT_IN_CONTROL


def under(frame: str) -> dict[str, tuple[Any, str]]:
    """Requests with the name of a frame, and the parameter in the refusal."""
    offset = wire.LinRel(offset=HERE, reference=frame)
    wave = wire.SineImpedance(
        base=replace(SPRING, frame=frame),
        amplitude=(0.0,) * 6,
        frequency=(1.0,) * 6,
        phase=(0.0,) * 6,
        bias=(0.0,) * 6,
    )
    return {
        "moved": (run(ptp(), replace(ptp(), frame=frame)), "items[1].frame"),
        "axes": (run(wire.Item(motion=offset)), "items[0].motion.reference"),
        "mode": (run(replace(ptp(), mode=replace(SPRING, frame=frame))), "items[0].mode.frame"),
        "pattern": (run(replace(ptp(), mode=wave)), "items[0].mode.base.frame"),
        "servo": (wire.ServoOpen(watchdog=1.0, frame=frame), "frame"),
        "servo's mode": (wire.ServoOpen(watchdog=1.0, mode=replace(SPRING, frame=frame)), "mode.frame"),
    }


@pytest.mark.parametrize("name", under(""))
@pytest.mark.parametrize("frame", ["nowhere", "gripper/tip", "/tcp", "part/tcp"])
def test_frames_that_nothing_has_are_refused_by_name(peer: Peer, name: str, frame: str) -> None:
    peer.ask(wire.DefineTool(tool=GRIPPER))
    peer.ask(wire.AttachTool(name="gripper", frame=""))
    message, parameter = under(frame)[name]
    refused = peer.ask(message)
    assert (refused.code, refused.parameter, refused.value) == (Code.UNKNOWN_NAME, parameter, frame)
    assert refused.allowed.startswith("tool, flange, tcp, pad")


@pytest.mark.parametrize(
    "frame", ["tool", "flange", "tcp", "pad", "gripper/pad", "part/tip", "tip", "base", "/table"]
)
def test_every_name_of_a_frame_is_known(peer: Peer, frame: str) -> None:
    peer.ask(wire.DefineTool(tool=GRIPPER))
    peer.ask(wire.AttachTool(name="gripper", frame=""))
    peer.ask(wire.AttachLoad(load=replace(EMPTY, frames=frames("tip")), attached=True))
    rests = frame in ("base", "/table")
    answer = peer.ask(under(frame)["moved"][0])
    assert isinstance(answer, wire.Rejected if rests else wire.Accepted)
    answer = peer.ask(under(frame)["mode"][0])
    assert isinstance(answer, wire.Accepted), answer


def test_the_mode_in_force_is_reported(peer: Peer) -> None:
    def expected_text(mode: Any) -> bool:
        wanted = repr(mode)  # NaN is not equal to itself
        return bool(peer.wait_for(wire.State, lambda s: s.mode is not None and repr(s.mode.mode) == wanted))

    peer.ask(wire.Subscribe(groups=wire.Groups.MODE, rate=100.0))
    assert expected_text(wire.PositionMode())
    accepted = peer.ask(run(replace(ptp(), motion=wire.Hold(duration=NAN), mode=SPRING)))
    assert expected_text(SPRING)
    peer.ask(wire.Cancel(id=accepted.id))
    peer.wait_for(wire.MotionFinished, lambda event: event.id == accepted.id)
    servo = peer.ask(wire.ServoOpen(watchdog=2.0, mode=SPRING)).id
    peer.wait_for(wire.MotionStarted, lambda event: event.id == servo)
    softer = replace(SPRING, nullspace_stiffness=7.0)
    assert isinstance(peer.ask(wire.ServoSettings(servo=servo, mode=softer)), wire.Accepted)
    assert expected_text(softer)
    peer.ask(wire.ServoClose(servo=servo))
    peer.wait_for(wire.MotionFinished, lambda event: event.id == servo)
