"""The panel as a program: a viser server that draws arms until its input or the process ends.

python -m heptarm.panel.process --target sim://127.0.0.1:30001

`heptarm panel` runs it in the foreground, `heptarm sim --panel` as a child.
"""

from __future__ import annotations

import argparse
import contextlib
import http
import io
import json
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from heptarm.arm.link.halt import halt
from heptarm.errors import CommandRejected, HeptarmError, require
from heptarm.io import tcp
from heptarm.io.clock import RealClock
from heptarm.io.panel_box import PanelBox
from heptarm.panel import frame, texts
from heptarm.panel.guard import Page, PageGuard, free_port, is_local
from heptarm.panel.model import PanelArm, groups_for
from heptarm.skills.gripper import Gripper, TwoSignalGripper
from heptarm.values.io import GripperWiring
from heptarm.values.robot import Body
from heptarm.wire.messages import StopKind

if TYPE_CHECKING:
    from heptarm.arm.arm import Arm
    from heptarm.sim.plant.appearance import ArmMeshes
    from heptarm.sim.plant.scene import Scene

#: Pictures per second, and every how many of them texts and plots are drawn [Hz].
RATE, _TEXTS, _PLOTS = 25.0, 3, 6
#: Every how many of them the panel looks for plans.
_PLANS = 12
#: States per second that the panel subscribes to [Hz].
STATE_RATE = 50.0
#: Distance of the bases of several arms [m].
_APART = 1.4
#: Longest time for a stop without a session [s].
_STOP_TIMEOUT = 5.0


@dataclass(frozen=True, slots=True)
class PanelOptions:
    """What the panel is started with.

    Attributes:
        host: address to listen on.
        port: TCP port; 0: any free one.
        allow_control: whether others in the network may control the arms, when `host` lets them in.
        read_only: nobody may control the arms.
        scene: what is drawn around the first arm; empty: nothing.
        positions: file in which a simulator writes the positions of all bodies of the scene; None: there is none.
        meshes: folder with meshes of the arms; empty: heptarm's own.
        recordings: folder for recordings.
        gripper: signals of the gripper, "open=NAME close=NAME is_open=NAME is_closed=NAME", those that are not named on
            the media flange; empty: that of the scene, if it has one.
        light: a light page instead of a dark one.
    """

    host: str = "127.0.0.1"
    port: int = 8080
    allow_control: bool = False
    read_only: bool = False
    scene: str = ""
    positions: Path | None = None
    meshes: str = ""
    recordings: Path = Path()
    gripper: str = ""
    light: bool = False

    @property
    def may_control(self) -> bool:
        """Whether a page may control the arms: on this machine, or with permission."""
        return not self.read_only and (is_local(self.host) or self.allow_control)


def shapes_of(options: PanelOptions) -> tuple[ArmMeshes, Scene | None]:
    """What is drawn of the arms, and around the first one.

    Raises:
        CommandRejected: there are no such meshes, or there is no such scene.
    """
    from heptarm.sim.plant.appearance import ArmMeshes
    from heptarm.sim.plant.scene import Scene

    try:
        meshes = ArmMeshes.of(options.meshes)
    except ValueError as error:
        raise CommandRejected(str(error), parameter="meshes", value=options.meshes) from None
    try:
        return meshes, Scene.of(options.scene) if options.scene else None
    except ValueError as error:
        raise CommandRejected(str(error), parameter="scene", value=options.scene) from None


