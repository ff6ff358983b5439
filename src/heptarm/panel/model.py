"""What the panel knows about one arm and does to it, without a browser.

`PanelArm.poll` reads the newest state and never waits for one. Everything that a page offers is a method here, so that
what a button does can be tested, and refused, in one place.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from heptarm.errors import CommandRejected, HeptarmError, ModeConflict, MotionError
from heptarm.io.panel_box import PlanOutline
from heptarm.model.dynamics import GRAVITY
from heptarm.panel.jog import Jog, Jogger
from heptarm.panel.points import PointList, TaughtPoint
from heptarm.panel.wizard import Wizard, WizardSettings
from heptarm.planning.search import Keep
from heptarm.sim.collision import CollisionModel
from heptarm.values.checks import Array, Value, within
from heptarm.values.io import SignalValue
from heptarm.values.motion.planned_path import Path as PlannedPath
from heptarm.values.pose import Pose
from heptarm.values.robot import Body
from heptarm.values.state import GROUP_NAMES, Safety, State, Wrench
from heptarm.values.world import WorldOutline

if TYPE_CHECKING:
    from heptarm.arm.arm import Arm
    from heptarm.arm.motion.handle import MotionHandle
    from heptarm.record.recorder import Recorder
    from heptarm.skills.gripper import Gripper

#: Time that the history of the force covers [s].
HISTORY = 10.0
#: Samples of the force that are kept, and of the path.
_MOST_FORCES, _MOST_PLACES = 1000, 1500
#: The path gets a new point when the motion frame is this far from the last one [m].
_STEP = 0.002
#: Name of the place where a path to the handle ends.
_HANDLE = "the handle"
#: Joint positions that a search reaches after it has found a path, for faster ones; about half a second.
_IMPROVE = 300
#: For so long a ghost stays at the end of its plan [s].
_PAUSE = 1.0
#: What a person does about a reason why the arm stands, and on a virtual robot.
_REMEDIES = {
    "emergency stop": (
        "Release the emergency stop and acknowledge it on the smartPAD; then Resume.",
        "Clear",
    ),
    "safeguard open": ("Close the gate and confirm it; then Resume.", "Clear"),
    "enabling switch not held": (
        "Hold the enabling switch of the smartPAD in its middle position.",
        "Enable",
    ),
    "safety stop": ("Remove the cause, acknowledge it on the smartPAD; then Recover.", "Clear"),
    "paused": ("Press Resume here, or Start on the smartPAD.", ""),
    "recovery required": ("Press Recover.", ""),
}


@dataclass(frozen=True, slots=True)
class Advice:
    """Something that happened, or a reason why the arm stands, and what to do about it.

    Attributes:
        what: in words.
        remedy: what to do; empty: nothing.
        level: "info", "warning" or "error".
        at: when it happened, seconds since the epoch.
    """

    what: str
    remedy: str = ""
    level: str = "info"
    at: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Readout(Value):
    """What a page shows of an arm at one moment.

    Attributes:
        title: KUKA's name of the robot.
        cabinet: name of the cabinet.
        is_virtual: the robot is simulated.
        state: the newest state; None: none was received.
        tcp: pose of the motion frame in the base; None: not known.
        wrench: external force and torque beside `undeclared`; None: not known.
        undeclared: weight on the flange that no load data state [N].
        is_connected: the connection is there, and the state is fresh.
        in_control: this panel controls the arm.
        controller: name of the client that controls it; empty: nobody.
        is_jogging: the arm follows a button of the panel.
        slowed: why it is slower than the button asks for; empty: it is not.
        running: name of the taught point that the arm is moving to; empty: none.
        target: pose to which the panel moves the arm; None: to none.
        stands: why the arm cannot move, with remedies; empty: it can.
        last_stop: the last stop, also after it was cleared; None: there was none.
        message: outcome of the last action; None: there is none.
        recording: file that is being written; empty: none.
    """

    title: str
    cabinet: str
    is_virtual: bool
    state: State | None
    tcp: Pose | None
    wrench: Wrench | None
    undeclared: float
    is_connected: bool
    in_control: bool
    controller: str
    is_jogging: bool
    slowed: str
    running: str
    target: Pose | None
    stands: tuple[Advice, ...]
    last_stop: Advice | None
    message: Advice | None
    recording: str


class PanelArm:
    """One arm of a panel.

    Args:
        arm: connected; it need not be in control.
        halt: stops the arm without a session.
        operate: carries out a command of the operator of a virtual robot; None: there is none.
        may_control: whether this panel may do more than look and stop.
        folder: where recordings go.
        gripper: that its buttons open and close; None: there is none.
        mounted: what a scene mounts on the flange of a virtual robot; None: nothing.
        scene: bodies around which it plans paths, as of `heptarm.CollisionModel`; empty: none.
        target: what the arm is connected to; a saved one gets what the wizard measures.

    Attributes:
        wizard: measures tool, load and camera.
        plan: that a ghost of the arm shows; None: there is none.
        world: that a program shows; None: none does.
    """

    def __init__(
        self,
        arm: Arm,
        *,
        halt: Callable[[], None],
        operate: Callable[[str], str] | None = None,
        may_control: bool = True,
        folder: Path = Path(),
        gripper: Gripper | None = None,
        mounted: Body | None = None,
        scene: str = "",
        target: str = "",
    ) -> None:
        self.arm = arm
        self._scene = scene
        self._planning = threading.Lock()
        self.world: WorldOutline | None = None
        self._model: CollisionModel | None = None
        self._found: tuple[PlannedPath, float] | None = None
        self.gripper = gripper
        self._mounted = mounted
        self.wizard = Wizard(arm, target, show=self.show_plan, report=self.report)
        self.plan: PlanOutline | None = None
        self._plan_since = 0.0
        self._gripping = threading.Lock()
        self.may_control = may_control
        self.points = PointList(arm.robot)
        self.goal: Pose | None = None
        self._halt = halt
        self._operate = operate
        self._folder = folder
        self._jogger = Jogger(arm, self.report)
        self._recorder: Recorder | None = None
        self._handle: MotionHandle | None = None
        self._visiting: tuple[str, ...] = ()
        self._message: Advice | None = None
        self._last_stop: Advice | None = None
        self._stops: tuple[str, ...] | None = None
        self._seen = 0
        self._forces: deque[tuple[float, float]] = deque(maxlen=_MOST_FORCES)
        self._path: deque[Array] = deque(maxlen=_MOST_PLACES)

    # ----------------------------------------------------------------------------------- looking

    def poll(self) -> Readout:
        """Read the newest state, and note the force, the path and stops; it waits for nothing."""
        arm, is_connected = self.arm, self.arm.connected
        state = arm.connection.newest()
        try:
            _ = arm.state
        except HeptarmError:
            is_connected = False
        tcp = None if state is None or state.groups.pose is None else state.pose
        wrench, undeclared = (None, 0.0) if state is None else self._external(state)
        if state is not None and is_connected and state.stamp != self._seen:
            self._seen = state.stamp
            self._note(state, tcp, wrench)
        stands = () if state is None else self._reasons(state.groups.safety)
        if self._recorder is not None and not self._recorder.is_running:
            self._end_recording()  # a full disk has ended it
        handle = self._handle
        running = ""
        if handle is not None and not handle.done:
            running = self._visiting[min(handle.item, len(self._visiting) - 1)]
        return Readout(
            title=arm.robot.title,
            cabinet=arm.cabinet,
            is_virtual=arm.is_virtual,
            state=state,
            tcp=tcp,
            wrench=wrench,
            undeclared=undeclared,
            is_connected=is_connected,
            in_control=arm.in_control,
            controller=arm.controller,
            is_jogging=self._jogger.is_moving,
            slowed=self._jogger.slowed,
            running=running,
            target=self._target(running),
            stands=stands,
            last_stop=self._last_stop,
            message=self._message,
            recording="" if self._recorder is None else self._recorder.path.name,
        )

    def _external(self, state: State) -> tuple[Wrench | None, float]:
        """The external wrench without the weight of a tool that is not attached, and that weight [N]."""
        groups = state.groups
        if groups.wrench is None or self._mounted is None or groups.pose is None or groups.mode is None:
            return groups.wrench, 0.0
        if state.tool:
            return state.wrench, 0.0
        weight = self._mounted.mass * np.array(GRAVITY)
        torque = np.cross(state.pose.rotation @ self._mounted.com, weight)  # the motion frame is the flange
        force, torque = state.wrench.force - weight, state.wrench.torque - torque
        return replace(state.wrench, force=force, torque=torque), float(np.linalg.norm(weight))

    def _note(self, state: State, tcp: Pose | None, wrench: Wrench | None) -> None:
        if wrench is not None:
            self._forces.append((time.monotonic(), float(np.linalg.norm(wrench.force))))
        if tcp is not None and (not self._path or float(np.linalg.norm(tcp.xyz - self._path[-1])) > _STEP):
            self._path.append(tcp.xyz)
        safety = state.groups.safety
        if safety is None:
            return
        before, self._stops = self._stops, safety.stops
        new = [] if before is None else [reason for reason in safety.stops if reason not in before]
        if new:
            remedies = [
                reason.remedy for reason in self._reasons(safety) if reason.what in map(str.capitalize, new)
            ]
            self._last_stop = Advice(
                ", ".join(new).capitalize(), remedies[0] if remedies else "", "warning", time.time()
            )

    def _reasons(self, safety: Safety | None) -> tuple[Advice, ...]:
        """Why the arm cannot move, with what to do about it."""
        if safety is None:
            return ()
        if not safety.is_known:
            return (
                Advice(
                    "The safety state is unknown",
                    "Look at the smartPAD: this cabinet reports none.",
                    "warning",
                ),
            )
        found = []
        for reason in safety.stops:
            remedy, button = _REMEDIES.get(reason, ("", ""))
            if self._operate is not None and button:
                remedy = f"You are its operator: press {button} under Operator" + (
                    "; then Resume." if "Resume" in remedy else "."
                )
            found.append(Advice(reason.capitalize(), remedy, "warning"))
        if not found and not safety.ready_to_move and not safety.moving:
            found.append(Advice("Not ready to move", "Press Recover.", "warning"))
        return tuple(found)

    def _target(self, running: str) -> Pose | None:
        if running and running in self.points.names:
            return list(self.points)[self.points.index(running)].pose
        return self.goal

    @property
    def forces(self) -> tuple[Array, Array]:
        """Times before now [s] and sizes of the external force [N] of the last `HISTORY` seconds, shape (n,) each."""
        now = time.monotonic()
        kept = [(at - now, force) for at, force in list(self._forces) if now - at <= HISTORY]
        times, forces = zip(*kept, strict=True) if kept else ((), ())
        return np.array(times), np.array(forces)

    @property
    def path(self) -> Array:
        """Positions of the motion frame on the path driven, in the base, shape (n, 3) [m]."""
        return np.array(list(self._path)).reshape(-1, 3)

    def clear_path(self) -> None:
        """Forget the path driven."""
        self._path.clear()

    @property
    def has_operator(self) -> bool:
        """Whether the panel can play the operator of this virtual robot."""
        return self._operate is not None and self.may_control

    def report(self, error: HeptarmError) -> None:
        """Show an error, in words and with its remedy."""
        self._say(error.text, error.hint, "error")

    def _say(self, what: str, remedy: str = "", level: str = "info") -> None:
        self._message = Advice(what, remedy, level, time.time())

    # ------------------------------------------------------------------------------ stop, recover

    def stop(self) -> None:
        """Stop the arm, without a session and without control; it never waits for a button or a program.

        Raises:
            HeptarmError: neither way reaches the cabinet.
        """
        self._jogger.bar()
        self.wizard.end()
        try:
            self._halt()
        except HeptarmError:
            self.arm.stop()
        self._last_stop = Advice("Stopped by the panel", "", "info", time.time())
        self._say("Stopped")

    def take_control(self) -> None:
        """Take control of the arm; raises NotInControl if another client has it."""
        self._check_allowed()
        self.arm.take_control()
        self._say("The panel controls the arm")

    def release_control(self) -> None:
        """Stop jogging and give control back."""
        self._jogger.bar()
        if self.arm.in_control:
            self.arm.release_control()
        self._say("Control is released")

    def recover(self) -> None:
        """Make the arm ready as far as software may, and report the steps left to a person."""
        self._check_allowed()
        recovery = self.arm.recover()
        if recovery.done:
            self._say(f"Ready: {', '.join(recovery.did) or 'nothing had to be done'}")
        else:
            self._say("Not ready", "; ".join(recovery.remaining), "warning")

    def pause(self) -> None:
        """Pause on the path."""
        self._check_allowed()
        self.arm.pause()

    def resume(self) -> None:
        """Continue after a pause."""
        self._check_allowed()
        self.arm.resume()
        self._say("Resumed")

    def set_override(self, value: float) -> None:
        """Set the application override, [0, 1]."""
        self._check_allowed()
        self.arm.set_override(value)

    def operate(self, words: str) -> None:
        """Do as the operator of the virtual robot does.

        Raises:
            CommandRejected: the panel cannot play the operator, or there is no such action.
        """
        self._check_allowed()
        if self._operate is None:
            raise CommandRejected(
                "the panel cannot play the operator of this robot",
                parameter="words",
                hint="start the simulator by the panel: heptarm panel --target sim://iiwa14, or heptarm sim --panel",
            )
        self._operate(words)

    def _check_allowed(self) -> None:
        """Refuse to do anything on a panel that only shows."""
        if not self.may_control:
            raise CommandRejected(
                "this panel only shows: it does not control the arm",
                parameter="control",
                hint="start it on this machine without --read-only; for others in the network with --allow-control",
            )

    # ------------------------------------------------------------------------------------ moving

    def jog(self, jog: Jog, owner: object = None) -> None:
        """Move the arm by hand for a moment; to go on, call it again. See `Jogger.hold`."""
        self._check_allowed()
        self._jogger.hold(jog, owner)

    def end_jog(self, owner: object = None) -> None:
        """End jogging; with an owner only if it is the one who jogs."""
        self._jogger.release(owner)

    # ------------------------------------------------------------------------------------- plans

    def show_plan(self, plan: PlanOutline) -> None:
        """Let a ghost of the arm move along a plan, again and again."""
        self._plan_since = time.monotonic()
        self.plan, self._found = plan, None

    def hide_plan(self) -> None:
        """Show no plan."""
        self.plan = self._found = None

    @property
    def plan_time(self) -> float:
        """Time of the plan at which the ghost is now [s]."""
        if self.plan is None:
            return 0.0
        duration = float(self.plan.t[-1])
        return min((time.monotonic() - self._plan_since) % (duration + _PAUSE), duration)

    def preview(self, *names: str, speed: float = 0.1) -> None:
        """Plan the motion to taught points, and show it; nothing moves.

        Args:
            names: of the points; none: all of them in order.
            speed: fraction of the full speed, (0, 1].

        Raises:
            CommandRejected: there is no such point, the list is empty, the points were taught with another tool, or one
                cannot be reached in this way.
        """
        chosen = self._chosen(names)
        self._check_tool(chosen)
        found = self.arm.plan(self.points.motions(chosen), speed=speed)
        self.show_plan(found.outline())
        self._say(f"Planned: {found.duration:.1f} s; {found.closest('velocity')}")

    @property
    def has_path(self) -> bool:
        """Whether the plan that is shown is a path that `drive` moves along."""
        return self._found is not None

    def plan_to(
        self,
        goal: Pose,
        *,
        places: Mapping[str, Pose],
        speed: float = 0.1,
        keep: Keep = (),
    ) -> None:
        """Find a path to a pose of the motion frame, around the bodies of the scene, and show it; nothing moves.

        Args:
            goal: in the base.
            places: where free bodies of the scene are in the base, by name.
            speed: fraction of the full speed, (0, 1].
            keep: constraints along the path.

        Raises:
            NoPath: none was found; the text has the bodies in the way.
            ModeConflict: the arm moves, or a search runs.
        """
        if not self._planning.acquire(blocking=False):
            raise ModeConflict("a search runs", parameter="goal", hint="wait until it has ended")
        try:
            world = self._placed(places)
            found = self.arm.find_path(goal, avoid=world, speed=speed, keep=keep, improve=_IMPROVE)
            self.show_plan(self.arm.plan(found, speed=speed).outline())
            self._found = found, speed
            self._say(f"Path: {found}")
        finally:
            self._planning.release()

    def drive(self, *, places: Mapping[str, Pose]) -> None:
        """Move along the path that is shown, if it is free of the bodies as they are now; returns at once.

        Args:
            places: as of `plan_to`.

        Raises:
            CommandRejected: no path is shown; NotInControl, CollisionForeseen.
            ModeConflict: the arm moves.
        """
        self._check_allowed()
        if self._found is None:
            raise CommandRejected("no path is shown", parameter="path", hint="plan one to the handle first")
        if self._jogger.is_moving:
            raise ModeConflict("the arm is being jogged", parameter="path", hint="release the button first")
        path, speed = self._found
        self._placed(places)
        self._visit((_HANDLE,), self.arm.start(path, speed=speed, when="reject"))
        self.hide_plan()

    def _placed(self, places: Mapping[str, Pose]) -> CollisionModel:
        """The bodies of the scene where they are now, and those that a program shows; always the same model."""
        shown = self.world or WorldOutline(self.arm.robot.name)
        made = CollisionModel.of(replace(shown, scene=self._scene or shown.scene))
        for name, pose in places.items():
            if made.held(name) is None:
                made.place(name, pose)
        if self._model is None:
            self._model = made
        else:
            self._model.become(made)
        return self._model

    def measure(self, kind: str, settings: WizardSettings) -> None:
        """Begin to measure tool, load or camera; see `Wizard.begin`."""
        self._check_allowed()
        self.wizard.begin(kind, settings)

    # ----------------------------------------------------------------------------------- gripper

    def open_gripper(self) -> None:
        """Begin to open the gripper; the outcome is a message."""
        self._grip(opens=True)

    def close_gripper(self) -> None:
        """Begin to close the gripper; the outcome is a message."""
        self._grip(opens=False)

    def _grip(self, *, opens: bool) -> None:
        self._check_allowed()
        gripper = self.gripper
        if gripper is None:
            raise CommandRejected(
                "the panel knows no gripper",
                parameter="gripper",
                hint='start it with --gripper "open=OUTPUT close=OUTPUT is_open=INPUT is_closed=INPUT"',
            )
        if not self._gripping.acquire(blocking=False):
            raise ModeConflict("the gripper moves", parameter="gripper", hint="wait until it has arrived")

        def move() -> None:
            try:
                gripper.open() if opens else gripper.close()
                holds = not opens and gripper.holds_something
                said = "is open" if opens else "holds something" if holds else "is closed on nothing"
                self._say(f"The gripper {said}")
            except HeptarmError as error:
                self.report(error)
            finally:
                self._gripping.release()

        self._say(f"The gripper {'opens' if opens else 'closes'}")
        threading.Thread(target=move, name="heptarm-panel-gripper", daemon=True).start()

    # ------------------------------------------------------------------------------------ points

    def teach(self, name: str = "", *, straight: bool = False) -> TaughtPoint:
        """Add the arm's position to the list of points.

        Args:
            name: empty: P1, P2 ...
            straight: approach it on a straight line.

        Returns:
            The new point.
        """
        self._check_allowed()
        state = self.arm.state
        tool = state.tool if state.groups.mode is not None else ""
        point = TaughtPoint(name.strip() or self.points.free_name(), state.q, state.pose, tool, straight)
        self.points.add(point)
        self._say(f"Taught {point.name}")
        return point

    def run(self, *names: str, speed: float = 0.1) -> None:
        """Move to taught points one after the other; returns at once.

        Args:
            names: of the points; none: all of them in order.
            speed: fraction of the full speed, (0, 1].

        Raises:
            CommandRejected: there is no such point, or the list is empty; NotInControl.
            ModeConflict: the arm moves.
        """
        self._check_allowed()
        within(speed, "speed", 0.0, 1.0, above=True)
        chosen = self._chosen(names)
        if self._jogger.is_moving:
            raise ModeConflict("the arm is being jogged", parameter="points", hint="release the button first")
        self._check_tool(chosen)
        self._visit(chosen, self.arm.start(self.points.motions(chosen), speed=speed, when="reject"))

    def _visit(self, names: tuple[str, ...], handle: MotionHandle) -> None:
        """Remember and report a motion to places of these names."""
        self._visiting, self._handle = names, handle
        handle.add_done_callback(self._on_done)
        self._say(f"Moving to {', '.join(names)}")

    def _chosen(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Names of points, none: all of them; refused if there are none."""
        chosen = names or self.points.names
        if not chosen:
            raise CommandRejected(
                "the list of points is empty", parameter="points", hint="teach a point first"
            )
        return chosen

    def _check_tool(self, names: tuple[str, ...]) -> None:
        """Refuse points that were taught with another tool."""
        tools = {list(self.points)[self.points.index(name)].tool for name in names}
        attached = self.arm.state.tool
        if tools - {attached}:
            raise CommandRejected(
                f"the points were taught with {' and '.join(sorted(tool or 'no tool' for tool in tools))}, "
                f"attached is {attached or 'no tool'}",
                parameter="points",
                hint="attach the tool with which they were taught",
            )

    def _on_done(self, handle: MotionHandle) -> None:
        error = handle.error
        if error is None:
            self._say(f"Arrived at {self._visiting[-1]}")
        elif not (
            isinstance(error, MotionError) and self._message is not None and self._message.what == "Stopped"
        ):
            self.report(error)

    def end_run(self) -> None:
        """End the motion to taught points, if one runs."""
        handle = self._handle
        if handle is not None and not handle.done:
            handle.cancel()

    # ------------------------------------------------------------------- signals, tools, recording

    def set_output(self, name: str, value: SignalValue) -> None:
        """Write an output."""
        self._check_allowed()
        self.arm.io[name] = value

    def attach_tool(self, name: str) -> None:
        """Attach a tool that the cabinet knows; empty: detach it. The arm has to be at rest."""
        self._check_allowed()
        if name:
            self.arm.attach_tool(name)
        else:
            self.arm.detach_tool()
        self._say(f"Attached: {name or 'no tool'}")

    def start_recording(self) -> Path:
        """Begin to record everything to a new file; returns its path.

        Raises:
            CommandRejected: it cannot be written. MissingExtra: the package mcap is not installed.
        """
        self._check_allowed()
        if self._recorder is not None:
            raise CommandRejected("a recording runs", parameter="recording", hint="stop it first")
        begun = time.strftime("panel-%Y%m%d-%H%M%S")
        names = (f"{begun}{f'-{number}' if number > 1 else ''}.mcap" for number in itertools.count(1))
        path = next(one for name in names if not (one := self._folder / name).exists())
        self._recorder = self.arm.record(path).start()
        self._say(f"Recording to {path}")
        return path

    def stop_recording(self) -> None:
        """End the recording, if one runs."""
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            recorder.close()
            self._say(f"Recorded to {recorder.path}")

    def _end_recording(self) -> None:
        try:
            self.stop_recording()
        except HeptarmError as error:
            self.report(error)

    def close(self) -> None:
        """End jogging and recording; the arm itself stays open."""
        self.wizard.close()
        self._jogger.close()
        self._end_recording()


def groups_for(offered: object) -> tuple[str, ...]:
    """The groups of a state that the panel subscribes to: all that a cabinet offers."""
    kind = type(offered)
    names = {group.name for group in kind if group & offered}  # type: ignore[attr-defined]
    return tuple(name for name in GROUP_NAMES if name.upper() in names)
