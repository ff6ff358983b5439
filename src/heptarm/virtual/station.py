"""The station of the virtual cabinet: what Java sees of the plant and its FRI sessions, and what a project furnishes.

Java reads state from the shared ring without asking Python; only commands cross into Python, where they are
planned in the calling thread.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import jpype
import jpype.nio
import numpy as np

from heptarm.errors import CommandRejected, HeptarmError, Unreachable
from heptarm.model.inverse import solve
from heptarm.values.links import Body
from heptarm.values.pose import Pose
from heptarm.virtual.fri.sessions import Sessions
from heptarm.virtual.fri.signals import SessionSignal
from heptarm.virtual.java_order import JavaListener, mode_of, numbers, order_of
from heptarm.virtual.order import PlanError
from heptarm.virtual.plant import Plant
from heptarm.virtual.templates import Project


def boxed(value: str | int | float | bool) -> Any:
    """A value as the Java object that an application finds in its process data."""
    kinds = {bool: "java.lang.Boolean", int: "java.lang.Integer", float: "java.lang.Double"}
    kind = kinds.get(type(value))
    return jpype.JString(value) if kind is None else jpype.JClass(kind).valueOf(value)


def furnish(station: Any, project: Project) -> None:
    """Give a station the templates and taught frames of a project."""
    made = jpype.JClass("heptarm.doubles.Template")
    for one in project.templates:
        template = made(one.is_tool, one.mass, _doubles(one.centre), _doubles(one.inertia), one.moved)
        template.setType(one.type)
        for path, placed in one.frames:
            template.addFrame(path, _doubles(placed))
        station.addTemplate(one.name, template)
    for path, placed in project.frames:
        station.addFrame(path, _doubles(placed))
    for path, redundancy in project.redundancies:
        station.setRedundancy(path, *redundancy)


def _doubles(values: Sequence[float]) -> Any:
    return jpype.JArray(jpype.JDouble)(list(values))


def open_station(plant: Plant, sessions: Sessions) -> Any:
    """Give the plant and its FRI sessions to Java; returns heptarm.doubles.Station."""
    robot = plant.robot
    limits = [*robot.q_min, *robot.q_max, *robot.dq_max, *robot.tau_max]

    @jpype.JImplements("heptarm.doubles.Plant")
    class Proxy:
        """The plant as Java sees it."""

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def title(self) -> str:
            return robot.title

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def limits(self) -> Any:
            return jpype.JArray(jpype.JDouble)(limits)

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def submit(self, order: Any) -> str | None:
            try:
                made = order_of(order)
                if order.friSession:
                    overlaid = sessions.overlaid(
                        int(order.friSession),
                        int(order.friCommand),
                        made.id,
                        made.mode,
                        JavaListener(order.listener),
                    )
                    made = replace(made, listener=overlaid)
                plant.submit(made)
            except (PlanError, CommandRejected) as error:
                return str(error)
            return None

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def cancel(self, order_id: int) -> None:
            plant.cancel(int(order_id))

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def cancelAll(self) -> None:
            plant.cancel(None)

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def stopFast(self) -> None:
            plant.stop_fast()

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def acknowledge(self) -> None:
            plant.acknowledge()

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def clipManualOverride(self, most: float) -> None:
            plant.safety.manual = min(plant.safety.manual, float(most))

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def pause(self) -> None:
            plant.pause()

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def resume(self) -> None:
            plant.resume()

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def changeMode(self, order_id: int, values: Any) -> None:
            mode, _ = mode_of(values)
            if mode is not None:
                plant.change_mode(int(order_id), mode)

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def watch(self, condition: Any, at_once: bool, listener: Any) -> int:
            return plant.lookout.observe(numbers(condition), listener.changed, at_once=bool(at_once))

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def unwatch(self, number: int) -> None:
            plant.lookout.forget(int(number))

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def signal(self, name: Any, output: bool) -> int:
            try:
                return plant.signals.place(str(name), is_output=bool(output))
            except ValueError as error:
                raise jpype.JClass("java.lang.IllegalStateException")(str(error)) from error

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def inverse(self, pose: Any, redundancy: Any, near: Any) -> Any:
            place = numbers(pose)
            try:
                e1, status, _ = numbers(redundancy)
                found = solve(
                    robot,
                    Pose.of(place[:3], place[3:]),
                    e1=e1,
                    status=int(status),
                    near=list(numbers(near)),
                )
            except Unreachable:
                return None
            return jpype.JArray(jpype.JDouble)(found.tolist())

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def friOpen(self, host: Any, settings: Any, transformations: Any, signals: Any, channel: Any) -> int:
            period, multiplier, port, own = (int(value) for value in settings[:])
            try:
                return sessions.open(
                    (str(host), port),
                    period_ms=period,
                    multiplier=multiplier,
                    port=None if own < 0 else own,
                    transformations=tuple(str(name) for name in transformations),
                    signals=tuple(SessionSignal.of(one) for one in signals),
                    channel=channel.changed,
                )
            except HeptarmError as error:  # Java would see a proxy without a word
                raise jpype.JClass("java.lang.IllegalStateException")(str(error)) from error

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def friClose(self, number: int) -> None:
            sessions.close(int(number))

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def carries(self, values: Any) -> None:
            mass, *rest = numbers(values)
            try:
                plant.carries(Body(mass, np.array(rest[:3]), inertia=np.array(rest[3:])))
            except HeptarmError as error:
                raise jpype.JClass("java.lang.IllegalArgumentException")(str(error)) from error

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def links(self) -> Any:
            return jpype.JArray(jpype.JDouble)([robot.d_bs, robot.d_se, robot.d_ew, robot.d_wf])

    memory = jpype.nio.convertToDirectBuffer(plant.ring.memory)
    station = jpype.JClass("heptarm.doubles.Station").open(memory, Proxy())
    hub = station.hub
    plant.on_wake = hub.tick
    plant.on_safety = station.safetyChanged
    return station
