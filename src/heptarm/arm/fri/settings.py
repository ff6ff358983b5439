"""The request for an FRI session: checked here with the cabinet's own codes, then turned into its message."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

from heptarm.arm.link.connection import Connection
from heptarm.arm.translate.modes import mode_message
from heptarm.errors import CommandRejected, ConnectFailed, LimitError, ModeConflict, ShapeError
from heptarm.fri.loop.client import Client
from heptarm.fri.loop.compiled import CompiledLaw
from heptarm.fri.loop.law_interface import Memory
from heptarm.fri.loop.settings import LoopKeywords, LoopSettings
from heptarm.fri.loop.user_api import Output, Params
from heptarm.fri.loop.user_api import State as FriState
from heptarm.fri.protocol.messages import MAX_IO, MAX_NAME
from heptarm.io.udp import UdpSocket
from heptarm.values.checks import instance, integer, scalar, shown, within, word
from heptarm.values.frames import check_printable
from heptarm.values.io import find_name
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Mode, Position
from heptarm.values.mode.sine import SineImpedance
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code

if TYPE_CHECKING:
    from typing_extensions import Unpack

#: `law(state, out, params)` or `law(state, out, params, memory)`.
Law = (
    Callable[[FriState, Output, Params], object]
    | Callable[[FriState, Output, Params, Memory], object]
    | CompiledLaw
)

KINDS = {mode.name.lower(): mode for mode in wire.FriCommandMode}
#: Quantities that the client commands, by kind.
COMMANDS: dict[str, tuple[str, ...]] = {
    "position": ("q",),
    "torque": ("q", "tau"),
    "wrench": ("q", "wrench"),
    "pose": ("pose", "e1"),
    "monitor": (),
}
#: What laws of a kind command; and the mode in which they are alone with the arm, where there is only one such mode.
_BY_LAW = {"position": "q", "torque": "tau", "wrench": "wrench"}
_FOR_LAWS: dict[str, Mode] = {"torque": JointImpedance(stiffness=0.0)}
#: FRI's own ports.
PORTS = range(30200, 30210)
#: Default periods [ms].
PERIOD, PERIOD_MONITOR = 5, 1
#: Longest time between two answers, by kind [ms].
_MAX_ANSWER_TIME = {"position": 10, "torque": 5, "wrench": 10, "pose": 10, "monitor": 100}
_EXAMPLE_MODE = "CartesianImpedance(stiffness=(500, 500, 500, 50, 50, 50))"


class FriKeywords(LoopKeywords, total=False):
    """Keywords of `Arm.fri`, for type checkers: those of the session here, and the settings of its loop."""

    period_ms: int | None
    multiplier: int
    mode: Mode | None
    io: Sequence[str]
    host: str
    port: int | None
    timeout: float


@dataclass(frozen=True, slots=True)
class FriRequest:
    """A checked request for a session.

    Attributes:
        kind: the commanded quantity, or "monitor".
        message: to the cabinet; host may be empty, and the port is set once the client listens.
        make: makes the client, which then listens on an address of this machine.
        has_law: a law commands.
    """

    kind: str
    message: wire.FriOpen
    make: Callable[[str], Client]
    has_law: bool


def request(
    connection: Connection,
    kind: str,
    *,
    period_ms: int | None = None,
    multiplier: int = 1,
    mode: Mode | None = None,
    io: Sequence[str] = (),
    host: str = "",
    port: int | None = None,
    timeout: float = 10.0,
    **loop: Unpack[LoopKeywords],
) -> FriRequest:
    """Check the keywords of `Arm.fri`; turn them into a request.

    Raises:
        CommandRejected: this cabinet does not support such a session.
        ModeConflict: this kind is not possible in this control mode.
        LimitError: a value outside its range.
    """
    word(kind, "kind", KINDS)
    _check_kind(kind, connection.welcome.capabilities)
    period = (PERIOD_MONITOR if kind == "monitor" else PERIOD) if period_ms is None else period_ms
    _check_period(kind, period, multiplier)
    law = loop.get("law")
    if isinstance(law, CompiledLaw):
        _check_law(kind, law)
        mode = _FOR_LAWS.get(law.kind) if mode is None else mode
    check_mode(kind, mode)
    if kind == "monitor" and law is not None:
        raise ModeConflict(
            "a monitoring session takes no law",
            code=int(Code.MODE_CONFLICT),
            parameter="law",
            hint='iterate over its states, or use arm.fri("position")',
        )
    if loop.get("params") is not None and law is None:
        raise ShapeError("params need a law, and none was given", parameter="params", hint="give law=...")
    if port is not None:
        integer(port, "port", 0, 65535)
    check_printable(instance(host, str, "host"), "host")
    settings = LoopSettings(model=connection.robot, **loop)
    message = wire.FriOpen(
        host=host,
        period=round(period) * 1e-3,
        receive_multiplier=multiplier,
        command=KINDS[kind],
        mode=None if kind == "monitor" else mode_message(mode),
        timeout=within(timeout, "timeout", 0.1, 60.0, unit="s"),
        io=_signals(io, connection),
    )

    def make(address: str) -> Client:
        return _listening(port, address, lambda chosen: Client(chosen, host=address, settings=settings))

    return FriRequest(kind, message, make, law is not None)


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


def _check_law(kind: str, law: CompiledLaw) -> None:
    """Refuse a law in a session that does not command what the law is written to command.

    Raises:
        ModeConflict: it would run without effect.
    """
    commanded = _BY_LAW.get(law.kind)
    if commanded is not None and kind != "monitor" and commanded not in COMMANDS[kind]:
        raise ModeConflict(
            f'{law!r} commands {commanded}, which is not commanded in an FRI session of kind "{kind}"',
            code=int(Code.MODE_CONFLICT),
            parameter="law",
            allowed=", ".join(COMMANDS[kind]),
            hint=f'open the session with arm.fri("{law.kind}", law=...)',
        )


def _signals(names: Sequence[str], connection: Connection) -> tuple[str, ...]:
    """Full names of the signals of the session, checked as the cabinet does."""
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise ShapeError(
            f"io must be a list of names, got {shown(names)}",
            parameter="io",
            value=names,
            hint=f'io=["{names}"]' if isinstance(names, str) else 'for example io=["LEDBlue"]',
        )
    if not names:
        return ()
    if "fri_io" not in connection.welcome.capabilities:
        raise CommandRejected(
            "the FRI of this cabinet transmits no signals",
            code=int(Code.UNSUPPORTED),
            parameter="io",
            hint="it needs FRI 1.14 or later; arm.io reads and writes them through the application",
        )
    known = connection.signals
    all_names = tuple(signal.name for signal in known)
    found = [known[find_name(name, all_names)] for name in names]
    full = tuple(signal.name for signal in found)
    if len(full) > MAX_IO:
        raise LimitError(
            f"FRI transmits at most {MAX_IO} signals, got {len(full)}",
            code=int(Code.BAD_LENGTH),
            parameter="io",
            value=len(full),
            allowed=f"[0, {MAX_IO}]",
        )
    for place, signal in enumerate(found):
        if signal.name in full[:place]:
            raise CommandRejected(
                f"io names {signal.name} twice", code=int(Code.UNKNOWN_NAME), parameter=f"io[{place}]"
            )
        if signal.kind == "integer" or len(signal.name) > MAX_NAME:
            what = (
                f"{signal.name} is a signed integer, which FRI does not transmit"
                if signal.kind == "integer"
                else f"FRI transmits names of at most {MAX_NAME} bytes, {signal.name} has {len(signal.name)}"
            )
            raise CommandRejected(
                what, code=int(Code.UNSUPPORTED), parameter=f"io[{place}]", hint="arm.io reads and writes it"
            )
    return full


def _check_period(kind: str, period: float, multiplier: int) -> None:
    period = scalar(period, "period_ms", unit="ms")
    if not isfinite(period) or period != round(period) or not 1 <= period <= 100:
        raise LimitError(
            f"period_ms must be a whole number from 1 to 100 ms, got {period:g}",
            code=int(Code.OUT_OF_RANGE if isfinite(period) else Code.NOT_FINITE),
            parameter="period_ms",
            value=period,
            allowed="1, 2, ... 100 ms",
        )
    integer(multiplier, "multiplier", 1, 100)
    answers, most = period * multiplier, _MAX_ANSWER_TIME[kind]
    if answers > most:
        what = "a monitoring client" if kind == "monitor" else f"a client that commands {kind}"
        raise LimitError(
            f"{what} must answer at least every {most} ms, got every {answers:g} ms",
            code=int(Code.OUT_OF_RANGE),
            parameter="period_ms",
            value=answers,
            allowed=f"period_ms x multiplier in [1, {most}] ms",
        )


def check_mode(kind: str, mode: Mode | None) -> None:
    """Check that a kind is possible in the control mode of the hold under the overlay, as the cabinet does.

    Raises:
        ModeConflict: it is not; the hint names a mode in which it is.
    """
    if kind == "monitor":
        return
    mode = Position() if mode is None else mode
    name = type(mode).__name__
    if isinstance(mode, SineImpedance):
        needs, example = "an overlay is not possible with a superposed sine force", _EXAMPLE_MODE
    elif kind == "torque" and not isinstance(mode, JointImpedance):
        needs, example = "a torque overlay needs joint impedance under it", "JointImpedance(stiffness=0)"
    elif kind == "wrench" and not isinstance(mode, CartesianImpedance):
        needs, example = "a wrench overlay needs Cartesian impedance under it", _EXAMPLE_MODE
    else:
        return
    raise ModeConflict(
        f"{needs}, got {name}",
        code=int(Code.MODE_CONFLICT),
        parameter="mode",
        value=name,
        allowed=example.partition("(")[0],
        hint=f'arm.fri("{kind}", mode={example}), with the mode from heptarm.modes',
    )


def check_command(kind: str, given: Mapping[str, object]) -> None:
    """Check that a session of this kind commands the given quantities; None counts as not given.

    Raises:
        ModeConflict: it commands another quantity.
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


def _listening(port: int | None, address: str, make: Callable[[int], Client]) -> Client:
    """Make a client on a port of an address; None: the first free one of FRI's ports."""
    if port is not None:
        return make(port)
    for candidate in PORTS:
        if not _is_free(candidate, address):
            continue
        try:
            return make(candidate)
        except ConnectFailed as error:
            if (
                error.parameter != "port"
            ):  # otherwise another program took it, or just tests whether it is free
                raise
    raise ConnectFailed(
        f"none of FRI's ports {PORTS[0]} to {PORTS[-1]} is free on this machine",
        parameter="port",
        hint="end another FRI client (`ss -ulpn` lists them), or give a port, as in arm.fri(..., port=30300)",
    )


def _is_free(port: int, address: str) -> bool:
    try:
        UdpSocket(port, host=address).close()
    except ConnectFailed as error:
        if error.parameter != "port":
            raise
        return False
    return True
