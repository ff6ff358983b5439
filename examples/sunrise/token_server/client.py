"""Moves the arm through TokenServer: python client.py HOST PORT."""

import math
import socket
import sys
import time


class Robot:
    def __init__(self, host: str, port: int) -> None:
        for _ in range(600):  # until the application listens
            try:
                self.socket = socket.create_connection((host, port), timeout=60)
                break
            except ConnectionRefusedError:
                time.sleep(0.1)
        self.lines = self.socket.makefile("r", encoding="ascii", newline="\n")

    def ask(self, *words: object) -> str:
        self.socket.sendall((" ".join(str(word) for word in words) + "\n").encode("ascii"))
        return self.lines.readline().strip()

    def numbers(self, *words: object) -> list[float]:
        return [float(word) for word in self.ask(*words).split("_")[1:]]


robot = Robot(sys.argv[1], int(sys.argv[2]))
start = robot.numbers("pose")
print("rel:", robot.ask("rel", 0, 60, -40))
end = robot.numbers("pose")
dx, dy, dz = (round(b - a) for a, b in zip(start[:3], end[:3]))
print(f"moved by {dx} {dy} {dz} mm")
print(
    "wrong:", robot.ask("dance"), "|", robot.ask("ptp", 1, "two"), "|", robot.ask("ptp", 0, 9, 0, 0, 0, 0, 0)
)
print("ptp:", robot.ask("ptp", 0, 0.5, 0, -1.5, 0, 1.1, 0, 0.5))
print("servo:", robot.ask("servo", "on"), "|", robot.ask("servo", "on"))
q = robot.numbers("joints")
top = 0.0
for step in range(300):
    target = list(q)
    target[6] += 0.2 * math.sin(step * 0.05)
    measured = robot.numbers("servo", *target)
    top = max(top, abs(measured[6] - q[6]))
    time.sleep(0.01)
print(f"servo moved A7 by {top:.1f} rad")
print("off:", robot.ask("servo", "off"), "|", robot.ask("servo", *q))
print("force below 5 N:", max(abs(one) for one in robot.numbers("force")) < 5.0)
print(robot.ask("bye"))
