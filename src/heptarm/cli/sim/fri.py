"""`heptarm sim fri VERSION`: the controller side of FRI on a simulated arm, for any FRI client, without a cabinet."""

from __future__ import annotations

import contextlib
import re
import signal as system
import sys
import threading
import weakref
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, replace
from math import isfinite
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from heptarm.cli.output import emit, is_silent, lines
from heptarm.cli.sim.options import ArmOptions
from heptarm.errors import CommandRejected, ConnectFailed, require
from heptarm.fri.protocol.messages import IoDirection, IoType, IoValue
from heptarm.fri.protocol.version import Version
from heptarm.values.checks import within
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Mode, Position
from heptarm.values.pose import deg
from heptarm.values.robot import RobotModel, robot

if TYPE_CHECKING:
    from heptarm.sim.fri.faults import LinkFaults
    from heptarm.sim.fri.server import Server
    from heptarm.sim.fri.settings import Event
    from heptarm.sim.runtime.operator import SimulatedOperator
    from heptarm.sim.runtime.standalone_fri import Standalone

_SIGNAL = re.compile(r"(.+\.[^.<>]+)([<>])(bool|u[0-9]+|analog.*)")
_WORDS = {"true": 1.0, "false": 0.0}
#: Start position [deg]: bent, so that the arm can move in every direction.
START = (0.0, 30.0, 0.0, -90.0, 0.0, 60.0, 0.0)


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class FriControllerOptions:
    """Options of `heptarm sim fri` beside those of the arm; texts are as on the command line."""

    command: Annotated[
        Literal["monitor", "position", "torque", "wrench", "pose"],
        Parameter(name="--fri-command", help="What the client may command."),
    ] = "position"
    client: Annotated[str, Parameter(name="--fri-client", help="HOST:PORT where the client listens.")] = (
        "127.0.0.1:30200"
    )
    period: Annotated[float, Parameter(name="--fri-period", help="Time between two messages [ms].")] = 5.0
    multiplier: Annotated[
        int, Parameter(name="--fri-multiplier", help="The client answers every n-th message.")
    ] = 1
    port: Annotated[
        int | None,
        Parameter(
            name="--fri-port",
            help="UDP port to send from. Default: the client's port, or the next free one.",
        ),
    ] = None
    signals: Annotated[
        tuple[str, ...],
        Parameter(
            name="--fri-io",
            help="GROUP.NAME<TYPE is an input that the client reads, GROUP.NAME>TYPE an output that it writes, "
            "TYPE bool, u8 (or other bits) or analog; may be repeated. Type `set GROUP.NAME VALUE` while it runs.",
        ),
    ] = ()
    frames: Annotated[
        tuple[str, ...],
        Parameter(name="--fri-frame", help="Name of a frame that the client is asked for; may be repeated."),
    ] = ()
    mode: Annotated[
        Literal["", "position", "joint-impedance", "cartesian-impedance"],
        Parameter(
            name="--fri-mode",
            help="Control mode under the overlay. Default: position; joint-impedance for torques, "
            "cartesian-impedance for wrenches.",
        ),
    ] = ""
    stiffness: Annotated[
        str,
        Parameter(
            name="--fri-stiffness",
            help="Of joint-impedance: one number or seven [Nm/rad], default 200. Of cartesian-impedance: along and "
            "about the axes, as 2000,200, or six numbers [N/m, Nm/rad], default 2000,200.",
        ),
    ] = ""
    start: Annotated[
        str,
        Parameter(name="--fri-start", help="A1,...,A7 at the start [deg]. Default: 0,30,0,-90,0,60,0."),
    ] = ""
    force: Annotated[
        str,
        Parameter(
            name="--fri-force",
            help="FX,FY,FZ on the flange from the start, base axes [N]; --fault 'push 0 0 -20 2@5' pushes for 2 s "
            "after 5 s.",
        ),
    ] = ""
    network: Annotated[
        tuple[str, ...],
        Parameter(
            name="--fri-network",
            help="Fault of the network in both directions, as loss=0.01, delay=0.002 or jitter=0.001: loss, duplicate, "
            "corrupt, reorder and burst are probabilities, delay, jitter and burst_time [s]; may be repeated.",
        ),
    ] = ()


_DEFAULTS = FriControllerOptions()
_ARM = ArmOptions()


