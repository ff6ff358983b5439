"""An arm follows poses: by UDP, of a second arm that is guided; clutch, scale, walls; what is no pose is counted."""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from subprocess import DEVNULL, PIPE, STDOUT
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import heptarm as ha
import heptarm.cli.teleop as command_module
from heptarm import devices, skills
from heptarm.arm.link.local_simulator import PrivateCabinet
from heptarm.arm.link.target import Target
from heptarm.cli.jog import DEVICES
from heptarm.cli.options import Access, CommandTarget
from heptarm.devices.pose_stream import PoseInput, PoseStream
from heptarm.errors import CommandRejected, LimitError, NotReady, OutsideWorkspace, ShapeError
from heptarm.model.kinematics import forward
from heptarm.skills.pose_following import _Follower
from heptarm.values.robot import robot
from tests.cli.running import HEPTARM, Command, refused
from tests.conftest import RunningCabinet
from tests.simulators import FASTER

SPEED = FASTER

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)


class Sender:
    """A program that sends poses."""

    def __init__(self, port: int) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(("127.0.0.1", port))

    def send(self, xyz: list[float], *buttons: str, **more: object) -> None:
        content = {"position": xyz, "quaternion": [0, 0, 0, 1], "buttons": list(buttons)} | more
        self.socket.send(json.dumps(content).encode())

    def close(self) -> None:
        self.socket.close()


class Clock:
    """A clock that a test moves on."""

    def __init__(self) -> None:
        self.now = 1_000_000_000

    def nanos(self) -> int:
        return self.now

    def sleep(self, seconds: float) -> None:
        raise AssertionError

    def sleep_until(self, due: int) -> None:
        raise AssertionError


def test_the_newest_pose_counts_and_silence_releases_the_buttons() -> None:
    clock = Clock()
    with PoseStream(0, host="127.0.0.1", silence=0.2, clock=clock) as stream:
        assert stream.read() == PoseInput()
        sender = Sender(stream.port)
        sender.send([0.1, 0.2, 0.3], "clutch", t=5.0)
        sender.send([0.5, 0.2, 0.3], "clutch", t=5.2)
        sender.send([0.4, 0.2, 0.3], t=5.1)  # overtaken
        seen = stream.read()
        assert seen.pose is not None and seen.pose.x == 0.5 and seen.buttons == {"clutch"}
        clock.now += 210_000_000
        assert stream.read().buttons == frozenset() and stream.read().pose == seen.pose
        sender.send([0.0, 0.0, 0.1], "clutch", t=0.1)  # a sender that began again
        seen = stream.read()
        assert seen.pose is not None and seen.pose.z == 0.1 and seen.buttons == {"clutch"}
        bad: list[tuple[bytes, str]] = [
            (b"\xff\xfe", "codec"),
            (b"[1, 2]", "object of JSON"),
            (b'{"position": [1, 2, 3]}', "quaternion"),
            (b"[" * 4000, "recursion"),
            (b"x" * 5000, "at most 4096"),
            (b'{"position": [1, 2, NaN], "quaternion": [0, 0, 0, 1]}', "finite"),
            (b'{"position": [1, 2, 3e9], "quaternion": [0, 0, 0, 1]}', "within 1000 m"),
            (b'{"position": [1, 2, true], "quaternion": [0, 0, 0, 1]}', "3 numbers"),
            (b'{"position": [1, 2, 3], "quaternion": [0, 0, 0, 2]}', "norm 1"),
            (b'{"position": [1, 2, 3], "quaternion": [0, 0, 0, 1], "buttons": "a"}', "list of up to 32"),
            (b'{"position": [1, 2, 3], "quaternion": [0, 0, 0, 1], "t": null}', "t must"),
        ]
        for number, (data, text) in enumerate(bad, 1):
            sender.socket.send(data)
            assert stream.read().pose == seen.pose
            assert stream.refused == number and (text in stream.error or text == "recursion"), stream.error
        with pytest.raises(NotReady, match="cannot be received at 127"):
            devices.pose_stream(stream.port)
        sender.close()
    assert stream.read() == PoseInput()
    with pytest.raises(LimitError, match="port must be"):
        devices.pose_stream(-1)
    with pytest.raises(LimitError, match="silence must be"):
        devices.pose_stream(0, silence=0.0)


