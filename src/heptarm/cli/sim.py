"""`heptarm sim`: a virtual cabinet in the foreground, and a view of it if wanted."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from heptarm.cli import typed
from heptarm.cli.output import emit
from heptarm.errors import ConnectFailed
from heptarm.virtual.operator import WORDS


def run(
    *,
    model: str,
    host: str,
    port: int,
    speed: float,
    view: bool,
    view_port: int,
    key: str,
    faults: tuple[str, ...],
    payload: str,
    project: Path | None,
    verbose: bool,
    as_json: bool,
) -> int:
    """Run until Ctrl-C or SIGTERM; lines on standard input are what the operator does. Returns the exit code.

    Raises:
        ConnectFailed: the cabinet or the view does not start; the text says why.
    """
    command = [sys.executable, "-m", "heptarm.virtual.cabinet", "--parent-pipe", "--model", model]
    command += ["--host", host, "--port", str(port), "--speed", str(speed)]
    command += ["--key", key] if key else []
    for fault in faults:
        command += ["--fault", fault]
    command += ["--payload", payload] if payload else []
    command += ["--project", str(project)] if project is not None else []
    command += ["--verbose"] if verbose else []
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with ExitStack() as stack:
        cabinet = stack.enter_context(_child(command))
        ready = _ready(cabinet, f"the virtual cabinet does not start on {host}:{port}")
        target = f"sim://{host}:{ready['port']}"
        if view:
            viewer = stack.enter_context(
                _child(
                    [
                        sys.executable,
                        "-m",
                        "heptarm.virtual.view",
                        "--target",
                        target,
                        "--port",
                        str(view_port),
                    ]
                )
            )
            ready["view"] = _ready(viewer, "the view does not start")["url"]
        if as_json:
            emit(ready | {"target": target})
        else:
            print(f"A virtual {model} is ready. Connect with {target}; Ctrl-C ends it.")
            if view:
                print(f"See it at {ready['view']}")
            if sys.stdin is not None and sys.stdin.isatty():
                print("You are the operator: type emergency_stop, clear, start, t1, enable ... or help.")
            sys.stdout.flush()
        _converse(cabinet, as_json)
        try:
            return cabinet.wait()
        except KeyboardInterrupt:
            return 0


def run_application(
    *,
    folder: Path,
    main: str,
    data: tuple[str, ...],
    model: str,
    speed: float,
    as_json: bool,
) -> int:
    """Compile somebody else's application and run it to its end; returns the exit code.

    Raises:
        HeptarmError: it does not compile, or there is no such application; the text says why.
    """
    from heptarm.virtual.application import compile_application

    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with TemporaryDirectory(prefix="heptarm-") as out:
        application = compile_application(folder, Path(out), main=main)
        command = [sys.executable, "-m", "heptarm.virtual.cabinet", "--parent-pipe", "--verbose"]
        command += ["--model", model, "--speed", str(speed), "--application", application.main]
        command += ["--classpath", out]
        for jar in application.jars:
            command += ["--classpath", str(jar)]
        for task in application.background:
            command += ["--background", task]
        command += ["--project", str(application.project)] if application.project else []
        for one in data:
            command += ["--data", one]
        if not as_json:
            print(f"{application.main} runs on a virtual {model}; Ctrl-C deselects it.", flush=True)
        with _child(command) as cabinet:
            try:
                assert cabinet.stdout is not None
                said = cabinet.stdout.read()  # until it ends; closing its input would end it
                cabinet.wait()
            except KeyboardInterrupt:
                return 0
        failure = _failure(said)
        if as_json:
            emit({"application": application.main, "ended": not failure, "error": failure})
        elif failure:
            print(f"heptarm: {application.main} ended with an error: {failure}", file=sys.stderr)
        return 1 if failure or cabinet.returncode else 0


def _failure(said: str) -> str:
    for line in said.splitlines():
        with suppress(ValueError):
            return str(dict(json.loads(line)).get("error", ""))
    return ""


def _type(cabinet: subprocess.Popen[str], as_json: bool) -> None:
    """Hand on what is typed; the end of standard input ends nothing."""
    assert cabinet.stdin is not None
    for said in typed.lines():
        if said == "help":
            for words, meaning in WORDS.items():
                about = json.dumps({"say": words, "to": meaning}) if as_json else f"{words:26} {meaning}"
                print(about, flush=True)
            continue
        cabinet.stdin.write(f"{said}\n")
        cabinet.stdin.flush()


def _converse(cabinet: subprocess.Popen[str], as_json: bool) -> None:
    """Let whoever sits before the terminal play the operator."""
    threading.Thread(target=_careful, args=(_answer, cabinet, as_json), daemon=True).start()
    if not typed.is_silent():
        threading.Thread(target=_careful, args=(_type, cabinet, as_json), daemon=True).start()


def _careful(
    work: Callable[[subprocess.Popen[str], bool], None], cabinet: subprocess.Popen[str], as_json: bool
) -> None:
    """Work until a pipe is closed."""
    with suppress(OSError, ValueError):
        work(cabinet, as_json)


def _answer(cabinet: subprocess.Popen[str], as_json: bool) -> None:
    """Show what the cabinet answers."""
    assert cabinet.stdout is not None
    for line in cabinet.stdout:
        try:
            reply = dict(json.loads(line))
        except ValueError:
            continue
        if as_json:
            print(line.strip(), flush=True)
        elif reply.get("operator"):
            print(reply["error"] or f"done: {reply['operator']}", flush=True)


class _child(subprocess.Popen[str]):
    """A process that ends when its standard input is closed, and so with us, whatever happens to us."""

    def __init__(self, command: list[str]) -> None:
        # a session of its own: Ctrl-C is for us, who then end the children in order
        super().__init__(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
        )

    def __exit__(self, *_: Any) -> None:
        assert self.stdin is not None
        self.stdin.close()
        try:
            self.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self.kill()
            self.wait()


def _ready(child: subprocess.Popen[str], otherwise: str) -> dict[str, Any]:
    assert child.stdout is not None
    line = child.stdout.readline()
    try:
        ready = dict(json.loads(line))
    except ValueError:
        raise ConnectFailed(f"{otherwise}: {line.strip() or 'see the message above'}") from None
    if not ready.get("ready"):
        raise ConnectFailed(
            f"{otherwise}: {ready.get('error')}", hint="choose another port with --port, or 0 for any"
        )
    return ready
