"""The plant as Java sees it: motion orders, conditions, FRI sessions, and the project's templates.

Java reads states from the shared memory without asking Python; only commands cross into Python. Threads of Python take
them from a queue of Java: JPype makes a type for the Java objects of each thread state of Python, a Java thread has a
new thread state in each call, and the types are never freed (1.6 kB for each call with JPype 1.7). Orders and
conditions come as the bytes that `heptarm.planning.seam` decodes.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import isnan
from typing import Any, cast

import jpype
import jpype.nio
import numpy as np

from heptarm.errors import CommandRejected, HeptarmError, Unreachable
from heptarm.model.inverse_kinematics import solve
from heptarm.planning import seam
from heptarm.planning.motion import PlanError
from heptarm.sim.controller.command import ConditionWatch, MotionCommand
from heptarm.sim.fri.io import SessionSignal
from heptarm.sim.fri.sessions import Sessions
from heptarm.sim.plant.carried import CarriedShapes
from heptarm.sim.plant.plant import Plant
from heptarm.sim.runtime.project import Project
from heptarm.values.frames import TOOL
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Mode
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.pose import Pose
from heptarm.values.robot import Body
from heptarm.values.shape import Shape, ShapeKind

log = logging.getLogger("heptarm.sim")

#: Calls of Java that are carried out at the same time; a stop never waits for a motion that is being planned.
_CALLS_AT_ONCE = 4


class JavaListener:
    """A Java listener as the plant's; see `heptarm.sim.controller.command.PartListener`."""

    __slots__ = ("_java",)

    def __init__(self, java: Any) -> None:
        self._java = java

    def started(self) -> None:
        """The motion begins."""
        self._java.started()

    def finished(self, cause: str, text: str) -> None:
        """The motion has ended."""
        self._java.finished(int(seam.EndCause[cause.upper()]), text)

    def reached(self, part: int) -> None:
        """A part of it begins."""
        self._java.reached(part)


# -------------------------------------------------------------------------------------------------------- translation


def _keywords(value: Any) -> dict[str, Any]:
    """Fields of a value of the seam by name, arrays as arrays."""
    found = {name: getattr(value, name) for name in value.__slots__}
    return {name: np.array(value) if isinstance(value, tuple) else value for name, value in found.items()}


def mode_of(mode: seam.ImpedanceMode | None) -> tuple[Mode | None, tuple[float, ...] | None]:
    """A control mode, and the quaternion of its axes if they are fixed to the base."""
    if mode is None:
        return None, None
    if isinstance(mode, seam.JointImpedance):
        return JointImpedance(**_keywords(mode)), None
    if isinstance(mode, seam.SineImpedance):
        base, axes = _cartesian(mode.base)
        return SineImpedance(**{**_keywords(mode), "base": base}), axes
    return _cartesian(mode)


def _cartesian(mode: seam.CartesianImpedance) -> tuple[CartesianImpedance, tuple[float, ...] | None]:
    given = _keywords(mode)
    axes = given.pop("axes")
    given["max_force_stops"] &= not np.isnan(mode.max_force).all()
    return CartesianImpedance(**given, frame=TOOL if axes is None else "reference"), mode.axes


def command_of(order: seam.MotionOrder, java: Any) -> MotionCommand:
    """The command of a motion.

    Args:
        order: as Java describes it.
        java: its listener.
    """
    mode, axes = mode_of(order.mode)
    listener = JavaListener(java)
    watches = tuple(
        ConditionWatch(
            condition.condition,
            partial(java.fired, condition.part, condition.breaks, condition.index),
            condition.breaks,
            condition.part,
        )
        for condition in order.conditions
    )
    return MotionCommand(order.id, order.motion, order.tcp, mode, axes, listener, listener, watches)


# --------------------------------------------------------------------------------------------------------------- Java


def boxed(value: str | int | float | bool) -> Any:
    """A value as the Java object that an application finds in its process data."""
    kinds = {bool: "java.lang.Boolean", int: "java.lang.Integer", float: "java.lang.Double"}
    kind = kinds.get(type(value))
    return jpype.JString(value) if kind is None else jpype.JClass(kind).valueOf(value)