@pytest.fixture(scope="module")
def arm(cabinet: RunningCabinet) -> Iterator[ha.Arm]:
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        yield arm


@pytest.mark.slow
def test_an_arm_follows_while_the_clutch_is_held_scaled_turned_and_inside_its_walls(arm: ha.Arm) -> None:
    arm.move(ha.ptp(HOME), speed=1.0)
    start = arm.state.pose
    arm.workspace = ha.Workspace((start.xyz - 0.3, start.xyz + [0.3, 0.3, 0.02]), mode="clamp")
    axes = ha.Pose.from_rotvec([0, 0, 0], [0, 0, np.pi / 2])  # the sender's x is the arm's y
    with devices.pose_stream(0) as stream:
        sender = Sender(stream.port)
        hand, phase = np.zeros(3), [0]

        def person(_: PoseInput) -> bool:
            """Move without the clutch; with it; let go and reach back; jump; press up against the wall."""
            now = arm.state.pose
            if phase[0] == 0:
                hand[0] += 0.005
                if hand[0] > 0.06:
                    assert now.distance_to(start) < 1e-3, "without the clutch nothing moves"
                    phase[0] = 1
            elif phase[0] == 1:
                hand[0] = min(hand[0] + 0.002, 0.16)
                phase[0] += hand[0] == 0.16 and now.y > start.y + 0.045
            elif phase[0] == 2:
                hand[0] = max(hand[0] - 0.02, 0.0)
                phase[0] += hand[0] == 0.0
            elif phase[0] == 3:
                hand[:] = [0.0, 0.0, 0.9]  # the tracking has jumped
                phase[0] = 4
            elif phase[0] == 4:
                hand[2] += 0.002
                phase[0] += hand[2] > 1.0 and now.z > start.z + 0.015
            held = phase[0] in (1, 3, 4)
            sender.send(hand.tolist(), *(["clutch"] if held else []), *(["quit"] if phase[0] == 5 else []))
            return True

        sender.send([0, 0, 0])
        stats = skills.follow_poses(
            arm, stream, scale=0.5, axes=axes, while_true=person, watchdog=2.0, duration=90.0, speed=1.0
        )
        sender.close()
    end = arm.wait_for_rest().pose
    assert phase[0] == 5, stats
    assert abs(end.y - start.y - 0.05) < 3e-3 and abs(end.x - start.x) < 3e-3, (
        "half of 0.1 m, along the arm's y"
    )
    assert 0.015 < end.z - start.z < 0.022, "the wall is 20 mm above"
    assert stats.refused == 0 and stats.clamped > 0
    arm.workspace = None
    with pytest.raises(ShapeError, match="must be a device that knows its pose"):
        skills.follow_poses(arm, 3)  # type: ignore[arg-type]
    with devices.pose_stream(0) as other, pytest.raises(LimitError, match="scale must be"):
        skills.follow_poses(arm, other, scale=0.0)
    with pytest.raises(CommandRejected, match="NoSuchSignal"):
        skills.LeaderArm(arm, clutch="NoSuchSignal")


@pytest.mark.slow
@pytest.mark.long
def test_an_arm_follows_a_second_one_that_is_pushed(arm: ha.Arm, tmp_path: Path) -> None:
    arm.move(ha.ptp(HOME), speed=1.0)
    start = arm.state.pose
    with ha.connect("sim://iiwa7", watchdog=10.0, timeout=60.0) as leader:
        leader.move(ha.ptp(HOME), speed=1.0)
        began = leader.pose()
        with skills.LeaderArm(leader) as guided:
            leader.operator.start_push([0, 15, 0], duration=300.0)

            def goes_on(_: PoseInput) -> bool:
                return leader.pose().y < began.y + 0.1

            skills.follow_poses(
                arm, guided, scale=0.5, while_true=goes_on, watchdog=2.0, duration=90.0, speed=1.0
            )
            leader.operator.start_push([0, 0, 0], duration=0.0)
    assert 0.02 < arm.wait_for_rest().pose.y - start.y < 0.08


