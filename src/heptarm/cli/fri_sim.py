"""`heptarm sim --fri VERSION`: the controller side of FRI on a simulated arm, for any FRI client, without a cabinet."""

from __future__ import annotations

import contextlib
import re
import signal as system
import sys
import threading
from collections.abc import Callable
from dataclasses import asdict
from typing import TYPE_CHECKING

from heptarm.cli.output import emit, is_silent, lines
from heptarm.errors import CommandRejected, ConnectFailed, require
from heptarm.fri.protocol.messages import IoDirection, IoType, IoValue
from heptarm.fri.protocol.version import Version
from heptarm.values.arrays import within
from heptarm.values.pose import deg

if TYPE_CHECKING:
    from heptarm.sim.fri.server import Server
    from heptarm.sim.fri.settings import Event
    from heptarm.sim.runtime.standalone_fri import Standalone

_SIGNAL = re.compile(r"(.+\.[^.<>]+)([<>])(bool|u[0-9]+|analog.*)")
_WORDS = {"true": 1.0, "false": 0.0}
#: Start position [deg]: bent, so that the arm can move in every direction.
START = (0.0, 30.0, 0.0, -90.0, 0.0, 60.0, 0.0)


def run(
    *,
    version: str,
    model: str,
    command: str,
    client: str,
    period: float,
    multiplier: int,
    port: int | None,
    signals: tuple[str, ...],
    frames: tuple[str, ...],
    speed: float,
    verbose: bool,
    as_json: bool,
) -> int:
    """Offer one session after the other until Ctrl-C or SIGTERM; return the exit code.

    Args:
        version: of FRI, such as "1.15".
        model: of the robot.
        command: "monitor", "position", "torque", "wrench" or "pose".
        client: HOST:PORT where the client listens.
        period: between two messages [ms].
        multiplier: the client answers every n-th message.
        port: the controller's own; None: the client's, or the next free one on the same machine.
        signals: that the client sees, as `signal` reads them.
        frames: names of frames that the client is asked for.
        speed: simulated seconds per second.
        verbose: also print each change of quality.
        as_json: print objects.

    Raises:
        CommandRejected: version, command and period do not go together; the text gives the reason.
        ConnectFailed: the port is taken, or the client's address is none.
    """
    standalone = made(
        version=version,
        model=model,
        command=command,
        client=client,
        period=period,
        multiplier=multiplier,
        port=port,
        signals=signals,
        frames=frames,
        speed=speed,
        tell=_printer(verbose=verbose, as_json=as_json),
    )
    for number in (system.SIGTERM, system.SIGINT):
        if system.getsignal(number) is not system.SIG_IGN:  # a shell's background job ignores Ctrl-C
            system.signal(number, lambda *_: standalone.stop())
    controller, own = standalone.server.controller, standalone.server.port
    ready = {"ready": True, "fri": version, "client": client, "port": own, "model": model, "command": command}
    if as_json:
        emit(ready)
    else:
        print(
            f"A virtual {model} speaks FRI {version} from UDP port {own} to a client on {client}, every {period:g} ms, "
            f"and offers a {command} overlay. Ctrl-C ends it."
        )
        sys.stdout.flush()
    if signals and not is_silent():
        threading.Thread(target=_read_values, args=(standalone.server,), daemon=True).start()
    standalone.run()
    counts = asdict(controller.meter.counts)
    if as_json:
        emit({"ended": True, "answers": counts, "refused": controller.traffic.refused})
    else:
        print(
            f"answers: {counts['on_time']} on time, {counts['late']} late, {counts['lost']} lost, "
            f"{controller.traffic.refused} refused"
        )
    return 0


def made(
    *,
    version: str,
    model: str,
    command: str,
    client: str,
    period: float,
    multiplier: int,
    port: int | None,
    signals: tuple[str, ...],
    frames: tuple[str, ...],
    speed: float,
    tell: Callable[[Event], None],
) -> Standalone:
    """The controller with its arm; see `run`. `tell` is called with each event."""
    require("mujoco", extra="sim")
    from heptarm.sim.fri.sessions import PlantArm
    from heptarm.sim.fri.settings import SessionConfiguration
    from heptarm.sim.plant.plant import Plant
    from heptarm.sim.runtime.standalone_fri import Standalone, StandaloneSettings, command_mode

    try:
        spoken = Version.of(version)
    except ValueError as error:
        raise CommandRejected(str(error), parameter="--fri", value=version) from None
    settings = StandaloneSettings(
        configuration=SessionConfiguration(
            spoken, whole(period), multiplier, signals=tuple(map(signal, signals)), transformations=frames
        ),
        client=address(client),
        port=port,
        command=command_mode(command),
        speed=within(speed, "speed", 0.0, 100.0, above=True),
    )
    plant = Plant(model, q=tuple(deg(*START).tolist()))
    return Standalone(PlantArm(plant), settings, listener=tell)


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


def _read_values(server: Server) -> None:
    """Set typed values until standard input is closed."""
    with contextlib.suppress(OSError):
        _set_typed(server)


def _set_typed(server: Server) -> None:
    """Give signals the values that are typed: `set Group.Name 1`."""
    for said in lines():
        verb, name, value = (*said.split(), "", "", "")[:3]
        try:
            if verb != "set":
                raise ValueError
            number = _WORDS[value.lower()] if value.lower() in _WORDS else float(value)
            server.set(name, int(number) if number == int(number) else number)
        except CommandRejected as error:
            print(error, file=sys.stderr, flush=True)
        except (ValueError, OverflowError):
            print(f"{said!r} is not understood; type `set GROUP.NAME VALUE`", file=sys.stderr, flush=True)


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