def add_project(station: Any, project: Project) -> None:
    """Give a station the templates and taught frames of a project."""
    made = jpype.JClass("heptarm.doubles.runtime.ObjectTemplate")
    for entry in project.templates:
        template = made(
            entry.is_tool, entry.mass, _doubles(entry.centre), _doubles(entry.inertia), entry.moved
        )
        template.setType(entry.type)
        for path, placed in entry.frames:
            template.addFrame(path, _doubles(placed))
        station.addTemplate(entry.name, template)
    for path, placed in project.frames:
        station.addFrame(path, _doubles(placed))
    for path, redundancy in project.redundancies:
        station.setRedundancy(path, *redundancy)
    for path, name, value in project.parameters:
        station.setParameter(path, name, boxed(value))


def _doubles(values: Sequence[float]) -> Any:
    return jpype.JArray(jpype.JDouble)(list(values))


def _numbers(values: Any) -> list[float]:
    """Numbers of a Java array."""
    return [float(value) for value in values[:]]


class JavaPlant:
    """The methods of the Java interface heptarm.doubles.plant.Plant.

    Args:
        plant: the plant.
        sessions: its FRI sessions.
    """

    def __init__(self, plant: Plant, sessions: Sessions) -> None:
        self._plant, self._sessions = plant, sessions

    def describe(self) -> Any:
        """Name, limits and dimensions of the robot."""
        robot = self._plant.robot
        names = seam.RobotDescription.__slots__
        return jpype.JArray(jpype.JByte)(
            seam.RobotDescription(**{name: getattr(robot, name) for name in names}).encode()
        )

    def submit(self, order: Any, listener: Any) -> str | None:
        """Plan and queue a motion; the text of a refusal, or None."""
        given = seam.MotionOrder.decode(bytes(order.encode()))
        try:
            made = command_of(given, listener)
            overlay = given.fri_overlay
            if overlay is not None:
                overlaid = self._sessions.overlaid(
                    overlay.session, overlay.command, made.id, made.mode, JavaListener(listener)
                )
                made = replace(made, is_overlaid=True, listener=overlaid)
            self._plant.submit(made)
        except (PlanError, CommandRejected) as error:
            return str(error)
        return None

    def cancel(self, order_id: int) -> None:
        """Cancel a motion."""
        self._plant.cancel(int(order_id))

    def cancelAll(self) -> None:
        """Cancel every motion."""
        self._plant.cancel(None)

    def stopFast(self) -> None:
        """Brake every axis with full deceleration."""
        self._plant.stop_fast()

    def acknowledge(self) -> None:
        """Acknowledge errors whose cause is gone."""
        self._plant.acknowledge()

    def clipManualOverride(self, limit: float) -> None:
        """Limit the manual override."""
        self._plant.safety.manual = min(self._plant.safety.manual, float(limit))

    def pause(self) -> None:
        """Pause execution."""
        self._plant.pause()

    def resume(self) -> None:
        """Resume execution."""
        self._plant.resume()

    def changeMode(self, order_id: int, mode: Any) -> None:
        """Change the parameters of a running motion's control mode."""
        if mode is not None:
            changed, _ = mode_of(seam.decode_impedance_mode(bytes(mode.encode())))
            if changed is not None:
                self._plant.change_mode(int(order_id), changed)

    def watch(self, condition: Any, at_once: bool, listener: Any) -> int:
        """Monitor a condition; returns its number."""
        decoded = seam.decode_condition(bytes(condition.encode()))
        return self._plant.condition_monitor.observe(decoded, listener.changed, at_once=bool(at_once))

    def unwatch(self, number: int) -> None:
        """Stop monitoring a condition."""
        self._plant.condition_monitor.forget(int(number))

    def signal(self, name: Any, output: bool) -> int:
        """Place of a signal in the IO image."""
        return self._plant.signals.place(str(name), is_output=bool(output))

    def inverse(self, pose: Any, e1: float, status: int, near: Any) -> Any:
        """Inverse kinematics; None where there is no solution."""
        place = _numbers(pose)
        try:
            found = solve(
                self._plant.robot,
                Pose.of(place[:3], place[3:]),
                e1=None if isnan(e1) else float(e1),
                status=int(status),
                near=_numbers(near),
            )
        except Unreachable:
            return None
        return _doubles(found.tolist())

    def friOpen(self, settings: Any, channel: Any) -> int:
        """Open an FRI session; returns its number."""
        given = seam.FriSessionSettings.decode(bytes(settings.encode()))
        return self._sessions.open(
            (given.host, given.remote_port),
            period_ms=given.send_period,
            multiplier=given.receive_multiplier,
            port=given.local_port or None,
            transformations=given.transformations,
            signals=tuple(SessionSignal.of(signal) for signal in given.signals),
            channel=channel.changed,
        )

    def friClose(self, number: int) -> None:
        """Close an FRI session."""
        self._sessions.close(int(number))

    def setAttachedLoad(self, load: Any) -> None:
        """Set the load data of everything attached to the flange."""
        self._plant.set_load_data(_body(load))

    def setSafetyLoad(self, load: Any, workpiece: float) -> None:
        """Set the load that the safety functions count."""
        self._plant.set_safety_load(_body(load), workpiece=float(workpiece))

    def setCarriedBodies(self, carried: Any) -> None:
        """Set the shapes of everything attached to the flange."""
        given = seam.CarriedBodies.decode(bytes(carried.encode()))
        self._plant.carry(
            [
                CarriedShapes(
                    body.name, tuple(map(_shape, body.shapes)), _pose(body.pose), is_tool=body.is_tool
                )
                for body in given.bodies
            ]
        )


