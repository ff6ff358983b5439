"""`heptarm sim`: a virtual cabinet in the foreground, and a view of it if wanted."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from contextlib import ExitStack
from typing import Any

from heptarm.cli.output import emit
from heptarm.errors import ConnectFailed


def run(
    *,
    model: str,
    host: str,
    port: int,
    speed: float,
    view: bool,
    view_port: int,
    key: str,
    verbose: bool,
    as_json: bool,
) -> int:
    """Run until Ctrl-C or SIGTERM; returns the exit code.

    Raises:
        ConnectFailed: the cabinet or the view does not start; the text says why.
    """
    command = [sys.executable, "-m", "heptarm.virtual.cabinet", "--parent-pipe", "--model", model]
    command += ["--host", host, "--port", str(port), "--speed", str(speed)]
    command += ["--key", key] if key else []
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
            sys.stdout.flush()
        try:
            return cabinet.wait()
        except KeyboardInterrupt:
            return 0


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