@pytest.mark.slow
@pytest.mark.long
def test_the_command_between_two_arms_records_joints_and_gripper_to_its_end(tmp_path: Path) -> None:
    leader = PrivateCabinet.start(Target(model="iiwa7"))
    follower = PrivateCabinet.start(Target(model="iiwa14", options=(("scene", "bins"),)))
    try:
        targets = [f"sim://{cabinet.host}:{cabinet.port}" for cabinet in (leader, follower)]
        for target in targets:
            with ha.connect(target, watchdog=5.0, timeout=30.0) as one:
                one.move(ha.ptp(ha.deg(0, 25, 0, -90, 0, 65, 0)), speed=0.5)
        options = ("--for", "8", "--record", str(tmp_path / "set"), "--task", "Look", "--scale", "0.5")
        grips = ("--gripper", "scene", "--grip", "MediaFlange.UserButton")
        command = [*HEPTARM, "teleop", "--leader", targets[0], "--follower", targets[1], *options, *grips]
        with Command(command, stdin=DEVNULL, stdout=PIPE, stderr=STDOUT, text=True) as process:
            assert process.stdout is not None
            assert "compliant" in process.stdout.readline()
            assert leader.operate("push 0 15 0 300") == ("", "")
            time.sleep(3.0)
            assert leader.operate("set MediaFlange.UserButton true") == ("", "")
            said = process.communicate(timeout=120)[0]
        assert process.returncode == 0 and "1 episode in" in said, said
        (episode,) = ha.load_episodes(tmp_path / "set")
        began, ended = episode["pose"][0, :3], episode["pose"][-1, :3]
        assert ended[1] - began[1] > 0.01 and episode.task == "Look"
        assert episode["gripper"][0] == 1.0 and episode["gripper"][-1] == 0.0, "the press closed it"
        assert episode.action.shape == (len(episode), 8) and episode.action[-1, 7] == 0.0
        assert np.abs(episode.action[:, :7] - episode["q"]).max() < 0.1
    finally:
        leader.close()
        follower.close()


TOOL = """<RoboticsAPIData version="3"><objectTemplates>
  <toolTemplate class="" defaultMotionFrameRef="/Tip" name="Gripper">
    <frames><frame name="Tip"><transformation x="0.0" y="0.0" z="120.0"/></frame></frames>
    <loadData cogX="0.0" cogY="0.0" cogZ="60.0" mass="2.0"/>
  </toolTemplate>
</objectTemplates></RoboticsAPIData>"""


