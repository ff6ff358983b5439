"""A client session and a cabinet session, connected by hand."""

from __future__ import annotations

from heptarm.wire.messages import MAJOR, Groups, RobotInfo, Welcome
from heptarm.wire.session import Received, Session, Side, StateReceived

ROBOT = RobotInfo(
    model="iiwa14",
    title="LBR iiwa 14 R820",
    q_min=(-2.9, -2.0, -2.9, -2.0, -2.9, -2.0, -3.0),
    q_max=(2.9, 2.0, 2.9, 2.0, 2.9, 2.0, 3.0),
    dq_max=(1.5, 1.5, 1.7, 1.3, 2.2, 2.3, 2.3),
    tau_max=(320.0, 320.0, 176.0, 176.0, 110.0, 40.0, 40.0),
)


def welcome(**changes: object) -> Welcome:
    fields: dict[str, object] = {
        "major": MAJOR,
        "minor": 0,
        "session": 7,
        "software": "0",
        "cabinet": "test",
        "virtual": True,
        "robot": ROBOT,
        "capabilities": ("ptp", "lin", "lin_rel", "hold"),
        "tools": (),
        "frames": (),
        "signals": (),
        "groups": Groups(255),
        "max_rate": 1000.0,
        "heartbeat": 0.4,
        "controller": "",
    }
    return Welcome(**(fields | changes))  # type: ignore[arg-type]


def pour(data: bytes, into: Session) -> list[Received | StateReceived]:
    into.receive_data(data)
    return list(into.events())


def open_pair(key: bytes | None = None) -> tuple[Session, Session]:
    client, cabinet = Session(Side.CLIENT, key=key), Session(Side.CABINET, key=key)
    pour(client.send(client.hello(name="t")), cabinet)
    if key is not None:
        pour(cabinet.send(cabinet.challenge()), client)
        pour(client.send(client.proof()), cabinet)
    pour(cabinet.send(welcome()), client)
    return client, cabinet