def _body(load: Any) -> Body:
    given = seam.AttachedLoad.decode(bytes(load.encode()))
    return Body(given.mass, np.array(given.centre), inertia=np.array(given.inertia))


def _shape(shape: seam.BodyShape) -> Shape:
    return Shape(cast("ShapeKind", shape.kind.name.lower()), np.array(shape.size), _pose(shape.pose))


def _pose(numbers: Sequence[float]) -> Pose:
    return Pose.of(numbers[:3], numbers[3:])


def java_memory() -> dict[str, int]:
    """Used bytes of the heap, and number of threads of Java."""
    factory = jpype.JClass("java.lang.management.ManagementFactory")
    heap = factory.getMemoryMXBean().getHeapMemoryUsage()
    return {"java_heap": int(heap.getUsed()), "java_threads": int(factory.getThreadMXBean().getThreadCount())}


#: Methods whose errors concern their argument; those of the others concern the state of the plant.
_ARGUMENT_ERRORS = ("setAttachedLoad", "setSafetyLoad", "setCarriedBodies")


def _carry_out(calls: Any, plant: JavaPlant) -> None:
    """Carry out calls of Java for ever."""
    while True:
        call = calls.next()
        method = str(call.method)
        try:
            call.returned(getattr(plant, method)(*call.arguments))
        except Exception as error:
            if not isinstance(error, (HeptarmError, ValueError)):
                log.exception("%s failed", method)
            call.failed(str(error) or repr(error), method in _ARGUMENT_ERRORS)


def open_station(plant: Plant, sessions: Sessions) -> Any:
    """Give the plant and its FRI sessions to Java; returns heptarm.doubles.runtime.Station."""
    memory = jpype.nio.convertToDirectBuffer(plant.shared.memory)
    calls, given = jpype.JClass("heptarm.doubles.plant.PlantCalls")(), JavaPlant(plant, sessions)
    for number in range(_CALLS_AT_ONCE):
        name = f"plant-calls-{number}"
        threading.Thread(target=_carry_out, args=(calls, given), name=name, daemon=True).start()
    station = jpype.JClass("heptarm.doubles.runtime.Station").open(memory, calls)
    plant.on_wake = station.timers.tick
    plant.on_safety = station.safetyChanged
    return station
