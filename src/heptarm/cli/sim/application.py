"""`heptarm sim app`: a Sunrise application of the user, compiled and run on a virtual cabinet."""

from __future__ import annotations

import signal
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from heptarm.cli.output import emit
from heptarm.cli.sim.child import (
    ADDRESS_MISSING,
    Child,
    cabinet_command,
    first_line,
    listen,
    relay_answers,
)
from heptarm.cli.sim.options import DEFAULTS, NO_OPTIONS, CabinetOptions, check_port
from heptarm.cli.sim.page import Page
from heptarm.errors import CommandRejected, ConnectFailed
from heptarm.io.keys import find_key
from heptarm.values.files import read_text
from heptarm.values.simulator_options import SimulatorOptions

if TYPE_CHECKING:
    from heptarm.sim.runtime.addresses import AddressMap

_ADDRESS_HINT = (
    "the application uses an address that this machine does not have: replace it with --map ADDRESS=127.0.0.1, "
    "or give it to this machine: sudo ip address add ADDRESS/32 dev lo"
)


def application(
    folder: Annotated[
        Path, Parameter(help="Folder of the Sunrise project, or of the application's sources.")
    ],
    /,
    *,
    app_class: Annotated[
        str,
        Parameter(
            help="Class of the application, if there are several; only this class and what it needs are compiled."
        ),
    ] = "",
    app_data: Annotated[
        tuple[str, ...], Parameter(help="Process data as NAME=VALUE; may be repeated.")
    ] = DEFAULTS.data,
    answer: Annotated[
        tuple[int, ...],
        Parameter(
            negative="",
            help="Button, from 0, that answers the next dialog; may be repeated. Further dialogs wait for "
            "a typed `answer BUTTON`.",
        ),
    ] = DEFAULTS.answer,
    answers: Annotated[
        Path | None,
        Parameter(
            help="File of such buttons, one per line; # starts a comment. They are used before those of --answer.",
        ),
    ] = None,
    addresses: Annotated[
        tuple[str, ...],
        Parameter(
            name="--map",
            help="OLD=NEW: replace an address of the lab in string literals of the sources, in process data and in FRI "
            "sessions, as in 172.31.1.25=127.0.0.1; may be repeated.",
        ),
    ] = DEFAULTS.map,
    jar: Annotated[
        tuple[Path, ...],
        Parameter(help="Library of the application that is in no folder of the project; may be repeated."),
    ] = (),
    port: Annotated[
        int | None,
        Parameter(
            help="Port on which clients may observe the application, as `heptarm state` and `heptarm record` do, and "
            "stop the arm; 0 takes a free one. Default: with --view a free one, else none."
        ),
    ] = None,
    options: CabinetOptions = NO_OPTIONS,
) -> int:
    """Compile and run a Sunrise application of your own on a virtual cabinet, to its end or until Ctrl-C.

    For example:

        heptarm sim app ~/workspace/MyProject --app-class Nod --answer 0 --view
    """
    from heptarm.sim.runtime.addresses import AddressMap

    observed = options.view or port is not None
    if not observed:
        _refuse_what_observers_need(options)
    buttons = (*_read_answers(answers), *answer)
    if any(button < 0 for button in buttons):
        raise CommandRejected(
            f"--answer must be the number of a button, from 0, got {min(buttons)}",
            parameter="answer",
            value=min(buttons),
        )
    try:
        mapped = AddressMap.of(addresses)
    except ValueError as error:
        raise CommandRejected(str(error), parameter="map") from None
    page = Page.of(options)
    simulator = replace(
        options.simulator(port=check_port(port or 0, "port"), observed=observed),
        data=app_data,
        map=addresses,
        answer=buttons,
    )
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with TemporaryDirectory(prefix="heptarm-") as out, ExitStack() as stack:
        simulator = page.positions(
            stack, _compiled(folder, Path(out), app_class, mapped, simulator, jars=jar)
        )
        return _run(simulator, page=page, key_file=options.key_file, as_json=options.as_json)


def _refuse_what_observers_need(options: CabinetOptions) -> None:
    """Refuse an address and a key where nobody can connect.

    Raises:
        CommandRejected: one of them is given.
    """
    for name, given in (
        ("host", options.host != DEFAULTS.host),
        ("key-file", options.key_file is not None),
    ):
        if given:
            raise CommandRejected(
                f"--{name} needs --port or --view: your application opens its own connections",
                parameter=name,
                hint=f"add --port for clients that observe it, or leave out --{name}",
            )


