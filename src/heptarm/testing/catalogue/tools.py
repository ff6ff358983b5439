"""Scenarios: tools and workpieces on the flange, and their frames."""

from __future__ import annotations

import numpy as np

from heptarm import model
from heptarm.arm.arm import Arm
from heptarm.errors import CommandRejected, MotionAborted
from heptarm.testing.measure import Unfit, above, baseline, fresh, holds, near, watch
from heptarm.testing.scenario import Risk, scenario
from heptarm.testing.stage import HOME, TABLE, stage
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.motion.motion import hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose, deg
from heptarm.values.result import Cause
from heptarm.values.shape import capsule
from heptarm.values.tool import Tool, Workpiece
from heptarm.when import force

_TIP = Pose.xyz_abc(0.03, 0.0, 0.12, *deg(0, 90, 0))
_GRIPPER = Tool(
    "scenario-gripper", mass=1.5, com=(0.0, 0.0, 0.06), tcp=_TIP, frames={"pad": Pose.at(0.0, 0.04, 0.1)}
)
_PROBE = Tool(
    "scenario-probe", tcp=Pose.at(0.0, 0.08, 0.15), shapes=[capsule(0.01, 0.13, at=Pose.at(0.0, 0.08, 0.075))]
)
_PART = Workpiece("scenario-part", mass=1.0, com=(0.0, 0.0, 0.05), frames={"peg": Pose.at(0.0, 0.0, 0.08)})


@scenario(line=6, rows="I1 I2", virtual=True, risk=Risk.STILL, needs=("tools",))
def template(arm: Arm) -> None:
    """A tool template of the project is attached by its name, defines the motion frame, and is detached."""
    if not arm.tools:
        raise Unfit("the project has no tool templates")
    name, tool = next(iter(arm.tools.items()))
    flange = fresh(arm).pose
    arm.attach_tool(name)
    state = fresh(arm)
    holds(state.tool == name, f"attached: {state.tool}")
    near(state.pose.xyz, (flange @ tool.frames[0][1]).xyz, 2e-4, "place of its tip", unit="m")
    arm.detach_tool()
    state = fresh(arm)
    holds(state.tool == "", "taken off")
    near(state.pose.xyz, flange.xyz, 2e-4, "what is moved is the flange", unit="m")


@scenario(line=6, rows="I3 I6 C5", virtual=True, space=0.25, needs=("tools", "lin_rel"))
def tip(arm: Arm) -> None:
    """A tool defined by the client: motions refer to its tip, along its own axes, or to another of its frames."""
    with arm.tool(_GRIPPER):
        start = fresh(arm).pose
        arm.move(lin_rel(z=0.04, speed_mps=0.2))
        near(fresh(arm).pose.xyz, (start @ Pose.at(0, 0, 0.04)).xyz, 5e-4, "tip, along its own z", unit="m")
        target = arm.pose("pad") @ Pose.at(0.0, 0.03, 0.0)
        arm.move(lin(target, moving="pad", speed_mps=0.2))
        fresh(arm)
        near(arm.pose("pad").xyz, target.xyz, 5e-4, "another frame, by its name", unit="m")
        arm.attach_tool(_GRIPPER, frame="pad")
        near(fresh(arm).pose.xyz, target.xyz, 5e-4, "chosen at run time, it is what poses mean", unit="m")
        try:
            arm.move(lin_rel(z=0.01, moving="nothing"))
            holds(False, "an unknown frame is refused")
        except CommandRejected as error:
            holds("pad" in error.text, error.text)


@scenario(line=6, rows="I4 I5", virtual=True, space=0.02, needs=("tools", "workpieces", "hold"))
def load(arm: Arm) -> None:
    """Mass and centre of mass of tool and workpiece are compensated: they cause no external force."""
    before = baseline(arm)
    with arm.tool(_GRIPPER):
        arm.move(hold(0.4))
        state, seen = fresh(arm), baseline(arm)
        more = model.gravity(arm.robot, state.q, load=_GRIPPER.body) - model.gravity(arm.robot, state.q)
        near(seen.tau - before.tau, more, 0.3, "the tool's part of the torques", unit="Nm")
        near(seen.tau_ext, before.tau_ext, 0.3, "external torques", unit="Nm")
        with arm.attached(_PART):
            arm.move(hold(0.4))
            held = baseline(arm)
            above(abs(float(held.tau[1] - seen.tau[1])), 2.0, "the workpiece's part in A2", unit="Nm")
            near(held.force, seen.force, 0.8, "force", unit="N")
            peg = arm.pose("scenario-part/peg")
            near(peg.xyz, (arm.pose() @ Pose.at(0, 0, 0.08)).xyz, 2e-4, "its own frame", unit="m")


