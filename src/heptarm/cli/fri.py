"""`heptarm sim --fri VERSION`: the controller side of FRI on a simulated arm, for any FRI client, without a cabinet."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from dataclasses import asdict
from typing import TYPE_CHECKING

from heptarm.cli.output import emit
from heptarm.errors import CommandRejected, ConnectFailed, require
from heptarm.fri.version import Version
from heptarm.values.arrays import within
from heptarm.values.pose import deg

if TYPE_CHECKING:
    from heptarm.virtual.fri.events import Event
    from heptarm.virtual.fri.standalone import Standalone

#: Where the arm stands at first [deg]: bent, so that every direction is free.
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
    speed: float,
    verbose: bool,
    as_json: bool,
) -> int:
    """Offer one session after the other until Ctrl-C or SIGTERM; returns the exit code.

    Args:
        version: of FRI, such as "1.15".
        model: of the robot.
        command: "monitor", "position", "torque", "wrench" or "pose".
        client: HOST:PORT where the client listens.
        period: between two messages [ms].
        multiplier: the client answers every n-th message.
        port: the controller's own; None: the client's, or a neighbour of it on the same machine.
        speed: simulated seconds per second.
        verbose: also tell each change of quality.
        as_json: print objects.

    Raises:
        CommandRejected: version, command and period do not go together; the text says why.
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
        speed=speed,
        tell=_teller(verbose=verbose, as_json=as_json),
    )
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: standalone.stop())
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
    speed: float,
    tell: Callable[[Event], None],
) -> Standalone:
    """The controller with its arm; see `run`. `tell` is called with each event."""
    require("mujoco", extra="sim")
    from heptarm.virtual.fri.configuration import Configuration
    from heptarm.virtual.fri.plant_arm import PlantArm
    from heptarm.virtual.fri.standalone import Settings, Standalone, command_mode
    from heptarm.virtual.plant import Plant

    try:
        spoken = Version.of(version)
    except ValueError as error:
        raise CommandRejected(str(error), parameter="--fri", value=version) from None
    settings = Settings(
        configuration=Configuration(spoken, whole(period), multiplier),
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
        ConnectFailed: it is neither.
    """
    host, colon, port = text.partition(":")
    if not host or (colon and not port.isdigit()):
        raise ConnectFailed(f"{text!r} is no address", hint="HOST:PORT is wanted, such as 127.0.0.1:30200")
    return host, int(port) if colon else 30200


def whole(period: float) -> int:
    """A period in whole milliseconds.

    Raises:
        CommandRejected: it is none.
    """
    if period != round(period):
        raise CommandRejected(
            f"the period is {period:g} ms; FRI knows whole milliseconds",
            parameter="period",
            value=period,
            allowed="1, 2, ... 100 ms",
        )
    return round(period)


def _teller(*, verbose: bool, as_json: bool) -> Callable[[Event], None]:
    require("mujoco", extra="sim")
    from heptarm.virtual.fri.events import QualityChanged
    from heptarm.virtual.fri.standalone import words

    def tell(event: Event) -> None:
        text = "" if isinstance(event, QualityChanged) and not verbose else words(event)
        if not text:
            return
        if as_json:
            emit({"event": type(event).__name__, "text": text})
        else:
            print(text, flush=True)

    return tell
