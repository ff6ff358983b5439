"""A cabinet as a child process, and the words that a person at the terminal types as its operator."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from heptarm.cli.output import is_silent, lines
from heptarm.errors import ConnectFailed, refuse_windows, require_extra, system_errors
from heptarm.io.keys import environment
from heptarm.sim.runtime.operator import WORDS
from heptarm.values.simulator_options import SimulatorOptions

#: The error of Java for an address that this machine does not have.
ADDRESS_MISSING = "Cannot assign requested address"


class Child(subprocess.Popen[str]):
    """A process that ends when its standard input is closed, and therefore with this process.

    Args:
        command: to start.
        key: pre-shared key that it uses, in its environment; None: none.
    """

    def __init__(self, command: list[str], key: str | None) -> None:
        # a session of its own: Ctrl-C reaches this process only, which then ends its children in order
        with system_errors("a process cannot be started"):
            super().__init__(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                start_new_session=True,
                env=environment(key),
            )

    def __exit__(self, *_: Any) -> None:
        assert self.stdin is not None
        self.stdin.close()
        try:
            self.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self.kill()
            self.wait()


def first_line(child: subprocess.Popen[str], otherwise: str) -> dict[str, Any]:
    """The first line of a child.

    Raises:
        ConnectFailed: it is no JSON object: the child has failed.
    """
    assert child.stdout is not None
    line = child.stdout.readline()
    try:
        ready = dict(json.loads(line))
    except ValueError:
        raise ConnectFailed(f"{otherwise}: {line.strip() or 'see the message above'}") from None
    for note in ready.pop("notes", ()):
        print(f"heptarm: {note}", file=sys.stderr, flush=True)
    return ready


def ready_line(child: subprocess.Popen[str], otherwise: str) -> dict[str, Any]:
    """The first line of a child that has to be ready.

    Raises:
        ConnectFailed: it is not; the text gives the child's reason.
    """
    ready = first_line(child, otherwise)
    if not ready.get("ready"):
        if ready.get("host") or ready.get("options"):
            hint = ""
        elif ADDRESS_MISSING in str(ready.get("error")):
            hint = "choose an address of this machine with --host"
        else:
            hint = "choose another port with --port, or 0 for any"
        raise ConnectFailed(f"{otherwise}: {ready.get('error')}", hint=hint)
    return ready


def cabinet_command(options: SimulatorOptions) -> list[str]:
    """The command line of a cabinet's process.

    Raises:
        HeptarmError: this machine cannot run one.
    """
    refuse_windows("the virtual cabinet")
    require_extra("sim")
    return [sys.executable, "-m", "heptarm.sim.runtime.cabinet", *options.arguments()]


def say(cabinet: subprocess.Popen[str], words: str) -> None:
    """Pass an action of the operator."""
    assert cabinet.stdin is not None
    cabinet.stdin.write(f"{words}\n")
    cabinet.stdin.flush()


def print_words(as_json: bool) -> None:
    """Print what can be typed."""
    for words, meaning in WORDS.items():
        about = json.dumps({"say": words, "to": meaning}) if as_json else f"{words:26} {meaning}"
        put(about)


def converse(cabinet: subprocess.Popen[str], as_json: bool) -> None:
    """Let the user at the terminal play the operator."""
    threading.Thread(target=until_closed, args=(relay_answers, cabinet, as_json), daemon=True).start()
    listen(cabinet, as_json)


def listen(cabinet: subprocess.Popen[str], as_json: bool) -> None:
    """Pass typed lines in the background."""
    if not is_silent():
        threading.Thread(target=until_closed, args=(_type_lines, cabinet, as_json), daemon=True).start()


def _type_lines(cabinet: subprocess.Popen[str], as_json: bool) -> None:
    """Pass typed lines to the cabinet; the end of standard input does not end the cabinet."""
    for said in lines():
        if said == "help":
            print_words(as_json)
            continue
        say(cabinet, said)


def until_closed(work: Callable[..., object], *arguments: object) -> None:
    """Work until the pipe is closed."""
    with suppress(OSError, ValueError):
        work(*arguments)


def relay_answers(cabinet: subprocess.Popen[str], as_json: bool, *, number: int = 0) -> str:
    """Print the cabinet's answers until it ends, after its number if it is one of several.

    Returns:
        The error that ended its application.
    """
    assert cabinet.stdout is not None
    failure = ""
    for line in cabinet.stdout:
        try:
            reply = dict(json.loads(line))
        except (ValueError, TypeError):
            continue
        if "operator" not in reply:
            failure = str(reply.get("error", ""))
        elif as_json:
            put(json.dumps(reply | {"cabinet": number}) if number else line.strip())
        elif reply["operator"]:
            text = reply["error"] or reply["shown"] or f"done: {reply['operator']}"
            put(f"{number}: {text}" if number else text)
    return failure


def put(line: str) -> None:
    """Print a line at once and in one piece: several threads print."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()