@pytest.mark.slow
@pytest.mark.long
def test_the_command_follows_a_phone_with_a_tool_within_the_workspace(tmp_path: Path) -> None:
    project = tmp_path / "RoboticsAPI.data.xml"
    project.write_text(TOOL)
    cabinet = PrivateCabinet.start(Target(model="iiwa14", options=(("project", str(project)),)))
    try:
        target = f"sim://{cabinet.host}:{cabinet.port}"
        with ha.connect(target, watchdog=5.0, timeout=30.0) as one:
            one.move(ha.ptp(HOME), speed=0.5)
            x, y, z = one.pose().xyz
        box = f"{x - 0.5},{y - 0.5},{z - 0.5},{x + 0.5},{y + 0.05},{z + 0.5}"
        options = ("--poses", "0", "--target", target, "--tool", "Gripper", "--workspace", box, "--for", "12")
        command = [*HEPTARM, "teleop", *options, "--record", str(tmp_path / "set")]
        with Command(command, stdin=DEVNULL, stdout=PIPE, stderr=STDOUT, text=True) as process:
            assert process.stdout is not None
            phone = Sender(int(process.stdout.readline().split("port ")[1].split(";")[0]))
            for index in range(100):  # 5 s aside without the clutch, back, and 5 s aside with it
                step = index % 50
                phone.send([0.0, 0.004 * step, 0.0], *(["clutch"] if index > 50 else []))
                time.sleep(0.1)
            phone.close()
            said = process.communicate(timeout=120)[0]
        assert process.returncode == 0 and "1 episode in" in said, said
        (episode,) = ha.load_episodes(tmp_path / "set")
        flange = np.array([forward(robot("iiwa14"), q)[:3, 3] for q in episode["q"]])
        lengths = np.linalg.norm(episode["pose"][:, :3] - flange, axis=1)
        assert np.abs(lengths - 0.12).max() < 5e-3, "the tip of the tool is what moves"
        moved = episode["pose"][:, 1] - episode["pose"][0, 1]
        assert np.abs(moved[: len(moved) // 3]).max() < 2e-3, "the clutch is not held"
        assert 0.04 < moved.max() < 0.055, "up to the wall of the workspace"
        with ha.connect(target, watchdog=5.0, timeout=30.0) as one:
            assert one.pose().distance_to(one.pose("flange")) < 1e-6, "the tool is detached again"
    finally:
        cabinet.close()


class Refusing:
    """An arm and its servo motion that refuse targets beyond a wall at x = 0.6 m."""

    groups = ()
    start = None

    def __init__(self) -> None:
        self.x = 0.5

    def pose(self, **_: object) -> ha.Pose:
        return ha.Pose.at(self.x)

    def set(self, pose: ha.Pose) -> ha.Pose:
        if pose.x > 0.6 + 1e-9:
            raise OutsideWorkspace("the target is outside")
        self.x = pose.x
        return pose


def test_the_next_press_of_the_clutch_begins_where_the_wall_has_held_the_arm() -> None:
    one: Any = Refusing()
    device: Any = SimpleNamespace(roles=devices.Roles(dead_man="clutch"))
    follower = _Follower(one, one, device, 1.0, False, ha.Pose.at(), "clutch", None)

    def move(places: Iterable[float], *buttons: str) -> None:
        for x in places:
            follower.step(PoseInput(ha.Pose.at(x), frozenset(buttons)))

    move([0.0])
    move(np.linspace(0.0, 0.4, 21).tolist(), "clutch")
    assert one.x == pytest.approx(0.6), "the hand is 0.3 m beyond the wall"
    move(np.linspace(0.4, 0.1, 21).tolist())
    move(np.linspace(0.1, 0.05, 6).tolist(), "clutch")
    assert one.x == pytest.approx(0.55)


class Opened:
    """A device, and an arm, that do nothing."""

    robot = robot("iiwa14")

    def __enter__(self) -> Opened:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def close(self) -> None:
        pass


@pytest.mark.parametrize(("given", "used"), [(None, 0.5), (0.05, 0.05)])
def test_the_command_moves_by_a_device_at_the_speed_that_is_given(
    monkeypatch: pytest.MonkeyPatch, given: float | None, used: float
) -> None:
    speeds = []

    def moved(*_: object, **keywords: object) -> None:
        speeds.append(keywords["speed"])

    monkeypatch.setattr(command_module, "teleoperate", moved)
    monkeypatch.setitem(DEVICES, "gamepad", Opened)
    monkeypatch.setattr(CommandTarget, "connect", lambda _: Opened())
    monkeypatch.setattr(Access, "ask_first", lambda *_: None)
    assert command_module.teleop(device="gamepad", speed=given) == 0
    assert speeds == [used]


def test_the_command_refuses_what_does_not_fit() -> None:
    cases: list[tuple[tuple[str, ...], str]] = [
        ((), "one of --leader, --device and --poses, got none"),
        (("--poses", "0", "--device", "keyboard"), "got device, poses"),
        (("--poses", "0", "--reflect", "0.5"), "reflect needs a leader"),
        (("--poses", "0", "--gripper", "scene", "--grip", "A"), "grip needs a leader and a gripper"),
        (("--leader", "a", "--gripper", "scene"), "gripper needs grip"),
        (("--device", "gamepad", "--speed", "0.05", "--scale", "0.1"), "scale needs a leader or poses"),
        (("--device", "gamepad", "--clutch", "A"), "clutch needs a leader"),
        (("--poses", "0", "--clutch", "A"), "clutch needs a leader"),
        (("--leader", "a", "--host", "0.0.0.0"), "host needs poses"),
        (("--poses", "0", "--gripper", "opens=A"), "signals of a gripper must be NAME=Group.Signal"),
        (("--poses", "0", "--workspace", "1,2"), "workspace must be X,Y,Z,X,Y,Z"),
        (("--poses", "0", "--for", "-1"), "for must be"),
    ]
    for options, text in cases:
        assert text in refused("teleop", *options).stderr
