"""`heptarm sim`: one or several virtual cabinets in the foreground, and a view or panel beside one."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from heptarm.cli.output import emit, is_silent, lines
from heptarm.cli.sim.child import (
    Child,
    cabinet_command,
    converse,
    print_words,
    put,
    ready_line,
    relay_answers,
    say,
    until_closed,
)
from heptarm.cli.sim.options import DEFAULTS, NO_OPTIONS, CabinetOptions, check_port, most_from
from heptarm.cli.sim.page import Page
from heptarm.errors import CommandRejected
from heptarm.io.keys import find_key
from heptarm.values.simulator_options import SimulatorOptions

#: Most cabinets that one command runs.
_MOST = 64


def sim(
    *,
    port: Annotated[int, Parameter(help="Port; 0 takes a free one.")] = DEFAULTS.port,
    count: Annotated[
        int,
        Parameter(
            help="Number of cabinets, on consecutive ports; they end together. Typed words are for all of them, or "
            "for one after its number, as in `2 emergency_stop`."
        ),
    ] = 1,
    panel: Annotated[
        bool,
        Parameter(negative="", help="Open the panel in the browser: look, jog, and be the operator."),
    ] = False,
    options: CabinetOptions = NO_OPTIONS,
) -> int:
    """Run a virtual cabinet until Ctrl-C; `sim app` runs your own application, `sim fri` a bare FRI controller.

    For example:

        heptarm sim --panel

        heptarm sim app ~/workspace/MyProject

        heptarm sim fri 2.5 --fri-command torque
    """
    page = Page.of(options, panel=panel)
    simulator = options.simulator(port=check_port(port, "port"))
    _check_count(count, port, page=page.name)
    if count > 1:
        return _fleet(simulator, count, key_file=options.key_file, as_json=options.as_json)
    return _cabinet(simulator, page=page, key_file=options.key_file, as_json=options.as_json)


def _check_count(count: int, port: int, *, page: str) -> None:
    """Check the number of cabinets.

    Raises:
        CommandRejected: it is out of range, or there is a view or a panel, which shows one cabinet.
    """
    most = most_from(port, _MOST)
    if not 1 <= count <= most:
        raise CommandRejected(
            f"--count must be in [1, {most}], got {count}",
            parameter="count",
            value=count,
            allowed=f"[1, {most}]",
        )
    if count > 1 and page:
        raise CommandRejected(
            f"--{page} cannot be used with --count: it shows one cabinet",
            parameter=page,
            hint="run heptarm panel --target sim://HOST:PORT, with one --target for each of them",
        )


def _fleet(options: SimulatorOptions, count: int, *, key_file: Path | None, as_json: bool) -> int:
    """Run several virtual cabinets, each a process, until Ctrl-C, SIGTERM, or the end of one of them.

    Raises:
        ConnectFailed: one of them does not start; the text gives the reason.
        CommandRejected: the key cannot be used.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    host, first = options.host, options.port
    ports = [first + number if first else 0 for number in range(count)]
    with ExitStack() as stack:
        cabinets: list[subprocess.Popen[str]] = []
        for port in ports:
            key = find_key(key_file=key_file, host=host, port=port)
            cabinets.append(stack.enter_context(Child(cabinet_command(replace(options, port=port)), key)))
        stack.callback(_close_all, cabinets)  # before the first of them is waited for
        targets, model = [], ""
        for number, (cabinet, port) in enumerate(zip(cabinets, ports, strict=True), 1):
            ready = ready_line(cabinet, f"virtual cabinet {number} does not start on {host}:{port}")
            targets.append(f"sim://{host}:{ready['port']}")
            model = str(ready["model"])
            if as_json:
                emit(ready | {"cabinet": number, "target": targets[-1]})
        if not as_json:
            print(f"{count} virtual {model} are ready; Ctrl-C ends them:")
            for number, target in enumerate(targets, 1):
                print(f"{number:3}  {target}")
            sys.stdout.flush()
        ended = threading.Event()
        for number, cabinet in enumerate(cabinets, 1):
            arguments = (cabinet, as_json, number, ended)
            threading.Thread(target=_answer_until_end, args=arguments, daemon=True).start()
        if not is_silent():
            threading.Thread(target=_type_to_all, args=(cabinets, as_json), daemon=True).start()
        try:
            ended.wait()
        except KeyboardInterrupt:
            return 0
    codes: list[int] = [abs(cabinet.returncode) for cabinet in cabinets]
    return max(codes)


def _close_all(cabinets: list[subprocess.Popen[str]]) -> None:
    """Let all cabinets end at the same time."""
    for cabinet in cabinets:
        assert cabinet.stdin is not None
        with suppress(OSError):
            cabinet.stdin.close()


def _answer_until_end(
    cabinet: subprocess.Popen[str], as_json: bool, number: int, ended: threading.Event
) -> None:
    with suppress(OSError, ValueError):
        relay_answers(cabinet, as_json, number=number)
    ended.set()


def _type_to_all(cabinets: list[subprocess.Popen[str]], as_json: bool) -> None:
    """Pass typed lines to all cabinets, or to the one whose number they begin with."""
    for said in lines():
        first, _, rest = said.partition(" ")
        number = int(first) if first.isdecimal() else 0
        if said == "help":
            print_words(as_json)
            continue
        if not 0 <= number <= len(cabinets):
            text = f"there is no cabinet {number}; there are 1 to {len(cabinets)}"
            put(json.dumps({"operator": said, "error": text}) if as_json else text)
            continue
        chosen = [cabinets[number - 1]] if number else cabinets
        for cabinet in chosen:
            with suppress(OSError, ValueError):
                say(cabinet, rest if number else said)


def _cabinet(
    options: SimulatorOptions,
    *,
    page: Page,
    key_file: Path | None,
    as_json: bool,
) -> int:
    """Run a virtual cabinet until Ctrl-C or SIGTERM; lines on standard input are the operator's actions.

    Args:
        options: of the cabinet.
        page: in the browser.
        key_file: file with the key.
        as_json: print JSON.

    Raises:
        ConnectFailed: the cabinet or the page does not start; the text gives the reason.
        CommandRejected: the key cannot be used.
    """
    host, port = options.host, options.port
    key = find_key(key_file=key_file, host=host, port=port)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with ExitStack() as stack:
        options = page.positions(stack, options)
        cabinet = stack.enter_context(Child(cabinet_command(options), key))
        ready = ready_line(cabinet, f"the virtual cabinet does not start on {host}:{port}")
        target = f"sim://{host}:{ready['port']}"
        if page.name:
            viewer, ready[page.name] = page.open(stack, target, key, options)
            threading.Thread(target=until_closed, args=(_obey, viewer, cabinet), daemon=True).start()
        if as_json:
            emit(ready | {"target": target})
        else:
            print(f"A virtual {ready['model']} is ready. Connect with {target}; Ctrl-C ends it.")
            if page.name:
                print(f"{'See it' if page.name == 'view' else 'The panel is'} at {ready[page.name]}")
            if sys.stdin is not None and sys.stdin.isatty():
                print("You are the operator: type emergency_stop, clear, start, t1, enable ... or help.")
            sys.stdout.flush()
        converse(cabinet, as_json)
        try:
            return cabinet.wait()
        except KeyboardInterrupt:
            return 0


def _obey(panel: subprocess.Popen[str], cabinet: subprocess.Popen[str]) -> None:
    """Pass on what the panel's operator does, until the panel ends."""
    assert panel.stdout is not None
    for line in panel.stdout:
        words = json.loads(line).get("say", "")
        if words:
            say(cabinet, words)
