"""The page: what is drawn of an arm with viser, and what its buttons do.

Nothing is decided here: a button calls a method of the model, and what the model refuses is shown as its message. The
callbacks of held buttons run in viser's event loop, in the order in which the browser sent them, and never block.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from heptarm import calibration
from heptarm.calibration.board import KINDS as BOARDS
from heptarm.errors import HeptarmError
from heptarm.panel import texts
from heptarm.panel.drawing import DrawnBodies, DrawnGhost, DrawnMarks, DrawnWorld, wxyz
from heptarm.panel.jog import JOINT_SPEED, LINE_SPEED, TURN_SPEED, Jog, JointJog, PoseJog, TwistJog
from heptarm.panel.model import HISTORY, PanelArm, Readout
from heptarm.panel.wizard import KINDS, WizardSettings
from heptarm.planning.constraints import constraint_from_text
from heptarm.values.camera import FRAMES
from heptarm.values.frames import BASE, FLANGE, TOOL
from heptarm.values.motion.planned_path import OnPlane, PathConstraint, Upright
from heptarm.values.pose import Pose
from heptarm.values.world import WorldOutline

log = logging.getLogger("heptarm.panel")

#: How often a held button asks again [Hz].
_HOLD_RATE = 10.0
#: Speeds at first [%]: of jogging, and of programs.
_SLOW = 10
_JOINTS, _NONE = "joints", "(none)"
_AXES = ("X", "Y", "Z", "A", "B", "C")
#: Place of A, B, C among the rotations of a twist: about z, y, x.
_TURNS = {"A": 5, "B": 4, "C": 3}
#: For so long an input shows what was chosen, while the robot does not report it yet [s].
_SETTLES = 1.5
#: Upper ends of the plot of the force [N].
_SCALES = (10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 5000.0)
_STOPS = {
    "Emergency stop": "emergency_stop",
    "Open the gate": "operator_safety",
    "Safety stop": "protective_stop",
    "Drive error": "drive_error",
}
_RUN, _MEASUREMENT = "run", "measurement"
_ACTIONS = {"Clear": "clear", "Start": "start", "Enable": "enable", "Release enabling": "release"}
_MODES = {"T1": "t1", "T2": "t2", "AUT": "aut"}
_PUSH = {"Push 20 N down, 2 s": "push 0 0 -20 2", "Push 30 N sideways, 2 s": "push 0 30 0 2"}


class ArmPage:
    """The widgets and drawings of one arm.

    Args:
        server: a viser server.
        model: the arm.
        world: its bodies.
        bodies: those of the world that a program shows.
        marks: what else is drawn of it.
        ghost: shows its plan.
        root: node of viser's scene that is the base of the arm; empty: the world.
        tab: where the readouts go.
    """

    def __init__(
        self,
        server: Any,
        model: PanelArm,
        world: DrawnWorld,
        bodies: DrawnBodies,
        marks: DrawnMarks,
        ghost: DrawnGhost,
        *,
        root: str,
        tab: Any,
    ) -> None:
        self.model = model
        self._server, self._gui = server, server.gui
        self._world, self._bodies, self._marks, self._ghost, self._root = world, bodies, marks, ghost, root
        self._outline: WorldOutline | None = None
        self._points: tuple[Any, ...] = ()
        self._pages: dict[str, int] = {}  # of runs and measurements: the page that has started the newest
        self._trail: tuple[int, ...] = ()
        self._outputs: dict[str, Any] = {}
        self._top = _SCALES[0]
        self._marks.show_places("frame", model.arm.frames)
        with tab:
            self._joints = self._gui.add_html("")
            self._place = self._gui.add_html("")
            self._wrench = self._gui.add_html("")
            self._plot = self._gui.add_uplot(
                (np.array([-HISTORY, 0.0]), np.zeros(2)),
                ({}, {"label": "|F| [N]", "stroke": "#ff6b0a", "width": 2}),
                scales=self._scales(),
                axes=(
                    {"stroke": "#999", "grid": {"stroke": "#8883"}},
                    {"stroke": "#999", "grid": {"stroke": "#8883"}, "size": 36},
                ),
                legend={"show": False},
                aspect=2.4,
                padding=(10, 10, 0, 0),
            )
            if model.may_control:
                self._make_recording()
        self._head = self._gui.add_html("")
        self._safety = self._gui.add_html("")
        self._plan = self._gui.add_html("")
        self._hide = self._gui.add_button("Hide plan", color="gray", visible=False)
        self._hide.on_click(lambda _: model.hide_plan())
        if model.may_control:
            self._make_control()
            tabs = self._gui.add_tab_group()
            with tabs.add_tab("Jog"):
                self._make_jog()
            with tabs.add_tab("Program"):
                self._make_program()
            with tabs.add_tab("IO, tools"):
                self._make_signals()
            with tabs.add_tab("Calibrate"):
                self._make_wizard()
            if model.has_operator:
                with tabs.add_tab("Operator"):
                    self._make_operator()
        else:
            self._gui.add_html(
                '<div class="ha"><div class="box">This panel only shows the arm. STOP works.</div></div>'
            )
            self._inputs = self._gui.add_html("")

    # ----------------------------------------------------------------------------------- drawing

    def draw(self, readout: Readout) -> None:
        """Move what is three-dimensional."""
        state, tcp = readout.state, readout.tcp
        if state is None or state.groups.joints is None:
            return
        if self.model.world is not self._outline:
            self._show_world(self.model.world)
        self._world.show(state.q)
        self._world.carry(self.model.arm.shapes)
        if tcp is not None:
            force = None if readout.wrench is None else readout.wrench.force
            self._marks.show(tcp, np.array(self._world.flange.xpos), force)
        self._marks.show_target(readout.target)
        self._ghost.show(self.model.plan, self.model.plan_time)

    def _show_world(self, outline: WorldOutline | None) -> None:
        self._outline = outline
        self._bodies.show(outline)
        try:
            self._world.have(*("", ()) if outline is None else (outline.scene, outline.placed))
        except (ValueError, HeptarmError) as error:
            log.warning("the scene that a program shows cannot be drawn: %s", error)

    def write(self, readout: Readout) -> None:
        """Write the texts."""
        model, state = self.model, readout.state
        _put(self._head, texts.head(readout))
        _put(self._safety, texts.safety(readout))
        _put(self._plan, texts.plan(model.plan))
        if self._hide.visible != (model.plan is not None):
            self._hide.visible = model.plan is not None
        if model.may_control and self._drive.visible != model.has_path:
            self._drive.visible = model.has_path
        _put(self._joints, texts.joints(state, model.arm.robot))
        _put(self._place, texts.place(readout.tcp, state))
        _put(self._wrench, texts.wrench(readout.wrench, readout.undeclared))
        path = model.path
        if path.shape != self._trail or readout.is_jogging or readout.running:
            self._trail = path.shape
            self._marks.show_trail(path)
        values = {} if state is None or state.groups.io is None else dict(state.groups.io)
        known = model.arm.io.signals
        _put(self._inputs, texts.signals({n: v for n, v in values.items() if not known[n].is_output}))
        if not model.may_control:
            return
        self._name_buttons(readout)
        self._write_wizard()
        _put(self._list, texts.program(model.points, self._chosen.value, readout.running))
        for name, handle in self._outputs.items():
            if name in values:
                _follow(handle, values[name])
        if state is not None and state.motion is not None:
            _follow(self._override, round(100 * state.motion.override))
        self._write_points()

    def _name_buttons(self, readout: Readout) -> None:
        for handle, label in (
            (self._control, "Release control" if readout.in_control else "Take control"),
            (self._record, "Stop recording" if readout.recording else "Record"),
        ):
            if handle.label != label:
                handle.label = label

    def plot(self) -> None:
        """Draw the force of the last seconds."""
        times, forces = self.model.forces
        if len(times) < 2:
            return
        top = next((scale for scale in _SCALES if scale > 1.1 * forces.max()), _SCALES[-1])
        if top != self._top:
            self._top = top
            self._plot.scales = self._scales()
        self._plot.data = (times, forces)

    def _scales(self) -> dict[str, Any]:
        # with a range of x, too, viser 1.1 draws no axes
        return {"x": {"time": False}, "y": {"range": (0.0, self._top)}}

    def _write_points(self) -> None:
        points = tuple(self.model.points)
        if points == self._points:
            return
        self._points = points
        names = self.model.points.names or (_NONE,)
        before = self._chosen.value
        self._chosen.options = names
        self._chosen.value = before if before in names else names[-1]
        self._marks.show_places("point", {point.name: point.pose for point in points})

    # ----------------------------------------------------------------------------------- widgets

    def _button(self, label: str, action: Callable[[], object], **look: Any) -> Any:
        """A button; what its action refuses becomes the model's message."""
        handle = self._gui.add_button(label, **look)
        handle.on_click(lambda _: self._do(action))
        return handle

    def _do(self, action: Callable[[], object]) -> None:
        try:
            action()
        except HeptarmError as error:
            self.model.report(error)

    def _held(self, label: str, jog: Callable[[], Jog], **look: Any) -> Any:
        """A button that moves the arm while it is held."""
        handle = self._gui.add_button(label, **look)

        async def hold(event: Any) -> None:
            self._do(lambda: self.model.jog(jog(), event.client_id))

        async def release(event: Any) -> None:
            self.model.end_jog(event.client_id)

        handle.on_hold(hold, callback_hz=_HOLD_RATE)
        handle.on_click(release)
        return handle

    def _grid(self) -> None:
        self._gui.add_html(texts.GRID)

    def _wide(self) -> None:
        self._gui.add_html(texts.WIDE)

    def _make_control(self) -> None:
        model = self.model
        with self._gui.add_folder("Control"):
            self._grid()
            self._control = self._button("Take control", self._toggle_control, color="blue")
            self._button("Recover", model.recover, color="gray")
            self._button("Pause", model.pause, color="gray")
            self._button("Resume", model.resume, color="gray")
            if model.gripper is not None:
                self._button("Open gripper", model.open_gripper, color="gray")
                self._button("Close gripper", model.close_gripper, color="gray")

    def _make_recording(self) -> None:
        self._grid()
        self._override = self._gui.add_slider("Override [%]", 0, 100, 1, 100, hint="a factor on every speed")
        self._override.on_update(self._on_override)
        self._record = self._button("Record", self._toggle_recording, color="gray")
        self._button("Clear trail", self.model.clear_path, color="gray")

    def _toggle_control(self) -> None:
        if self.model.arm.in_control:
            self.model.release_control()
        else:
            self.model.take_control()

    def _toggle_recording(self) -> None:
        if self.model.poll().recording:
            self.model.stop_recording()
        else:
            self.model.start_recording()

    def _on_override(self, event: Any) -> None:
        if event.client_id is not None:
            self._do(lambda: self.model.set_override(self._override.value / 100))

    # -------------------------------------------------------------------------------------- jog

    def _make_jog(self) -> None:
        arm = self.model.arm
        self._gui.add_html(texts.KEYS)
        self._speed = self._gui.add_slider("Speed [%]", 1, 100, 1, _SLOW)
        self._frame = self._gui.add_dropdown(
            "Jog",
            (_JOINTS, BASE, TOOL, *arm.frames),
            initial_value=_JOINTS,
            hint="joints, or along whose axes",
        )
        self._turning = [
            self._held(f"A{index + 1} {sign}", self._joint_jog(index, factor), color="gray")
            for index in range(7)
            for sign, factor in (("−", -1.0), ("+", 1.0))
        ]
        self._driving = [
            self._held(f"{axis} {sign}", self._twist_jog(axis, factor), color="gray", visible=False)
            for axis in _AXES
            for sign, factor in (("−", -1.0), ("+", 1.0))
        ]
        self._frame.on_update(self._on_frame)
        self._with_gizmo = self._gui.add_checkbox("Handle to drag the TCP", initial_value=False)
        self._follows = self._gui.add_checkbox(
            "Follow while dragging", initial_value=False, hint="otherwise hold the button"
        )
        self._wide()
        self._go = self._held("Hold: go to the handle", self._goal_jog, color="orange", visible=False)
        self._plan_path = self._button(
            "Plan around bodies", self._find_path, color="gray", visible=False, hint="a path to the handle"
        )
        self._upright = self._gui.add_checkbox(
            "Keep the tool upright", initial_value=False, visible=False, hint="on the path around bodies"
        )
        self._level = self._gui.add_checkbox(
            "Keep its height", initial_value=False, visible=False, hint="likewise"
        )
        self._also = self._gui.add_text(
            "Also keep", "", visible=False, hint="likewise, as in Python: OnLine((0.5, 0, 0.4), (0, 1, 0))"
        )
        self._drive = self._gui.add_button("Drive the path", color="orange", visible=False)
        self._drive.on_click(self._of_page(_RUN, lambda: self.model.drive(places=self._world.places)))
        self._follows.visible = False
        self._gizmo = self._server.scene.add_transform_controls(
            f"{self._root}/handle", scale=0.22, visible=False, depth_test=False
        )
        self._gizmo.on_update(self._on_gizmo)
        self._with_gizmo.on_update(self._on_with_gizmo)

    def _fraction(self) -> float:
        return float(self._speed.value) / 100

    def _joint_jog(self, index: int, factor: float) -> Callable[[], Jog]:
        return lambda: JointJog(np.eye(7)[index] * factor * self._fraction() * JOINT_SPEED)

    def _twist_jog(self, axis: str, factor: float) -> Callable[[], Jog]:
        place = _TURNS.get(axis, _AXES.index(axis))
        fastest = TURN_SPEED if axis in _TURNS else LINE_SPEED
        return lambda: TwistJog(np.eye(6)[place] * factor * self._fraction() * fastest, self._frame.value)

    def _goal_jog(self) -> Jog:
        return PoseJog(self._gizmo_pose(), self._fraction())

    def _gizmo_pose(self) -> Pose:
        w, x, y, z = self._gizmo.wxyz.tolist()
        return Pose.of(self._gizmo.position, (x, y, z, w))

    def _on_frame(self, _: Any) -> None:
        is_joint = self._frame.value == _JOINTS
        for handle in self._turning:
            handle.visible = is_joint
        for handle in self._driving:
            handle.visible = not is_joint

    def _on_with_gizmo(self, _: Any) -> None:
        shown = bool(self._with_gizmo.value)
        tcp = self.model.poll().tcp
        if tcp is not None:
            self._gizmo.position, self._gizmo.wxyz = tcp.xyz, wxyz(tcp)
        paths = (self._plan_path, self._upright, self._level, self._also)
        for control in (self._gizmo, self._go, self._follows, *paths):
            control.visible = shown
        self._world.name_bodies(visible=shown)
        self.model.goal = None

    def _find_path(self) -> None:
        keep: list[PathConstraint] = [Upright("z")] if self._upright.value else []
        tcp = self.model.poll().tcp
        if self._level.value and tcp is not None:
            keep.append(OnPlane(tcp.xyz))
        if self._also.value.strip():
            keep.append(constraint_from_text(self._also.value, "Also keep"))
        self.model.plan_to(self._gizmo_pose(), places=self._world.places, speed=self._fraction(), keep=keep)

    async def _on_gizmo(self, event: Any) -> None:
        self.model.goal = self._gizmo_pose()
        if not self._follows.value:
            return
        if event.phase == "end":
            self.model.end_jog(event.client_id)
        else:
            self._do(lambda: self.model.jog(self._goal_jog(), event.client_id))

    # ---------------------------------------------------------------------------------- program

    def _make_program(self) -> None:
        gui, model = self._gui, self.model
        self._grid()
        self._list = gui.add_html("")
        self._chosen = gui.add_dropdown("Point", (_NONE,))
        self._name = gui.add_text("Name", "", hint="of the next point, or the new name of the chosen one")
        self._button("Teach here", self._teach, color="green")
        self._button("Rename", self._rename, color="gray")
        self._button("Up", lambda: model.points.shift(self._chosen.value, -1), color="gray")
        self._button("Down", lambda: model.points.shift(self._chosen.value, 1), color="gray")
        self._button("PTP / LIN", self._toggle_approach, color="gray")
        self._button("Delete", lambda: model.points.delete(self._chosen.value), color="gray")
        self._run_speed = gui.add_slider("Run at [%]", 1, 100, 1, _SLOW)
        for label, action in (
            ("Go to point", self._run_chosen),
            ("Step", self._step),
            ("Run all", self._run),
        ):
            handle = gui.add_button(label, color="orange")
            handle.on_click(self._of_page(_RUN, action))
        self._button("Preview", lambda: model.preview(speed=float(self._run_speed.value) / 100), color="gray")
        self._button("Cancel", model.end_run, color="gray")
        save = gui.add_button("Save", color="gray")
        save.on_click(
            lambda event: event.client.send_file_download(
                "points.json", model.points.to_json().encode(), save_immediately=True
            )
        )
        load = gui.add_upload_button("Load", color="gray", mime_type="application/json")
        load.on_upload(lambda event: self._do(lambda: self.model.points.load(event.target.value.content)))

    def _teach(self) -> None:
        point = self.model.teach(self._name.value)
        self._name.value = ""
        self._write_points()
        self._chosen.value = point.name

    def _rename(self) -> None:
        self.model.points.rename(self._chosen.value, self._name.value.strip())
        new, self._name.value = self._name.value.strip(), ""
        self._write_points()
        self._chosen.value = new

    def _toggle_approach(self) -> None:
        points = self.model.points
        point = tuple(points)[points.index(self._chosen.value)]
        points.approach(point.name, straight=not point.straight)

    def _of_page(self, what: str, action: Callable[[], object]) -> Callable[[Any], None]:
        """What starts a run or a measurement, and remembers whose page has done so; a refused one has not."""

        def start(event: Any) -> None:
            try:
                action()
            except HeptarmError as error:
                self.model.report(error)
            else:
                self._pages[what] = event.client_id

        return start

    def _run(self, *names: str) -> None:
        self.model.run(*names, speed=float(self._run_speed.value) / 100)

    def _run_chosen(self) -> None:
        self._run(*((self._chosen.value,) if self.model.points.names else ()))

    def _step(self) -> None:
        """Run to the chosen point, and choose the next one; a step that is refused chooses none."""
        self._run_chosen()
        names, chosen = self.model.points.names, self._chosen.value
        self._chosen.value = names[(self.model.points.index(chosen) + 1) % len(names)]

    # ----------------------------------------------------------------------------- signals, tools

    def _make_signals(self) -> None:
        gui, model = self._gui, self.model
        arm = model.arm
        self._grid()
        tools = (_NONE, *arm.tools)
        self._tool = gui.add_dropdown("Tool", tools, hint=f"on the {FLANGE}; the arm has to be at rest")
        self._wide()
        self._button(
            "Attach", lambda: model.attach_tool("" if self._tool.value == _NONE else self._tool.value)
        )
        self._inputs = gui.add_html("")
        outputs = [signal for signal in arm.io.signals.values() if signal.is_output][: texts.MOST_SIGNALS]
        for signal in outputs:
            if signal.kind == "boolean":
                handle = gui.add_checkbox(signal.name, initial_value=False)
            else:
                handle = gui.add_number(
                    signal.name,
                    signal.low,
                    min=signal.low,
                    max=signal.high,
                    step=0.01 if signal.kind == "analog" else 1.0,
                )
            handle.on_update(self._setter(signal.name, handle))
            self._outputs[signal.name] = handle

    def _setter(self, name: str, handle: Any) -> Callable[[Any], None]:
        def put(event: Any) -> None:
            if event.client_id is not None:
                self._do(lambda: self.model.set_output(name, handle.value))

        return put

    # ------------------------------------------------------------------------------------ wizard

    def _make_wizard(self) -> None:
        gui, wizard = self._gui, self.model.wizard
        self._grid()
        self._measured = gui.add_dropdown("Measure", tuple(KINDS.values()))
        self._measured.on_update(lambda _: self._show_settings())
        usual, board = WizardSettings(), calibration.Board()
        self._count = gui.add_number("Poses", usual.count, min=0, max=100, step=1, hint="0: the usual number")
        self._surface = gui.add_text("Surface [m]", usual.surface, hint="plane:X,Y,Z or sphere:X,Y,Z,RADIUS")
        self._radius = gui.add_number("Tip radius [mm]", 0.0, min=0.0, max=100.0, step=0.1)
        self._inertia = gui.add_checkbox("Inertia, too", initial_value=False, hint="at 30 % or more")
        self._camera = gui.add_text("Camera", usual.camera, hint="its number, a stream, or sim")
        self._mounted = gui.add_dropdown("Camera on the", FRAMES[::-1])
        self._board = gui.add_dropdown("Board", tuple(BOARDS))
        self._columns = gui.add_number("Columns", board.columns, min=1, max=30, step=1)
        self._rows = gui.add_number("Rows", board.rows, min=1, max=30, step=1)
        self._square = gui.add_number("Square [mm]", 1e3 * board.square, min=1.0, max=1000.0, step=0.1)
        self._measuring = gui.add_slider("Speed [%] ", 1, 100, 1, _SLOW)
        self._steps = gui.add_html("")
        self._seen = gui.add_image(np.zeros((3, 4, 3), np.uint8), visible=False, format="jpeg")
        for label, action, color in (("Begin", self._begin, "blue"), ("Go on", wizard.go_on, "orange")):
            gui.add_button(label, color=color).on_click(self._of_page(_MEASUREMENT, action))
        self._button("Give up", wizard.give_up, color="red")
        self._saved = gui.add_text("Save as", "", hint="name of the tool or camera of the saved target")
        self._wide()
        self._button("Save result", lambda: wizard.save(self._saved.value), color="green")
        self._shown: Any = None
        self._show_settings()

    def _kind(self) -> str:
        return next(kind for kind, text in KINDS.items() if text == self._measured.value)

    def _show_settings(self) -> None:
        kind = self._kind()
        for needed, handles in (
            ("poses touch camera", (self._count,)),
            ("touch", (self._surface, self._radius)),
            ("load", (self._inertia,)),
            ("camera", (self._camera, self._mounted, self._board, self._columns, self._rows, self._square)),
            ("touch load camera", (self._measuring,)),
        ):
            for handle in handles:
                handle.visible = kind in needed.split()

    def _begin(self) -> None:
        board = calibration.Board(
            int(self._columns.value), int(self._rows.value), self._square.value / 1e3, self._board.value
        )
        settings = WizardSettings(
            count=int(self._count.value),
            surface=self._surface.value,
            tip_radius=self._radius.value / 1e3,
            inertia=self._inertia.value,
            speed=self._measuring.value / 100,
            camera=self._camera.value,
            frame=self._mounted.value,
            board=board,
        )
        self.model.measure(self._kind(), settings)

    def _write_wizard(self) -> None:
        step = self.model.wizard.step
        _put(self._steps, texts.wizard(step))
        if step.picture is not self._shown:
            self._shown = step.picture
            self._seen.visible = step.picture is not None
            if step.picture is not None:
                self._seen.image = step.picture

    # ---------------------------------------------------------------------------------- operator

    def _make_operator(self) -> None:
        gui = self._gui
        self._grid()
        gui.add_html('<div class="ha"><h4>You are beside the virtual robot</h4></div>')
        for label, words in _STOPS.items():
            self._action(label, words, "red")
        for label, words in _ACTIONS.items():
            self._action(label, words, "gray")
        modes = gui.add_button_group("Mode", tuple(_MODES))
        modes.on_click(lambda event: self._do(lambda: self.model.operate(_MODES[event.target.value])))
        for label, words in _PUSH.items():
            self._wide()
            self._action(label, words, "gray")

    def _action(self, label: str, words: str, color: str) -> None:
        self._button(label, lambda: self.model.operate(words), color=color)

    # ------------------------------------------------------------------------------------- ends

    def forget(self, client: int) -> None:
        """End what a page has started that was closed."""
        self.model.end_jog(client)
        for what, end in ((_RUN, self.model.end_run), (_MEASUREMENT, self.model.wizard.close)):
            if self._pages.get(what) == client:
                # it asks the cabinet, for which viser's event loop must not wait
                threading.Thread(target=self._do, args=(end,), daemon=True).start()


def _put(handle: Any, content: str) -> None:
    """Change a text if it is another one: each change goes to every browser."""
    if handle.content != content:
        handle.content = content


def _follow(handle: Any, value: Any) -> None:
    """Let an input show the robot's value, unless somebody has just changed it and the robot follows."""
    if handle.value != value and time.time() - handle.update_timestamp > _SETTLES:
        handle.value = value