def open_server(options: PanelOptions, pages: Mapping[str, Page]) -> tuple[Any, PageGuard]:
    """A viser server with a floor, and its guard, which lets in nobody before it has the port of the server.

    Args:
        options: see `PanelOptions`.
        pages: what is answered besides viser's own page, by their paths.

    Raises:
        MissingExtra: viser is not installed.
        CommandRejected: there is no such address to listen on. LimitError: there is no such port.
    """
    viser = require("viser", extra="viz")
    port = free_port(options.host, options.port)  # viser would wait for ever for an address that is none
    guard = PageGuard(options.host)
    # viser's own lines have a URL without the token, which lets nobody in
    with contextlib.redirect_stdout(io.StringIO()), guard.installed(pages):
        server = viser.ViserServer(host=options.host, port=port, verbose=False)
    server.gui.configure_theme(
        dark_mode=not options.light, show_logo=False, show_share_button=False, brand_color=(255, 107, 10)
    )
    server.gui.set_panel_label("heptarm")
    server.gui.add_html(texts.STYLE)
    server.scene.set_up_direction("+z")
    server.scene.world_axes.visible = False
    server.scene.add_grid(
        "/floor",
        width=4.0,
        height=4.0,
        cell_size=0.1,
        section_size=0.5,
        cell_color=(70, 74, 82) if not options.light else (205, 208, 214),
        section_color=(105, 110, 120) if not options.light else (160, 164, 172),
        fade_distance=8.0,
    )
    return server, guard


