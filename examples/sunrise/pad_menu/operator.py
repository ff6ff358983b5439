"""Plays the person at the smartPAD for PadMenu: python operator.py FOLDER-OF-THE-PROJECT [OPTIONS OF heptarm sim]."""

import subprocess
import sys

#: What has to appear in the log, and what the operator types then.
SCRIPT = [
    ("Next job?", "answer 0"),
    ("Next job?", "press 0 MENU"),
    ("lamp on", "press 1 MENU"),
    ("speed 50 %", "press 1 MENU"),
    ("speed 75 %", "press 1 MENU second"),
    ("speed 50 %", "answer 1"),
    ("Next job?", "answer 2"),
    ("place below it free?", "answer 0"),
    ("Next job?", "answer 2"),
    ("place below it free?", "answer 1"),
    ("Next job?", "answer 3"),
    ("nods: 1", "answer 0"),
    ("Next job?", "answer 4"),
]

command = [sys.executable, "-m", "heptarm.cli.main", "sim", "app", *sys.argv[1:]]
sim = subprocess.Popen(
    command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1
)
assert sim.stdin and sim.stdout
script = list(SCRIPT)
for line in sim.stdout:
    print(line, end="", flush=True)
    if script and script[0][0] in line:
        sim.stdin.write(script.pop(0)[1] + "\n")
        sim.stdin.flush()
sys.exit(sim.wait() or (1 if script else 0))
