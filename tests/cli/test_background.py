"""Commands started by a script in the background, where the shell makes them ignore SIGINT."""

from __future__ import annotations

import json
import signal
import subprocess
import time

import pytest

from tests.cli.running import HEPTARM


@pytest.mark.parametrize("words", [("--port", "0"), ("--fri", "1.15", "--fri-port", "0")], ids=["sim", "fri"])
def test_ctrl_c_at_the_terminal_is_not_for_a_background_job(words: tuple[str, ...]) -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # as a shell does; it is inherited
    try:
        process = subprocess.Popen([*HEPTARM, "sim", "--json", *words], stdout=subprocess.PIPE, text=True)
    finally:
        signal.signal(signal.SIGINT, before)
    with process:
        try:
            assert process.stdout is not None
            assert json.loads(process.stdout.readline())["ready"]
            process.send_signal(signal.SIGINT)
            time.sleep(0.5)
            assert process.poll() is None, "it ended on a Ctrl-C that was not for it"
            process.terminate()
            process.stdout.read()
            assert process.wait(timeout=30) == 0
        finally:
            process.kill()