def fri(
    version: Annotated[str, Parameter(help="FRI version, such as 1.15, 2.5 or 2.7.")],
    /,
    *,
    options: FriControllerOptions = _DEFAULTS,
    arm: ArmOptions = _ARM,
) -> int:
    """Run a bare FRI controller, without a cabinet, for any client: one session after the other until Ctrl-C.

    For example:

        heptarm sim fri 2.5 --fri-command torque --fri-period 2

    Raises:
        CommandRejected: version, command and period do not go together; the text gives the reason.
        ConnectFailed: the port is taken, or the client's address is none.
    """
    model = robot(arm.model or "iiwa14", flange=arm.flange or None)
    standalone, operator = _made(version, model, options, arm)
    before = {}
    for number in (system.SIGTERM, system.SIGINT):
        if system.getsignal(number) is not system.SIG_IGN:  # a shell's background job ignores Ctrl-C
            before[number] = system.signal(number, lambda *_: standalone.stop())
    controller, own = standalone.server.controller, standalone.server.port
    ready = {
        "ready": True,
        "fri": version,
        "client": options.client,
        "port": own,
        "model": model.name,
        "command": options.command,
    }
    if arm.as_json:
        emit(ready)
    else:
        print(
            f"A virtual {model.name} speaks FRI {version} from UDP port {own} to a client on "
            f"{options.client}, every {options.period:g} ms, and offers a {options.command} overlay. Ctrl-C ends it."
        )
        sys.stdout.flush()
    if not is_silent():
        # the thread may outlive the arm and must not keep it: bindings report what is left at the end as leaks
        targets = weakref.proxy(standalone.server), weakref.proxy(operator)
        threading.Thread(target=_read_lines, args=targets, daemon=True).start()
    standalone.run()
    for number, handler in before.items():
        system.signal(number, handler)
    counts = asdict(controller.meter.counts)
    if arm.as_json:
        emit({"ended": True, "answers": counts, "refused": controller.traffic.refused})
    else:
        print(
            f"answers: {counts['on_time']} on time, {counts['late']} late, {counts['lost']} lost, "
            f"{controller.traffic.refused} refused"
        )
    return 0


def _made(
    version: str, model: RobotModel, options: FriControllerOptions, arm: ArmOptions
) -> tuple[Standalone, SimulatedOperator]:
    """The controller with its arm, and the operator beside it."""
    require("mujoco", extra="sim")
    from heptarm.sim.fri.faults import FaultScenario
    from heptarm.sim.fri.settings import SessionConfiguration
    from heptarm.sim.plant.payload import parse_payload
    from heptarm.sim.plant.plant import Plant, fitted_arm
    from heptarm.sim.plant.sensor_errors import sensor_errors
    from heptarm.sim.runtime.operator import SimulatedOperator
    from heptarm.sim.runtime.standalone_fri import (
        OperatedArm,
        Standalone,
        StandaloneSettings,
        command_mode,
        usual_mode,
    )

    try:
        spoken = Version.of(version)
    except ValueError as error:
        raise CommandRejected(str(error), parameter="--fri", value=version) from None
    command, link = command_mode(options.command), link_faults(options.network)
    settings = StandaloneSettings(
        configuration=SessionConfiguration(
            spoken,
            whole(options.period),
            options.multiplier,
            signals=tuple(map(signal, options.signals)),
            transformations=options.frames,
        ),
        client=address(options.client),
        port=options.port,
        command=command,
        mode=control(options.mode, options.stiffness, usual_mode(command)),
        speed=within(arm.speed, "speed", 0.0, 100.0, above=True),
        scenario=FaultScenario(to_client=link, from_client=replace(link, seed=link.seed + 1)),
    )
    start = deg(*(numbers(options.start, "--fri-start", 7) if options.start else START))
    model.check(start, "--fri-start")
    fitted = fitted_arm(arm.fitted, model)
    try:
        errors = sensor_errors(model, arm.sensors, fitted)
    except ValueError as error:
        raise CommandRejected(str(error), parameter="sensors", value=arm.sensors) from None
    plant = Plant(model.name, q=tuple(start.tolist()), errors=errors, fitted=fitted)
    if options.force:
        x, y, z = numbers(options.force, "--fri-force", 3)
        plant.apply_wrench((x, y, z))
    operator = SimulatedOperator(plant)
    try:
        if arm.payload:
            plant.set_payload(parse_payload(arm.payload))
        for fault in arm.fault:
            operator.schedule(fault)
    except ValueError as error:
        raise CommandRejected(str(error)) from None
    listener = _printer(verbose=arm.verbose, as_json=arm.as_json)
    return Standalone(OperatedArm(plant, operator), settings, listener=listener), operator


def control(mode: str, stiffness: str, usual: Mode) -> Mode:
    """The control mode of the names on the command line.

    Raises:
        CommandRejected: a stiffness that does not fit the mode.
        LimitError: a stiffness out of range.
    """
    from heptarm.sim.runtime.standalone_fri import STIFFNESS

    if mode == "position" or (not mode and isinstance(usual, Position)):
        if stiffness:
            raise CommandRejected(
                "--fri-stiffness needs an impedance",
                parameter="--fri-stiffness",
                hint="add --fri-mode joint-impedance or cartesian-impedance",
            )
        return Position()
    if mode == "joint-impedance" or (not mode and isinstance(usual, JointImpedance)):
        values = numbers(stiffness, "--fri-stiffness", 1, 7) if stiffness else None
        if values is None:
            return usual if isinstance(usual, JointImpedance) else JointImpedance(STIFFNESS)
        return JointImpedance(values[0] if len(values) == 1 else values)
    if not stiffness:
        return CartesianImpedance()
    values = numbers(stiffness, "--fri-stiffness", 2, 6)
    return CartesianImpedance(values if len(values) == 6 else (*values[:1] * 3, *values[1:] * 3))


