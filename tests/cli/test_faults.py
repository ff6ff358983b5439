"""`heptarm sim` with a simulated operator: timed faults, and commands typed while it runs."""

from __future__ import annotations

import json
import signal
import subprocess

import heptarm as ha
from tests.cli.running import HEPTARM, run, sim
from tests.interrupts import ctrl_c_interrupts


def test_a_timed_fault_happens_and_goes() -> None:
    with sim("--fault", "emergency_stop@0.5", "--fault", "t1@0.6") as ready:
        with ha.connect(ready["target"], control=False, timeout=30.0) as arm:
            arm.wait_until(lambda s: s.safety.emergency_stop, timeout=30.0)
            arm.wait_until(lambda s: s.safety.mode.value == "t1", timeout=30.0)
        shown = run("state", "--target", ready["target"])
        assert "T1" in shown.stdout and "emergency stop" in shown.stdout
        left = run("recover", "--target", ready["target"])
        assert left.returncode == 1 and "release the emergency stop" in left.stdout


def test_a_fault_that_is_none_reports_what_there_is() -> None:
    done = run("sim", "--port", "0", "--fault", "explosion@1")
    assert done.returncode == 1 and "emergency_stop" in done.stderr
    assert "@" in run("sim", "--port", "0", "--fault", "emergency_stop").stderr
    assert "--fault" in run("sim", "--help").stdout


def test_what_is_typed_is_done() -> None:
    command = [*HEPTARM, "sim", "--json", "--port", "0"]
    with ctrl_c_interrupts():
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdin is not None and process.stdout is not None
    try:
        ready = json.loads(process.stdout.readline())
        process.stdin.write("help\noperator_safety\nexplode\n")
        process.stdin.flush()
        said = [json.loads(process.stdout.readline())]
        while "operator" not in said[-1]:
            said.append(json.loads(process.stdout.readline()))
        refused = json.loads(process.stdout.readline())
        assert any(one.get("say") == "emergency_stop" for one in said)
        assert said[-1] == {"operator": "operator_safety", "error": "", "shown": ""}
        assert refused["operator"] == "explode" and "emergency_stop" in refused["error"]
        process.stdin.close()  # ends nothing
        with ha.connect(ready["target"], control=False, timeout=30.0) as arm:
            arm.wait_until(lambda s: s.safety.operator_safety_open, timeout=30.0)
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=30) == 0
        process.stdout.close()
