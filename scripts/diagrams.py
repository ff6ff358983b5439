"""Draw the diagrams of the documentation as SVG: data flows, one column per process, one box per step; and the network.

`diagrams.py` writes docs/_static/flow-*.svg and network.svg; `diagrams.py --check` fails if one of them is out of date,
or if a box names a file that does not exist.
"""

from __future__ import annotations

import sys
from html import escape
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "docs" / "_static"

#: Sizes in pixels.
LANE, BOX, STEP, HEIGHT, HEAD, MARGIN = 236, 216, 62, 40, 34, 12
COLOURS = ("#e8f0fb", "#eaf6ec", "#fdf3e3", "#f5eafa")
EDGE, TEXT, MUTED = "#4a5a6a", "#1c2733", "#53616f"


class Step(NamedTuple):
    """One box of a diagram.

    Attributes:
        lane: column, from 0.
        name: what it does.
        file: where it is, relative to the repository; shown by its last two parts.
        arrow: what passes to the next box.
    """

    lane: int
    name: str
    file: str
    arrow: str = ""


PY = "src/heptarm"
CORE, APP = "cabinet/core/src/heptarm/core", "cabinet/app/src/heptarm/app"
DOUBLES = "cabinet/doubles/src/heptarm/doubles"

DIAGRAMS: dict[str, tuple[tuple[str, ...], tuple[Step, ...]]] = {
    "motion": (
        ("Your program", "Cabinet application (Java 6)", "Doubles (Java 17)", "Simulator (Python)"),
        (
            Step(0, "Arm.move, Arm.start", f"{PY}/arm/verbs.py", "ProgramTerms"),
            Step(0, "check and time-limit the program", f"{PY}/arm/motion/program_request.py", "values"),
            Step(0, "values to messages", f"{PY}/arm/translate/motions.py", "wire.Run"),
            Step(0, "frame, send, await the answer", f"{PY}/arm/link/link.py", "TCP"),
            Step(1, "read a frame", f"{CORE}/session/ClientConnection.java", "Run"),
            Step(1, "check and accept", f"{CORE}/session/CommandHandler.java", "Program"),
            Step(1, "run items in order", f"{CORE}/motion/MotionExecutor.java", "Item"),
            Step(1, "build Sunrise motions", f"{APP}/MotionBuilder.java", "moveAsync"),
            Step(2, "describe the motion", f"{DOUBLES}/motion/MotionTranslator.java", "MotionOrder"),
            Step(3, "Java to Python", f"{PY}/sim/runtime/java_plant.py", "MotionCommand"),
            Step(3, "plan behind the motion before", f"{PY}/planning/planner.py", "Plan"),
            Step(3, "set-point each millisecond", f"{PY}/sim/controller/interpolator.py", "set-points"),
            Step(3, "torque", f"{PY}/sim/control_laws/active_law.py", "torque"),
            Step(3, "one step of MuJoCo", f"{PY}/sim/plant/plant.py"),
        ),
    ),
    "state": (
        ("Simulator (Python)", "Doubles (Java 17)", "Cabinet application (Java 6)", "Your program"),
        (
            Step(0, "write one tick", f"{PY}/sim/plant/plant.py", "numbers"),
            Step(0, "ring of ticks", f"{PY}/sim/plant/shared_state.py", "shared memory"),
            Step(1, "read a tick", f"{DOUBLES}/plant/SharedState.java", "LBR getters"),
            Step(2, "Sunrise units to SI", f"{APP}/SunriseSensors.java", "Sensors"),
            Step(2, "filter the velocity", f"{CORE}/state/StateReader.java", "groups"),
            Step(2, "one sample for all clients", f"{CORE}/state/StateSampler.java", "State"),
            Step(2, "write to the socket", f"{CORE}/session/ClientConnection.java", "TCP"),
            Step(3, "read, keep the body", f"{PY}/arm/link/link.py", "bytes"),
            Step(3, "newest sample, queues", f"{PY}/arm/link/state_stream.py", "StateSample"),
            Step(3, "decode when it is used", f"{PY}/arm/translate/state.py", "State"),
            Step(3, "arm.state, arm.states()", f"{PY}/arm/verbs.py"),
        ),
    ),
    "servo": (
        ("Your program", "Cabinet application (Java 6)", "Doubles (Java 17)", "Simulator (Python)"),
        (
            Step(0, "JointServo.set", f"{PY}/arm/motion/servo.py", "clipped target"),
            Step(0, "pack and send, no answer", f"{PY}/arm/link/link.py", "TCP"),
            Step(1, "read a frame", f"{CORE}/session/ClientConnection.java", "ServoJoints"),
            Step(1, "find the servo motion", f"{CORE}/session/CommandHandler.java", "Target"),
            Step(1, "newest target, watchdog", f"{CORE}/motion/ServoStream.java", "follow"),
            Step(1, "call the Sunrise runtime", f"{APP}/SunriseServo.java", "setDestination"),
            Step(2, "post the destination", f"{DOUBLES}/motion/ServoRuntime.java", "joints"),
            Step(2, "slot for a servo target", f"{DOUBLES}/plant/SharedState.java", "shared memory"),
            Step(3, "newest target", f"{PY}/sim/plant/shared_state.py", "q, dq"),
            Step(3, "aim the follower", f"{PY}/sim/controller/interpolator.py", "target"),
            Step(3, "online trajectory", f"{PY}/sim/controller/servo.py"),
        ),
    ),
    "fri": (
        ("Your program", "FRI loop (own process)", "Simulator, or KUKA's controller"),
        (
            Step(2, "tick, compose a message", f"{PY}/sim/fri/controller_side.py", "monitoring message"),
            Step(2, "send and receive", f"{PY}/sim/fri/server.py", "UDP"),
            Step(1, "receive a datagram", "native/fri_loop.c", "bytes"),
            Step(1, "decode the message", "native/fri_message.c", "monitored values"),
            Step(1, "session state", "native/fri_session.c", "Sample"),
            Step(1, "law, or newest command", "native/fri_cycle.c", "command"),
            Step(0, "Client.command", f"{PY}/fri/loop/client.py", "shared memory"),
            Step(1, "clamp to the limits", "native/fri_guard.c", "set-point"),
            Step(1, "encode the answer", "native/fri_message.c", "UDP"),
            Step(2, "check the command", f"{PY}/sim/fri/controller_side.py", "Superposition"),
            Step(2, "overlay on the motion", f"{PY}/sim/fri/sessions.py"),
        ),
    ),
    "ros": (
        ("ROS node", "heptarm.ros (no ROS import)", "heptarm.arm"),
        (
            Step(0, "goal callback", "ros2/heptarm_ros2/heptarm_ros2/trajectory.py", "goal message"),
            Step(1, "accept or refuse", f"{PY}/ros/node/driver.py", "TrajectoryGoal"),
            Step(1, "one motion for all goals", f"{PY}/ros/trajectory/streamed_execution.py", "goal, state"),
            Step(1, "check against the limits", f"{PY}/ros/trajectory/check.py", "JointTrajectory"),
            Step(1, "set-point of this instant", f"{PY}/ros/trajectory/runner.py", "ControlStep"),
            Step(1, "judge the tolerances", f"{PY}/ros/trajectory/tolerances.py", "verdict"),
            Step(1, "command the set-point", f"{PY}/ros/trajectory/servo_execution.py", "q, dq"),
            Step(2, "servo motion", f"{PY}/arm/motion/servo.py", "result"),
            Step(1, "feedback and result", f"{PY}/ros/node/driver.py", "GoalResult"),
            Step(0, "succeed, abort or cancel", "ros2/heptarm_ros2/heptarm_ros2/trajectory.py"),
        ),
    ),
}