def numbers(text: str, name: str, *counts: int) -> tuple[float, ...]:
    """Numbers with commas between them.

    Raises:
        CommandRejected: they are not as many, or not finite numbers.
    """
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) not in counts or not all(map(isfinite, values)):
        raise CommandRejected(
            f"{name} must be {' or '.join(map(str, counts))} finite numbers with commas between them, got {text!r}",
            parameter=name,
            value=text,
            hint=f"for example {name}={','.join(['10'] * counts[-1])}",
        )
    return values


def link_faults(texts: tuple[str, ...]) -> LinkFaults:
    """Faults of the network of texts NAME=VALUE.

    Raises:
        CommandRejected: there is no such fault, or its value is no number.
        LimitError: a value out of range.
    """
    from heptarm.sim.fri.faults import LinkFaults

    known = [field.name for field in fields(LinkFaults) if field.name not in ("silence", "seed")]
    values = {}
    for text in texts:
        name, _, value = text.partition("=")
        if name not in known:
            raise CommandRejected(
                f"--fri-network must be NAME=VALUE, NAME one of {', '.join(known)}; got {text!r}",
                parameter="--fri-network",
                value=text,
                hint="probabilities are in [0, 1], times in s, as in delay=0.002",
            )
        (values[name],) = numbers(value, f"--fri-network {name}", 1)
    return replace(LinkFaults(), **values)  # type: ignore[arg-type]


def address(text: str) -> tuple[str, int]:
    """Host and port of "HOST:PORT" or "HOST".

    Raises:
        ConnectFailed: the text is neither.
    """
    host, colon, port = text.partition(":")
    if not host or (colon and not port.isdigit()):
        raise ConnectFailed(
            f"the client's address must be HOST:PORT, got {text!r}",
            hint="give HOST:PORT, such as 127.0.0.1:30200",
        )
    return host, int(port) if colon else 30200


def signal(text: str) -> IoValue:
    """The signal "Group.Name<type" (an input) or "Group.Name>type" (an output), at first 0.

    Raises:
        CommandRejected: it is not one.
    """
    parts = _SIGNAL.fullmatch(text)
    if parts is None:
        raise CommandRejected(
            f"a signal must be GROUP.NAME<TYPE or GROUP.NAME>TYPE, got {text!r}",
            parameter="--fri-io",
            value=text,
            hint="< is an input of the client, > an output; TYPE is bool, u8 (or other bits) or analog",
        )
    name, direction, kind = parts[1], parts[2], parts[3]
    types = {"b": IoType.BOOLEAN, "u": IoType.DIGITAL, "a": IoType.ANALOG}
    return IoValue(name, types[kind[0]], IoDirection.INPUT if direction == "<" else IoDirection.OUTPUT, 0)


def _read_lines(server: Server, operator: SimulatedOperator) -> None:
    """Execute typed lines until standard input is closed."""
    with contextlib.suppress(OSError):
        for said in lines():
            try:
                _execute(said, server, operator)
            except (CommandRejected, ValueError, OverflowError) as error:
                print(error, file=sys.stderr, flush=True)


def _execute(said: str, server: Server, operator: SimulatedOperator) -> None:
    """Give a signal of the session its value, `set GROUP.NAME VALUE`; anything else is an action of the operator."""
    verb, name, value = (*said.split(), "", "", "")[:3]
    if verb != "set":
        operator.do(said)
        return
    try:
        number = _WORDS[value.lower()] if value.lower() in _WORDS else float(value)
    except ValueError:
        raise ValueError(f"{said!r} is not understood; type `set GROUP.NAME VALUE`") from None
    server.set(name, int(number) if number == int(number) else number)


def whole(period: float) -> int:
    """A period in whole milliseconds.

    Raises:
        CommandRejected: it is not one.
    """
    if period != round(period):
        raise CommandRejected(
            f"the period must be a whole number of milliseconds, 1 to 100 ms, got {period:g} ms",
            parameter="period",
            value=period,
            allowed="1, 2, ... 100 ms",
        )
    return round(period)


def _printer(*, verbose: bool, as_json: bool) -> Callable[[Event], None]:
    require("mujoco", extra="sim")
    from heptarm.sim.fri.settings import QualityChanged, describe

    def tell(event: Event) -> None:
        text = "" if isinstance(event, QualityChanged) and not verbose else describe(event)
        if not text:
            return
        if as_json:
            emit({"event": type(event).__name__, "text": text})
        else:
            print(text, flush=True)

    return tell