class Panel:
    """A viser server with the pages of some arms.

    Args:
        arms: the models, at least one.
        options: see `PanelOptions`.

    Attributes:
        url: with the token, to print once.
        server: of viser.

    Raises:
        MissingExtra: viser is not installed.
        CommandRejected: the scene or the meshes cannot be drawn, or there is no such address to listen on.
        LimitError: there is no such port.
    """

    def __init__(self, arms: Sequence[PanelArm], options: PanelOptions) -> None:
        require("viser", extra="viz")
        from heptarm.panel.drawing import DrawnBodies, DrawnGhost, DrawnMarks, DrawnWorld
        from heptarm.panel.page import ArmPage

        meshes, surroundings = shapes_of(options)
        pages = {"/": self._frame, frame.STOP_PATH: self._answer_stop}
        self._is_light = options.light
        server, guard = open_server(options, pages)
        self.server = server
        self._arms = tuple(arms)
        self._ended = threading.Event()
        self._drawing = threading.RLock()
        self._pages: list[ArmPage] = []
        middle = _APART * (len(self._arms) - 1) / 2
        server.initial_camera.position = (1.7, middle - 1.5, 1.15)
        server.initial_camera.look_at = (0.15, middle, 0.5)
        readouts = server.gui.add_panel()
        tabs = server.gui.add_tab_group() if len(self._arms) > 1 else None
        for number, model in enumerate(self._arms):
            root = f"/arm{number + 1}"
            server.scene.add_frame(root, show_axes=False, position=(0.0, _APART * number, 0.0))
            scene = surroundings if number == 0 else None
            title = model.arm.robot.name if tabs is None else f"{number + 1}: {model.arm.robot.name}"
            tab = readouts.add_tab(title)
            with contextlib.ExitStack() as stack:
                if tabs is not None:
                    stack.enter_context(tabs.add_tab(title))
                page = ArmPage(
                    server,
                    model,
                    DrawnWorld(
                        server,
                        model.arm.robot.name,
                        scene,
                        options.positions if number == 0 else None,
                        meshes,
                        root=root,
                    ),
                    DrawnBodies(server, meshes, root),
                    DrawnMarks(server, root),
                    DrawnGhost(server, model.arm.robot.name, meshes, root),
                    root=root,
                    tab=tab,
                )
            self._pages.append(page)
        readouts.dock_left()
        readouts.set_width(360)
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(340)
        server.on_client_disconnect(self._forget)
        guard.port = server.get_port()  # from now on it lets in who has the token
        self.url = guard.url
        self._box = PanelBox([model.arm.robot.name for model in self._arms])

    def _frame(self) -> tuple[http.HTTPStatus, str, str]:
        """The page around viser's."""
        return http.HTTPStatus.OK, "text/html", frame.page(light=self._is_light)

    def _answer_stop(self) -> tuple[http.HTTPStatus, str, str]:
        """Stop all arms, and say which of them did not answer."""
        failed = self.stop()
        if not failed:
            return http.HTTPStatus.OK, "text/plain", "stopped"
        reasons = "; ".join(failed)
        return http.HTTPStatus.BAD_GATEWAY, "text/plain", f"NOT stopped: {reasons}: press the emergency stop"

    def stop(self) -> list[str]:
        """Stop all arms at once, each in a thread of its own: one that does not answer delays no other.

        Returns:
            Why arms were not stopped, by their robots' names; empty: all were.
        """
        # an arm counts as stopped only once that is known, whatever ends its thread
        failed = dict.fromkeys(self._arms, "no answer")
        threads = [threading.Thread(target=_stop, args=(model, failed), daemon=True) for model in self._arms]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return [f"{model.arm.robot.name}: {why}" for model, why in failed.items()]

    async def _forget(self, client: Any) -> None:
        """End what a page has started that was closed."""
        for page in self._pages:
            page.forget(client.client_id)

    def draw(self, count: int) -> None:
        """One picture, the count-th."""
        readouts = [model.poll() for model in self._arms]
        if not self.server.get_clients() and count > 1:
            return  # nobody looks
        if count % _PLANS == 0:
            self._take_plan()
        if count % _TEXTS == 0:
            self._look_at_world()
        with self.server.atomic():
            for page, readout in zip(self._pages, readouts, strict=True):
                page.draw(readout)
                if count % _TEXTS == 0:
                    page.write(readout)
                if count % _PLOTS == 0:
                    page.plot()

    def _take_plan(self) -> None:
        """Show the plan that a program has handed over, with the arm of its model that is nearest to its beginning."""
        plan = self._box.take()
        if plan is None:
            return

        def distance(model: PanelArm) -> float:
            state = model.arm.connection.newest()
            if state is None or state.groups.joints is None:
                return math.inf
            return float(np.abs(state.q - plan.q[0]).max())

        fitting = [model for model in self._arms if model.arm.robot.name == plan.robot]
        if fitting:
            min(fitting, key=distance).show_plan(plan)

    def _look_at_world(self) -> None:
        """Show the world of a program with the first arm of its robot."""
        world = self._box.world()
        for model in self._arms:
            is_its = world is not None and model.arm.robot.name == world.robot
            model.world = world if is_its else None
            world = None if is_its else world

    def run(self) -> None:
        """Draw until `close` is called."""
        period, count = 1.0 / RATE, 0
        due = time.monotonic()
        while not self._ended.is_set():
            with self._drawing:
                if not self._ended.is_set():
                    self.draw(count)
            count += 1
            due = max(due + period, time.monotonic())
            self._ended.wait(due - time.monotonic())

    def close(self) -> None:
        """End the pages; the arms stay connected."""
        self._ended.set()
        self._box.close()
        for model in self._arms:
            model.close()
        with (
            self._drawing,
            contextlib.redirect_stdout(io.StringIO()),
        ):  # a picture belongs to a server that runs
            self.server.stop()


def _stop(model: PanelArm, failed: dict[PanelArm, str]) -> None:
    try:
        model.stop()
    except HeptarmError as error:
        failed[model] = str(error)
        model.report(error)
    else:
        del failed[model]


def halting(arm: Arm, host: str, port: int) -> Callable[[], None]:
    """What stops an arm without a session, at the address of its cabinet."""
    private = arm.connection.cabinet
    place = (host, port) if private is None else (private.host, private.port)

    def stop() -> None:
        halt(
            lambda: tcp.connect(*place, timeout=_STOP_TIMEOUT),
            StopKind.PATH,
            clock=RealClock(),
            timeout=_STOP_TIMEOUT,
        )

    return stop


