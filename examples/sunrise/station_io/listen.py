"""Shows what StatusSender sends: python listen.py PORT (0: any free one, which is printed)."""

import socket
import sys

udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
udp.bind(("", int(sys.argv[1])))
print("port", udp.getsockname()[1], flush=True)
udp.settimeout(120)
seen, lost, last, before, turned = 0, 0, None, None, 0.0
while True:
    words = udp.recv(2000).decode("ascii").split(";")
    number, busy, done, valve = int(words[0]), words[4], int(words[5]), float(words[6])
    joints = [float(word) for word in words[7:14]]
    seen += 1
    lost += 0 if last is None else number - last - 1
    last, turned = number, max(turned, joints[6])
    if (busy, done) != before:
        print(f"{words[1]} {words[2]} busy {busy} done {done} valve {valve:.2f} V", flush=True)
        before = busy, done
    if done == 2 and busy == "0":
        break
print(f"A7 has been at {turned:.0f} deg, {lost} of {seen + lost} datagrams lost")
