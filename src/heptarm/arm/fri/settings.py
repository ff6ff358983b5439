"""What an FRI session is asked for: checked here first, with the cabinet's own codes, and turned into its message."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, TypedDict

import numpy.typing as npt

from heptarm.arm.modes import mode_message
from heptarm.errors import CommandRejected, ConnectFailed, LimitError, ModeConflict, ShapeError
from heptarm.fri.limits import Limits
from heptarm.fri.messages import MAX_IO, MAX_NAME
from heptarm.fri.policy import Policy
from heptarm.fri.pose_guard import PoseLimits
from heptarm.io.udp import UdpSocket
from heptarm.rt import Client, Output, Params
from heptarm.rt import State as FriState
from heptarm.values.arrays import within
from heptarm.values.io import find_name
from heptarm.values.mode import CartesianImpedance, JointImpedance, Mode, Position, SineImpedance
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code

if TYPE_CHECKING:
    from heptarm.arm.connection import Connection

#: `law(state, out, params)`.
Law = Callable[[FriState, Output, Params], object]

KINDS = {mode.name.lower(): mode for mode in wire.FriCommandMode}
#: What the client may command, by kind.
COMMANDS: dict[str, tuple[str, ...]] = {
    "position": ("q",),
    "torque": ("q", "tau"),
    "wrench": ("q", "wrench"),
    "pose": ("pose", "e1"),
    "monitor": (),
}
#: FRI's own ports.
PORTS = range(30200, 30210)
#: Period unless another one is asked for [ms].
PERIOD, PERIOD_MONITOR = 5, 1
#: How seldom a client that commands may answer [ms].
_SLOWEST = {"position": 10, "torque": 5, "wrench": 10, "pose": 10, "monitor": 100}
_SOFT = "CartesianImpedance(stiffness=(500, 500, 500, 50, 50, 50))"


class FriSettings(TypedDict, total=False):
    """What `Arm.fri` can be told, for type checkers."""

    period_ms: int | None
    multiplier: int
    mode: Mode | None
    law: Law | None
    params: Mapping[str, npt.ArrayLike] | None
    policy: Policy | None
    limits: Limits | None
    pose_limits: PoseLimits | None
    io: Sequence[str]
    version: str | None
    host: str
    port: int | None
    realtime: bool
    cpu: int | None
    history: int
    timeout: float


@dataclass(frozen=True, slots=True)
class Request:
    """A checked wish for a session.

    Attributes:
        kind: what is commanded, or "monitor".
        message: to the cabinet; host may be empty, and the port is set when the client listens.
        make: makes the client, which then listens.
        has_law: a law commands.
    """

    kind: str
    message: wire.FriOpen
    make: Callable[[], Client]
    has_law: bool


def request(
    connection: Connection,
    kind: str,
    *,
    period_ms: int | None = None,
    multiplier: int = 1,
    mode: Mode | None = None,
    law: Law | None = None,
    params: Mapping[str, npt.ArrayLike] | None = None,
    policy: Policy | None = None,
    limits: Limits | None = None,
    pose_limits: PoseLimits | None = None,
    io: Sequence[str] = (),
    version: str | None = None,
    host: str = "",
    port: int | None = None,
    realtime: bool = True,
    cpu: int | None = None,
    history: int = 2048,
    timeout: float = 10.0,
) -> Request:
    """Check everything and say it in the protocol's words; see `Arm.fri`.

    Raises:
        CommandRejected: this cabinet has no such session.
        ModeConflict: kind and control mode do not go together.
        LimitError: a value outside its range.
    """
    if kind not in KINDS:
        raise ShapeError(
            f"kind is {kind!r}; allowed are {', '.join(map(repr, KINDS))}", parameter="kind", value=kind
        )
    _check_kind(kind, connection.welcome.capabilities)
    period = (PERIOD_MONITOR if kind == "monitor" else PERIOD) if period_ms is None else period_ms
    _check_pace(kind, period, multiplier)
    check_mode(kind, mode)
    if kind == "monitor" and law is not None:
        raise ModeConflict(
            "a session that only monitors calls no law",
            code=int(Code.MODE_CONFLICT),
            parameter="law",
            hint='read states from it, or choose arm.fri("position")',
        )
    if params is not None and law is None:
        raise ShapeError("params are for a law, and none was given", parameter="params")
    if port is not None and not 0 <= port < 1 << 16:
        raise LimitError(f"port is {port}; allowed is [0, 65535]", parameter="port", value=port)
    message = wire.FriOpen(
        host=host,
        period=round(period) * 1e-3,
        receive_multiplier=multiplier,
        command=KINDS[kind],
        mode=None if kind == "monitor" else mode_message(mode),
        timeout=within(timeout, "timeout", 0.1, 60.0, unit="s"),
        io=_signals(io, connection),
    )

    def make() -> Client:
        return _listening(
            port,
            lambda chosen: Client(
                chosen,
                version=version,
                model=connection.robot,
                limits=limits,
                pose_limits=pose_limits,
                policy=policy,
                law=law,
                params=params,
                history=history,
                realtime=realtime,
                cpu=cpu,
            ),
        )

    return Request(kind, message, make, law is not None)


def _check_kind(kind: str, capabilities: tuple[str, ...]) -> None:
    if f"fri_{kind}" in capabilities:
        return
    offered = [name.removeprefix("fri_") for name in capabilities if name.startswith("fri_")]
    if not offered:
        text, hint = "this cabinet has no FRI", "install the option Sunrise.FRI and synchronise the project"
    elif kind == "pose":
        text = "Cartesian pose overlays came with Sunrise 2.x; this cabinet runs 1.x"
        hint = 'solve the pose to joints and use arm.fri("position"), or arm.servo("pose")'
    else:
        text, hint = f"this cabinet has no FRI sessions of kind {kind!r}", ""
    raise CommandRejected(
        text,
        code=int(Code.UNSUPPORTED),
        parameter="command",
        value=kind,
        allowed=", ".join(offered),
        hint=hint,
    )


def _signals(names: Sequence[str], connection: Connection) -> tuple[str, ...]:
    """Full names of the signals that the session shall carry, checked as the cabinet does."""
    if isinstance(names, str):
        raise ShapeError(
            f"io is {names!r}; a list of names is wanted", parameter="io", hint=f'io=["{names}"]'
        )
    if not names:
        return ()
    if "fri_io" not in connection.welcome.capabilities:
        raise CommandRejected(
            "this cabinet's FRI carries no signals",
            code=int(Code.UNSUPPORTED),
            parameter="io",
            hint="they came with FRI 1.14; arm.io reads and writes them over the application",
        )
    known = connection.signals
    all_names = tuple(one.name for one in known)
    found = [known[find_name(name, all_names)] for name in names]
    full = tuple(one.name for one in found)
    if len(full) > MAX_IO:
        raise LimitError(
            f"{len(full)} signals; FRI carries at most {MAX_IO}",
            code=int(Code.BAD_LENGTH),
            parameter="io",
            value=len(full),
            allowed=f"[0, {MAX_IO}]",
        )
    for place, one in enumerate(found):
        if one.name in full[:place]:
            raise CommandRejected(
                f"{one.name} is named twice", code=int(Code.UNKNOWN_NAME), parameter=f"io[{place}]"
            )
        if one.kind == "integer" or len(one.name) > MAX_NAME:
            what = (
                f"{one.name} is a number with a sign, and FRI carries none"
                if one.kind == "integer"
                else f"FRI carries names of at most {MAX_NAME} octets; {one.name} has {len(one.name)}"
            )
            raise CommandRejected(
                what, code=int(Code.UNSUPPORTED), parameter=f"io[{place}]", hint="arm.io reads and writes it"
            )
    return full


def _check_pace(kind: str, period: float, multiplier: int) -> None:
    if not isfinite(period) or period != round(period) or not 1 <= period <= 100:
        raise LimitError(
            f"period_ms is {period:g}; FRI sends every whole number of milliseconds from 1 to 100",
            code=int(Code.OUT_OF_RANGE if isfinite(period) else Code.NOT_FINITE),
            parameter="period_ms",
            value=period,
            allowed="1, 2, ... 100 ms",
        )
    if multiplier not in range(1, 101):
        raise LimitError(
            f"multiplier is {multiplier}; allowed is 1, 2, ... 100",
            code=int(Code.OUT_OF_RANGE),
            parameter="multiplier",
            value=multiplier,
            allowed="1, 2, ... 100",
        )
    answers, most = period * multiplier, _SLOWEST[kind]
    if answers > most:
        what = "a monitoring client" if kind == "monitor" else f"a client that commands a {kind}"
        raise LimitError(
            f"{what} has to answer at least every {most} ms, not every {answers:g}",
            code=int(Code.OUT_OF_RANGE),
            parameter="period_ms",
            value=answers,
            allowed=f"period_ms x multiplier in [1, {most}] ms",
        )


def check_mode(kind: str, mode: Mode | None) -> None:
    """Check that a command goes with the control mode of the hold beneath it, as the cabinet does.

    Raises:
        ModeConflict: it does not; the hint names one that does.
    """
    if kind == "monitor":
        return
    mode = mode or Position()
    name = type(mode).__name__
    if isinstance(mode, SineImpedance):
        needs, example = "no overlay goes with a superposed force", _SOFT
    elif kind == "torque" and not isinstance(mode, JointImpedance):
        needs, example = "a torque overlay needs joint impedance under it", "JointImpedance(stiffness=0)"
    elif kind == "wrench" and not isinstance(mode, CartesianImpedance):
        needs, example = "a wrench overlay needs Cartesian impedance under it", _SOFT
    else:
        return
    raise ModeConflict(
        f"{needs}; the mode is {name}",
        code=int(Code.MODE_CONFLICT),
        parameter="mode",
        value=name,
        allowed=example.partition("(")[0],
        hint=f'arm.fri("{kind}", mode={example}), with the mode from heptarm.modes',
    )


def check_command(kind: str, given: Mapping[str, object]) -> None:
    """Check that a session of a kind commands what is given; None is not.

    Raises:
        ModeConflict: it commands something else.
    """
    for name, value in given.items():
        if value is not None and name not in COMMANDS[kind]:
            other = {"q": "position", "tau": "torque", "e1": "pose"}.get(name, name)
            raise ModeConflict(
                f'{name} is not commanded in an FRI session of kind "{kind}"',
                parameter=name,
                allowed=", ".join(COMMANDS[kind]) or "nothing",
                hint=f'open the session with arm.fri("{other}")',
            )


def _listening(port: int | None, make: Callable[[int], Client]) -> Client:
    """A client on its port; None: the first of FRI's that is free."""
    if port is not None:
        return make(port)
    for candidate in PORTS:
        if not _is_free(candidate):
            continue
        try:
            return make(candidate)
        except ConnectFailed as error:
            if error.parameter != "port":  # else somebody was quicker, or has just looked whether it is free
                raise
    raise ConnectFailed(
        f"none of FRI's ports {PORTS[0]} to {PORTS[-1]} is free on this machine",
        parameter="port",
        hint="end another FRI client (`ss -ulpn` names them), or give a port, as in arm.fri(..., port=30300)",
    )


def _is_free(port: int) -> bool:
    try:
        UdpSocket(port).close()
    except ConnectFailed:
        return False
    return True
