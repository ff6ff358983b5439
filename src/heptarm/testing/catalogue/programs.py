"""Scenarios: several motions, one after the other, and their outcomes."""

from __future__ import annotations

import asyncio
import threading
from dataclasses import replace as replaced

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.motion.handle import MotionHandle
from heptarm.do import notify
from heptarm.errors import HeptarmError, ModeConflict, MotionAborted
from heptarm.model.kinematics import forward
from heptarm.testing.measure import above, below, fresh, holds, near, note, record, watch
from heptarm.testing.scenario import scenario
from heptarm.testing.stage import HOME
from heptarm.values.condition.signals import path
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.motion.dynamics import Blending
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.motion.motion import Motion, hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose, deg
from heptarm.values.result import Cause


def _turned(degrees: float) -> Motion:
    return ptp(HOME + deg(0, 0, 0, 0, 0, 0, degrees), speed=0.4)


def _under_way(arm: Arm, handle: MotionHandle) -> None:
    """Wait until A7 has left home."""
    arm.wait_until(lambda s: abs(s.q[6] - HOME[6]) > 0.03 or handle.done, timeout=20.0)
    holds(not handle.done, "it is running")


@scenario(line=2, rows="B2 B3 B4 B5 B7 B8 G15", space=0.1, needs=("ptp",))
def queue(arm: Arm) -> None:
    """Started motions are queued on the cabinet and can be awaited; states arrive meanwhile."""
    pushed = arm.states()
    first, second = arm.start(_turned(20), speed=0.15), arm.start(_turned(0))
    holds(not first.done and not second.done, "both calls return before anything is done")
    farthest, end, reported = 0.0, None, False
    for state in pushed:
        reported = reported or (
            state.motion is not None and (state.motion.id, state.motion.queued) == (first.id, 1)
        )
        farthest = max(farthest, state.q[6])
        if end is None and first.done:
            end = arm.state.stamp  # a slow machine has not seen all of them yet
        if end is not None and state.stamp >= end:
            break
    pushed.close()
    holds(reported, "the cabinet reports that one runs and one waits")
    near(farthest, np.radians(20), 0.02, "seen while it ran: A7 got to", unit="rad")
    ended: list[int] = []
    second.add_done_callback(lambda handle: ended.append(handle.id))

    async def wait() -> bool:
        return (await second).arrived

    holds(asyncio.run(wait()), "the second one, awaited, arrives")
    holds(first.done and first.progress == 1.0, "both have reported that they are done")
    arm.wait_until(lambda _: ended == [second.id], timeout=5.0)
    near(arm.wait_for_rest().q, HOME, 1e-3, "back home", unit="rad")


@scenario(line=2, rows="B9 B16", space=0.1, needs=("ptp",))
def replace(arm: Arm) -> None:
    """A new motion replaces the running and queued ones, or is refused, as requested."""
    first, waiting = arm.start(_turned(60), speed=0.15), arm.start(_turned(30))
    _under_way(arm, first)
    try:
        arm.start(_turned(0), when="reject")
        holds(False, "one that shall not wait is refused")
    except ModeConflict as error:
        note(error.text)
    last = arm.start(_turned(-10), when="replace")
    holds(last.wait().arrived, "the new one arrives")
    for handle in (first, waiting):
        holds(handle.wait().cause is Cause.REPLACED, "the others know that they were replaced")
    near(arm.wait_for_rest().q[6], np.radians(-10), 1e-3, "A7", unit="rad")


@scenario(line=2, rows="B10 B14", space=0.1, needs=("ptp",))
def cancel(arm: Arm) -> None:
    """A motion is cancelled while it runs: it brakes, reports it, and the arm stays where it stopped."""
    handle = arm.start(_turned(80), speed=0.15)
    _under_way(arm, handle)
    handle.cancel()
    result = handle.wait()
    holds(result.cause is Cause.CANCELLED and not result.arrived, f"interrupted: {result.cause.value}")
    rests = arm.wait_for_rest()
    below(rests.q[6], np.radians(75), "A7 stopped at", unit="rad")
    near(fresh(arm, after=0.2).q, rests.q, 1e-3, "and a little later", unit="rad")


