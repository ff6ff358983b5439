"""Values that are legal by themselves but wrong here: unknown names, crossed bounds, limits of this robot.

Each is given to the API, and as a raw message to the application past the API: both refuse it with the same code.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import nan
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import Arm, Tool
from heptarm.arm.translate.modes import mode_message
from heptarm.values.condition.force import Force, torque
from heptarm.values.condition.signals import io, path
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.motion.motion import Motion
from heptarm.values.pose import Pose
from heptarm.wire import messages as wire
from tests.schema.calls import HOME

UNKNOWN, RANGE, CONDITION, LIMIT, UNSUPPORTED = 42, 2, 5, 50, 40
FAR = (0.0, 2.5, 0.0, 0.0, 0.0, 0.0, 0.0)
HOLD = wire.Hold(duration=1.0)
STEP = wire.LinRel(offset=wire.Pose(xyz=(0.0, 0.0, 0.01), quat=(0.0, 0.0, 0.0, 1.0)))
SPRING: Any = mode_message(CartesianImpedance())
SINE: Any = mode_message(SineImpedance())
TOOL = wire.ToolInfo(name="t", mass=1.0, com=(0.0,) * 3, inertia=(0.0,) * 6)
ORIGIN = wire.Pose(xyz=(0.0,) * 3, quat=(0.0, 0.0, 0.0, 1.0))
LAMP, BUTTON = "MediaFlange.LEDBlue", "MediaFlange.UserButton"


def run(motion: wire.Motion = HOLD, **more: object) -> wire.Run:
    return wire.Run(items=(wire.Item(motion=motion, **more),))  # type: ignore[arg-type]


def until(node: wire.ConditionNode) -> wire.Run:
    return run(until=wire.Condition(nodes=(node,)))


@dataclass(frozen=True)
class Wrong:
    """Wrong values: the message and the field, the call and its parameter, the code of both."""

    message: wire.Message
    place: str
    call: Callable[[Arm], object]
    name: str
    code: int = UNKNOWN


def moving(motion: Motion, **more: Any) -> Callable[[Arm], object]:
    return lambda arm: arm.start(motion, **more)


NODE = "items[0].until.nodes[0]"
WRONG = {
    "motion frame": Wrong(
        run(STEP, frame="nowhere"),
        "items[0].frame",
        moving(ha.lin_rel(z=0.01, moving="nowhere")),
        "moving",
    ),
    "axes": Wrong(
        run(replace(STEP, reference="nowhere")),
        "items[0].motion.reference",
        moving(ha.lin_rel(z=0.01, frame="nowhere")),
        "frame",
    ),
    "axes of a mode": Wrong(
        run(mode=replace(SPRING, frame="nowhere")),
        "items[0].mode.frame",
        moving(ha.hold(1.0), mode=CartesianImpedance(frame="nowhere")),
        "mode.frame",
    ),
    "axes of a pattern": Wrong(
        run(mode=replace(SINE, base=replace(SPRING, frame="nowhere"))),
        "items[0].mode.base.frame",
        moving(ha.hold(1.0), mode=SineImpedance(CartesianImpedance(frame="nowhere"))),
        "mode.frame",
    ),
    "axes of a force": Wrong(
        until(wire.ForceAbove(frame="nowhere", threshold=5.0)),
        f"{NODE}.frame",
        moving(ha.hold(1.0), until=Force(frame="nowhere") > 5),
        "until[0].frame",
    ),
    "axes of a normal force": Wrong(
        until(wire.NormalForceAbove(frame="nowhere", axis=wire.Axis.Z, threshold=5.0)),
        f"{NODE}.frame",
        moving(ha.hold(1.0), until=Force(frame="nowhere").normal("z") > 5),
        "until[0].frame",
    ),
    "axes of a shear force": Wrong(
        until(wire.ShearForceAbove(frame="nowhere", axis=wire.Axis.Z, threshold=5.0)),
        f"{NODE}.frame",
        moving(ha.hold(1.0), until=Force(frame="nowhere").shear("z") > 5),
        "until[0].frame",
    ),
    "axes of a component": Wrong(
        until(wire.ForceOutside(frame="nowhere", axis=wire.Axis.Z, low=-5.0, high=5.0)),
        f"{NODE}.frame",
        moving(ha.hold(1.0), until=Force(frame="nowhere").along("z").outside(-5, 5)),
        "until[0].frame",
    ),
    "axes of a torque": Wrong(
        until(wire.TorqueOutside(frame="nowhere", axis=wire.Axis.Z, low=-5.0, high=5.0)),
        f"{NODE}.frame",
        moving(ha.hold(1.0), until=torque(frame="nowhere").about("z").outside(-5, 5)),
        "until[0].frame",
    ),
    "signal": Wrong(
        until(wire.SignalIs(signal="Cell.Nothing", value=True)),
        f"{NODE}.signal",
        moving(ha.hold(1.0), until=io["Cell.Nothing"]),
        "signal",
    ),
    "number signal": Wrong(
        until(wire.SignalOutside(signal="Cell.Nothing", low=0.0, high=1.0)),
        f"{NODE}.signal",
        moving(ha.hold(1.0), until=io["Cell.Nothing"] > 1),
        "signal",
    ),
    "path of a hold": Wrong(
        until(wire.PathReached(reference=wire.PathReference.START, distance=0.1, delay=0.0)),
        "items[0].until",
        moving(ha.hold(1.0), until=path.after(0.1)),
        "items[0].until",
        CONDITION,
    ),
    "joint limit": Wrong(
        run(wire.Ptp(q=FAR)),
        "items[0].motion.q[1]",
        moving(ha.ptp(FAR)),
        "q[1]",
        LIMIT,
    ),
    "joint limit of a point": Wrong(
        run(wire.JointSpline(points=(wire.JointPoint(q=FAR),))),
        "items[0].motion.points[0].q[1]",
        moving(ha.spline_joints([FAR])),
        "points[0].q[1]",
        LIMIT,
    ),
    "stiffness about an axis": Wrong(
        run(mode=replace(SPRING, stiffness=(1000.0,) * 6)),
        "items[0].mode.stiffness[3]",
        lambda arm: arm.start(ha.hold(1.0), mode=CartesianImpedance((1000.0,) * 6)),
        "stiffness[3]",
        RANGE,
    ),
    "a stop at no force": Wrong(
        run(mode=replace(SPRING, max_force_stops=True)),
        "items[0].mode.max_force_stops",
        lambda arm: arm.start(ha.hold(1.0), mode=CartesianImpedance(max_force_stops=True)),
        "max_force_stops",
        RANGE,
    ),
    "ramps longer than all": Wrong(
        run(mode=replace(SINE, total_time=1.0, rise_time=2.0)),
        "items[0].mode.total_time",
        lambda arm: arm.start(ha.hold(1.0), mode=SineImpedance(total_time=1.0, rise_time=2.0)),
        "total_time",
        RANGE,
    ),
    "waiting for no end": Wrong(
        run(mode=replace(SINE, stay_active=True)),
        "items[0].mode.stay_active",
        lambda arm: arm.start(ha.hold(1.0), mode=SineImpedance(stay_active=True)),
        "stay_active",
        RANGE,
    ),
    "crossed bounds": Wrong(
        until(wire.JointTorqueOutside(joint=1, low=5.0, high=-5.0)),
        f"{NODE}.low",
        lambda arm: arm.start(ha.hold(1.0), until=torque[1].outside(5.0, -5.0)),
        "low",
        RANGE,
    ),
    "crossed bounds of a guide": Wrong(
        run(wire.HandGuide(q_min=(0.5,) + (nan,) * 6, q_max=(-0.5,) + (nan,) * 6)),
        "items[0].motion.q_min[0]",
        lambda arm: arm.start(ha.hand_guide(q_min=(0.5,) + (nan,) * 6, q_max=(-0.5,) + (nan,) * 6)),
        "q_min[0]",
        RANGE,
    ),
    "servo frame": Wrong(
        wire.ServoOpen(frame="nowhere"),
        "frame",
        lambda arm: arm.servo(moving="nowhere"),
        "moving",
    ),
    "servo condition": Wrong(
        wire.ServoOpen(until=wire.Condition(nodes=(wire.ForceAbove(frame="nowhere", threshold=5.0),))),
        "until.nodes[0].frame",
        lambda arm: arm.servo(until=Force(frame="nowhere") > 5),
        "until[0].frame",
    ),
    "tool": Wrong(
        wire.AttachTool(name="hammer", frame=""),
        "name",
        lambda arm: arm.attach_tool("hammer"),
        "name",
    ),
    "tool with a slash": Wrong(
        wire.DefineTool(tool=replace(TOOL, name="a/b")),
        "tool.name",
        lambda arm: arm.attach_tool(Tool("a/b")),
        "name",
        RANGE,
    ),
    "frame that is taken": Wrong(
        wire.DefineTool(tool=replace(TOOL, frames=(wire.FrameInfo(name="flange", pose=ORIGIN),))),
        "tool.frames[0].name",
        lambda arm: arm.attach_tool(Tool("t", frames={"flange": Pose.at()})),
        "frames[0].name",
        RANGE,
    ),
    "inertia of no body": Wrong(
        wire.DefineTool(tool=replace(TOOL, inertia=(1.0, 1.0, 9.0, 0.0, 0.0, 0.0))),
        "tool.inertia",
        lambda arm: arm.attach_tool(Tool("t", mass=1.0, inertia=(1, 1, 9, 0, 0, 0))),
        "inertia",
        RANGE,
    ),
    "output": Wrong(
        wire.SetSignals(values=(wire.SetSignal(signal="Cell.Nothing", value=1.0),)),
        "values[0].signal",
        lambda arm: arm.io.set({"Cell.Nothing": True}),
        "signal",
    ),
    "half a lamp": Wrong(
        wire.SetSignals(values=(wire.SetSignal(signal=LAMP, value=0.5),)),
        "values[0].value",
        lambda arm: arm.io.set({LAMP: 0.5}),
        LAMP,
        RANGE,
    ),
    "input": Wrong(
        wire.SetSignals(values=(wire.SetSignal(signal=BUTTON, value=1.0),)),
        "values[0].signal",
        lambda arm: arm.io.set({BUTTON: True}),
        "signal",
        UNSUPPORTED,
    ),
    "process data": Wrong(
        wire.GetProcessData(name="cell.no"),
        "name",
        lambda arm: arm.pad.process_data("cell.no"),
        "name",
    ),
    "own process data": Wrong(
        wire.SetProcessData(name="heptarm.port", value="1"),
        "name",
        lambda arm: arm.pad.set_process_data("heptarm.port", 1),
        "name",
        UNSUPPORTED,
    ),
}


@pytest.fixture(scope="module")
def arm() -> Iterator[Arm]:
    with ha.connect("sim://iiwa14?speed=3", watchdog=10.0, timeout=30.0) as arm:
        yield arm


@pytest.mark.parametrize("what", WRONG)
def test_both_sides_refuse_it_with_one_code(arm: Arm, what: str) -> None:
    wrong = WRONG[what]
    before = arm.wait_for_rest(timeout=30.0)
    with pytest.raises(ha.CommandRejected) as here:
        wrong.call(arm)
    with pytest.raises(ha.CommandRejected) as there:
        arm.connection.link.request(wrong.message, wire.Accepted, timeout=30.0)
    assert (here.value.code, here.value.parameter) == (wrong.code, wrong.name), here.value.text
    assert (there.value.code, there.value.parameter) == (wrong.code, wrong.place), there.value.text
    after = arm.wait_for_rest(timeout=30.0)
    assert np.abs(after.q - before.q).max() < 1e-3 and after.tool == before.tool


def test_the_cabinet_still_works(arm: Arm) -> None:
    assert arm.move(ha.ptp(HOME)).arrived
