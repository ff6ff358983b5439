"""The verbs of an arm: what it does by itself, and what skills are built on.

A verb checks its arguments, adds the settings of the arm and of the enclosing blocks, and sends a request. What can be
written with these verbs alone is a function of `heptarm.skills`.
"""

from __future__ import annotations

import atexit
import contextlib
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import inf
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Literal, TypeAlias, TypeVar, overload
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from heptarm._library import Unavailable
from heptarm.arm.devices.camera import (
    OLDEST,
    CalledSource,
    CameraStream,
    DrawnSource,
    Mounting,
    PictureSource,
    check_states,
)
from heptarm.arm.devices.io import Io
from heptarm.arm.devices.operator import Operator
from heptarm.arm.devices.smartpad import Pad
from heptarm.arm.devices.tools import Tooling
from heptarm.arm.flange_check import flange_warning
from heptarm.arm.fri import settings as fri_settings
from heptarm.arm.fri.session import Fri
from heptarm.arm.link.connection import STATE_RATE, Connection, StopWatch
from heptarm.arm.link.state_stream import GROUPS, States
from heptarm.arm.motion import load_check, program_request
from heptarm.arm.motion.following import FollowedPath, FollowTerms, PathFollower
from heptarm.arm.motion.foresight import Foresight
from heptarm.arm.motion.handle import LONGEST_STREAM, STREAM_SIZE, BreakRule, MotionHandle, check_timeout
from heptarm.arm.motion.jog import JogLimits, TwistLimits, TwistServo, VelocityServo
from heptarm.arm.motion.load_check import LoadCheck
from heptarm.arm.motion.preview import ProgramPreview
from heptarm.arm.motion.program_request import ProgramTerms
from heptarm.arm.motion.recovery import RecoveryAttempts
from heptarm.arm.motion.rest import REST_TIMEOUT, RestDetector, settle
from heptarm.arm.motion.servo import (
    JointServo,
    LineServo,
    PoseServo,
    ServoKeywords,
    ServoRequest,
    StreamTerms,
    documented,
)
from heptarm.arm.translate.conditions import condition_message
from heptarm.errors import CommandRejected, HeptarmError, ShapeError, Timeout
from heptarm.planning.search import STATES, TIMEOUT, Goal, Keep
from heptarm.record.camera import CameraFeed, CameraSubject
from heptarm.record.episodes import EpisodeSet, EpisodeTerms, NumberSource, named_cameras
from heptarm.record.recorder import Recorder
from heptarm.values.camera import NO_DISTORTION, Camera
from heptarm.values.checks import array, callback, flag, instance, integer, shown, within, word
from heptarm.values.clearance import CollisionCheck, CollisionWorld
from heptarm.values.condition.collision import Collision, CollisionGuard
from heptarm.values.condition.condition import Condition, check_condition
from heptarm.values.condition.reaction import Reaction, check_reaction
from heptarm.values.files import path_of
from heptarm.values.frames import BASE, TOOL, check_name
from heptarm.values.mode.mode import MODES, Mode, check_mode
from heptarm.values.motion.motion import Motion
from heptarm.values.motion.planned_path import Path as FoundPath
from heptarm.values.pose import Pose
from heptarm.values.result import Recovery, Result
from heptarm.values.robot import Body, RobotModel
from heptarm.values.sealed import Sealed
from heptarm.values.shape import Shape
from heptarm.values.state import State, Wrench
from heptarm.values.text import lines, printable
from heptarm.values.tool import KnownTool, Tool, Workpiece
from heptarm.values.workspace import Workspace
from heptarm.wire import messages as wire

if TYPE_CHECKING:
    from typing_extensions import Unpack

_log = logging.getLogger("heptarm.arm")

#: States that a stream of all states keeps for a slow loop.
_STREAM_SIZE = 2000
#: Longest wait, after an error, for the arm to rest so that its tool can be changed [s].
_TOOL_PATIENCE = 5.0
#: `Arm.speed` of a real robot until a program or its saved target sets another.
REAL_SPEED = 0.25
_STOPS = {kind.name.lower(): kind for kind in wire.StopKind}
_Arm = TypeVar("_Arm", bound="ArmVerbs")
_Carrier = TypeVar("_Carrier")
OnCollision: TypeAlias = Callable[[Collision], None] | None
#: Guards of the blocks that `guarded` has begun, which FRI sessions obey, and what is called at a collision; at most
#: one for an arm, since two would contradict each other.
guards_in_force: WeakKeyDictionary[ArmVerbs, tuple[CollisionGuard, OnCollision]] = WeakKeyDictionary()


def _checked(check: CollisionCheck) -> CollisionCheck:
    """Refuse what cannot check a path."""
    if not callable(getattr(check, "first_on", None)):
        raise ShapeError(
            f"collision_check must have a method first_on, got {shown(check)}",
            parameter="collision_check",
            value=check,
            hint='for example heptarm.CollisionModel("iiwa14", scene="table")',
        )
    return check