@scenario(line=2, rows="B10 B11 B15", space=0.1, needs=("ptp", "joint_impedance"))
def stop(arm: Arm) -> None:
    """A stop from another thread ends a blocking move with an error; the arm holds, stiff, then compliant."""

    def stopping() -> None:
        arm.wait_until(lambda s: abs(s.q[6] - HOME[6]) > 0.03, timeout=20.0)
        arm.stop()

    other = threading.Thread(target=stopping)
    other.start()
    try:
        arm.move(ptp(HOME + deg(0, 0, 0, 0, 0, 0, 90), speed=0.1))
        holds(False, "the move ends with an error")
    except MotionAborted as error:
        holds(error.cause is Cause.STOPPED and len(error.history) > 3, f"{error.text}, with its last states")
    other.join()
    rests = arm.wait_for_rest()
    near(fresh(arm, after=0.2).q, rests.q, 1e-3, "held, stiff", unit="rad")
    compliant = record(arm, hold(0.4), mode=JointImpedance(300.0))
    near(compliant.q[-1], rests.q, 0.02, "held, compliant", unit="rad")


@scenario(line=2, rows="F12", space=0.2, needs=("lin_rel", "pause"))
def pause(arm: Arm) -> None:
    """A motion pauses on its path, and continues along it."""
    start = arm.wait_for_rest().pose
    handle = arm.start(lin_rel(y=0.12, frame="base", speed_mps=0.06))
    arm.wait_until(lambda s: s.pose.distance_to(start) > 0.02, timeout=20.0)
    arm.pause()
    arm.wait_until(lambda s: s.safety.paused and np.abs(s.dq).max() < 1e-3, timeout=20.0)
    paused = arm.state
    holds(not handle.done and paused.pose.distance_to(start) < 0.11, "it rests on its path")
    arm.resume()
    states = [state for state in watch(arm, 0.1)]
    holds(handle.wait().arrived, "it arrives")
    places = np.array([state.pose.xyz for state in states]) - start.xyz
    below(float(np.abs(places[:, [0, 2]]).max()), 5e-4, "offset from its path", unit="m")
    near(arm.wait_for_rest().pose.xyz - start.xyz, (0, 0.12, 0), 5e-4, "end", unit="m")


@scenario(line=2, rows="B13", space=0.25, needs=("lin", "blending"))
def blending(arm: Arm) -> None:
    """At a blended corner the arm does not stop; without blending it does."""
    start = arm.wait_for_rest().pose
    corner = Pose(start.xyz + [0.0, 0.06, 0.0], start.quat)
    end = Pose(start.xyz + [0.05, 0.06, 0.0], start.quat)
    sides = [
        lin(corner, speed_mps=0.07, acceleration_mps2=0.15),
        lin(end, speed_mps=0.07, acceleration_mps2=0.15),
    ]
    blended = record(arm, [replaced(sides[0], blending=Blending(distance=0.02)), sides[1]])
    near(arm.wait_for_rest().pose.xyz, end.xyz, 5e-4, "end", unit="m")
    fast = np.flatnonzero(blended.speeds > 0.9 * 0.07)
    above(float(blended.speeds[fast[0] : fast[-1]].min()), 0.3 * 0.07, "slowest at the corner", unit="m/s")
    arm.move(lin(start, speed_mps=0.3))
    exact = record(arm, sides)
    fast = np.flatnonzero(exact.speeds > 0.9 * 0.07)
    below(float(exact.speeds[fast[0] : fast[-1]].min()), 0.1 * 0.07, "without blending", unit="m/s")


@scenario(line=2, rows="B6 B5", space=0.1, needs=("ptp",))
def progress(arm: Arm) -> None:
    """Progress increases, and the time to the destination decreases with time."""
    pushed = arm.states()  # from before the beginning: a slow machine would miss the first of them
    handle = arm.start(_turned(60))
    seen = []
    end = None
    for state in pushed:
        if state.motion is not None and state.motion.id == handle.id:
            seen.append((state.motion.stamp * 1e-9, handle.progress, state.motion.remaining))
        if end is None and handle.done:
            end = arm.state.stamp
        if end is not None and state.stamp >= end:
            break
    pushed.close()
    reported = np.array([entry for entry in seen if np.isfinite(entry[2])])
    above(len(reported), 5, "states with the time to the destination")
    holds((np.diff([entry[1] for entry in seen]) >= 0).all(), "progress never goes back")
    ends = reported[:, 0] + reported[:, 2]
    below(float(np.ptp(ends[2:])), 0.05, "the end that they foretell moves by", unit="s")


