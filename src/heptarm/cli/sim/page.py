"""The view or the panel beside a cabinet that `heptarm sim` runs."""

from __future__ import annotations

import subprocess
import sys
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from heptarm.cli.sim.child import Child, ready_line
from heptarm.cli.sim.options import CabinetOptions, check_port
from heptarm.errors import CommandRejected, require_extra
from heptarm.values.simulator_options import SimulatorOptions

_PORT = 8080


@dataclass(frozen=True, slots=True)
class Page:
    """The page in the browser beside a cabinet, in a process of its own.

    Attributes:
        name: "panel" or "view", which only shows; empty: no page.
        port: its TCP port.
        meshes: folder with meshes of the arm; empty: heptarm's own.
    """

    name: str
    port: int = _PORT
    meshes: str = ""

    @classmethod
    def of(cls, options: CabinetOptions, *, panel: bool | None = None) -> Page:
        """The page of the command line.

        Args:
            options: of the command.
            panel: whether the panel is wanted; None: the command has none.

        Raises:
            CommandRejected: there is no page to use port or meshes, or they cannot be used.
        """
        if options.view and panel:
            raise CommandRejected(
                "--view and --panel show the same cabinet", parameter="view", hint="leave out --view"
            )
        name = "panel" if panel else "view" if options.view else ""
        for option, given in (("view-port", options.view_port is not None), ("meshes", bool(options.meshes))):
            if given and not name:
                pages = "--view" if panel is None else "--view or --panel"
                raise CommandRejected(f"--{option} needs {pages}", parameter=option, hint="add --view")
        if options.meshes:
            require_extra("sim")
            from heptarm.sim.plant.appearance import ArmMeshes

            try:
                ArmMeshes.of(options.meshes)
            except ValueError as error:
                raise CommandRejected(str(error), parameter="meshes", value=options.meshes) from None
        port = _PORT if options.view_port is None else check_port(options.view_port, "view-port")
        return cls(name, port, options.meshes)

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
        command += ["--port", str(self.port)]
        if options.positions is not None:
            command += ["--scene", options.scene, "--positions", str(options.positions)]
        if self.meshes:
            command += ["--meshes", self.meshes]
        if self.name == "view":
            command += ["--read-only"]
        process = stack.enter_context(Child(command, key))
        return process, str(ready_line(process, f"the {self.name} does not start")["url"])
