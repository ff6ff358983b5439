"""`connect`: make a connected arm of a target."""

from __future__ import annotations

import itertools
import logging
import os
import socket
from dataclasses import replace
from pathlib import Path
from typing import Literal

from heptarm.arm.arm import Arm
from heptarm.arm.link.connection import STATE_RATE, TIMEOUT, Connection, Options
from heptarm.arm.link.local_simulator import PrivateCabinet
from heptarm.arm.link.state_stream import GROUPS, groups_of
from heptarm.arm.link.target import parse_target, target_from_env
from heptarm.arm.watchdog import CONNECTION
from heptarm.errors import ConnectFailed, ShapeError
from heptarm.io import tcp
from heptarm.io.clock import RealClock
from heptarm.io.keys import find_key
from heptarm.io.targets import SavedTarget
from heptarm.io.transport import Transport
from heptarm.values.checks import finite, flag, instance, within, word
from heptarm.values.frames import check_printable
from heptarm.values.robot import FLANGES, ROBOTS, robot
from heptarm.values.robot import flange as flange_of
from heptarm.values.text import printable
from heptarm.wire import messages as wire

_log = logging.getLogger("heptarm.arm")

#: Longest name of a client [bytes].
_MAX_NAME = 64


#: Counts the clients of this process that were not named.
_unnamed = itertools.count(1)


def _default_name() -> str:
    """Name of a client: user, host and process, and from the second client of this process on its number."""
    number = next(_unnamed)
    name = f"{os.environ.get('USER', 'python')}@{socket.gethostname()}:{os.getpid()}"
    name = printable(name) if number == 1 else f"{printable(name)}#{number}"
    return name.encode()[-_MAX_NAME:].decode(errors="ignore")


