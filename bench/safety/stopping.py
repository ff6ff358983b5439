"""Stops at random instants of every kind of motion, on the plant with its dynamics."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bench.measure.figure import Figure, benchmark
from heptarm.model.kinematics import forward
from heptarm.planning.motion import CARTESIAN_DEFAULT, TICK, ServoMotion
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.plant.plant import Plant
from heptarm.values.motion.hand_guiding import hand_guide
from heptarm.values.pose import Pose
from tests.sim import motions
from tests.sim.driving import READY
from tests.sim.ideal import KINDS, braking, stopping_time

INSTANTS = 200
#: Time that every stop has beyond that of its deceleration limit, in which the joints settle at their setpoints [s].
SETTLING = 0.1
#: Distance of a servo target from its start [rad]; from farther away the arm may hit the floor or itself.
REACH = 0.4
#: Kinds of motion that follow a target or a hand; limits on lines, distance [m], force of the hand [N].
GUIDED = ("straight", "guiding")
QUICK = motions.straight(velocity=(0.5,) * 3 + (1.0,) * 3, acceleration=(2.0,) * 3 + (4.0,) * 3)
DISTANCE = 0.06
PUSH = 60.0
#: An axis below this speed is at rest [rad/s].
REST = 0.01


@benchmark("stopping")
def stopping() -> Iterator[Figure]:
    """200 stops of each kind at random instants of each kind of motion: how many rest in time, and the times."""
    for how in ("path", "fast", "emergency"):
        for kind in (*KINDS, *GUIDED):
            random = np.random.default_rng(19)
            times, in_time = [], 0
            for _ in range(INSTANTS):
                time, allowed = (_stop_guided if kind in GUIDED else _stop)(kind, how, random)
                times.append(time)
                in_time += time <= allowed
            detail = {
                "median_ms": round(float(np.median(times)) * 1e3, 1),
                "max_ms": round(max(times) * 1e3, 1),
            }
            fraction = in_time / INSTANTS
            yield Figure(f"stop_{how}_{kind}", fraction, "fraction", limit=1.0, at_least=True, detail=detail)


def _stop(kind: str, how: str, random: np.random.Generator) -> tuple[float, float]:
    """One stop: how long the arm takes to rest, and how long it may [s]."""
    plant, order = Plant("iiwa14", q=READY), KINDS[kind]
    plant.submit(order)
    plant.tick()
    if isinstance(order.motion, ServoMotion):
        plant.shared.post(order.id, np.array(READY) + random.uniform(-REACH, REACH, 7))
    plant.step(int(random.integers(1, 700)))
    allowed = stopping_time(plant, how) + SETTLING
    return _rest(plant, how), allowed


def _stop_guided(kind: str, how: str, random: np.random.Generator) -> tuple[float, float]:
    """The same while the arm follows a Cartesian target, or a person who keeps pushing."""
    plant = Plant("iiwa14", q=READY)
    if kind == "guiding":
        plant.submit(MotionCommand(1, motions.guide(hand_guide())))
        plant.safety.guide()
        plant.step(50)
        plant.apply_wrench(tuple(random.uniform(-PUSH, PUSH, 3)))
        plant.step(int(random.integers(1, 700)))
        robot = plant.robot
        fastest = float(np.abs(plant.snapshot.dq).max())
        allowed = braking(fastest, 0.0, float(robot.ddq_max.min()), float(robot.dddq_max.min())) + SETTLING
        return _rest(plant, how), allowed
    plant.submit(MotionCommand(1, QUICK))
    plant.tick()
    here = _tip(plant)
    plant.shared.post(1, Pose.of(here.xyz + random.uniform(-DISTANCE, DISTANCE, 3), here.quat).array)
    plant.step(int(random.integers(3, 700)))
    if how != "path":
        allowed = stopping_time(plant, how)
    else:
        before, now, after = (
            Pose.from_matrix(forward(plant.robot, q)).xyz for q in plant.interpolator.command
        )
        speed, change = np.linalg.norm(after - now) / TICK, np.linalg.norm(after - 2 * now + before) / TICK**2
        allowed = braking(float(speed), float(change), *CARTESIAN_DEFAULT[1:])
    allowed += SETTLING
    return _rest(plant, how), allowed


def _tip(plant: Plant) -> Pose:
    return Pose.from_matrix(forward(plant.robot, plant.snapshot.q_cmd))


def _rest(plant: Plant, how: str) -> float:
    """Stop the arm; how long it takes to rest [s]."""
    if how == "emergency":
        plant.safety.request_stop(StopRequest.EMERGENCY_STOP)
    else:
        (plant.stop_fast if how == "fast" else plant.stop)()
    ticks = last = 0
    while ticks < 50 or ticks - last < 50:  # until it has rested for a while
        plant.tick()
        ticks += 1
        if float(np.abs(plant.snapshot.dq).max()) > REST:
            last = ticks
    return last * TICK