def svg(lanes: tuple[str, ...], steps: tuple[Step, ...]) -> str:
    """Draw a diagram."""
    width = 2 * MARGIN + LANE * len(lanes)
    height = 2 * MARGIN + HEAD + STEP * len(steps)
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        f'font-family="system-ui, sans-serif">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        f'<path d="M0 0 L8 4 L0 8 z" fill="{EDGE}"/></marker></defs>',
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    for number, lane in enumerate(lanes):
        left = MARGIN + LANE * number
        out.append(
            f'<rect x="{left}" y="{MARGIN}" width="{LANE}" height="{height - 2 * MARGIN}" fill="{COLOURS[number]}"/>'
        )
        out.append(text(left + LANE / 2, MARGIN + 21, lane, size=13, weight=600))
    for number, step in enumerate(steps):
        x, y = _corner(number, step)
        out.append(
            f'<rect x="{x}" y="{y}" width="{BOX}" height="{HEIGHT}" rx="5" fill="#ffffff" stroke="{EDGE}"/>'
        )
        out.append(text(x + BOX / 2, y + 16, f"{number + 1}  {step.name}", size=12))
        short = "/".join(Path(step.file).parts[-2:])
        out.append(text(x + BOX / 2, y + 32, short, size=10, colour=MUTED))
        if number + 1 < len(steps):
            out.append(_arrow(number, step, steps[number + 1]))
    return "\n".join([*out, "</svg>", ""])


class Device(NamedTuple):
    """A box of the network's drawing.

    Attributes:
        x, y, width, height: its place and size [px].
        name: what it is.
        lines: further text.
        colour: index into COLOURS; -1: white.
    """

    x: float
    y: float
    width: float
    height: float
    name: str
    lines: tuple[str, ...] = ()
    colour: int = -1


class Cable(NamedTuple):
    """A connection between two points, with text above and below its middle."""

    start: tuple[float, float]
    end: tuple[float, float]
    above: str
    below: str = ""