class ArmVerbs(Sealed):
    """A connected arm without the skills; see `heptarm.arm.arm.Arm`."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._tooling = Tooling(connection)
        self._foresight = Foresight(connection, self._tooling)
        self._io = Io(connection)
        self._pad = Pad(connection)
        self._speed, self._is_speed_set = 1.0, False
        self._mode: Mode | None = None
        self._breaks: tuple[BreakRule, ...] = ()
        self._name = ""

    # ------------------------------------------------------------------------------- connection

    def open(self, *, control: bool) -> None:
        """Connect; `connect` has done this already. Raises as `connect` does."""
        atexit.register(self.close)
        link = self._connection
        link.open()
        if not self._is_speed_set and not self.is_virtual:
            self._speed = REAL_SPEED
        if control:
            link.take_control()
        if link.options.rate > 0:
            self._wait_for_first_state()

    def _wait_for_first_state(self) -> None:
        """Wait for a state, and for the velocities, which the cabinet knows from its second sample on."""
        link = self._connection
        sample = link.feed.after(0, link.options.timeout)
        if sample is None:
            raise Timeout(
                f"no state received within {link.options.timeout:g} s",
                hint="check the network and the load of the cabinet, or use connect(..., timeout=...)",
            )
        joints = link.build(sample).groups.joints
        if joints is not None and np.isnan(joints.dq).any():
            link.feed.after(sample.number, link.options.timeout)
        self._check_flange()

    def _check_flange(self) -> None:
        """Warn of a media flange that the robot model does not have."""
        newest = self._connection.newest()
        groups = None if newest is None else newest.groups
        if groups is None or groups.joints is None or groups.pose is None:
            return
        try:
            expected = self._tooling.reached(groups.joints.q, TOOL)
        except Unavailable:
            return  # without its compiled part heptarm moves the arm, and computes no kinematics
        if expected is not None and (
            text := flange_warning(self.robot, groups.joints, groups.pose, expected)
        ):
            _log.warning("%s", text)

    def reconnect(self) -> None:
        """Make a new connection after the old one was lost; a controller takes control again.

        Raises:
            ConnectFailed: the cabinet does not answer.
            NotInControl: another client has taken control meanwhile.
        """
        self._tooling.forget()
        self._connection.reopen()

    def take_control(self) -> None:
        """Take control of the robot.

        Raises:
            NotInControl: another client controls the robot; the text names it.
        """
        self._tooling.forget()
        self._connection.take_control()

    def release_control(self) -> None:
        """Give control back; a running motion is stopped."""
        self._connection.release_control()

    def close(self) -> None:
        """Leave the arm at rest and disconnect; a private simulator ends. Calling it again has no effect.

        A controller stops the running motion and waits until the arm rests; an observer only disconnects.
        """
        if self.in_control and not self._connection.closed.is_set():
            self._connection.check_may_wait("arm.close()")
        if not self._connection.mark_closed():
            return
        try:
            if self.in_control:
                self._come_to_rest()
        finally:
            atexit.unregister(self.close)
            self._connection.close()

    def _come_to_rest(self) -> None:
        try:
            self.subscribe(groups=("joints", "motion", "safety"))
            self.stop()
            self._connection.wait_for(RestDetector(self._connection), REST_TIMEOUT)
            self._connection.left_at_rest = True
            self.release_control()
        except HeptarmError as error:
            _log.warning("closing: %s", error)

    def __enter__(self: _Arm) -> _Arm:
        """The arm itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close it."""
        self.close()

    def __repr__(self) -> str:
        """Short form."""
        link = self._connection
        state = "closed" if link.closed.is_set() else "connected" if link.is_connected else "lost"
        name = f"{self._name}: " if self._name else ""
        return f"<Arm {name}{link.title}, {state}, {'in control' if link.in_control else 'observing'}>"

    def __str__(self) -> str:
        """A few lines: the robot, its connection, and the ceiling of its speed."""
        link = self._connection
        if link.closed.is_set() or not link.is_connected:
            return repr(self)
        other = f"observing; {self.controller or 'nobody'} is in control"
        begun = "" if self._is_speed_set or self.is_virtual else ", as every real robot begins"
        rows = {
            "name": self._name,
            "cabinet": f"{self.cabinet}, {'simulated' if self.is_virtual else 'real'}",
            "robot": self.robot.name,
            "control": "in control" if link.in_control else other,
            "speed": f"at most {self._speed:.0%} of each axis' maximum{begun}: arm.speed",
        }
        return lines(self.robot.title, rows)

    @property
    def name(self) -> str:
        """Its name in `connect_all`, or that of its saved target, with which errors of several arms begin; "": none.

        Raises:
            ShapeError: not a text (when it is set).
        """
        return self._name

    @name.setter
    def name(self, value: str) -> None:
        self._name = printable(instance(value, str, "name"))

    @property
    def connection(self) -> Connection:
        """The connection beneath this arm: messages, clock and events. Tools and tests use it, programs need not."""
        return self._connection

    @property
    def connected(self) -> bool:
        """Whether it is connected to the cabinet."""
        return self._connection.is_connected

    @property
    def in_control(self) -> bool:
        """Whether it is connected and this client controls the robot."""
        return self._connection.in_control and self._connection.is_connected

    @property
    def controller(self) -> str:
        """Name of the client that controls the robot; empty: none."""
        return self._connection.controller

    # ---------------------------------------------------------------------- robot and components

    @property
    def robot(self) -> RobotModel:
        """The connected robot and its limits."""
        return self._connection.robot

    @property
    def capabilities(self) -> tuple[str, ...]:
        """What this cabinet supports: "ptp", "lin", ..."""
        return self._connection.welcome.capabilities

    @property
    def is_virtual(self) -> bool:
        """Whether the robot is simulated."""
        return self._connection.welcome.virtual

    @property
    def software(self) -> str:
        """Version of the cabinet application."""
        return self._connection.welcome.software

    @property
    def cabinet(self) -> str:
        """Name of the cabinet."""
        return self._connection.welcome.cabinet

    @property
    def real_time_factor(self) -> float:
        """Seconds of the robot's clock per second of this computer's: N for a simulator N times as fast."""
        return self._connection.real_time_factor

    @property
    def operator(self) -> Operator:
        """The operator beside the robot, played by this program; a private simulator only.

        Raises:
            CommandRejected: the target is not a private simulator.
        """
        if self._connection.cabinet is None:
            raise CommandRejected(
                "arm.operator is available only on a simulator that this program started",
                hint='use connect("sim://iiwa14"), or type the commands into the terminal of `heptarm sim`',
            )
        return Operator(self._connection.cabinet)

    @property
    def io(self) -> Io:
        """The cabinet's signals: those of the media flange and of IO groups."""
        return self._io

    @property
    def pad(self) -> Pad:
        """The smartPAD: messages, user keys, process data."""
        return self._pad

    # ------------------------------------------------------------------------------------ states

    @property
    def state(self) -> State:
        """The newest pushed state; reading it sends no request to the cabinet.

        Raises:
            StaleState: it is too old to act on; the text has its age.
            ConnectionLost: the connection has ended.
        """
        return self._connection.fresh()

    @property
    def state_rate(self) -> float:
        """Pushed states per second [Hz]; 0: none. See `subscribe`."""
        return self._connection.options.rate

    @property
    def groups(self) -> tuple[str, ...]:
        """Groups that pushed states contain; see `subscribe`."""
        return self._connection.options.groups

    def history(self) -> tuple[State, ...]:
        """The last states, up to 50, oldest first."""
        return self._connection.history()

    def states(
        self,
        *,
        rate: float | None = None,
        duration: float | None = None,
        until: MotionHandle | None = None,
        size: int | None = None,
    ) -> States:
        """Iterate over states, each at most once.

        Args:
            rate: at most this many per second [Hz], the newest each time; None: every pushed state, in order.
            duration: end after the states of this time [s]; None: never.
            until: every state of this motion to its end, as `MotionHandle.states`; without a rate and a duration.
            size: without a rate, number of states kept for a slow loop, 2000, and 100,000 of a motion;
                `States.lost` counts those dropped.

        Raises:
            LimitError: a rate or duration that is not positive.
            CommandRejected: `until` beside a rate or a duration.
        """
        if until is not None:
            instance(until, MotionHandle, "until")
            if rate is not None or duration is not None:
                raise CommandRejected(
                    "until must be given without rate and duration: it returns every state of the motion",
                    parameter="until",
                    hint="leave them out, or skip states in the loop",
                )
            return until.states(size=STREAM_SIZE if size is None else size)
        return self._connection.stream(
            rate=None if rate is None else within(rate, "rate", 0.0, 1e4, above=True, unit="Hz"),
            duration=None if duration is None else within(duration, "duration", 0.0, 1e9, unit="s"),
            size=integer(_STREAM_SIZE if size is None else size, "size", 1, LONGEST_STREAM),
        )

    def record(
        self,
        path: str | Path,
        *,
        rate: float | None = None,
        camera: Camera | None = None,
        overwrite: bool = False,
    ) -> Recorder:
        """A recording of everything that happens while the `with` block runs; `heptarm.load` reads it.

        Pushed states, FRI cycles at their own rate, requests, events and errors go to the file in a thread of its own.
        The file is complete to its last half second even if this program is killed.

        Args:
            path: the file, MCAP.
            rate: have at least so many states pushed per second meanwhile [Hz]; None: as many as are.
            camera: a simulated camera whose pictures are in the file, too: of a model of the arm, not of the robot. It
                needs the group "joints". A process of its own draws them, so that they never hold up the states; when
                it is too slow it drops pictures, which `Recorder.pictures_dropped` counts. None: no pictures.
            overwrite: replace a file that exists.

        Raises:
            LimitError: a rate outside its range.
            CommandRejected: the file exists. Or it cannot be written, or this machine cannot draw (when the block
                begins).
            MissingExtra: the package mcap is not installed, or those of a camera (when the block begins).
        """
        cameras = {} if camera is None else {"": camera_feed(self, camera)}
        return Recorder(
            {"": self._connection}, path_of(path), rate=rate, cameras=cameras, overwrite=overwrite
        )

    def episodes(
        self,
        folder: str | Path,
        *,
        rate: float = 20.0,
        cameras: Mapping[str, Camera | PictureSource] | Sequence[Camera | PictureSource] = (),
        streams: Mapping[str, NumberSource | None] | None = None,
        task: str = "",
        reset: Callable[[], object] | None = None,
    ) -> EpisodeSet:
        """Episodes of a task for learning: each a recording of its own, with a label, pictures and streams.

        `heptarm.load_episodes` reads them in equal steps; `heptarm convert FOLDER OUT --to lerobot` makes a data set
        for LeRobot.

        Args:
            folder: of the files; is made if it is not there, and gets more episodes if it has some.
            rate: steps per second of the robot's clock, up to 500 [Hz].
            cameras: simulated ones or functions, as `camera` takes them, by their names.
            streams: functions that return numbers of a sensor, or None where there is nothing new, by their names; each
                is called twice a step in a thread of its own. None instead of a function: the program pushes
                the numbers, `EpisodeSet.push`.
            task: what is done, in words.
            reset: called before each episode, to bring arm and scene to the start. After an error of it there is no
                episode.

        Raises:
            ShapeError: no such cameras, streams or function.
            LimitError: a rate outside its range.
            CommandRejected: a name that is taken, or has other characters than a to z, 0 to 9 and _.
        """
        check_states(self.state_rate, self.groups)
        given = named_cameras(cameras)
        for name, source in given.items():
            if not isinstance(source, Camera) and not callable(source):
                raise ShapeError(
                    f"cameras[{name!r}] must be a Camera or a function that returns a picture, got {shown(source)}",
                    parameter="cameras",
                )
        terms = EpisodeTerms(
            rate=rate,
            task=task,
            cameras={name: partial(self.camera, source) for name, source in given.items()},
            streams=dict(instance({} if streams is None else streams, Mapping, "streams")),
            reset=reset,
            factor=self.real_time_factor,
        )
        return EpisodeSet(self._connection, path_of(folder, "folder"), terms)

    def camera(
        self,
        source: Camera | PictureSource,
        *,
        depth: bool = False,
        labels: bool = False,
        latency: float = 0.0,
        pose: Pose | None = None,
        frame: str = "flange",
        matrix: npt.ArrayLike | None = None,
        distortion: npt.ArrayLike = NO_DISTORTION,
    ) -> CameraStream:
        """Live pictures, each with the arm at the moment when it was taken.

        A simulated camera draws the arm at its pushed states, in a process of its own. Your own camera is any function
        that waits for the next picture and returns it: `cv2.VideoCapture(0).read`, or one that reads a ROS topic.

        Args:
            source: a simulated camera; or a function that returns a picture, bytes of shape (height, width, 3) or
                (height, width), in red, green and blue; or True and the picture in OpenCV's blue, green and red.
            depth: have distances, too; of a simulated camera.
            labels: have the bodies that each pixel shows, too; of a simulated camera.
            latency: age of a picture when the program gets it [s]: a simulated camera holds its pictures back for so
                long, and a picture of your function belongs to the state so long before it returned.
            pose: pose of your own camera in `frame`, as `heptarm.calibration.hand_eye` measures it; None: not known.
            frame: frame of your own camera: "flange", which moves it with the arm, or "base".
            matrix: intrinsic matrix of your own camera, shape (3, 3) [pixels]; None: not known.
            distortion: of your own camera's lens, k1 k2 p1 p2 k3 as in OpenCV, shape (5,).

        Returns:
            The pictures: `read()` waits for the next one; close it, or use it as a `with` block.

        Raises:
            ShapeError: neither a camera nor a function.
            CommandRejected: an argument of the other kind of camera; there is no such scene, or this machine cannot
                draw.
            StaleState: the subscribed groups lack "joints".
            MissingExtra: MuJoCo or Pillow is not installed.
        """
        check_states(self.state_rate, self.groups)
        late = within(latency, "latency", 0.0, OLDEST, unit="s")
        layers = ["pixels"]
        layers += ["depth"] if flag(depth, "depth") else []
        layers += ["labels"] if flag(labels, "labels") else []
        own = Mounting.of(self.robot, frame=frame, pose=pose, matrix=matrix, distortion=distortion)
        link = self._connection
        link.check_open()
        if isinstance(source, Camera):
            own.refuse_for_simulated()
            feed = camera_feed(self, source, layers=layers)
            drawn = DrawnSource(feed, layers, late, link.real_time_factor)
            place = Mounting(self.robot, source.frame, source.pose, source.matrix, source.distortion)
            return CameraStream(link, drawn, place)
        called = CalledSource(source, layers, link.clock, late)
        return CameraStream(link, called, own)

    def wait_until(self, condition: Callable[[State], object], *, timeout: float = 30.0) -> State:
        """Wait until a condition holds for a pushed state; checked by this program, not by the cabinet.

        Args:
            condition: called with each state.
            timeout: longest wait [s].

        Returns:
            The state for which it held.

        Raises:
            Timeout: it did not hold in time; the text names what stops the arm, if anything does.
            SafetyStop: a safety stop began meanwhile, and a second later the condition still did not hold.
            ConnectionLost: the connection has ended.
        """
        return self._wait_for(callback(condition, "condition"), timeout, StopWatch())

    def subscribe(self, *, rate: float = STATE_RATE, groups: Sequence[str] = GROUPS) -> None:
        """Choose the pushed states; a new choice replaces the old one.

        Args:
            rate: states per second [Hz]; 0: none.
            groups: "joints", "torques", "pose", "wrench", "motion", "safety", "io", "mode".

        Raises:
            CommandRejected: a group that the cabinet does not offer.
            LimitError: a rate above the cabinet's maximum.
        """
        self._connection.subscribe(rate, groups)

    def _wait_for(self, condition: Callable[[State], object], timeout: float, watch: StopWatch) -> State:
        seconds = check_timeout(timeout)
        with self._connection.stopping_on_interrupt():
            return self._connection.wait_for(condition, seconds, watch=watch)

    # ---------------------------------------------------------------------------------- motion

    @property
    def speed(self) -> float:
        """Ceiling of the speed of all motions sent, a fraction of each axis' maximum in (0, 1].

        A motion's own speed can only be lower. It begins at that of the saved target, otherwise at 0.25 on a real robot
        and at 1 on a simulator.
        """
        return self._speed

    @speed.setter
    def speed(self, value: float) -> None:
        self._speed, self._is_speed_set = within(value, "speed", 0.0, 1.0, above=True), True

    @property
    def collision_check(self) -> CollisionCheck | None:
        """Checks the path of each motion before it is sent, such as a `heptarm.CollisionModel`; None: nothing does.

        `move` and `start` then refuse a path on which bodies would touch, and one that cannot be planned. Servo
        motions, FRI and hand guiding have no path that could be checked. It is no safety function: it knows only its
        own model of the scene, and the shapes of the attached tool and workpiece. It plans as `plan` does.
        """
        return self._foresight.check

    @collision_check.setter
    def collision_check(self, value: CollisionCheck | None) -> None:
        self._foresight.check = None if value is None else _checked(value)

    def plan(
        self,
        motion: Motion | Sequence[Motion],
        *,
        mode: Mode | None = None,
        speed: float | None = None,
        until: Condition | None = None,
        then: Reaction | None = None,
        start: npt.ArrayLike | None = None,
        step: float = 0.01,
        collision_check: CollisionCheck | None = None,
    ) -> ProgramPreview:
        """Look ahead: how a motion, or several as one batch, would go. Nothing moves, and nothing is sent.

        It is planned as the virtual cabinet plans it, also beside a robot, whose own planner may take a little longer
        or shorter. Needs `pip install 'heptarm[sim]'`, but no simulator.

        Mode, break condition and reaction are checked as `move` checks them. The preview is of the commanded path to
        its end: a compliant arm may be beside it, and a condition may end it earlier.

        Args:
            motion: one motion or several, without hand guiding and endless holds.
            mode: see `move`.
            speed: ceiling, (0, 1]; the lower one of this and `arm.speed` applies, as in `move`.
            until: see `move`.
            then: see `move`.
            start: joint positions at which it begins, shape (7,) [rad]; None: where the arm rests.
            step: time between two samples of the result [s], 0.001 to 1.
            collision_check: checks the path for collisions, such as a `heptarm.CollisionModel`; None:
                `arm.collision_check`. It is no safety function.

        Returns:
            Duration, paths over time, where limits come closest, and collisions.

        Raises:
            LimitError: a joint would leave its limits.
            Unreachable: a pose is out of reach.
            OutsideWorkspace: it leaves `workspace`.
            CommandRejected: the path passes a singularity, or names an unknown frame.
            ModeConflict: a motion runs, and `start` is not given.
            StaleState: the newest state is too old, or lacks the joints.
            MissingExtra: the planner is not installed.
        """
        motions = program_request.listed(motion)
        return self._foresight.preview(
            motions,
            self._terms(mode=mode, speed=speed, until=until, then=then),
            start=None if start is None else array(start, 7, "start"),
            step=within(step, "step", 0.001, 1.0, unit="s"),
            check=None if collision_check is None else _checked(collision_check),
        )

    def find_path(
        self,
        goal: Goal,
        *,
        avoid: CollisionWorld | None = None,
        keep: Keep | None = None,
        speed: float | None = None,
        tcp_speed: float | None = None,
        timeout: float = TIMEOUT,
        states: int = STATES,
        improve: int = 0,
        seed: int = 0,
        stop: Callable[[], bool] | None = None,
        progress: Callable[[int, float], object] | None = None,
    ) -> FoundPath:
        """Find a path around bodies, from where the arm rests, with what is attached to it. Nothing moves.

        The path is a motion: `move(path)` lets the cabinet follow it as a joint spline, also in a program with others.
        It is checked again before it is sent, against `avoid` as it is then, and so slow that the torques of the joints
        can move the load of the attached tool. Needs `pip install 'heptarm[sim]'`.

        It is an aid for programs, no safety function: it knows only the bodies of the model.

        Args:
            goal: joint positions, shape (7,) [rad]; a pose of the tool frame in the base, with any elbow; a `Region`;
                or several of these, of which the path reaches one.
            avoid: model of the bodies, such as a `heptarm.CollisionModel`, whose margin is kept; None:
                `arm.collision_check`.
            keep: constraint along the path, such as `Upright("z", within=0.1)`, or several of them; None: none.
            speed: ceiling for which its duration is computed, (0, 1]; the lower one of this and `arm.speed`.
            tcp_speed: the origin of the tool frame is not to be faster on the path [m/s], up to 10; None: any speed.
            timeout: longest search [s].
            states: most joint positions that the search reaches.
            improve: joint positions that it reaches after that in search of faster paths.
            seed: of its random numbers: the same one finds the same path in the same world.
            stop: called again and again; the search ends when it returns true.
            progress: called again and again with the joint positions reached so far, and how near start and goal came
                [rad].

        Raises:
            NoPath: none was found; the text has the bodies in the way, or how near it came.
            ModeConflict: a motion runs.
            StaleState: the newest state is too old, or lacks the joints.
            CommandRejected: the model is of another robot; LimitError and ShapeError are such errors.
            MissingExtra: the planner is not installed.
        """
        terms = self._terms(mode=None, speed=speed, until=None, then=None)
        return self._foresight.find_path(
            goal,
            avoid=avoid,
            keep=keep,
            speed=terms.speed,
            tcp_speed=tcp_speed,
            timeout=timeout,
            states=states,
            improve=improve,
            seed=seed,
            stop=stop,
            progress=progress,
        )

    def follow(
        self,
        path: FoundPath,
        *,
        watch: CollisionWorld | None = None,
        mode: Mode | None = None,
        speed: float | None = None,
        until: Condition | None = None,
        then: Reaction | None = None,
        timeout: float | None = None,
        stop: Callable[[], bool] | None = None,
        on_progress: Callable[[float], object] | None = None,
    ) -> FollowedPath:
        """Move along a path through a world that changes, and go around what comes into the way.

        Another thread adds, places and removes bodies of `watch`. At each change the rest of the path is checked. Where
        bodies would touch, the arm brakes on its path at once, holds its position, and goes on along a new path: to
        the goal for which the first one was found, under the same constraint, with the same seed. What comes nearer
        than the arm needs to brake, it cannot avoid. It is no safety function.

        Args:
            path: found by `find_path`, from where the arm rests.
            watch: model of the bodies, such as a `heptarm.CollisionModel`; None: that of the path.
            mode: see `move`.
            speed: ceiling, (0, 1].
            until: break condition, see `move`; it ends the whole.
            then: see `move`.
            timeout: longest time for all of it [s]; None: any.
            stop: called again and again; the arm brakes on its path and stays when it returns true.
            on_progress: called again and again with the completed fraction of the present path, [0, 1].

        Returns:
            How it ended, and the new paths.

        Raises:
            NoPath: there is no way any more, and the arm has braked; `reason` as in `find_path`.
            MotionAborted: ended early, also while the arm held its position.
            ModeConflict: another motion runs; or as in `move`.
            Timeout: not ended in time; the arm was stopped.
            CommandRejected: refused before anything moved, as in `move` and `find_path`.
        """
        instance(path, FoundPath, "path", hint="find one: arm.find_path(goal, avoid=world)")
        world = path.world if watch is None else watch
        if not isinstance(world, CollisionWorld):
            raise ShapeError(
                f"watch must be a model of bodies, got {shown(world)}",
                parameter="watch",
                value=world,
                hint='for example heptarm.CollisionModel("iiwa14", scene="table")',
            )
        limit = inf if timeout is None else check_timeout(timeout)
        terms = self._terms(mode=mode, speed=speed, until=until, then=then)
        link = self._connection
        link.check_may_wait("arm.follow()")
        link.check_no_block("arm.follow()")
        search = partial(
            self._foresight.find_path,
            path.goal,
            avoid=world,
            keep=path.keep or None,
            speed=terms.speed,
            tcp_speed=path.tcp_speed,
            timeout=TIMEOUT,
            states=STATES,
            improve=0,
            seed=path.stats.seed,
            progress=None,
        )
        follow_terms = FollowTerms(
            world=world,
            search=search,
            send=lambda motion, *, when: self._send((motion,), replace(terms, when=when)),
            timeout=limit,
            stop=(lambda: False) if stop is None else callback(stop, "stop"),
            on_progress=(lambda _: None) if on_progress is None else callback(on_progress, "on_progress"),
        )
        with link.stopping_on_interrupt():
            return PathFollower(link, self._tooling, follow_terms).follow(replace(path, world=world))

    def loaded(self, model: _Carrier) -> _Carrier:
        """A model of bodies with the shapes of what is attached to this arm, as its own checks and searches use it.

        Args:
            model: such as a `heptarm.CollisionModel`; it stays as it is.

        Raises:
            ShapeError: not a model that carries tools.
        """
        if not isinstance(model, CollisionWorld):
            raise ShapeError(
                f"model must be a model of bodies that carries tools, got {shown(model)}",
                parameter="model",
                value=model,
                hint='for example heptarm.CollisionModel("iiwa14", scene="table")',
            )
        return self._tooling.loaded(model)

    @property
    def workspace(self) -> Workspace | None:
        """Where the tool and the joints may be, for all commands of this arm object; None: anywhere.

        `move` and `start` refuse a motion that leaves it, before anything is sent; they plan it as `plan` does, which
        needs `pip install 'heptarm[sim]'`. Hand guiding has no path that could be checked, nor what follows it. Servo
        motions, velocities too, clamp their targets to it or refuse them. FRI sessions have limits of their own.

        It is no safety function: only this program obeys it.

        Raises:
            ShapeError: not a Workspace (when it is set).
            CommandRejected: its frame is neither "base" nor a taught frame (likewise).
        """
        return self._foresight.workspace

    @workspace.setter
    def workspace(self, value: Workspace | None) -> None:
        before = self._foresight.workspace
        self._foresight.workspace = None if value is None else instance(value, Workspace, "workspace")
        try:
            self._foresight.boundary()
        except CommandRejected:
            self._foresight.workspace = before
            raise

    def move(
        self,
        motion: Motion | Sequence[Motion],
        *,
        mode: Mode | None = None,
        speed: float | None = None,
        until: Condition | None = None,
        then: Reaction | None = None,
        timeout: float | None = None,
    ) -> Result:
        """Carry out a motion, or several as one batch, and wait until it has ended.

        Args:
            motion: one motion or several.
            mode: control mode of all of them; None: that of `using`, otherwise position.
            speed: ceiling for this call, (0, 1]; the lower one of this and `arm.speed` applies.
            until: break condition, as in `until=force > 10`: the motion ends when it holds, and the motions after it
                do not begin. See heptarm.when; the result names the part that fired, where, and the forces.
            then: what the arm does when `until` has ended the motion: "stay" where it has braked, "relax", or
                `Retreat(distance)`; done by the cabinet. None: "stay", or that of the enclosing block.
            timeout: longest wait [s]; None: three times the longest plausible duration plus 15 s.

        Returns:
            How it ended. Its state shows the arm at rest, as `arm.state` does, unless another motion waits or the arm
            did not settle within 0.5 s, as when it is pushed in impedance control.

        Raises:
            CommandRejected: refused before anything moved; LimitError and others name the value and the range.
            CollisionForeseen: `collision_check` found bodies that would touch.
            OutsideWorkspace: a motion leaves `workspace`.
            MotionAborted: ended early; carries cause, state and history.
            ConnectionLost: the connection was lost; the cabinet stops the arm.
            Timeout: not ended in time; the arm was stopped.
            ModeConflict: this thread is in the block of a servo motion or an FRI session.
            LocalProtocolError: called from a callback.
        """
        motions = program_request.listed(motion)
        if timeout is not None:
            check_timeout(timeout)
        self._connection.check_may_wait("arm.move()")
        self._connection.check_no_block("arm.move()")
        if timeout is None and program_request.is_endless(motions, self._connection.robot):
            raise ShapeError(
                "this program ends only when it is cancelled, so that move() would never return",
                parameter="timeout",
                hint="give a timeout, a hold with a duration, or use arm.start()",
            )
        with self._connection.stopping_on_interrupt():
            handle = self._send(motions, self._terms(mode=mode, speed=speed, until=until, then=then))
            try:
                result = handle.wait(timeout=timeout)
            except Timeout:
                handle.cancel()
                raise
            return settle(self._connection, handle.id, result)

    def start(
        self,
        motion: Motion | Sequence[Motion],
        *,
        mode: Mode | None = None,
        speed: float | None = None,
        until: Condition | None = None,
        then: Reaction | None = None,
        when: Literal["queue", "replace", "reject"] = "queue",
    ) -> MotionHandle:
        """Begin a motion, or several as one batch, and return at once.

        Args:
            motion: one motion or several.
            mode: control mode of all of them; None: that of `using`, otherwise position.
            speed: ceiling for this call, (0, 1].
            until: break condition; see `move`.
            then: reaction to it; see `move`.
            when: while another motion runs: "queue" behind it, "replace" it, or "reject" this one.

        Raises:
            CommandRejected: refused; ModeConflict if `when` is "reject" and a motion runs.
            ConnectionLost: the connection has ended.
        """
        with self._connection.stopping_on_interrupt():
            motions = program_request.listed(motion)
            return self._send(motions, self._terms(mode=mode, speed=speed, until=until, then=then, when=when))

    @contextlib.contextmanager
    def using(self, mode: Mode) -> Iterator[None]:
        """A block whose motions and servo motions have a control mode unless they name another.

        Raises:
            ShapeError: not a control mode.
        """
        instance(mode, MODES, "mode", hint="make one with heptarm.modes, for example JointImpedance(300.0)")
        outer, self._mode = self._mode, mode
        try:
            yield
        finally:
            self._mode = outer

    @contextlib.contextmanager
    def breaking_on(
        self,
        condition: Condition,
        *,
        error: Callable[[Result], HeptarmError] | None = None,
        then: Reaction = "stay",
    ) -> Iterator[None]:
        """A block whose motions and servo motions also end when a condition holds.

        Args:
            condition: break condition, in addition to `until` of each motion; see heptarm.when.
            error: called with the result of a motion that it ended; returns the error that `move` and `wait` raise.
                Called from the link's thread, so it must not block. None: the motion ends with a result.
            then: reaction of motions in the block that name none; see `move`. Servo motions have none.

        Raises:
            ShapeError: not a condition, or not a reaction.
        """
        if error is not None:
            callback(error, "error")
        rule = BreakRule(check_condition(condition, "condition"), error, check_reaction(then))
        self._breaks = (*self._breaks, rule)
        try:
            yield
        finally:
            self._breaks = tuple(other for other in self._breaks if other is not rule)

    def _terms(
        self,
        *,
        mode: Mode | None,
        speed: float | None,
        until: Condition | None,
        then: Reaction | None,
        when: str = "queue",
    ) -> ProgramTerms:
        """The terms of a call: its own, with those of the arm and of the enclosing blocks."""
        breaks = self._breaks
        terms = ProgramTerms(
            speed=self._speed if speed is None else speed,
            mode=self._mode if mode is None else mode,
            until=self._until(until, breaks),
            then=self._then(then, until, breaks),
            when=when,
            breaks=breaks,
        )
        return replace(terms, speed=min(terms.speed, self._speed))

    def _until(self, until: Condition | None, breaks: tuple[BreakRule, ...]) -> Condition | None:
        """A break condition together with those of the enclosing blocks."""
        if until is not None:
            check_condition(until)
        for rule in breaks:
            until = rule.condition if until is None else until | rule.condition
        return until

    def _then(
        self, then: Reaction | None, until: Condition | None, breaks: tuple[BreakRule, ...]
    ) -> Reaction:
        """The reaction of a motion: its own, or that of the innermost block."""
        if then is None:
            return breaks[-1].then if breaks else "stay"
        if until is None and not breaks:
            raise ShapeError(
                "then is the reaction to a break condition, but the motion has none",
                parameter="then",
                value=then,
                hint="give until, for example until=force > 10",
            )
        return check_reaction(then)

    def _send(self, motions: tuple[Motion, ...], terms: ProgramTerms) -> MotionHandle:
        made = program_request.checked(self._connection, self._tooling, motions, terms)
        self._foresight.examine(made)
        load_check.check_before(self.robot, terms.mode, self._connection.newest())
        return program_request.send(self._connection, made)

    @overload
    def servo(self, kind: Literal["joint"] = "joint", **settings: Unpack[ServoKeywords]) -> JointServo: ...
    @overload
    def servo(self, kind: Literal["pose", "lin"], **settings: Unpack[ServoKeywords]) -> PoseServo: ...
    @overload
    def servo(self, kind: Literal["velocity"], **settings: Unpack[ServoKeywords]) -> VelocityServo: ...
    @overload
    def servo(self, kind: Literal["twist"], **settings: Unpack[ServoKeywords]) -> TwistServo: ...
    @documented
    def servo(
        self,
        kind: Literal["joint", "pose", "lin", "velocity", "twist"] = "joint",
        **settings: Unpack[ServoKeywords],
    ) -> JointServo | PoseServo | VelocityServo | TwistServo:
        """A stream of targets, or of velocities, that the arm follows; it begins with the `with` block.

        Args:
            kind: what the targets are: "joint" positions; "pose" of the motion frame, reached by the joints; "lin":
                the same, reached on straight lines; or velocities: "velocity" of the joints, or a "twist" of the
                motion frame. Velocities ramp to zero when none is set for `timeout`.
            **settings: as follows.

        Raises:
            LimitError: a value outside its range.
            CommandRejected: a setting that this kind of servo motion does not obey.
            ModeConflict: another motion runs (when the block begins).
        """
        breaks = self._breaks
        settings["mode"] = self._mode if settings.get("mode") is None else settings["mode"]
        check_mode(settings["mode"])
        load_check.check_before(self.robot, settings["mode"], self._connection.newest())
        request = ServoRequest(kind, **settings)
        message = request.message(self._speed)
        self._tooling.check_motion_frame(request.moving, "moving")
        self._tooling.check_mode(request.mode)
        ends, parts = condition_message(self._until(request.until, breaks), self._connection.signals)
        self._tooling.check_until(parts)
        terms = StreamTerms(
            replace(message, until=ends),
            request=request,
            ceiling=self._speed,
            period=request.period,
            watchdog=request.watchdog_time,
            boundary=self._foresight.boundary(),
            clear=None if request.keep_clear_of is None else self._tooling.loaded(request.keep_clear_of),
            until=parts,
            breaks=breaks,
        )
        if kind == "joint":
            return JointServo(self._connection, terms)
        moving = self._tooling.on_flange(request.moving)
        elbow = request.elbow_task(self._connection.robot)
        if kind == "lin":
            return LineServo(self._connection, terms, moving=moving, elbow=elbow)
        if kind == "pose":
            return PoseServo(self._connection, terms, moving=moving, elbow=elbow)
        limits = JogLimits(*request.joint_fractions(self._speed), request.silence)
        if kind == "velocity":
            return VelocityServo(self._connection, terms, limits)
        return TwistServo(
            self._connection,
            terms,
            limits,
            twist=TwistLimits(*request.line_limits()),
            moving=moving,
            elbow=elbow,
            axes=self._tooling.axes(TOOL if request.frame is None else request.frame),
        )

    def fri(
        self,
        kind: Literal["position", "torque", "wrench", "pose", "monitor"] = "position",
        **settings: Unpack[fri_settings.FriKeywords],
    ) -> Fri:
        """An FRI session in a process of its own; it begins with the `with` block.

        Args:
            kind: the quantity commanded on top of a hold: joint "position", "torque" (in joint impedance), "wrench"
                (in Cartesian impedance), "pose" (Sunrise 2.x); or "monitor", which runs beside other motions.
            **settings: as follows.
            period_ms: time between two messages, 1 to 100 [ms]; 5, and 1 for a monitor.
            multiplier: answer every n-th message; 1.
            mode: control mode of the hold; None: that of `using`, otherwise position, and for a ready law that commands
                torques `JointImpedance(stiffness=0.0)`.
            law: `law(state, out, params)` or `law(state, out, params, memory)`, called in the loop's process in
                every cycle; a law of `heptarm.law`, `heptarm.law_from` or `heptarm.laws` runs there without Python.
                None: `Fri.command`.
            params: numbers, arrays and poses by name for the law, which can change while it runs.
            memory: what the law keeps from call to call, numbers and arrays by name with their initial values.
            collision: bands of the external torques, as `collision_guard` makes them: the loop watches them in every
                message, and the arm brakes at once. None: those of the `guarded` block, if there is one.
            policy: what is sent while commands are missing, `heptarm.fri.Policy`; by default the arm brakes.
            limits: limits of the guard, `heptarm.fri.Limits`; those of the robot, slightly reduced.
            pose_limits: limits of commanded poses, `heptarm.fri.PoseLimits`; 0.25 m/s and 1 rad/s.
            io: up to ten names of signals, as in `arm.io`, that the session transmits: `state.io`, `Fri.output`.
            version: FRI release of the cabinet such as "1.15"; None: detected from the first message.
            host: address at which the cabinet reaches this machine; empty: that of this connection.
            port: own UDP port; 0: any free one; None: the first free one of FRI's.
            realtime: request real-time priority and locked memory. cpu: processor of the loop; None: any.
            busy_poll: how long before a message is due the loop polls for it instead of sleeping, see
                `heptarm.fri.Client` [s]; 0: never.
            history: messages that are kept. timeout: longest time until the session is open [s].

        Raises:
            CommandRejected: this cabinet does not support the session; ModeConflict: not in this control mode.
            LimitError: a value outside its range.
        """
        if settings.get("mode") is None:
            settings["mode"] = None if word(kind, "kind", fri_settings.KINDS) == "monitor" else self._mode
        check_mode(settings["mode"])
        load_check.check_before(self.robot, settings["mode"], self._connection.newest())
        self._tooling.check_mode(settings["mode"])
        rule = guards_in_force.get(self) if settings.get("collision") is None else None
        if rule is not None:
            settings["collision"] = rule[0]
        settings.setdefault("load", self._tooling.load)
        request = fri_settings.request(self._connection, kind, **settings)
        return Fri(self._connection, request, on_collision=None if rule is None else rule[1])

    # -------------------------------------------------------------------------- stop and recover

    def stop(self, kind: Literal["path", "fast", "after_motion"] = "path") -> None:
        """Stop the running motion and drop waiting ones; any client may, at any time, from any thread.

        It returns when the cabinet has accepted the stop; `wait_for_rest` waits until the arm rests. If the connection
        was lost, the stop goes through a new one.

        Args:
            kind: "path": brake on the path; "fast": brake every axis as hard as possible, off the path (a cabinet has
                only one kind of braking, so there it is the same); "after_motion": finish the running motion and drop
                the waiting ones.

        Raises:
            ConnectionLost: the cabinet cannot be reached.
        """
        self._connection.stop(_STOPS[word(kind, "kind", _STOPS)])

    def recover(self, *, timeout: float = 0.0) -> Recovery:
        """Make the robot ready again, as far as software may, and list the steps left to a person.

        It makes a new connection if the old one was lost, takes control if this client has none, acknowledges errors
        whose cause is gone, and ends a pause: a waiting motion continues along its path. It releases no stop and
        restarts no motion that was ended.

        Args:
            timeout: how long to try again while a step is left to a person [s].

        Returns:
            What was done, and the steps that remain.

        Raises:
            ConnectionLost: the arm was closed.
        """
        seconds = within(timeout, "timeout", 0.0, 1e6, unit="s")
        self._connection.check_may_wait("arm.recover()")
        with self._connection.stopping_on_interrupt():
            return RecoveryAttempts(self._connection).run(seconds)

    def pause(self) -> None:
        """Pause on the path."""
        self._connection.request(wire.Pause())

    def resume(self) -> None:
        """Continue after a pause."""
        self._connection.request(wire.Resume())

    def set_override(self, value: float) -> None:
        """Set the application override: a factor in [0, 1] on every programmed speed, at once.

        Raises:
            LimitError: outside [0, 1].
        """
        self._connection.request(wire.SetOverride(value=within(value, "override", 0.0, 1.0)))

    def wait_for_rest(self, *, timeout: float = REST_TIMEOUT) -> State:
        """Wait until nothing runs, nothing waits, and no axis turns.

        Raises:
            Timeout: the arm does not come to rest in time; the text names what stops it, if anything does.
            SafetyStop: a safety stop is active, so that what waits cannot begin.
            StaleState: the subscribed groups lack "joints" or "motion".
        """
        return self._wait_for(RestDetector(self._connection), timeout, StopWatch(waits_for_rest=True))

    # -------------------------------------------------------------------------- tools and frames

    @property
    def tools(self) -> dict[str, KnownTool]:
        """Tools that can be attached by name: templates of the project, and defined ones."""
        return self._tooling.known

    def remember_tools(self, tools: Sequence[Tool]) -> None:
        """Know tools by name, as `connect` does with those of a saved target; nothing is attached.

        Raises:
            ShapeError: not tools.
        """
        self._tooling.remember([instance(tool, Tool, f"tools[{index}]") for index, tool in enumerate(tools)])

    @property
    def shapes(self) -> tuple[tuple[Shape, Pose], ...]:
        """Shapes of the attached tool and workpiece, each with its pose in the flange frame; see `heptarm.shapes`."""
        return self._tooling.shapes

    @property
    def frames(self) -> dict[str, Pose]:
        """Taught frames of the project by name, in the base frame."""
        return self._tooling.taught

    def attach_tool(self, tool: Tool | str, *, frame: str | None = None) -> None:
        """Tell the cabinet which tool is on the flange, in place of another; the arm has to be at rest.

        On a robot a person mounts the tool; this sets the load with which the controller computes, and the frame to
        which motions, poses and wrenches refer. In a simulator the tool is mounted from now on. It stays attached when
        the client disconnects, since it stays on the flange.

        Args:
            tool: the tool, or the name of a template of the project or of a tool defined before.
            frame: the one of its frames that motions move by default; None: its first.

        Raises:
            CommandRejected: no tool or frame of that name; the text lists them.
            ModeConflict: a motion runs.
        """
        self._tooling.attach(tool, frame)

    def detach_tool(self) -> None:
        """Tell the cabinet that the flange is empty; a workpiece goes with its tool.

        Raises:
            ModeConflict: a motion runs.
        """
        self._tooling.detach()

    def attach_workpiece(self, workpiece: Workpiece | str, *, safety: bool = False) -> None:
        """Tell the cabinet what the tool holds, at the motion frame; the arm has to be at rest.

        Args:
            workpiece: the workpiece, or the name of a workpiece template of the project.
            safety: make it the safety workpiece: the safety functions of the cabinet, which monitor external forces
                by themselves, count its load until it is detached. Otherwise they count none, and may take the weight
                of a heavy workpiece for a collision. See `State.safety_workpiece`.

        Raises:
            CommandRejected: the project has no template of that name, or the cabinet does not take it as the safety
                workpiece; then nothing is attached.
            ModeConflict: a motion runs, or a workpiece is attached already.
        """
        self._tooling.attach_workpiece(workpiece, safety=safety)

    def detach_workpiece(self, workpiece: Workpiece | str) -> None:
        """Tell the cabinet that the tool does not hold the workpiece any more; then there is no safety workpiece.

        Args:
            workpiece: the workpiece, or its name.

        Raises:
            CommandRejected: the tool does not hold it.
            ModeConflict: a motion runs.
        """
        self._tooling.detach_workpiece(workpiece)

    @property
    def load(self) -> Body | None:
        """Load data of the attached tool and workpiece as one body in the flange frame; None: nothing that is known."""
        return self._tooling.load

    def verify_load(self, *, refuse: float = load_check.REFUSE) -> LoadCheck:
        """Check the load data of a resting arm that nothing touches: call it before impedance control.

        A compliant arm sinks under a weight that its load data lack. What the sensors' accuracy does not explain, 3 %
        of the highest torque of an axis, is logged as a warning; more than `refuse` is an error. Every motion, program,
        stream and FRI session in an impedance mode that begins in position control is checked like this by itself. It
        may begin in contact, so it is refused only where a missing weight explains the torques, from 8 % on.

        Args:
            refuse: fraction of the highest torque of an axis above which it is an error, (0, 1].

        Returns:
            The torques that the load data leave, and the mass at the flange that would explain them.

        Raises:
            NotReady: the load data are wrong by more than `refuse`, or something touches the arm.
            StaleState: the subscribed groups lack "joints" or "torques".
            Timeout: the arm does not rest.
        """
        limit = within(refuse, "refuse", 0.0, 1.0, above=True)
        begin = self.wait_for_rest().stamp
        states: list[State] = []

        def is_enough(state: State) -> bool:
            states.append(state)
            return state.stamp - begin >= load_check.SECONDS * 1e9

        self.wait_until(is_enough)
        return load_check.verify(self.robot, states, refuse=limit)

    @contextlib.contextmanager
    def tool(self, tool: Tool | str, *, frame: str | None = None) -> Iterator[None]:
        """A block in which a tool is attached; afterwards the one before is again. See `attach_tool`."""
        before = self._tooling.attached
        self.attach_tool(tool, frame=frame)
        with self._undoing(lambda: self._tooling.restore(before)):
            yield

    @contextlib.contextmanager
    def attached(self, workpiece: Workpiece | str, *, safety: bool = False) -> Iterator[None]:
        """A block in which the tool holds a workpiece. See `attach_workpiece`."""
        self.attach_workpiece(workpiece, safety=safety)
        with self._undoing(lambda: self.detach_workpiece(workpiece)):
            yield

    @contextlib.contextmanager
    def _undoing(self, undo: Callable[[], None]) -> Iterator[None]:
        """A block that ends with an action; after an error the arm must rest first, and the error stays."""
        try:
            yield
        except BaseException:
            try:
                self.wait_for_rest(timeout=_TOOL_PATIENCE)
                undo()
            except HeptarmError as error:
                _log.warning("the attached tool did not change: %s", error)
            raise
        undo()

    def pose(self, frame: str = TOOL, *, reference: str = BASE, state: State | None = None) -> Pose:
        """Pose of a frame in another one.

        Args:
            frame: "tool" (the motion frame), "flange", "base", a taught frame, or one of the tool or workpiece.
            reference: likewise.
            state: the state to compute it from; None: the newest.

        Raises:
            CommandRejected: no such frame is known; the text lists them.
            StaleState: as `state`.
        """
        check_name(frame, "frame")
        check_name(reference, "reference")
        seen = self.state if state is None else instance(state, State, "state")
        pose = self._tooling.pose(seen, frame)
        return pose if reference == BASE else self._tooling.pose(seen, reference).inverse() @ pose

    def wrench(self, frame: str = TOOL, *, axes: str = BASE, state: State | None = None) -> Wrench:
        """External force and torque at the origin of a frame.

        Args:
            frame: "tool" (the motion frame), "flange", or one of the tool or workpiece.
            axes: frame in whose axes the result is: the same names, "base", or a taught frame.
            state: the state to compute it from; None: the newest.

        Raises:
            CommandRejected: no such frame is known; the text lists them.
            StaleState: as `state`.
        """
        check_name(frame, "frame")
        check_name(axes, "axes")
        seen = self.state if state is None else instance(state, State, "state")
        return self._tooling.wrench(seen, frame, axes)


def camera_feed(arm: ArmVerbs, camera: Camera, *, layers: Sequence[str] = ("jpeg",)) -> CameraFeed:
    """What draws pictures of an arm; a private simulator's scene is in them.

    Raises:
        ShapeError: it is no camera.
    """
    cabinet = arm.connection.cabinet
    subject = CameraSubject(
        arm.robot.name,
        lambda: arm.shapes,
        scene="" if cabinet is None else cabinet.scene,
        positions=None if cabinet is None else cabinet.positions,
    )
    return CameraFeed(instance(camera, Camera, "camera"), subject, layers=layers)