def _read_answers(file: Path | None) -> list[int]:
    """Buttons of a file, one per line.

    Raises:
        CommandRejected: the file cannot be read, or a line is no number.
    """
    if file is None:
        return []
    found = []
    text = read_text(file, name="answers")
    for number, line in enumerate(text.splitlines(), 1):
        said = line.partition("#")[0].strip()
        if said and not said.isdecimal():
            raise CommandRejected(
                f"{file}, line {number}: an answer must be the number of a button, from 0, got {said!r}",
                parameter="answers",
                value=said,
                hint="write one number per line",
            )
        if said:
            found.append(int(said))
    return found


def _compiled(
    folder: Path,
    out: Path,
    main: str,
    addresses: AddressMap,
    options: SimulatorOptions,
    *,
    jars: tuple[Path, ...],
) -> SimulatorOptions:
    """Compile the application into a folder; return the options of the cabinet that runs it.

    Raises:
        HeptarmError: it does not compile, or there is no such application.
    """
    from heptarm.sim.runtime.application import compile_application, missing_options, unused_addresses

    application = compile_application(folder, out, main=main, addresses=addresses, jars=jars)
    data_file = options.project or application.project
    notes = [*application.left_out, *missing_options(folder)]
    for address in unused_addresses(folder, data_file, addresses):
        notes.append(
            f"--map: {address} is in no string of the sources and in no process data; where it comes from "
            f"elsewhere, give it to this machine: sudo ip address add {address}/32 dev lo"
        )
    for note in notes:
        print(f"heptarm: {note}", file=sys.stderr, flush=True)
    return replace(
        options,
        application=application.main,
        background=application.background,
        classpath=(str(out), *map(str, application.jars)),
        project=data_file,
        station=application.station if options.project is None else None,
    )


def _run(options: SimulatorOptions, *, page: Page, key_file: Path | None, as_json: bool) -> int:
    """Run a compiled application to its end; return the exit code.

    Raises:
        ConnectFailed: the cabinet or the page does not start.
        CommandRejected: the key cannot be used.
    """
    key = find_key(key_file=key_file, host=options.host, port=options.port) if options.observed else None
    with Child(cabinet_command(options), key) as running, ExitStack() as pages:
        try:
            ready = first_line(running, "the virtual cabinet does not start")
            if not ready.get("ready"):
                raise ConnectFailed(f"the virtual cabinet does not start: {ready.get('error')}")
            if not as_json:
                _announce(options.application, str(ready["model"]))
            if options.observed:
                ready["target"] = f"sim://{options.host}:{ready['port']}"
                if page.name:
                    _, ready[page.name] = page.open(pages, ready["target"], key, options)
                _show_target(ready, page.name, as_json=as_json)
            listen(running, as_json)
            failure = relay_answers(running, as_json)  # until it ends; closing its input would end it
            running.wait()
        except KeyboardInterrupt:
            return 0
    return _conclude(options.application, failure, running, as_json=as_json)


def _announce(application: str, model: str) -> None:
    print(f"{application} runs on a virtual {model}; Ctrl-C deselects it.", flush=True)
    if sys.stdin is not None and sys.stdin.isatty():
        print("You are the operator: type answer 0, press 0, emergency_stop, clear ... or help.", flush=True)


def _show_target(ready: dict[str, Any], page: str, *, as_json: bool) -> None:
    if as_json:
        emit(ready)
        return
    seen = f", or see it at {ready[page]}" if page else ""
    print(f"Observe it with {ready['target']}{seen}", flush=True)


def _conclude(application: str, failure: str, ended: subprocess.Popen[str], *, as_json: bool) -> int:
    """Report how the application ended; return the exit code."""
    if as_json:
        emit({"application": application, "ended": not failure, "error": failure})
    elif failure:
        print(f"heptarm: {application} ended with an error: {failure}", file=sys.stderr)
        if ADDRESS_MISSING in failure:
            print(f"heptarm: {_ADDRESS_HINT}", file=sys.stderr)
    return 1 if failure or ended.returncode else 0