@scenario(line=2, rows="B7", space=0.2, needs=("lin_rel", "blending", "triggers"))
def triggers(arm: Arm) -> None:
    """Triggers of blended motions fire at their points of the path, motions continue, the handle gets all events."""
    start = arm.wait_for_rest().pose.xyz
    there = lin_rel(y=0.08, frame="base", speed_mps=0.05, blend_m=0.01).trigger(
        path.after(0.04), notify("half")
    )
    back = lin_rel(z=0.04, frame="base", speed_mps=0.05).trigger(path.before_end(), notify("end"))
    handle = arm.start([there, back])
    events = list(handle.events())
    holds(handle.wait().arrived, "the program arrives")
    reported = [(event.kind, event.item, event.label) for event in events]
    wanted = [("begun", 0, ""), ("trigger", 0, "half"), ("ended", 0, ""), ("begun", 1, "")]
    holds(reported[:4] == wanted and ("trigger", 1, "end") in reported, f"events in their order: {reported}")
    half = next(event.state for event in events if event.label == "half")
    assert half is not None and half.joints is not None
    moved = Pose.from_matrix(forward(arm.robot, half.joints.q_cmd)).xyz - start
    above(float(moved[1]), 0.039, "reported behind the point, at", unit="m")


@scenario(line=2, rows="B12", space=0.1, needs=("ptp", "hold"))
def wait(arm: Arm) -> None:
    """The cabinet waits between two motions of a program."""
    recording = record(arm, [_turned(10), hold(0.4), _turned(0)])
    still = np.abs(recording.rates).max(axis=1) < 1e-3
    apart = recording.q_cmd[1:, 6] > np.radians(9.9)
    near(float(np.diff(recording.t)[still & apart].sum()), 0.4, 0.15, "rest at the turning point", unit="s")
    holds(recording.result.arrived and recording.result.item == 2, "all three were done")


@scenario(line=2, rows="B15 G20", space=0.1, needs=("ptp", "lin_rel"))
def error(arm: Arm) -> None:
    """A failed motion gives its reason, queued motions are dropped, and the next motion is unaffected."""
    try:
        arm.move([_turned(3), lin_rel(x=3.0, frame="base")])
        holds(False, "a line that leaves the workspace fails")
    except HeptarmError as trouble:
        holds(trouble.code != 0, f"code {trouble.code}: {trouble.text}")
    arm.wait_for_rest()
    holds(arm.move(_turned(5)).arrived, "the next one arrives")


@scenario(line=2, rows="F1", space=0.1, needs=("ptp",))
def ceiling(arm: Arm) -> None:
    """No motion exceeds the speed limit of the arm, whatever its own speed."""
    before, limit = arm.speed, 0.5 * min(arm.speed, 0.4)
    arm.speed = limit
    try:
        recording = record(arm, ptp(HOME + deg(0, 0, 0, 0, 0, 0, 30), speed=1.0))
    finally:
        arm.speed = before
    top = float(np.abs(recording.rates[:, 6]).max() / arm.robot.dq_max[6])
    near(top, limit, 0.03 * limit, "fraction of A7's maximum")


@scenario(line=2, rows="C28", space=0.15, needs=("ptp", "lin", "blending"))
def preview(arm: Arm) -> None:
    """A program moves along the path that a preview showed before, and takes as long."""
    start = arm.wait_for_rest().pose
    corner = Pose(start.xyz + [0.0, 0.1, 0.0], start.quat)
    program = [
        lin(corner, speed_mps=0.2, blend_m=0.02),
        lin(Pose(corner.xyz + [0.0, 0.0, 0.1], start.quat), speed_mps=0.2),
    ]
    ahead = arm.plan(program)
    holds(
        arm.state.motion is None or not arm.state.motion.active,
        f"nothing moves: {ahead.duration:.2f} s ahead",
    )
    note(f"closest to a limit: {ahead.closest('velocity')}")
    seen = record(arm, program)
    # a robot's own planner shapes the blend, and times it
    path_tolerance, time_tolerance = (1.5e-3, 0.03) if arm.is_virtual else (0.02, 0.3)
    places = ahead.tcp[:, :3]
    off = max(float(np.linalg.norm(places - place, axis=1).min()) for place in seen.xyz_cmd)
    below(off, path_tolerance + 0.5 * 0.2 * 0.01, "from the path of the preview", unit="m")
    near(seen.moving, ahead.duration, time_tolerance * ahead.duration + 0.05, "it took", unit="s")
    near(seen.q[-1], ahead.q[-1], 2e-3, "where it ended", unit="rad")