def model_of(
    arm: Arm, target: str, options: PanelOptions, operate: Callable[[str], str] | None = None
) -> PanelArm:
    """The model of a connected arm, which then pushes all that its cabinet offers.

    Args:
        arm: connected to the target.
        target: as in `heptarm.connect`.
        options: of the panel.
        operate: carries out a command of the operator; None: that of a private simulator, if it is one.
    """
    from heptarm.arm.link.target import parse_target

    chosen = parse_target(target)
    arm.subscribe(rate=STATE_RATE, groups=groups_for(arm.connection.welcome.groups))
    if operate is None and arm.connection.cabinet is not None:
        operate = arm.operator.do
    return PanelArm(
        arm,
        gripper=_gripper_of(arm, options) if options.may_control else None,
        mounted=_mounted_on(arm, options),
        halt=halting(arm, chosen.host, chosen.port),
        operate=operate,
        may_control=options.may_control,
        folder=options.recordings,
        scene=options.scene,
        target=target,
    )


def _gripper_of(arm: Arm, options: PanelOptions) -> Gripper | None:
    """The gripper of the options, or of the scene of a virtual robot; None: there is none.

    Raises:
        CommandRejected: its signals are named in a wrong way, or there are none of these names.
    """
    from heptarm.sim.plant.scene import GRIPPER, Scene

    try:
        if options.gripper:
            wiring = GripperWiring.of(options.gripper)
        elif arm.is_virtual and options.scene:
            scene = Scene.of(options.scene)
            if all(actuator.name != GRIPPER for actuator in scene.read().actuators):
                return None
            wiring = scene.wiring
        else:
            return None
    except ValueError as error:
        raise CommandRejected(str(error), parameter="gripper", value=options.gripper) from None
    return TwoSignalGripper(arm, **asdict(wiring))


def _mounted_on(arm: Arm, options: PanelOptions) -> Body | None:
    """What the scene of a virtual robot mounts on its flange; None: nothing."""
    from heptarm.sim.plant.scene import Scene

    if not arm.is_virtual or not options.scene:
        return None
    try:
        return Scene.of(options.scene).load
    except ValueError as error:
        raise CommandRejected(str(error), parameter="scene", value=options.scene) from None


def main(argv: list[str] | None = None) -> int:
    """Show a cabinet until standard input is closed or the cabinet ends; the operator's words go to standard output."""
    parser = argparse.ArgumentParser(prog="python -m heptarm.panel.process")
    parser.add_argument("--target", required=True)
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=8080)
    parser.add_argument("--scene", default="")
    parser.add_argument("--positions", type=Path, default=None)
    parser.add_argument("--meshes", default="", help="folder with link_0.stl to link_7.stl or .obj")
    parser.add_argument("--read-only", action="store_true")
    given = parser.parse_args(argv)
    from heptarm.arm.connect import connect

    options = PanelOptions(
        host=given.host,
        port=given.port,
        scene=given.scene,
        positions=given.positions,
        meshes=given.meshes,
        read_only=given.read_only,
    )
    try:
        require("viser", extra="viz")
    except HeptarmError as error:  # the parent prints it
        print(json.dumps({"ready": False, "error": str(error), "host": True}), flush=True)
        return 1
    signal.signal(signal.SIGTERM, lambda *_: os._exit(0))
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        with connect(given.target, control=False, name="panel", state_rate=STATE_RATE) as arm:
            panel = Panel([model_of(arm, given.target, options, _say)], options)
            print(json.dumps({"ready": True, "url": panel.url}), flush=True)
            try:
                panel.run()
            finally:
                panel.close()
    except CommandRejected as error:
        print(json.dumps({"ready": False, "error": str(error), "host": True}), flush=True)
        return 1
    except HeptarmError as error:
        print(f"the panel ends: {error}", file=sys.stderr)
    return 0


def _say(words: str) -> str:
    """Pass an action of the operator on to the parent, which has the cabinet's input."""
    print(json.dumps({"say": words}), flush=True)
    return ""


def _end_with_parent() -> None:
    while os.read(0, 4096):
        pass
    os._exit(0)


if __name__ == "__main__":
    sys.exit(main())
