"""Options common to the commands of `heptarm sim`; the cabinet's own defaults are those of `SimulatorOptions`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from heptarm.cli.options import Json, KeyFile, check_model
from heptarm.errors import CommandRejected
from heptarm.values.robot import ROBOTS
from heptarm.values.simulator_options import REAL_TIME, RealTime, SimulatorOptions

DEFAULTS = SimulatorOptions()
_LAST_PORT = 65535
#: Simulated seconds per second of real time.
_SLOWEST, _FASTEST = 0.01, 1000.0


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class ArmOptions:
    """Options of every simulated arm, with and without a cabinet."""

    model: Annotated[
        str | None,
        Parameter(
            validator=check_model,
            help=f"Robot: {', '.join(ROBOTS)}. Default: that of the project's StationSetup.cat, or iiwa14.",
        ),
    ] = None
    flange: Annotated[
        str,
        Parameter(
            help="Media flange: plain, touch, or its height above a plain one [m]. Default: that of the project's "
            "StationSetup.cat, or plain."
        ),
    ] = DEFAULTS.flange
    speed: Annotated[
        float, Parameter(help="Simulated seconds per second of real time; 0: as fast as possible.")
    ] = DEFAULTS.speed
    fault: Annotated[
        tuple[str, ...],
        Parameter(
            help="Inject a fault at a simulated time, as NAME@SECONDS: emergency_stop, operator_safety, "
            "protective_stop, drive_error, joint_limit, singularity, t1, release, clear ...; may be repeated. "
            "The same words can be typed while it runs."
        ),
    ] = DEFAULTS.fault
    payload: Annotated[
        str,
        Parameter(
            help="MASS or MASS,X,Y,Z: the true payload on the flange, whatever load data the controller has [kg, m]. "
            "Default: the controller's load data."
        ),
    ] = DEFAULTS.payload
    sensors: Annotated[
        str,
        Parameter(
            help="'noisy' or 'noisy:SEED': sensors with noise, offset and resolution, joints with friction. "
            "Default: ideal ones."
        ),
    ] = DEFAULTS.sensors
    fitted: Annotated[
        Path | None,
        Parameter(
            help="File of a measured arm, of heptarm calibrate arm: friction, stiffness in position control, the "
            "errors of its sensors. Default: what the simulator assumes."
        ),
    ] = DEFAULTS.fitted
    verbose: Annotated[
        bool,
        Parameter(
            negative="",
            help="Show the cabinet's log; beside an application the simulator's, of FRI each change of quality.",
        ),
    ] = DEFAULTS.verbose
    as_json: Json = False

    def __post_init__(self) -> None:
        """Refuse a speed that the simulator does not have.

        Raises:
            CommandRejected: it is out of range.
        """
        if self.speed != 0.0 and not _SLOWEST <= self.speed <= _FASTEST:
            raise CommandRejected(
                f"--speed must be 0 or in [{_SLOWEST:g}, {_FASTEST:g}], got {self.speed:g}",
                parameter="speed",
                value=self.speed,
                allowed=f"0, [{_SLOWEST:g}, {_FASTEST:g}]",
                hint="0 simulates as fast as possible",
            )


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class CabinetOptions(ArmOptions):
    """Options of a virtual cabinet, whatever application runs on it."""

    host: Annotated[str, Parameter(help="Address to listen on.")] = DEFAULTS.host
    real_time: Annotated[
        RealTime,
        Parameter(
            help="Real-time priority: while an FRI session is open (fri), always, and Java compiled for the lowest "
            "latency (on), never (off)."
        ),
    ] = REAL_TIME
    safety: Annotated[
        str,
        Parameter(
            help="TORQUE or TORQUE,MASS: limits of safety functions, which count the load of tool and safety "
            "workpiece: external torque of an axis while the arm moves [Nm], mass of a safety workpiece [kg]. "
            "Default: none."
        ),
    ] = DEFAULTS.safety
    scene: Annotated[
        str,
        Parameter(
            help="NAME or FILE: what is around the arm and on its flange: table, peg-in-hole, bins, shelf, "
            "table-and-post, cage, narrow-slot, two-arms, or a file (MJCF). Its bodies collide and can be grasped; the "
            "view shows them."
        ),
    ] = DEFAULTS.scene
    project: Annotated[
        Path | None,
        Parameter(
            help="RoboticsAPI.data.xml of a Sunrise project: process data, tool templates, frames; "
            "beside an application, used instead of the one in its folder."
        ),
    ] = DEFAULTS.project
    view: Annotated[bool, Parameter(negative="", help="Open a live 3D view in the browser.")] = False
    view_port: Annotated[
        int | None, Parameter(help="Port of view or panel; 0 takes a free one. Default: 8080.")
    ] = None
    meshes: Annotated[
        str,
        Parameter(
            help="With a view or panel: DIR with link_0.stl to link_7.stl, or .obj: draw the arm in these meshes "
            "instead of heptarm's own."
        ),
    ] = ""
    key_file: KeyFile = None
    key: Annotated[str, Parameter(show=False)] = ""

    def __post_init__(self) -> None:
        """Refuse a key on the command line, and a speed that the simulator does not have.

        Raises:
            CommandRejected: one of both is given.
        """
        ArmOptions.__post_init__(
            self
        )  # not super(): a class with slots is another one than the one written here
        if self.key:
            raise CommandRejected(
                "--key is not accepted: every user of this machine can read a command line",
                parameter="key",
                hint="put the key into a file of mode 0600 and use --key-file, or set HEPTARM_KEY",
            )

    def simulator(self, *, port: int, observed: bool = False) -> SimulatorOptions:
        """The options of the cabinet's process, which ends when its standard input is closed.

        Args:
            port: to listen on; 0: a free one.
            observed: clients may observe an application of the user.
        """
        return SimulatorOptions(
            model=self.model or DEFAULTS.model,
            flange=self.flange,
            host=self.host,
            port=port,
            observed=observed,
            speed=self.speed,
            real_time=self.real_time,
            fault=self.fault,
            payload=self.payload,
            safety=self.safety,
            sensors=self.sensors,
            fitted=self.fitted,
            scene=self.scene,
            project=self.project,
            parent_pipe=True,
            verbose=self.verbose,
        )


#: No options were given on the command line.
NO_OPTIONS = CabinetOptions()


def check_port(port: int, name: str) -> int:
    """A port to listen on.

    Raises:
        CommandRejected: there is no such port.
    """
    if not 0 <= port <= _LAST_PORT:
        raise CommandRejected(
            f"--{name} must be in [0, {_LAST_PORT}], got {port}",
            parameter=name,
            value=port,
            allowed=f"[0, {_LAST_PORT}]",
            hint="0 takes a free one",
        )
    return port


def most_from(port: int, most: int) -> int:
    """How many consecutive ports there are from this one on, but no more than `most`; 0 takes free ones."""
    return most if port == 0 else min(most, _LAST_PORT + 1 - port)
