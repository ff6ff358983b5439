"""`heptarm stop`: imports little before it has stopped the arm; `CommandTarget.connect` imports much more."""

from __future__ import annotations

from heptarm.arm.link.halt import halt
from heptarm.arm.link.target import parse_target, target_from_env
from heptarm.cli.options import NO_TARGET, CommandTarget, Json
from heptarm.cli.output import emit
from heptarm.errors import ConnectFailed, HeptarmError
from heptarm.io import tcp
from heptarm.io.clock import RealClock
from heptarm.wire.messages import StopKind

#: How long to try to stop the arm, and for each attempt to observe it [s].
_PATIENCE = 5.0


def stop(*, target: CommandTarget = NO_TARGET, as_json: Json = False) -> int:
    """Stop the arm; needs no control, no key and no place among the clients.

    For example:

        heptarm stop --target lab1
    """
    chosen = parse_target(target_from_env() if target.text is None else target.text)
    if chosen.is_private:
        raise ConnectFailed(
            f"{chosen} would be a new simulator, in which nothing moves",
            hint="give the address of the cabinet or simulator that runs: --target HOST:PORT",
        )
    halt(
        lambda: tcp.connect(chosen.host, chosen.port, timeout=_PATIENCE),
        StopKind.PATH,
        clock=RealClock(),
        timeout=_PATIENCE,
    )
    if not as_json:
        print("the arm stops", flush=True)
    at_rest = _rests(target, as_json=as_json)
    if as_json:
        emit({"stopped": True, "at_rest": at_rest})
    elif at_rest:
        print("the arm is at rest")
    return 0


def _rests(target: CommandTarget, *, as_json: bool) -> bool:
    """Wait until the arm rests; False if it cannot be observed."""
    try:
        with target.connect(control=False, timeout=_PATIENCE) as arm:
            arm.stop()
            arm.wait_for_rest()
    except HeptarmError as error:
        if not as_json:
            print(f"its rest was not observed: {error}")
        return False
    return True