def connect(
    target: str | None = None,
    *,
    name: str | None = None,
    key: str | None = None,
    key_file: str | Path | None = None,
    control: bool = True,
    timeout: float = TIMEOUT,
    state_rate: float = STATE_RATE,
    groups: tuple[str, ...] = GROUPS,
    on_disconnect: Literal["stop", "finish"] = "stop",
    watchdog: float = CONNECTION.default,
    datagrams: bool = False,
    black_box: bool = True,
    flange: str | float | None = None,
) -> Arm:
    """Connect to an arm.

    Args:
        target: "ADDRESS[:PORT]" of a cabinet; "sim://iiwa14" or "sim://iiwa7?speed=5" for a private simulator that
            ends with the arm; "sim://HOST:PORT" for a running one; the name of a saved target (`heptarm targets`), with
            its key, tool and ceiling of the speed. None: the environment variable HEPTARM_TARGET.
        name: name of this client, shown to other clients, up to 64 bytes; None: user, host and process, and
            a number from the second client of a process on.
        key: pre-shared key of the cabinet; "": none. None: it is looked up in `key_file`, the environment variable
            HEPTARM_KEY, and the key stored for the target. A private simulator takes the key that is found.
        key_file: file with the key as its only line, readable by its owner only.
        control: take control; otherwise only observe (and stop). One client at a time is in control.
        timeout: longest wait for the connection and for the answer to each request [s].
        state_rate: pushed states per second [Hz]; 0: none.
        groups: groups that a state contains: "joints", "torques", "pose", "wrench", "motion", "safety", "mode".
        on_disconnect: what the cabinet does with accepted motions when this client is lost: "stop" or "finish" them.
        watchdog: silence after which the cabinet counts this client as lost, [0.1, 10] s.
        datagrams: send servo targets and receive states by UDP beside the TCP connection, for networks that lose
            packets; what does not get through by UDP goes over TCP. `arm.connection.datagrams` reports how it fares.
        black_box: write the last 30 s to a file after an abort, a safety stop or a lost connection; the error has its
            path. The environment variable HEPTARM_BLACK_BOX chooses the folder, or is "off".
        flange: media flange of the robot, as in its station setup: "plain", "touch", or how far its frame is above that
            of a plain flange [m]. A private simulator gets it. None: that of the target, otherwise a plain one.
            No cabinet reports it; a warning names the likely one where the poses of the cabinet contradict it.

    Returns:
        The arm; use it in a `with` block, which leaves the arm at rest.

    Raises:
        ConnectFailed: no answer, or the session is refused; for a wrong target the text shows examples.
        VersionMismatch: client and cabinet speak different versions of the protocol.
        NotInControl: another client controls the robot; the text names it.
        CommandRejected: an argument is not allowed: the key is too weak, or other users can read its file.
    """
    word(on_disconnect, "on_disconnect", ("stop", "finish"))
    flag(control, "control")
    flag(datagrams, "datagrams")
    flag(black_box, "black_box")
    for given, what in ((target, "target"), (name, "name"), (key, "key")):
        if given is not None:
            instance(given, str, what)
    groups_of(groups, ~wire.Groups.NONE)
    if name is not None and len(check_printable(name, "name").encode()) > _MAX_NAME:
        raise ShapeError(
            f"name must have at most {_MAX_NAME} bytes, got {len(name.encode())}: {name!r}",
            code=3,
            parameter="name",
            value=name,
            allowed=f"at most {_MAX_NAME} bytes",
        )
    chosen = parse_target(target_from_env() if target is None else target).with_flange(flange)
    if key is None and key_file is None:
        key_file = chosen.key_file
    found = find_key(key=key, key_file=key_file, host=chosen.host, port=chosen.port)
    options = Options(
        name=name or _default_name(),
        key=None if found is None else found.encode(),
        timeout=within(timeout, "timeout", 0.0, 3600.0, above=True, unit="s"),
        rate=within(state_rate, "state_rate", 0.0, 1000.0, unit="Hz"),
        groups=groups,
        finishes=on_disconnect == "finish",
        watchdog=CONNECTION.time(finite(watchdog, "watchdog", unit="s")),
        datagrams=datagrams,
        black_box=black_box,
        flange=flange_of(flange) if flange is not None else chosen.flange or FLANGES["plain"],
    )
    private = PrivateCabinet.start(chosen, key=found) if chosen.is_private else None
    host, port = chosen.host, chosen.port
    if private is not None:
        host, port = private.host, private.port
        options = replace(options, flange=robot(private.model).flange)  # the project may have another one

    def dial() -> Transport:
        try:
            return tcp.connect(host, port, timeout=options.timeout)
        except ConnectFailed as error:
            if host not in ROBOTS:
                raise
            raise ConnectFailed(error.text, hint=f'"sim://{host}" starts a simulator') from error

    try:
        arm = Arm(Connection(dial, options, clock=RealClock(), cabinet=private))
        try:
            arm.open(control=control)
            if chosen.saved is not None:
                _set_up(arm, chosen.saved, control=control)
        except BaseException:
            arm.close()
            raise
    except BaseException:
        if private is not None:
            private.close()
        raise
    _log.info("connected to %s (%s), %s", chosen, arm.robot.title, "in control" if control else "observing")
    if "sunrise2_preview" in arm.capabilities:
        _log.warning(
            "this cabinet has a preview for Sunrise 2.x, never run on such a cabinet; it can: %s",
            ", ".join(arm.capabilities),
        )
    return arm


def _set_up(arm: Arm, saved: SavedTarget, *, control: bool) -> None:
    """Give an arm the name, the ceiling of the speed and the tool of its saved target.

    Raises:
        CommandRejected: the cabinet does not know the tool; the text lists those that it knows.
    """
    saved.mark_used()
    arm.name = saved.name
    if saved.speed is not None:
        arm.speed = saved.speed
    newest = arm.connection.newest()
    mode = None if newest is None else newest.groups.mode
    arm.remember_tools(saved.tools)
    is_measured = saved.tool in {
        tool.name for tool in saved.tools
    }  # its data may be newer than the cabinet's
    if control and saved.tool and (mode is None or mode.tool != saved.tool or is_measured):
        arm.attach_tool(saved.tool)
