"""Connect two clients to one virtual cabinet: one controls the arm, the other observes and stops it."""

import json
import subprocess
import sys

import heptarm as ha

command = [sys.executable, "-m", "heptarm.sim.runtime.cabinet", "--port", "0", "--parent-pipe"]
cabinet = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
assert cabinet.stdin and cabinet.stdout
target = f"sim://127.0.0.1:{json.loads(cabinet.stdout.readline())['port']}"

with (
    ha.connect(target, name="controller") as arm,
    ha.connect(target, control=False, name="observer") as observer,
):
    print("the client in control is", observer.controller)
    handle = arm.start(ha.ptp(ha.deg(90, 30, 0, -90, 0, 60, 0)), speed=0.3)
    observer.wait_until(lambda state: state.q[0] > 0.2)
    observer.stop()
    try:
        handle.wait()
    except ha.MotionAborted as error:
        print("the controller receives:", error)

cabinet.stdin.close()
cabinet.wait()