@scenario(
    line=6,
    rows="I5",
    virtual=True,
    risk=Risk.FAULT,
    space=0.1,
    needs=("workpieces", "safety_workpieces", "lin_rel"),
)
def safety_workpiece(arm: Arm) -> None:
    """Safety functions count the safety workpiece only: any other weight looks like a collision, and stops the arm."""
    from heptarm.arm.connect import connect

    target = f"{stage(model=arm.robot.name, speed=4.0)}&safety=12,5"
    with connect(target, watchdog=10.0, timeout=30.0, black_box=False) as own:
        own.move(ptp(HOME))
        with own.attached("Block", safety=True):
            holds(fresh(own).safety_workpiece == "Block", "the template's workpiece is the safety workpiece")
            holds(own.move(lin_rel(z=-0.05)).arrived, "4 kg that count do not disturb")
        holds(fresh(own).safety_workpiece == "", "there is none after it was detached")
        try:
            own.attach_workpiece(Workpiece("scenario-anvil", mass=6.0), safety=True)
            holds(False, "6 kg are refused")
        except CommandRejected as error:
            holds("allows 5 kg" in error.text and fresh(own).workpiece == "", error.text)
        own.attach_workpiece("Block")
        try:
            own.move(lin_rel(z=-0.05))
            holds(False, "4 kg that do not count stop the arm")
        except MotionAborted as error:
            holds(error.cause is Cause.SAFETY, "a safety function stopped 4 kg that it does not count")
        holds(fresh(own).safety.protective_stop, "the state shows its stop")


@scenario(
    line=6, rows="I12", virtual=True, risk=Risk.CONTACT, space=0.1, needs=("tools", "lin_rel", "conditions")
)
def shapes(arm: Arm) -> None:
    """The shapes of an attached tool collide: its tip meets the table, the force is felt there, and then it is gone."""
    height = fresh(arm).pose.z - TABLE
    if not 0.0 < height - _PROBE.tcp.z < 0.09:
        raise Unfit("the table is not below the tip of the scenario's tool")
    contact = force > 15.0
    with arm.tool(_PROBE):
        rest = baseline(arm)
        result = arm.move(lin_rel(z=-0.09, frame="base", speed_mps=0.02), until=contact, then="stay")
        holds(result.stopped_by == contact, "stopped by a contact")
        arm.wait_for_rest()
        near(fresh(arm).pose.z, TABLE, 6e-3, "height of the tip", unit="m")
        seen = baseline(arm)
        above(float(seen.force[2] - rest.force[2]), 7.0, "force, upwards", unit="N")
        near(seen.torque, rest.torque, 0.4, "its torque about the tip, where it acts", unit="Nm")
        arm.move(lin_rel(z=0.05, frame="base", speed_mps=0.1))
    below = lin_rel(z=-0.06, frame="base", speed_mps=0.05)
    holds(arm.move(below, until=contact).arrived, "the flange alone meets nothing there")


@scenario(line=6, rows="I6 G10", virtual=True, operator=True, risk=Risk.CONTACT, space=0.02, needs=("tools",))
def wrench(arm: Arm) -> None:
    """The wrench at the tip and at the flange, in the axes of either."""
    push = np.array([0.0, 14.0, -6.0])
    with arm.tool(_GRIPPER):
        arm.move(hold(0.3))
        rest, bare = baseline(arm), arm.wrench("flange")
        arm.operator.start_push(push, duration=60.0)
        arm.wait_until(lambda s: np.linalg.norm(s.wrench.force - rest.force - push) < 1.5, timeout=20.0)
        watch(arm, 0.3)
        seen, tip, flange = baseline(arm), arm.wrench(), arm.wrench("flange")
        near(seen.force - rest.force, push, 0.5, "force", unit="N")
        near(
            flange.torque - bare.torque,
            np.zeros(3),
            0.6,
            "torque at the flange, where the push acts",
            unit="Nm",
        )
        lever = arm.pose("flange").xyz - arm.pose().xyz
        near(seen.torque - rest.torque, np.cross(lever, push), 0.3, "torque at the tip", unit="Nm")
        own = arm.wrench(axes="tool").force
        near(own, arm.pose().rotation.T @ tip.force, 2.0, "force in the tip's axes", unit="N")
        arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
