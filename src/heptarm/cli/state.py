"""`heptarm state`: the state as a table, once or live."""

from __future__ import annotations

import sys
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from heptarm.arm.arm import Arm
from heptarm.cli.options import (
    NO_TARGET,
    CommandTarget,
    Json,
)
from heptarm.cli.output import emit, state_data
from heptarm.values.checks import within
from heptarm.values.state import State


def state(
    *,
    watch: Annotated[bool, Parameter(negative="", help="Repeat until Ctrl-C.")] = False,
    rate: Annotated[float, Parameter(help="States per second.")] = 10.0,
    duration: Annotated[float | None, Parameter(help="Watch for this long [s].")] = None,
    target: CommandTarget = NO_TARGET,
    as_json: Json = False,
) -> int:
    """Show the state of the arm.

    For example:

        heptarm state --target lab1

        heptarm state --watch --rate 5 --json --target sim://localhost:30001
    """
    within(rate, "rate", 0.0, 1000.0, above=True, unit="Hz")
    if duration is not None:
        within(duration, "duration", 0.0, 86400.0, above=True, unit="s")
    with target.connect(control=False, state_rate=max(rate, 10.0)) as arm:
        if not watch and duration is None:
            _show_once(arm, as_json=as_json)
            return 0
        try:
            _show_repeatedly(arm, rate, duration, as_json=as_json)
        except KeyboardInterrupt:
            return 0
    return 0


def _show_once(arm: Arm, *, as_json: bool) -> None:
    state = arm.wait_until(lambda seen: not np.isnan(seen.dq).any(), timeout=5.0)
    if as_json:
        emit(
            {"robot": arm.robot.title, "virtual": arm.is_virtual, "controller": arm.controller}
            | state_data(state)
        )
    else:
        Console().print(table(arm, state))


def _show_repeatedly(arm: Arm, rate: float, duration: float | None, *, as_json: bool) -> None:
    if as_json:
        for state in arm.states(rate=rate, duration=duration):
            emit(state_data(state))
        return
    console = Console()
    if not console.is_terminal:  # a live table would appear in a file when it ends
        for state in arm.states(rate=rate, duration=duration):
            console.print(table(arm, state))
            sys.stdout.flush()
        return
    with Live(auto_refresh=False, console=console) as live:
        for state in arm.states(rate=rate, duration=duration):
            live.update(table(arm, state), refresh=True)


def table(arm: Arm, state: State) -> Group:
    """A state for people: degrees and millimetres."""
    joints = Table(title=f"{arm.robot.title}{' (virtual)' if arm.is_virtual else ''}", title_justify="left")
    for name in ("", *(f"A{i + 1}" for i in range(7))):
        joints.add_column(name, justify="right")
    rows = (
        ("q [deg]", np.degrees(state.q), 2),
        ("dq [deg/s]", np.degrees(state.dq), 2),
        ("tau [Nm]", state.tau, 2),
        ("tau_ext [Nm]", state.tau_ext, 2),
    )
    for name, values, digits in rows:
        joints.add_row(Text(name), *(_fixed(v, digits) for v in values))
    x, y, z = state.pose.xyz * 1e3
    a, b, c = np.degrees(state.pose.abc)
    force = " ".join(f"{v:.1f}" for v in state.wrench.force)
    running = f"motion {state.motion.id}" if state.motion is not None and state.motion.active else "at rest"
    if not state.safety.is_known:
        ready = "readiness and stops unknown"
    elif state.safety.ready_to_move:
        ready = "ready to move"
    else:
        ready = f"not ready ({', '.join(state.safety.stops)})"
    lines = (
        f"flange  x {x:.1f}  y {y:.1f}  z {z:.1f} mm   a {a:.2f}  b {b:.2f}  c {c:.2f} deg",
        f"force   {force} N",
        f"status  {state.safety.mode.value.upper()}, {ready}, {running}, controlled by {arm.controller or 'nobody'}",
        f"age     {state.age * 1e3:.1f} ms",
    )
    return Group(joints, Text("\n".join(lines)))


def _fixed(value: float, digits: int) -> str:
    """Fixed-point text without a negative zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}"