NETWORK: tuple[Device, ...] = (
    Device(16, 16, 190, 268, "Workstation", ("Python, ROS",), 0),
    Device(46, 92, 130, 52, "network card", ("172.31.1.150",)),
    Device(46, 206, 130, 52, "second card", ("192.170.10.1",)),
    Device(470, 16, 354, 268, "Cabinet: one PC, two systems", (), 1),
    Device(484, 92, 120, 52, "X66 (KLI)", ("172.31.1.147",)),
    Device(484, 206, 120, 52, "KONI", ("192.170.10.2",)),
    Device(640, 72, 170, 84, "Windows", ("Java applications", "heptarm, TCP 30001"), 2),
    Device(640, 190, 170, 84, "Real-time system", ("motion kernel, 1 ms", "FRI, UDP 30200"), 3),
    Device(856, 16, 130, 268, "LBR iiwa", ("7 joints,", "7 torque sensors"), 0),
)
CABLES: tuple[Cable, ...] = (
    Cable((176, 118), (484, 118), "session: commands, states (TCP)", "FRI too, if it is set up for X66"),
    Cable((176, 232), (484, 232), "FRI only (UDP), optional"),
    Cable((604, 118), (640, 118), ""),
    Cable((604, 232), (640, 232), ""),
    Cable((604, 132), (640, 204), ""),
    Cable((725, 156), (725, 190), ""),
    Cable((810, 232), (856, 232), ""),
)


def network() -> str:
    """Draw the network between workstation and cabinet."""
    width, height = 1002, 300
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        f'font-family="system-ui, sans-serif">',
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    for one in NETWORK:
        fill = COLOURS[one.colour] if one.colour >= 0 else "#ffffff"
        out.append(
            f'<rect x="{one.x}" y="{one.y}" width="{one.width}" height="{one.height}" rx="5" fill="{fill}" '
            f'stroke="{EDGE}"/>'
        )
        middle = one.x + one.width / 2
        out.append(text(middle, one.y + 21, one.name, size=13, weight=600))
        for number, line in enumerate(one.lines):
            out.append(text(middle, one.y + 40 + 17 * number, line, size=11, colour=MUTED))
    for cable in CABLES:
        (x, y), (to_x, to_y) = cable.start, cable.end
        out.append(f'<path d="M{x} {y} L{to_x} {to_y}" stroke="{EDGE}" stroke-width="2" fill="none"/>')
        out.append(text((x + to_x) / 2, (y + to_y) / 2 - 8, cable.above, size=11))
        out.append(text((x + to_x) / 2, (y + to_y) / 2 + 18, cable.below, size=10, colour=MUTED))
    return "\n".join([*out, "</svg>", ""])


def _corner(number: int, step: Step) -> tuple[float, float]:
    return MARGIN + LANE * step.lane + (LANE - BOX) / 2, MARGIN + HEAD + STEP * number


def _arrow(number: int, one: Step, other: Step) -> str:
    (x, y), (to_x, to_y) = _corner(number, one), _corner(number + 1, other)
    if one.lane == other.lane:
        start, end = (x + BOX / 2, y + HEIGHT), (x + BOX / 2, to_y)
        label = text(x + BOX / 2 + 6, y + HEIGHT + 15, one.arrow, size=10, colour=MUTED, anchor="start")
        path = f"M{start[0]} {start[1]} L{end[0]} {end[1]}"
    else:  # to the side, then down into the next column
        right = other.lane > one.lane
        start = (x + (BOX if right else 0), y + HEIGHT / 2)
        end = (to_x + BOX / 2, to_y)
        path = f"M{start[0]} {start[1]} L{end[0]} {start[1]} L{end[0]} {end[1]}"
        at = (start[0] + end[0]) / 2
        label = text(at, start[1] - 5, one.arrow, size=10, colour=MUTED)
    return f'<path d="{path}" fill="none" stroke="{EDGE}" stroke-width="1.4" marker-end="url(#tip)"/>{label}'


def text(
    x: float,
    y: float,
    content: str,
    *,
    size: int,
    weight: int = 400,
    colour: str = TEXT,
    anchor: str = "middle",
) -> str:
    """A line of text, with its anchor at a point [px]."""
    return (
        f'<text x="{x}" y="{y}" font-size="{size}" font-weight="{weight}" fill="{colour}" '
        f'text-anchor="{anchor}">{escape(content)}</text>'
    )


def write(drawings: dict[str, str], arguments: list[str], *, by: str) -> int:
    """Write drawings into the folder, or with `--check` compare them.

    Args:
        drawings: SVG by the name of the file.
        arguments: of the command line.
        by: the script, for the message.

    Returns:
        The status to exit with.
    """
    stale = []
    for name, drawing in drawings.items():
        path = OUT / name
        if "--check" not in arguments:
            path.write_text(drawing, encoding="utf-8")
        elif not path.is_file() or path.read_text(encoding="utf-8") != drawing:
            stale.append(name)
    if stale:
        print(f"out of date: {', '.join(stale)}; run {by}", file=sys.stderr)
    return 1 if stale else 0


def main(arguments: list[str]) -> int:
    """Write the diagrams, or check them."""
    drawings = {"network.svg": network()}
    for name, (lanes, steps) in DIAGRAMS.items():
        missing = [step.file for step in steps if not (ROOT / step.file).is_file()]
        if missing:
            print(f"flow-{name}.svg names files that do not exist: {', '.join(missing)}", file=sys.stderr)
            return 1
        drawings[f"flow-{name}.svg"] = svg(lanes, steps)
    return write(drawings, arguments, by="scripts/diagrams.py")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
