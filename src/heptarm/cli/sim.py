"""`heptarm sim`: a virtual cabinet in the foreground, and a view of it if wanted."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, Literal

from cyclopts import Group, Parameter

from heptarm.cli.options import (
    FRI,
    Json,
    KeyFile,
    check_model,
)
from heptarm.cli.output import emit, is_silent, lines
from heptarm.errors import CommandRejected, ConnectFailed, refuse_windows, require_extra
from heptarm.io.keys import environment, find_key
from heptarm.sim.runtime.operator import WORDS
from heptarm.values.files import read_text
from heptarm.values.robot import ROBOTS, robot
from heptarm.values.simulator_options import RealTime, SimulatorOptions

_APP = Group("Your own application")

_PORT = 30001
#: Most cabinets that one command runs.
_MOST = 64
_LAST_PORT = 65535
#: Simulated seconds per second of real time.
_SLOWEST, _FASTEST = 0.01, 1000.0
#: The error of Java for an address that this machine does not have.
_NOT_HERE = "Cannot assign requested address"
_NOT_HERE_HINT = (
    "the application uses an address that this machine does not have: replace it with --map ADDRESS=127.0.0.1, "
    "or give it to this machine: sudo ip address add ADDRESS/32 dev lo"
)


def sim(
    *,
    model: Annotated[
        str | None,
        Parameter(
            validator=check_model,
            help=f"Robot: {', '.join(ROBOTS)}. Default: that of the project's StationSetup.cat, or iiwa14.",
        ),
    ] = None,
    flange: Annotated[
        str,
        Parameter(
            help="Media flange: plain, touch, or its height above a plain one [m]. Default: that of the project's "
            "StationSetup.cat, or plain."
        ),
    ] = "",
    host: Annotated[str, Parameter(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[
        int | None,
        Parameter(
            help="Port; 0 takes a free one. Default: 30001. With --app: clients may observe it there, as "
            "`heptarm state` and `heptarm record` do, and stop the arm."
        ),
    ] = None,
    count: Annotated[
        int,
        Parameter(
            help="Number of cabinets, on consecutive ports; they end together. Typed words are for all of them, or "
            "for one after its number, as in `2 emergency_stop`."
        ),
    ] = 1,
    speed: Annotated[
        float, Parameter(help="Simulated seconds per second of real time; 0: as fast as possible.")
    ] = 1.0,
    real_time: Annotated[
        RealTime,
        Parameter(
            help="Real-time priority: while an FRI session is open (fri), always, and Java compiled for the lowest "
            "latency (on), never (off)."
        ),
    ] = "fri",
    view: Annotated[bool, Parameter(negative="", help="Open a live 3D view in the browser.")] = False,
    panel: Annotated[
        bool,
        Parameter(negative="", help="Open the panel in the browser: look, jog, and be the operator."),
    ] = False,
    view_port: Annotated[int, Parameter(help="Port of view or panel; 0 takes a free one.")] = 8080,
    meshes: Annotated[
        str,
        Parameter(
            help="With --view or --panel: DIR with link_0.stl to link_7.stl, or .obj: draw the arm in these meshes "
            "instead of heptarm's own."
        ),
    ] = "",
    key_file: KeyFile = None,
    key: Annotated[str, Parameter(show=False)] = "",
    fault: Annotated[
        tuple[str, ...],
        Parameter(
            help="Inject a fault at a simulated time, as NAME@SECONDS: emergency_stop, operator_safety, "
            "protective_stop, drive_error, joint_limit, singularity, t1, release, clear ...; may be repeated. "
            "The same words can be typed while it runs."
        ),
    ] = (),
    payload: Annotated[
        str,
        Parameter(
            help="MASS or MASS,X,Y,Z: the true payload on the flange, whatever load data the controller has [kg, m]. "
            "Default: the controller's load data."
        ),
    ] = "",
    safety: Annotated[
        str,
        Parameter(
            help="TORQUE or TORQUE,MASS: limits of safety functions, which count the load of tool and safety "
            "workpiece: external torque of an axis while the arm moves [Nm], mass of a safety workpiece [kg]. "
            "Default: none."
        ),
    ] = "",
    sensors: Annotated[
        str,
        Parameter(
            help="'noisy' or 'noisy:SEED': sensors with noise, offset and resolution, joints with friction. "
            "Default: ideal ones."
        ),
    ] = "ideal",
    scene: Annotated[
        str,
        Parameter(
            help="NAME or FILE: what is around the arm and on its flange: table, peg-in-hole, bins, shelf, "
            "narrow-slot, or a file (MJCF). Its bodies collide and can be grasped; the view shows them."
        ),
    ] = "",
    project: Annotated[
        Path | None,
        Parameter(
            help="RoboticsAPI.data.xml of a Sunrise project: process data, tool templates, frames; "
            "with --app, used instead of the one in its folder."
        ),
    ] = None,
    verbose: Annotated[
        bool,
        Parameter(
            negative="", help="Show the cabinet's log; with --app, the simulator's beside the application's."
        ),
    ] = False,
    application: Annotated[
        Path | None,
        Parameter(
            name="--app", group=_APP, help="Compile and run this folder's Sunrise application instead."
        ),
    ] = None,
    app_class: Annotated[
        str,
        Parameter(
            group=_APP,
            help="Its class, if there are several applications; only this class and what it needs are compiled.",
        ),
    ] = "",
    app_data: Annotated[
        tuple[str, ...], Parameter(group=_APP, help="Process data as NAME=VALUE; may be repeated.")
    ] = (),
    answer: Annotated[
        tuple[int, ...],
        Parameter(
            group=_APP,
            negative="",
            help="Button, from 0, that answers the next dialog; may be repeated. Further dialogs wait for "
            "a typed `answer BUTTON`.",
        ),
    ] = (),
    answers: Annotated[
        Path | None,
        Parameter(
            group=_APP,
            help="File of such buttons, one per line; # starts a comment. They are used before those of --answer.",
        ),
    ] = None,
    addresses: Annotated[
        tuple[str, ...],
        Parameter(
            name="--map",
            group=_APP,
            help="OLD=NEW: replace an address of the lab in string literals of the sources, in process data and in FRI "
            "sessions, as in 172.31.1.25=127.0.0.1; may be repeated.",
        ),
    ] = (),
    fri: Annotated[
        str | None,
        Parameter(
            group=FRI,
            help="Run only an FRI controller of this version, such as 1.15, 2.5 or 2.7, without a cabinet.",
        ),
    ] = None,
    fri_command: Annotated[
        Literal["monitor", "position", "torque", "wrench", "pose"],
        Parameter(group=FRI, help="What the client may command."),
    ] = "position",
    fri_client: Annotated[
        str, Parameter(group=FRI, help="HOST:PORT where the client listens.")
    ] = "127.0.0.1:30200",
    fri_period: Annotated[float, Parameter(group=FRI, help="Time between two messages [ms].")] = 5.0,
    fri_multiplier: Annotated[int, Parameter(group=FRI, help="The client answers every n-th message.")] = 1,
    fri_port: Annotated[
        int | None,
        Parameter(group=FRI, help="UDP port to send from. Default: the client's port, or the next free one."),
    ] = None,
    fri_io: Annotated[
        tuple[str, ...],
        Parameter(
            group=FRI,
            help="GROUP.NAME<TYPE is an input that the client reads, GROUP.NAME>TYPE an output that it writes, "
            "TYPE bool, u8 (or other bits) or analog; may be repeated. Type `set GROUP.NAME VALUE` while it runs.",
        ),
    ] = (),
    fri_frame: Annotated[
        tuple[str, ...],
        Parameter(group=FRI, help="Name of a frame that the client is asked for; may be repeated."),
    ] = (),
    fri_mode: Annotated[
        Literal["", "position", "joint-impedance", "cartesian-impedance"],
        Parameter(
            group=FRI,
            help="Control mode under the overlay. Default: position; joint-impedance for torques, "
            "cartesian-impedance for wrenches.",
        ),
    ] = "",
    fri_stiffness: Annotated[
        str,
        Parameter(
            group=FRI,
            help="Of joint-impedance: one number or seven [Nm/rad], default 200. Of cartesian-impedance: along and "
            "about the axes, as 2000,200, or six numbers [N/m, Nm/rad], default 2000,200.",
        ),
    ] = "",
    fri_start: Annotated[
        str, Parameter(group=FRI, help="A1,...,A7 at the start [deg]. Default: 0,30,0,-90,0,60,0.")
    ] = "",
    fri_force: Annotated[
        str,
        Parameter(
            group=FRI,
            help="FX,FY,FZ on the flange from the start, base axes [N]; --fault 'push 0 0 -20 2@5' pushes for 2 s "
            "after 5 s.",
        ),
    ] = "",
    fri_network: Annotated[
        tuple[str, ...],
        Parameter(
            group=FRI,
            help="Fault of the network in both directions, as loss=0.01, delay=0.002 or jitter=0.001: loss, duplicate, "
            "corrupt, reorder and burst are probabilities, delay, jitter and burst_time [s]; may be repeated.",
        ),
    ] = (),
    as_json: Json = False,
) -> int:
    """Run a virtual cabinet until Ctrl-C; with --fri, a bare FRI controller; with --app, your own application."""
    if key:
        raise CommandRejected(
            "--key is not accepted: every user of this machine can read a command line",
            parameter="key",
            hint="put the key into a file of mode 0600 and use --key-file, or set HEPTARM_KEY",
        )
    if speed != 0.0 and not _SLOWEST <= speed <= _FASTEST:
        raise CommandRejected(
            f"--speed must be 0 or in [{_SLOWEST:g}, {_FASTEST:g}], got {speed:g}",
            parameter="speed",
            value=speed,
            allowed=f"0, [{_SLOWEST:g}, {_FASTEST:g}]",
            hint="0 simulates as fast as possible",
        )
    simulator = partial(
        SimulatorOptions,
        model=model or "",
        flange=flange,
        host=host,
        speed=speed,
        real_time=real_time,
        fault=fault,
        payload=payload,
        safety=safety,
        sensors=sensors,
        scene=scene,
        project=project,
        parent_pipe=True,
        verbose=verbose,
    )
    if application is not None:
        observed = view or port is not None
        defaults = {
            "--panel": (panel, False),
            "--view-port": (view_port, view_port if view else 8080),
            "--meshes": (meshes, meshes if view else ""),
            "--host": (host, host if observed else "127.0.0.1"),
            "--count": (count, 1),
            "--key-file": (key_file, key_file if observed else None),
            "--fri": (fri, None),
            "--fri-command": (fri_command, "position"),
            "--fri-client": (fri_client, "127.0.0.1:30200"),
            "--fri-period": (fri_period, 5.0),
            "--fri-multiplier": (fri_multiplier, 1),
            "--fri-port": (fri_port, None),
            "--fri-io": (fri_io, ()),
            "--fri-frame": (fri_frame, ()),
            "--fri-mode": (fri_mode, ""),
            "--fri-stiffness": (fri_stiffness, ""),
            "--fri-start": (fri_start, ""),
            "--fri-force": (fri_force, ""),
            "--fri-network": (fri_network, ()),
        }
        _refuse_beside_app({name for name, (value, default) in defaults.items() if value != default})
        return _application(
            folder=application,
            main=app_class,
            data=app_data,
            answers=(*_read_answers(answers), *answer),
            addresses=addresses,
            cabinet=simulator(port=_checked_port(port or 0, "port"), observed=observed),
            page=_Page("view" if view else "", _checked_port(view_port, "view-port"), meshes),
            key_file=key_file,
            as_json=as_json,
        )
    given = {
        "--app-class": app_class,
        "--app-data": app_data,
        "--answer": answer,
        "--answers": answers,
        "--map": addresses,
    }
    for name, value in given.items():
        if value:
            raise CommandRejected(f"{name} needs --app", parameter=name.lstrip("-"), hint="add --app FOLDER")
    if fri is not None:
        from heptarm.cli import fri_sim

        own = {
            "--view": view,
            "--panel": panel,
            "--meshes": bool(meshes),
            "--key-file": key_file is not None,
            "--project": project is not None,
            "--safety": bool(safety),
            "--scene": bool(scene),
            "--count": count != 1,
            "--real-time": real_time != "fri",
        }
        for name, present in own.items():
            if present:
                raise CommandRejected(
                    f"{name} cannot be used with --fri: there is no cabinet application",
                    parameter=name.lstrip("-"),
                    hint=f"leave out {name} or --fri",
                )
        options = fri_sim.FriControllerOptions(
            version=fri,
            model=robot(model or "iiwa14", flange=flange or None).name,
            command=fri_command,
            client=fri_client,
            period=fri_period,
            multiplier=fri_multiplier,
            port=fri_port,
            signals=fri_io,
            frames=fri_frame,
            mode=fri_mode,
            stiffness=fri_stiffness,
            start=fri_start,
            force=fri_force,
            network=fri_network,
            faults=fault,
            payload=payload,
            sensors=sensors,
            speed=speed,
        )
        return fri_sim.run(options, verbose=verbose, as_json=as_json)
    if view and panel:
        raise CommandRejected(
            "--view and --panel show the same cabinet", parameter="view", hint="leave out --view"
        )
    page = _Page("panel" if panel else "view" if view else "", _checked_port(view_port, "view-port"), meshes)
    first = _checked_port(_PORT if port is None else port, "port")
    _check_count(count, first, page=page.name)
    cabinet = simulator(port=first)
    if count > 1:
        return _fleet(cabinet, count, key_file=key_file, as_json=as_json)
    return _cabinet(cabinet, page=page, key_file=key_file, as_json=as_json)


class _Page:
    """The page in the browser beside a cabinet, in a process of its own.

    Args:
        name: "panel" or "view", which only shows; empty: no page.
        port: its TCP port.
        meshes: folder with meshes of the arm; empty: heptarm's own.

    Raises:
        CommandRejected: there is no page to use the meshes, or they cannot be used.
    """

    def __init__(self, name: str, port: int, meshes: str) -> None:
        self.name = name
        self._port = port
        self._meshes = meshes
        if not meshes:
            return
        if not name:
            raise CommandRejected("--meshes needs --view or --panel", parameter="meshes", hint="add --view")
        require_extra("sim")
        from heptarm.sim.plant.appearance import ArmMeshes

        try:
            ArmMeshes.of(meshes)
        except ValueError as error:
            raise CommandRejected(str(error), parameter="meshes", value=meshes) from None

    def positions(self, stack: ExitStack, options: SimulatorOptions) -> SimulatorOptions:
        """The options of the cabinet, which has to share the positions of a scene with the page."""
        if not (self.name and options.scene):
            return options
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="heptarm-")))
        return replace(options, positions=folder / "positions")

    def open(
        self, stack: ExitStack, target: str, key: str | None, options: SimulatorOptions
    ) -> tuple[subprocess.Popen[str], str]:
        """Open the page of a running cabinet; return its process and its URL.

        Raises:
            ConnectFailed: it does not start.
        """
        command = [sys.executable, "-m", "heptarm.panel.process", "--target", target]
        command += ["--port", str(self._port)]
        if options.positions is not None:
            command += ["--scene", options.scene, "--positions", str(options.positions)]
        if self._meshes:
            command += ["--meshes", self._meshes]
        if self.name == "view":
            command += ["--read-only"]
        process = stack.enter_context(_child(command, key))
        return process, str(_ready(process, f"the {self.name} does not start")["url"])


def _checked_port(port: int, name: str) -> int:
    """A port to listen on.

    Raises:
        CommandRejected: there is no such port.
    """
    if not 0 <= port <= _LAST_PORT:
        raise CommandRejected(
            f"--{name} must be in [0, {_LAST_PORT}], got {port}",
            parameter=name,
            value=port,
            allowed=f"[0, {_LAST_PORT}]",
            hint="0 takes a free one",
        )
    return port


def _check_count(count: int, port: int, *, page: str) -> None:
    """Check the number of cabinets.

    Raises:
        CommandRejected: it is out of range, or there is a view or a panel, which shows one cabinet.
    """
    most = _MOST if port == 0 else min(_MOST, _LAST_PORT + 1 - port)
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
            cabinets.append(stack.enter_context(_child(_command(replace(options, port=port)), key)))
        stack.callback(_close_all, cabinets)  # before the first of them is waited for
        targets, model = [], ""
        for number, (cabinet, port) in enumerate(zip(cabinets, ports, strict=True), 1):
            ready = _ready(cabinet, f"virtual cabinet {number} does not start on {host}:{port}")
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
        _answer(cabinet, as_json, number=number)
    ended.set()


def _type_to_all(cabinets: list[subprocess.Popen[str]], as_json: bool) -> None:
    """Pass typed lines to all cabinets, or to the one whose number they begin with."""
    for said in lines():
        first, _, rest = said.partition(" ")
        number = int(first) if first.isdecimal() else 0
        if said == "help":
            _print_words(as_json)
            continue
        if not 0 <= number <= len(cabinets):
            text = f"there is no cabinet {number}; there are 1 to {len(cabinets)}"
            _put(json.dumps({"operator": said, "error": text}) if as_json else text)
            continue
        chosen = [cabinets[number - 1]] if number else cabinets
        for cabinet in chosen:
            with suppress(OSError, ValueError):
                _say(cabinet, rest if number else said)


def _cabinet(
    options: SimulatorOptions,
    *,
    page: _Page,
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
        cabinet = stack.enter_context(_child(_command(options), key))
        ready = _ready(cabinet, f"the virtual cabinet does not start on {host}:{port}")
        target = f"sim://{host}:{ready['port']}"
        if page.name:
            viewer, ready[page.name] = page.open(stack, target, key, options)
            threading.Thread(target=_careful, args=(_obey, viewer, cabinet), daemon=True).start()
        if as_json:
            emit(ready | {"target": target})
        else:
            print(f"A virtual {ready['model']} is ready. Connect with {target}; Ctrl-C ends it.")
            if page.name:
                print(f"{'See it' if page.name == 'view' else 'The panel is'} at {ready[page.name]}")
            if sys.stdin is not None and sys.stdin.isatty():
                print("You are the operator: type emergency_stop, clear, start, t1, enable ... or help.")
            sys.stdout.flush()
        _converse(cabinet, as_json)
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
            _say(cabinet, words)


def _refuse_beside_app(names: set[str]) -> None:
    """Refuse options that have no meaning for a foreign application.

    Raises:
        CommandRejected: there is such an option.
    """
    for name in sorted(names):
        if name == "--panel":
            reason = "the panel commands the arm, which your application does; --view shows it"
        elif name in ("--view-port", "--meshes"):
            reason = "they belong to the page that --view opens"
        elif name in ("--host", "--key-file"):
            reason = "your application opens its own connections; for clients that observe it, add --port"
        elif name.startswith("--fri"):
            reason = "an FRI session is opened by the application itself"
        else:
            reason = "it belongs to heptarm's own application; yours opens its own connections"
        raise CommandRejected(
            f"{name} cannot be used with --app: {reason}",
            parameter=name.lstrip("-"),
            hint=f"leave out {name} or --app",
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


def _application(
    *,
    folder: Path,
    main: str,
    data: tuple[str, ...],
    answers: tuple[int, ...],
    addresses: tuple[str, ...],
    cabinet: SimulatorOptions,
    page: _Page,
    key_file: Path | None,
    as_json: bool,
) -> int:
    """Compile another application and run it to its end; return the exit code.

    Raises:
        HeptarmError: it does not compile, there is no such application, or an option is illegal.
    """
    from heptarm.sim.runtime.addresses import AddressMap
    from heptarm.sim.runtime.application import compile_application, unused_addresses

    try:
        mapped = AddressMap.of(addresses)
    except ValueError as error:
        raise CommandRejected(str(error), parameter="map") from None
    if any(button < 0 for button in answers):
        raise CommandRejected(
            f"--answer must be the number of a button, from 0, got {min(answers)}",
            parameter="answer",
            value=min(answers),
        )
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with TemporaryDirectory(prefix="heptarm-") as out, ExitStack() as stack:
        application = compile_application(folder, Path(out), main=main, addresses=mapped)
        data_file = cabinet.project or application.project
        notes = [*application.left_out]
        for address in unused_addresses(folder, data_file, mapped):
            notes.append(
                f"--map: {address} is in no string of the sources and in no process data; where it comes from "
                f"elsewhere, give it to this machine: sudo ip address add {address}/32 dev lo"
            )
        for note in notes:
            print(f"heptarm: {note}", file=sys.stderr, flush=True)
        options = replace(
            cabinet,
            application=application.main,
            background=application.background,
            classpath=(out, *map(str, application.jars)),
            project=data_file,
            station=application.station if cabinet.project is None else None,
            data=data,
            map=addresses,
            answer=answers,
        )
        failure = ""
        key = find_key(key_file=key_file, host=options.host, port=options.port) if options.observed else None
        options = page.positions(stack, options)
        with _child(_command(options), key) as running, ExitStack() as pages:
            try:
                ready = _first(running, "the virtual cabinet does not start")
                if not ready.get("ready"):
                    raise ConnectFailed(f"the virtual cabinet does not start: {ready.get('error')}")
                if not as_json:
                    print(
                        f"{application.main} runs on a virtual {ready['model']}; Ctrl-C deselects it.",
                        flush=True,
                    )
                    if sys.stdin is not None and sys.stdin.isatty():
                        print(
                            "You are the operator: type answer 0, press 0, emergency_stop, clear ... or help.",
                            flush=True,
                        )
                if options.observed:
                    ready["target"] = f"sim://{options.host}:{ready['port']}"
                    if page.name:
                        _, ready[page.name] = page.open(pages, ready["target"], key, options)
                    if as_json:
                        emit(ready)
                    else:
                        seen = f", or see it at {ready[page.name]}" if page.name else ""
                        print(f"Observe it with {ready['target']}{seen}", flush=True)
                _listen(running, as_json)
                failure = _answer(running, as_json)  # until it ends; closing its input would end it
                running.wait()
            except KeyboardInterrupt:
                return 0
        if as_json:
            emit({"application": application.main, "ended": not failure, "error": failure})
        elif failure:
            print(f"heptarm: {application.main} ended with an error: {failure}", file=sys.stderr)
            if _NOT_HERE in failure:
                print(f"heptarm: {_NOT_HERE_HINT}", file=sys.stderr)
        return 1 if failure or running.returncode else 0


def _command(options: SimulatorOptions) -> list[str]:
    refuse_windows("the virtual cabinet")
    require_extra("sim")
    return [sys.executable, "-m", "heptarm.sim.runtime.cabinet", *options.arguments()]


def _type(cabinet: subprocess.Popen[str], as_json: bool) -> None:
    """Pass typed lines to the cabinet; the end of standard input does not end the cabinet."""
    for said in lines():
        if said == "help":
            _print_words(as_json)
            continue
        _say(cabinet, said)


def _say(cabinet: subprocess.Popen[str], words: str) -> None:
    """Pass an action of the operator."""
    assert cabinet.stdin is not None
    cabinet.stdin.write(f"{words}\n")
    cabinet.stdin.flush()


def _print_words(as_json: bool) -> None:
    for words, meaning in WORDS.items():
        about = json.dumps({"say": words, "to": meaning}) if as_json else f"{words:26} {meaning}"
        _put(about)


def _converse(cabinet: subprocess.Popen[str], as_json: bool) -> None:
    """Let the user at the terminal play the operator."""
    threading.Thread(target=_careful, args=(_answer, cabinet, as_json), daemon=True).start()
    _listen(cabinet, as_json)


def _listen(cabinet: subprocess.Popen[str], as_json: bool) -> None:
    """Pass typed lines in the background."""
    if not is_silent():
        threading.Thread(target=_careful, args=(_type, cabinet, as_json), daemon=True).start()


def _careful(work: Callable[..., object], *arguments: object) -> None:
    """Work until the pipe is closed."""
    with suppress(OSError, ValueError):
        work(*arguments)


def _answer(cabinet: subprocess.Popen[str], as_json: bool, *, number: int = 0) -> str:
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
            _put(json.dumps(reply | {"cabinet": number}) if number else line.strip())
        elif reply["operator"]:
            text = reply["error"] or reply["shown"] or f"done: {reply['operator']}"
            _put(f"{number}: {text}" if number else text)
    return failure


def _put(line: str) -> None:
    """Print a line at once and in one piece: several threads print."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


class _child(subprocess.Popen[str]):
    """A process that ends when its standard input is closed, and therefore with this process.

    Args:
        command: to start.
        key: pre-shared key that it uses, in its environment; None: none.
    """

    def __init__(self, command: list[str], key: str | None) -> None:
        # a session of its own: Ctrl-C reaches this process only, which then ends its children in order
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


def _first(child: subprocess.Popen[str], otherwise: str) -> dict[str, Any]:
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


def _ready(child: subprocess.Popen[str], otherwise: str) -> dict[str, Any]:
    ready = _first(child, otherwise)
    if not ready.get("ready"):
        if ready.get("host") or ready.get("options"):
            hint = ""
        elif _NOT_HERE in str(ready.get("error")):
            hint = "choose an address of this machine with --host"
        else:
            hint = "choose another port with --port, or 0 for any"
        raise ConnectFailed(f"{otherwise}: {ready.get('error')}", hint=hint)
    return ready
