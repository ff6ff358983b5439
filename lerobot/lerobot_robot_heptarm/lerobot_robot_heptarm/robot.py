"""An arm of heptarm as a robot of LeRobot.

Actions are joint positions `joint_1.pos` to `joint_7.pos` [rad] and, with a gripper, `gripper.pos`, from 0, closed, to
1, open. An action goes to a stream of joint targets, which the cabinet follows within its limits and `speed`. The
stream begins with the first action and ends, at rest, when no action came for `watchdog`: LeRobot commands nothing
while it saves an episode. The next action begins a new one.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from lerobot.cameras import CameraConfig
from lerobot.cameras.utils import make_cameras_from_configs
from lerobot.robots import Robot, RobotConfig
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError

import heptarm as ha
from heptarm.values.io import GripperWiring
from lerobot_robot_heptarm.scenes import GRIPPER
from lerobot_robot_heptarm.stepped import SteppedArm

#: Names of the joints, as in data sets.
JOINTS = tuple(f"joint_{axis}" for axis in range(1, 8))
#: Largest watchdog of a stream [s].
_LONGEST = 2.0

#: No observation for so long, as while LeRobot saves: the next one begins an episode [s].
PAUSE = 0.3

_robots: list[HeptarmRobot] = []
#: Called with the robot before the first observation of each episode.
before_episode: list[Callable[[HeptarmRobot], None]] = []


def connected() -> HeptarmRobot:
    """The robot of this process that is connected: its cameras, and a script that leads it, ask for it.

    Raises:
        DeviceNotConnectedError: there is none.
    """
    if not _robots:
        raise DeviceNotConnectedError(
            "no robot of the type heptarm is connected in this process; connect it first"
        )
    return _robots[-1]


@RobotConfig.register_subclass("heptarm")
@dataclass(kw_only=True)
class HeptarmRobotConfig(RobotConfig):
    """What `--robot...` sets.

    Attributes:
        target: as in `heptarm.connect`: an entry of targets.toml, an address, `sim://iiwa14?scene=bins`.
        speed: ceiling of the joints' speed, a fraction in (0, 1].
        watchdog: longest gap between two actions; a longer one ends the stream, and the arm rests [s], up to 2.
        tool: a tool that the cabinet knows, attached while connected; "": none.
        gripper: signals of a gripper, as `heptarm panel --gripper` takes them: "open=NAME close=NAME is_open=NAME
            is_closed=NAME"; "scene": that of a virtual arm's scene, and the tool unless there is another; "": none.
        state: what observations have beside the joints and the gripper: any of "velocities" [rad/s], "torques", the
            external ones of the joints [Nm], "pose" of the tool frame in the base [m, rad, KUKA's angles] and "wrench",
            the external one there [N, Nm].
        bodies: free bodies of a virtual arm's scene whose places observations have [m].
        cameras: as for other robots; those of the type heptarm draw the scene.
    """

    target: str
    speed: float = 0.25
    watchdog: float = 0.5
    tool: str = ""
    gripper: str = ""
    state: list[str] = field(default_factory=list)
    bodies: list[str] = field(default_factory=list)
    cameras: dict[str, CameraConfig] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        unknown = set(self.state) - set(_MORE)
        if unknown:
            raise ValueError(f"state must be a list of {', '.join(_MORE)}, got {', '.join(sorted(unknown))}")
        if not 0.0 < self.speed <= 1.0:
            raise ValueError(f"speed must be in (0, 1], got {self.speed:g}")
        if not 0.05 <= self.watchdog <= _LONGEST:
            raise ValueError(f"watchdog must be in [0.05, {_LONGEST:g}] s, got {self.watchdog:g}")


def _named(prefix: str, names: str) -> tuple[str, ...]:
    return tuple(f"{prefix}_{name}.pos" for name in names.split())


#: Parts of an observation that a configuration may ask for: their names, and how they are read from a state. LeRobot's
#: rollout hands a policy what ends with .pos or .vel, and nothing else.
_MORE: dict[str, tuple[tuple[str, ...], Any]] = {
    "velocities": (tuple(f"{joint}.vel" for joint in JOINTS), lambda state: np.nan_to_num(state.dq)),
    "torques": (tuple(f"{joint}_torque.pos" for joint in JOINTS), lambda state: state.tau_ext),
    "pose": (_named("tool", "x y z a b c"), lambda state: [*state.pose.xyz, *state.pose.abc]),
    "wrench": (
        _named("wrench", "fx fy fz tx ty tz"),
        lambda state: [*state.wrench.force, *state.wrench.torque],
    ),
}


class HeptarmRobot(Robot):
    """A KUKA LBR iiwa, real or virtual."""

    config_class = HeptarmRobotConfig
    name = "heptarm"

    def __init__(self, config: HeptarmRobotConfig) -> None:
        super().__init__(config)
        self.config = config
        self.cameras = make_cameras_from_configs(config.cameras)
        self._arm: Any = None
        self._wiring = GripperWiring()
        self._opens: bool | None = None
        self._block = ExitStack()
        self._stream: Any = None
        self._stream_block = ExitStack()
        self._last, self._is_stepped = 0.0, False
        self._observed = -np.inf

    # --------------------------------------------------------------------------------- what it has

    @property
    def _has_gripper(self) -> bool:
        """Whether actions have a gripper; asked before anything is connected."""
        return bool(self.config.gripper)

    @property
    def _state_names(self) -> list[str]:
        names = [f"{joint}.pos" for joint in JOINTS]
        if self._has_gripper:
            names.append("gripper.pos")
        for part in self.config.state:
            names += _MORE[part][0]
        return names + [f"{body}_{axis}.pos" for body in self.config.bodies for axis in "xyz"]

    @property
    def observation_features(self) -> dict[str, Any]:
        """Numbers of a state, and the shapes of pictures."""
        pictures = {name: (camera.height, camera.width, 3) for name, camera in self.config.cameras.items()}
        return {**dict.fromkeys(self._state_names, float), **pictures}

    @property
    def action_features(self) -> dict[str, Any]:
        """Joint positions [rad], and the gripper."""
        names = [f"{joint}.pos" for joint in JOINTS]
        return dict.fromkeys([*names, "gripper.pos"] if self._has_gripper else names, float)

    # --------------------------------------------------------------------------------- connection

    @property
    def arm(self) -> ha.Arm:
        """The arm; raises DeviceNotConnectedError before `connect` and after `disconnect`."""
        if self._arm is None:
            raise DeviceNotConnectedError(f"{self} is not connected")
        return self._arm

    @property
    def is_connected(self) -> bool:
        """Whether it is connected."""
        return self._arm is not None

    def connect(self, calibrate: bool = True) -> None:
        """Connect, take control, and attach the tool; nothing moves."""
        if self.is_connected:
            raise DeviceAlreadyConnectedError(f"{self} is already connected")
        block = ExitStack()
        with block:
            arm = block.enter_context(ha.connect(self.config.target, watchdog=5.0))
            if self.config.tool or self.config.gripper == "scene":
                block.enter_context(arm.tool(self.config.tool or GRIPPER))
            if self._has_gripper:
                self._wiring = GripperWiring.of(self.config.gripper)
                _ = arm.io[self._wiring.is_open]  # a name that the cabinet lacks is refused here
            self._arm, self._block = arm, block.pop_all()
            _robots.append(self)
        try:
            for camera in self.cameras.values():
                camera.connect()
        except BaseException:
            self.disconnect()
            raise
        self.configure()

    def attach(self, arm: SteppedArm) -> None:
        """Use a simulated robot that is moved on step by step, in place of one that is connected."""
        self._end_stream()
        self._arm, self._is_stepped, self._opens = arm, True, None
        self._wiring = GripperWiring.of(self.config.gripper)

    @property
    def is_calibrated(self) -> bool:
        """Whether it knows its joint angles: an iiwa always does."""
        return True

    def calibrate(self) -> None:
        """Do nothing: the joints of an iiwa are measured absolutely."""

    def configure(self) -> None:
        """Do nothing: the cabinet keeps limits and load."""

    def disconnect(self) -> None:
        """Bring the arm to rest, release control, and end the connection."""
        if not self.is_connected:
            raise DeviceNotConnectedError(f"{self} is not connected")
        try:
            for camera in self.cameras.values():
                if camera.is_connected:
                    camera.disconnect()
            self._end_stream()
        finally:
            self._arm = self._opens = None
            if self in _robots:
                _robots.remove(self)
            self._block.close()

    # --------------------------------------------------------------------------------- at work

    def get_observation(self) -> dict[str, Any]:
        """The newest state, and the newest picture of each camera."""
        arm = self.arm
        if time.monotonic() - self._observed > PAUSE:
            for prepare in before_episode:
                prepare(self)
        self._observed = time.monotonic()
        state = arm.state
        values = [*state.q]
        if self._has_gripper:
            values.append(float(arm.io[self._wiring.is_open]))
        for part in self.config.state:
            values += list(_MORE[part][1](state))
        for body in self.config.bodies:
            values += list(arm.operator.where(body).xyz)
        pictures = {name: camera.read_latest() for name, camera in self.cameras.items()}
        return {**dict(zip(self._state_names, map(float, values), strict=True)), **pictures}

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        """Send targets of the joints and the gripper.

        Returns:
            What was sent: joints are clipped to their limits.

        Raises:
            DeviceNotConnectedError: not connected.
            heptarm.HeptarmError: a number that is not finite; or why the arm has stopped.
        """
        arm = self.arm
        q = np.array([float(action[f"{joint}.pos"]) for joint in JOINTS])
        sent = q if not np.isfinite(q).all() else q.clip(arm.robot.q_min, arm.robot.q_max)
        now = time.monotonic()
        silence = 0.0 if self._is_stepped else now - self._last
        if self._stream is not None and silence > 0.8 * self.config.watchdog:
            self._end_stream()
        if self._stream is None:
            self._begin_stream()
        self._stream.set(sent)
        self._last = now
        applied = {f"{joint}.pos": float(value) for joint, value in zip(JOINTS, sent, strict=True)}
        if self._has_gripper:
            opens = float(action["gripper.pos"]) > 0.5
            if opens is not self._opens:
                arm.io.set({self._wiring.open: opens, self._wiring.close: not opens})
                self._opens = opens
            applied["gripper.pos"] = float(opens)
        return applied

    def rest(self) -> None:
        """End the stream of targets, at rest: others may move the arm then."""
        self._end_stream()

    def _begin_stream(self) -> None:
        block = ExitStack()
        self._stream = block.enter_context(
            self.arm.servo("joint", speed=self.config.speed, watchdog=self.config.watchdog)
        )
        self._stream_block = block

    def _end_stream(self) -> None:
        """End the stream; that the watchdog has ended it already is what it is for."""
        if self._stream is None:
            return
        self._stream = None
        with suppress(ha.Starved):
            self._stream_block.close()
