"""The Kuka Sunrise Toolbox (KST) and iiwaPy3: their classes connect to port 30001, and the bridge is their server.

A request is a line of ASCII: a word and its numbers with underscores between. The answer is "done", "nak" where it is
refused, or numbers; a motion answers "done" when it begins and again at its end, or "interrupted" if its torque window
ended it. Lengths are millimetres, angles radians, joints count from 1; one speed is a fraction for joints and mm/s for
lines. Where client and server of KST disagree, the client's meaning counts: conditional relative lines and circles,
set-points with an answer, both spellings of the start of impedance.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial, reduce
from operator import or_
from types import MappingProxyType
from typing import Any, Literal

from heptarm.arm.arm import Arm
from heptarm.bridge.bridged_arm import BridgedArm
from heptarm.bridge.peer import Peer
from heptarm.errors import CommandRejected, ConnectFailed, ConnectionLost, HeptarmError, ShapeError
from heptarm.io.tcp import listening
from heptarm.values.checks import within
from heptarm.values.condition.condition import Condition
from heptarm.values.condition.force import JointTorqueOutside
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.values.mode.mode import Mode, Position
from heptarm.values.motion.circle import circ
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.motion.motion import Motion
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose
from heptarm.values.result import Cause
from heptarm.values.tool import Tool

_log = logging.getLogger("heptarm.bridge")

#: The port to which KST's classes connect.
PORT = 30001
_DONE, _NAK, _INTERRUPTED = "done", "nak", "interrupted"
#: A client reads the two answers of a motion one by one, if they do not come at once [s].
_APART = 0.02
#: How often the bridge looks whether it is to end [s].
_LOOK = 0.5
#: Pins of the media flange: KST counts those of its plug.
_OUTPUTS = MappingProxyType({1: "OutputX3Pin1", 2: "OutputX3Pin2", 11: "OutputX3Pin11", 12: "OutputX3Pin12"})
_INPUTS = MappingProxyType(
    {
        3: "InputX3Pin3",
        4: "InputX3Pin4",
        10: "InputX3Pin10",
        13: "InputX3Pin13",
        16: "InputX3Pin16",
    }
)

Stream = Literal["joint", "pose", "velocity"]


class KstBridge:
    """Answers the lines of KST and iiwaPy3.

    Args:
        arm: in control.
        send: sends an answer; a motion has two.
        interrupted: looks, during a motion, whether the program stops it or has gone.
    """

    def __init__(
        self, arm: Arm, *, send: Callable[[str], None], interrupted: Callable[[], bool] = lambda: False
    ) -> None:
        self._arm = arm
        self._bridged = BridgedArm(arm)
        self._send = send
        self._interrupted = interrupted
        self._logged = ""
        self._speed = 0.1
        self._joints: list[float] = [0.0] * 7
        self._pose: list[float] = [0.0] * 6
        self._via: list[float] = [0.0] * 6
        self._end: list[float] = [0.0] * 6
        self._stream: Stream | None = None
        self._mode: Mode = Position()

    def answer(self, line: str) -> bool:
        """Carry out a line.

        Returns:
            Whether the program goes on; False: it has said that it ends.

        Raises:
            ConnectionLost: the cabinet cannot be reached.
        """
        text = line.strip()
        if not text:  # iiwaPy3 ends some lines twice
            return True
        if text == "end":
            return False
        word = _word(text)
        try:
            values = [float(one) for one in text[len(word) :].split("_") if one]
            command = _COMMANDS.get(word)
            if command is None:
                raise CommandRejected(
                    f"line must be one of KST's commands, got {line[:40]!r}", parameter="line"
                )
            self._bridged.in_control(partial(command, self, values))
        except (HeptarmError, ValueError, OverflowError) as error:
            # a motion that ends since control was lost ends so, too; the next command takes it again
            if isinstance(error, ConnectionLost) and not self._bridged.arm.connected:
                raise
            if str(error) != self._logged:  # a stream repeats it
                self._logged = str(error)
                _log.warning("KST's command %s is refused: %s", word[:40], error)
            if word not in _SILENT:
                self._send(_NAK)
        return True

    @staticmethod
    def is_answered_at_once(line: str) -> bool:
        """Whether a line is answered during a motion, too: it asks for the state, or for a signal."""
        return _word(line.strip()) in _AT_ONCE or not line.strip()

    def stop(self) -> None:
        """Stop the arm: the program has gone."""
        self._bridged.stop()

    def _done(self) -> None:
        self._send(_DONE)

    def _numbers(self, values: Sequence[float]) -> None:
        self._send("".join(f"{value!r}_" for value in map(float, values)))

    # ---------------------------------------------------------------------------------- targets

    def _set_speed(self, values: list[float]) -> None:
        (self._speed,) = _count(values, 1)
        self._done()

    def _set_pose(self, values: list[float]) -> None:
        self._pose = _count(values, 6)
        self._done()

    def _set_via(self, values: list[float]) -> None:
        self._via = _count(values, 6)
        self._done()

    def _set_end(self, values: list[float]) -> None:
        self._end = _count(values, 6)
        self._done()

    def _target(self, kind: Stream, values: list[float], report: Callable[[], None]) -> None:
        """Take a target: a stream follows it, a motion comes to it later."""
        if kind == "joint":
            self._joints = _count(values, 7)
        if self._stream == kind:
            target: Any = _pose(_count(values, 6)) if kind == "pose" else _count(values, 7)
            self._bridged.follow(target, kind, settings=lambda: {"mode": self._mode, "speed": 1.0})
        report()

    def _begin(self, kind: Stream, mode: Mode) -> None:
        self._bridged.halt()
        self._stream, self._mode = kind, mode
        self._done()

    def _begin_impedance(self, values: list[float]) -> None:
        _, _, _, _, along, about, elbow = _count(values, 7)
        mode = CartesianImpedance({"xyz": along, "abc": about}, nullspace_stiffness=elbow)
        self._begin("joint", mode)

    def _end_stream(self, _: list[float]) -> None:
        self._bridged.halt()
        self._stream, self._mode = None, Position()
        self._done()

    # ---------------------------------------------------------------------------------- motions

    def _move(self, motion: Callable[[], Motion], until: Condition | None = None) -> None:
        """Carry out a motion: one answer when it begins, and one at its end."""
        self._stream = None
        handle = self._bridged.start(motion(), mode=Position(), until=until)
        began = time.monotonic()
        self._done()
        result = self._bridged.finish(handle, interrupted=self._interrupted)
        time.sleep(max(0.0, began + _APART - time.monotonic()))
        if result.cause is Cause.FINISHED:
            self._done()
        else:
            self._send(_INTERRUPTED)

    def _fraction(self) -> float:
        return within(self._speed, "jRelVel", 0.0, 1.0, above=True)

    def _mps(self) -> float:
        return within(self._speed / 1000.0, "jRelVel", 0.0, 10.0, above=True, unit="m/s")

    def _ptp(self) -> Motion:
        return ptp(self._joints, speed=self._fraction())

    def _line(self) -> Motion:
        return lin(_pose(self._pose), speed_mps=self._mps())

    def _relative(self, frame: str) -> Motion:
        x, y, z = (value / 1000.0 for value in self._pose[:3])
        return lin_rel(x=x, y=y, z=z, frame=frame, speed_mps=self._mps())

    def _circle(self) -> Motion:
        return circ(_pose(self._via), _pose(self._end), speed_mps=self._mps())

    # ------------------------------------------------------------------------------------ state

    def _report_joints(self) -> None:
        self._numbers(self._bridged.state().q.tolist())

    def _report_external(self) -> None:
        self._numbers(self._bridged.state().tau_ext.tolist())

    def _report_torques(self) -> None:
        self._numbers(self._bridged.state().tau.tolist())

    def _report_pose(self) -> None:
        pose = self._bridged.state().pose
        self._numbers([*(1000.0 * pose.xyz).tolist(), *pose.abc.tolist()])

    def _report_force(self) -> None:
        self._numbers(self._arm.wrench(axes="tool", state=self._bridged.state()).force.tolist())

    def _report_moment(self) -> None:
        self._numbers(self._arm.wrench(axes="tool", state=self._bridged.state()).torque.tolist())

    # ---------------------------------------------------------------------------- tool and pins

    def _attach(self, values: list[float]) -> None:
        self._bridged.halt()
        self._arm.attach_tool(Tool("KST", tcp=_pose(_count(values, 6))))
        self._done()

    def _set_pin(self, pin: int, value: bool) -> None:
        self._arm.io[_OUTPUTS[pin]] = value
        self._done()

    def _report_pin(self, pin: int) -> None:
        self._send(str(int(self._arm.io[_INPUTS[pin]])))

    def _set_lamp(self, colour: str) -> None:
        self._arm.io.led = colour
        self._done()

    def _guide(self, values: list[float]) -> None:
        raise CommandRejected(
            "the bridge has no hand guiding", parameter="line", hint="use heptarm's own: ha.hand_guide()"
        )


_Command = Callable[[KstBridge, list[float]], None]


def _target(kind: Stream, report: Callable[[KstBridge], None]) -> _Command:
    return lambda server, values: server._target(kind, values, lambda: report(server))


def _begin(kind: Stream) -> _Command:
    return lambda server, values: server._begin(kind, Position())


def _motion(motion: Callable[[KstBridge], Motion]) -> _Command:
    return lambda server, values: server._move(lambda: motion(server))


def _conditional(motion: Callable[[KstBridge], Motion]) -> _Command:
    return lambda server, values: server._move(lambda: motion(server), _window(values))


def _report(report: Callable[[KstBridge], None]) -> _Command:
    return lambda server, values: report(server)


def _output(pin: int, value: bool) -> _Command:
    return lambda server, values: server._set_pin(pin, value)


def _input(pin: int) -> _Command:
    return lambda server, values: server._report_pin(pin)


def _lamp(colour: str) -> _Command:
    return lambda server, values: server._set_lamp(colour)


def _word(text: str) -> str:
    """The command at the beginning of a line; empty: there is none."""
    return next((word for word in _WORDS if text.startswith(word)), "")


def _count(values: list[float], count: int) -> list[float]:
    if len(values) < count:
        raise ShapeError(f"line must have {count} numbers, got {len(values)}", parameter="line")
    return values[:count]


def _pose(values: Sequence[float]) -> Pose:
    x, y, z, a, b, c = values
    return Pose.xyz_abc(x / 1000.0, y / 1000.0, z / 1000.0, a, b, c)


def _window(values: list[float]) -> Condition:
    """The torques outside the windows of joints: for each its number, from 1, its smallest and its largest torque."""
    if not values or len(values) % 3:
        raise ShapeError(
            f"a torque window must have a joint and two torques for each joint, got {len(values)} numbers",
            parameter="line",
        )
    windows: list[Condition] = [
        JointTorqueOutside(round(values[at]) - 1, values[at + 1], values[at + 2])
        for at in range(0, len(values), 3)
    ]
    return reduce(or_, windows)


_FEEDBACK: Mapping[str, Callable[[KstBridge], None]] = MappingProxyType(
    {
        "ExT": KstBridge._report_external,
        "MT": KstBridge._report_torques,
        "JP": KstBridge._report_joints,
        "EEfP": KstBridge._report_pose,
        "EEfFrelEEF": KstBridge._report_force,
    }
)
_STREAMS: tuple[tuple[str, Stream], ...] = (("jp", "joint"), ("DcSeCar", "pose"), ("velJDC", "velocity"))
#: Targets that no answer follows.
_SILENT = ("jf_", "DcSeCar_")
_COMMANDS: Mapping[str, _Command] = MappingProxyType(
    {
        **{
            f"{word}{suffix}_": _target(kind, report)
            for word, kind in _STREAMS
            for suffix, report in _FEEDBACK.items()
        },
        "jp_": _target("joint", KstBridge._done),
        "jf_": _target("joint", lambda server: None),
        "DcSeCar_": _target("pose", lambda server: None),
        "DcSeCarW_": _target("pose", KstBridge._done),
        "velJDC_": _target("velocity", KstBridge._done),
        "TFtrans": KstBridge._attach,
        "jRelVel": KstBridge._set_speed,
        "cArtixanPosition_": KstBridge._set_pose,
        "cArtixanPositionCirc1_": KstBridge._set_via,
        "cArtixanPositionCirc2_": KstBridge._set_end,
        "startDirectServoJoints": _begin("joint"),
        "stDcEEf": _begin("pose"),
        "stVelDcJoint": _begin("velocity"),
        "startSmartImpedneceJoints": KstBridge._begin_impedance,
        "startSmartImpedanceJoints": KstBridge._begin_impedance,
        "stopDirectServoJoints": KstBridge._end_stream,
        "doPTPinJS": _motion(KstBridge._ptp),
        "doPTPinCS": _motion(KstBridge._line),
        "doPTPinCSRelBase": _motion(lambda server: server._relative("base")),
        "doPTPinCSRelEEF": _motion(lambda server: server._relative("tool")),
        "doPTPinCSCircle1": _motion(KstBridge._circle),
        "doPTP!inJS": _conditional(KstBridge._ptp),
        "doPTP!inCS": _conditional(KstBridge._line),
        "doPTP!inCSRelBase": _conditional(lambda server: server._relative("base")),
        "doPTP!inCSRelEEF": _conditional(lambda server: server._relative("tool")),
        "doPTP!CSCircle1": _conditional(KstBridge._circle),
        "getJointsPositions": _report(KstBridge._report_joints),
        "Torques_ext_J": _report(KstBridge._report_external),
        "Torques_m_J": _report(KstBridge._report_torques),
        "Eef_pos": _report(KstBridge._report_pose),
        "Eef_force": _report(KstBridge._report_force),
        "Eef_moment": _report(KstBridge._report_moment),
        "blueOn": _lamp("blue"),
        "blueOff": _lamp("off"),
        "handGuiding": KstBridge._guide,
        "preciseHandGuiding": KstBridge._guide,
        **{f"pin{pin}{word}": _output(pin, word == "on") for pin in _OUTPUTS for word in ("on", "off")},
        **{f"getPin{pin}": _input(pin) for pin in _INPUTS},
    }
)
#: The longest first: a word may begin with another one.
_WORDS = tuple(sorted(_COMMANDS, key=len, reverse=True))
#: What is answered during a motion: no motion, no stream and no tool.
_AT_ONCE = frozenset(
    word
    for word in _COMMANDS
    if word.startswith(("get", "Torques", "Eef", "blue", "pin"))
    or any(word == f"{stream}{suffix}_" for stream, _ in _STREAMS for suffix in _FEEDBACK)
)


# ------------------------------------------------------------------------------------------- connection


def serve_kst(
    arm: Arm,
    *,
    host: str = "127.0.0.1",
    port: int = PORT,
    on_change: Callable[[str], None] = lambda text: None,
    ended: threading.Event | None = None,
) -> None:
    """Let programs written for KST or iiwaPy3 control an arm, one after the other.

    Args:
        arm: in control.
        host: address to listen on.
        port: at which programs connect.
        on_change: called with a sentence when a program connects and when it has gone.
        ended: ends it when it is set; None: it runs until an error or Ctrl-C.

    Raises:
        ConnectFailed: the port is in use.
        ConnectionLost: the connection to the cabinet was lost; the cabinet stops the arm.
    """
    over = threading.Event() if ended is None else ended
    with listening(host=host, port=port) as listener:
        while not over.is_set():
            try:
                peer = Peer(listener.accept(timeout=_LOOK))
            except ConnectFailed:  # nobody yet
                continue
            on_change(f"a program at {peer.name} controls the arm")
            try:
                gone = _converse(arm, peer, over)
            finally:
                peer.close()
            on_change(f"the program has gone, the arm is stopped ({gone})")


def _converse(arm: Arm, peer: Peer, over: threading.Event) -> str:
    """Answer lines until the program has gone; returns why."""
    gone: list[str] = []

    def send(text: str) -> None:
        try:
            peer.send(f"{text}\n".encode("ascii"))
        except ConnectionLost as error:
            gone.append(str(error))

    def receive(*, wait: bool) -> None:
        try:
            peer.receive(wait=wait)
        except ConnectionLost as error:
            gone.append(str(error))

    def interrupted() -> bool:
        receive(wait=False)
        while (line := peer.next_line()) is not None and server.is_answered_at_once(line):
            peer.take_line()
            server.answer(line)
        return bool(gone) or over.is_set() or line == "end"

    server = KstBridge(arm, send=send, interrupted=interrupted)
    try:
        while not gone and not over.is_set():
            receive(wait=True)
            while not gone and (line := peer.take_line()) is not None:
                if not server.answer(line):
                    return "it has said so"
    finally:
        with suppress(ConnectionLost):  # then the cabinet stops the arm
            server.stop()
    return gone[0] if gone else "the bridge ends"
