"""`heptarm bridge`: programs written for other projects, unchanged, on heptarm's own cabinet application."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

from cyclopts import Parameter

from heptarm.arm.arm import Arm
from heptarm.bridge.kst import PORT as KST_PORT
from heptarm.bridge.kst import serve_kst
from heptarm.bridge.libiiwa import PORT as LIBIIWA_PORT
from heptarm.bridge.libiiwa import serve_libiiwa
from heptarm.cli.options import NO_TARGET, CommandTarget
from heptarm.values.checks import within

Ceiling = Annotated[
    float | None,
    Parameter(
        name="--speed",
        help="Ceiling of the speed, (0, 1]: the lower one of this and the program's applies. Default: that of the "
        "target; without one 0.25 on a robot, 1 on a virtual cabinet.",
    ),
]


def libiiwa(
    *,
    host: Annotated[str, Parameter(help="Where the program runs.")] = "127.0.0.1",
    port: Annotated[int, Parameter(help="Port at which it waits.")] = LIBIIWA_PORT,
    tool: Annotated[
        tuple[str, ...],
        Parameter(help="Name of a tool of the cabinet; repeated in the order of the indices in libiiwa."),
    ] = (),
    speed: Ceiling = None,
    target: CommandTarget = NO_TARGET,
) -> int:
    """Connect to programs written for libiiwa as its application on a cabinet does; runs until Ctrl-C.

    For example:

        heptarm bridge libiiwa --target sim://iiwa14

        heptarm bridge libiiwa --target lab1 --tool gripper --speed 0.5
    """
    within(port, "port", 1, 65535)
    with _bridged(target, speed, f"waits for LibIiwa() at {host}:{port}") as arm:
        serve_libiiwa(arm, host=host, port=port, tools=tool, on_change=lambda text: print(text, flush=True))
    return 0


def kst(
    *,
    host: Annotated[
        str,
        Parameter(help="Address to listen on: an alias of this machine where the program has an address."),
    ] = "127.0.0.1",
    port: Annotated[int, Parameter(help="Port; the programs connect to 30001.")] = KST_PORT,
    speed: Ceiling = None,
    target: CommandTarget = NO_TARGET,
) -> int:
    """Answer programs written for KST or iiwaPy3 as their server on a cabinet does; runs until Ctrl-C.

    For example:

        heptarm bridge kst --target sim://iiwa14

        heptarm bridge kst --target lab1 --speed 0.5
    """
    within(port, "port", 0, 65535)
    with _bridged(target, speed, f"KST and iiwaPy3 may connect to {host}:{port}") as arm:
        serve_kst(arm, host=host, port=port, on_change=lambda text: print(text, flush=True))
    return 0


@contextmanager
def _bridged(target: CommandTarget, speed: float | None, waits: str) -> Iterator[Arm]:
    """The arm that others' programs drive, until Ctrl-C or SIGTERM."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with target.connect() as arm:
        if speed is not None:
            arm.speed = speed
        print(f"{waits}, for {arm.robot.title}; Ctrl-C ends it and stops the arm", flush=True)
        yield arm
