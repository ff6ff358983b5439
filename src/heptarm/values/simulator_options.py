"""Options of the simulator, shared by `heptarm sim`, "sim://MODEL?OPTION=VALUE" and the cabinet's process."""

from __future__ import annotations

from dataclasses import Field, dataclass, field, fields
from pathlib import Path
from typing import Any, Literal, TypeAlias

from heptarm.values.robot import flange

#: When a virtual cabinet asks for real-time priority: while an FRI client has to answer each tick, always, never.
RealTime: TypeAlias = Literal["fri", "on", "off"]
REAL_TIME: RealTime = "fri"


def _about(
    text: str, *, metavar: str = "", in_target: bool = False, allowed: tuple[float, float] | None = None
) -> dict[str, Any]:
    """What an option has beside its default; an empty tuple as default: it may be given several times.

    Args:
        text: help.
        metavar: form of the value.
        in_target: also legal in a target "sim://MODEL?OPTION=VALUE".
        allowed: range of the value in a target.
    """
    return {"help": text, "metavar": metavar, "in_target": in_target, "allowed": allowed}


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorOptions:
    """Options of a virtual cabinet; a new one is declared here and used in `heptarm.sim.runtime.cabinet`."""

    model: str = field(
        default="",
        metadata=_about("name of the robot; default: that of the project's station setup, or iiwa14"),
    )
    flange: str = field(
        default="",
        metadata=_about(
            "media flange: plain, touch, or its height [m]; default: that of the project's station setup, or plain",
            metavar="plain|touch|HEIGHT",
            in_target=True,
        ),
    )
    host: str = field(default="127.0.0.1", metadata=_about("address to listen on"))
    port: int = field(default=30001, metadata=_about("TCP port; 0: any free port"))
    speed: float = field(
        default=1.0,
        metadata=_about(
            "simulated seconds per second; 0: as fast as possible", in_target=True, allowed=(0.01, 100.0)
        ),
    )
    key_file: Path | None = field(
        default=None,
        metadata=_about(
            "file with the pre-shared key that clients must know; default: the environment variable HEPTARM_KEY"
        ),
    )
    application: str = field(
        default="", metadata=_about("class of another application; the process ends with it")
    )
    background: tuple[str, ...] = field(
        default=(), metadata=_about("class of a background task of that application; may be repeated")
    )
    observed: bool = field(
        default=False,
        metadata=_about("also serve clients that observe that application and may stop the arm"),
    )
    classpath: tuple[str, ...] = field(
        default=(), metadata=_about("folder or jar with its classes; may be repeated")
    )
    answer: tuple[int, ...] = field(
        default=(),
        metadata=_about(
            "button of the next dialog of the application, from 0; may be repeated", metavar="BUTTON"
        ),
    )
    fri_version: str = field(
        default="1.15", metadata=_about("version of the cabinet's FRI, such as 1.11 or 2.5")
    )
    project: Path | None = field(
        default=None,
        metadata=_about("RoboticsAPI.data.xml with process data, tool templates and frames", in_target=True),
    )
    station: Path | None = field(
        default=None,
        metadata=_about(
            "StationSetup.cat with the project's robot; default: the one beside the project's data"
        ),
    )
    box: tuple[str, ...] = field(
        default=(),
        metadata=_about(
            "fixed box in the world [m]; may be repeated", metavar="X,Y,Z,LENGTH,WIDTH,HEIGHT", in_target=True
        ),
    )
    scene: str = field(
        default="",
        metadata=_about(
            "what is around the arm and on its flange: table, peg-in-hole, bins, shelf, table-and-post, cage, "
            "narrow-slot, two-arms, or a file (MJCF)",
            metavar="NAME|FILE",
            in_target=True,
        ),
    )
    payload: str = field(
        default="",
        metadata=_about(
            "true payload on the flange, whatever load data the controller has [kg, m]",
            metavar="MASS[,X,Y,Z]",
            in_target=True,
        ),
    )
    data: tuple[str, ...] = field(
        default=(), metadata=_about("process data; may be repeated", metavar="NAME=VALUE")
    )
    map: tuple[str, ...] = field(
        default=(),
        metadata=_about(
            "address of the lab's network and the one that takes its place in process data and FRI sessions; may be "
            "repeated",
            metavar="ADDRESS=ADDRESS",
        ),
    )
    drive_monitoring: str = field(
        default="on",
        metadata=_about(
            '"off": drives never trip, whatever speed, torque or position', metavar="on|off", in_target=True
        ),
    )
    safety: str = field(
        default="",
        metadata=_about(
            "limits of safety functions, with the load of tool and safety workpiece: external torque of an axis while "
            "the arm moves [Nm], mass of a safety workpiece [kg]",
            metavar="TORQUE[,MASS]",
            in_target=True,
        ),
    )
    sensors: str = field(
        default="ideal",
        metadata=_about(
            '"noisy": sensors with noise, offset and resolution, and joints with friction, the same for a seed',
            metavar="ideal|noisy[:SEED]",
            in_target=True,
        ),
    )
    fitted: Path | None = field(
        default=None,
        metadata=_about(
            "file of a measured arm, of `heptarm calibrate arm`: friction, stiffness and errors of its sensors",
            metavar="FILE",
            in_target=True,
        ),
    )
    fault: tuple[str, ...] = field(
        default=(),
        metadata=_about(
            "fault at a simulated time, such as emergency_stop@5; may be repeated",
            metavar="NAME@SECONDS",
            in_target=True,
        ),
    )
    real_time: str = field(
        default=REAL_TIME,
        metadata=_about(
            'real-time priority: "fri": while an FRI session is open; "on": always, and Java compiled for the lowest '
            'latency; "off": never',
            metavar="fri|on|off",
            in_target=True,
        ),
    )
    stats: Path | None = field(
        default=None,
        metadata=_about("file for statistics of the realtime loop and of memory, at the end and on SIGUSR1"),
    )
    trace: Path | None = field(
        default=None, metadata=_about("file for the state of the plant after each tick (0.5 MB/s)")
    )
    positions: Path | None = field(
        default=None, metadata=_about("file that always has the positions of arm and scene, for the view")
    )
    parent_pipe: bool = field(
        default=False,
        metadata=_about("end when standard input is closed; its lines are actions of the simulated operator"),
    )
    verbose: bool = field(default=False, metadata=_about("log to standard error"))

    def arguments(self) -> list[str]:
        """Command line of the cabinet's process for all values that differ from their default."""
        result: list[str] = []
        for option in fields(self):
            value = getattr(self, option.name)
            if value == option.default:
                continue
            if isinstance(value, bool):
                result.append(flag(option.name))
                continue
            for part in value if isinstance(value, tuple) else (value,):
                result += [flag(option.name), str(part)]
        return result


def flag(name: str) -> str:
    """Command line flag of an option."""
    return "--" + name.replace("_", "-")


def check_target_option(name: str, value: str) -> None:
    """Check an option of a target "sim://MODEL?OPTION=VALUE"; the cabinet's process checks the text of the others.

    Raises:
        ValueError: there is no such option, or its value is out of range.
    """
    known: dict[str, Field[Any]] = {
        field.name: field for field in fields(SimulatorOptions) if field.metadata["in_target"]
    }
    if name not in known:
        raise ValueError(f"option must be one of {', '.join(known)}; got {name!r}")
    if name == "flange":
        flange(value)
    allowed = known[name].metadata["allowed"]
    if allowed is None:
        return
    low, high = allowed
    try:
        good = low <= float(value) <= high
    except ValueError:
        good = False
    if not good:
        raise ValueError(f"{name} must be in [{low:g}, {high:g}], got {value}")
