"""Waits for DialOut and moves its arm: python pc.py PORT (0: any free one, which is printed)."""

import socket
import struct
import sys
import time
from typing import Any

STATE, PTP, LIN, STOP, TOUCH, END = 1, 2, 3, 4, 5, 99
HOME = [0.0, 0.5236, 0.0, -1.5708, 0.0, 1.0472, 0.0]

server = socket.socket()
server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
server.bind(("0.0.0.0", int(sys.argv[1])))
server.listen(1)
print("port", server.getsockname()[1], flush=True)
robot, _ = server.accept()
robot.settimeout(120)


def receive(count: int) -> bytes:
    data = b""
    while len(data) < count:
        part = robot.recv(count - len(data))
        if not part:
            raise SystemExit("the robot has closed the connection")
        data += part
    return data


def send(command: int, *values: float) -> dict[str, Any]:
    robot.sendall(struct.pack(f">ii{len(values)}d", 4 + 8 * len(values), command, *values))
    (length,) = struct.unpack(">i", receive(4))
    answer = struct.unpack(">iii21d", receive(length))
    return {
        "status": answer[1],
        "errors": answer[2],
        "q": answer[3:10],
        "tau": answer[10:17],
        "tip": answer[17:23],
        "moving": answer[23] > 0,
    }


def settle() -> dict[str, Any]:
    time.sleep(0.05)
    while send(STATE)["moving"]:
        time.sleep(0.02)
    return send(STATE)


start = settle()
print("ptp", send(PTP, 0.3, *HOME[1:])["status"], f"A1 at {settle()['q'][0]:.2f} rad")
x, y, z, a, b, c = start["tip"]
print("lin", send(LIN, x, y, z - 50, a, b, c)["status"], f"tip lower by {z - settle()['tip'][2]:.0f} mm")
send(PTP, 1.2, *HOME[1:])
while send(STATE)["q"][0] < 0.1:
    pass
print("stop", send(STOP)["status"], "before the goal:", settle()["q"][0] < 1.1)
print("far", send(LIN, 3000, 0, 500, a, b, c)["status"], "errors", settle()["errors"])
print("refused", send(PTP, 1.0, 2.0)["status"], send(77)["status"])
print("touch", send(TOUCH, x, y, z - 30, a, b, c, 15)["status"], "nothing was there")
print("end", send(END)["status"], flush=True)
robot.close()
server.close()
