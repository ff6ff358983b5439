"""A policy on the virtual cabinet, through TCP, Java application, servo motion and plant; and its guard."""

from __future__ import annotations

import subprocess
import sys
import time
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any, cast
from unittest.mock import Mock

import numpy as np
import pytest

import heptarm as ha
from heptarm.cli.options import CommandTarget
from heptarm.cli.rl.deploy import deploy as deploy_command
from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.contact.pick_place import PickPlace
from heptarm.rl.deploy import DeploySettings, circle, deploy
from heptarm.rl.deploy_contact import ContactSettings, _Run, deploy_contact
from heptarm.rl.film import film
from heptarm.rl.pilot import Pilot, PolicyGuard, Watch
from heptarm.rl.policy import Policy, shipped, shipped_contact
from heptarm.rl.report import EpisodeReport
from heptarm.rl.station import held_peg
from heptarm.rl.task import ReachTask
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.robot import robot
from tests.cli.running import refused, run
from tests.retry import retry, starved

ARM = "sim://iiwa14"
POINT = (0.55, 0.1, 0.4)


#: Ticks that may come late without an effect on an episode.
LATE_TICKS = 5


def tried(arm: ha.Arm, *arguments: Any, within: float = np.inf, **named: Any) -> EpisodeReport:
    """A deployment that is repeated if the guard, the cabinet or the loop found this machine too busy.

    Args:
        arm: the virtual arm.
        *arguments: of the deployment.
        within: mean distance at which a repetition is no longer of use, even if ticks came late [m].
        **named: of the deployment.
    """

    def busy(outcome: EpisodeReport | Exception) -> str:
        if isinstance(outcome, ha.StaleState | ha.Starved):
            arm.wait_for_rest()
            return "the loop of a policy was held up"
        late = isinstance(outcome, EpisodeReport) and outcome.facts["late_ticks"] > LATE_TICKS
        missed = late and (outcome.success_rate < 1.0 or outcome.mean > within)
        return "ticks of a policy came late" if missed else ""

    return retry(lambda: deploy(arm, *arguments, **named), busy)


@pytest.fixture(scope="module")
def reached() -> EpisodeReport:
    with ha.connect(ARM, watchdog=5.0) as arm:
        # beside other tests a machine may be held up for longer than is allowed on an arm
        settings = DeploySettings(guard=PolicyGuard(stale=2.0), homing=0.6)
        return tried(arm, shipped(feature=True), [POINT, (0.65, -0.15, 0.3)], within=0.02, settings=settings)


def test_the_shipped_policy_reaches_its_targets(reached: EpisodeReport) -> None:
    assert reached.success_rate == 1.0 and reached.mean < 0.02
    assert reached.facts["virtual"] and reached.facts["guard"].get("box", 0) == 0
    np.testing.assert_allclose(reached.paths, reached.task.tip(reached.joints))


def test_the_one_with_the_feature_does_so_gently_and_late() -> None:
    with ha.connect(ARM, watchdog=5.0) as arm:
        settings = DeploySettings(mode=JointImpedance(300.0), latency=0.06, homing=0.6)
        report = tried(arm, shipped(feature=True), [POINT], within=0.012, settings=settings)
    assert report.success_rate == 1.0 and report.mean < 0.012


def test_a_moving_target_is_followed() -> None:
    with ha.connect(ARM, watchdog=5.0) as arm:
        moving = circle((0.6, 0.0, 0.4), 0.1, period=8.0)
        report = tried(arm, shipped(feature=True), [moving])
    assert report.distances[0, 60:].max() < 0.08
    assert np.linalg.norm(report.targets[0] - moving(99 / 30)) < 1e-9


def test_targets_outside_the_box_and_foreign_robots_are_refused_before_anything_moves() -> None:
    with (
        ha.connect("sim://iiwa7?speed=5", watchdog=5.0) as arm,
        pytest.raises(ha.LimitError, match="trained for the LBR iiwa 14"),
    ):
        deploy(arm, shipped(feature=True), [POINT])
    with ha.connect(ARM, watchdog=5.0) as arm:
        before = arm.state.q
        for bad in ([2.0, 0, 0.4], [np.nan, 0, 0.4], [0.5, 0.1]):
            with pytest.raises(ha.CommandRejected):
                deploy(arm, shipped(feature=True), [bad])
        with pytest.raises(ha.CommandRejected, match="of a task with contacts, got one of reach"):
            deploy_contact(arm, cast("Any", shipped()), arm.pose())
        with pytest.raises(ha.CommandRejected, match="of the task reach, got one of peg-in-hole"):
            deploy(arm, cast("Any", shipped_contact(PegInHole)), [POINT])
        with pytest.raises(ha.ShapeError, match="targets"):
            deploy_contact(arm, shipped_contact(PegInHole), arm.pose(), [[0.0, 0.0, np.nan, 0.0, 0.0, 0.0]])
        with pytest.raises(ha.CommandRejected, match="tip"):
            deploy_contact(arm, shipped_contact(PegInHole), arm.pose())
        with pytest.raises(ha.LimitError, match="speed must be at least"):
            deploy_contact(arm, shipped_contact(PegInHole), arm.pose(), settings=ContactSettings(speed=0.01))
        places = [arm.pose(), ha.Pose.at(1.5, 0.0, 0.3)]
        flange = ContactSettings(frame="flange")
        with pytest.raises(ha.Unreachable, match=r"origins\[1\]"):
            deploy_contact(arm, shipped_contact(PegInHole), places, np.zeros((2, 6)), settings=flange)
        assert np.abs(arm.state.q - before).max() < 1e-4
    with pytest.raises(ha.LimitError, match="latency"):
        DeploySettings(latency=3.0)
    with pytest.raises(ha.LimitError, match="volume"):
        PolicyGuard(low=(1.0, 0.0, 0.0))


class Wild:
    """Returns random actions of full magnitude."""

    def __init__(self) -> None:
        self.task = ReachTask()
        self._random = np.random.default_rng(1)
        self._push = np.ones(7)

    def __call__(self, observation: np.ndarray, /) -> np.ndarray:
        if self._random.random() < 0.05:
            self._push = np.sign(self._random.normal(size=7))
        return self._push


def test_a_wild_policy_stays_in_the_box_and_within_the_limits() -> None:
    guard = PolicyGuard(low=(0.3, -0.3, 0.3), high=(0.7, 0.3, 0.8))
    with ha.connect(ARM, watchdog=5.0) as arm:
        report = tried(arm, Wild(), [POINT, POINT], settings=DeploySettings(guard=guard, homing=0.6))
        arm.wait_for_rest()
    assert (report.paths > np.array(guard.low) - 0.03).all()
    assert (report.paths < np.array(guard.high) + 0.03).all()
    assert report.facts["guard"]["box"] > 0


class Diverged:
    """Returns one action for ever."""

    def __init__(self, action: float) -> None:
        self.task = ReachTask()
        self._action = np.full(7, action)

    def __call__(self, observation: np.ndarray, /) -> np.ndarray:
        return self._action


def test_a_policy_that_diverges_ends_at_rest_and_its_episode_is_marked(tmp_path: Path) -> None:
    with ha.connect(ARM, watchdog=5.0) as arm, arm.record(tmp_path / "run.mcap"):
        with pytest.raises(
            ha.CommandRejected, match=r"episodes\[0\]: an action of the policy must be finite"
        ):
            tried(arm, Diverged(np.nan), [POINT])
        assert np.abs(arm.wait_for_rest().q - ReachTask().home).max() < 1e-2
    notes = [note.text for note in ha.load(tmp_path / "run.mcap").notes]
    assert any(text.startswith("failed: episodes[0]: an action of the policy") for text in notes)


def test_a_policy_that_saturates_without_effect_diverges() -> None:
    pilot = Pilot(Diverged(1.0))
    q = np.array(pilot.task.home)
    pilot.begin(q)
    with pytest.raises(ha.CommandRejected, match="at its bounds in every direction for 2 s"):
        for _ in range(100):  # pushed against what holds the arm: the leash ends the command
            pilot.decide(q, np.zeros(7), np.array(POINT))
    pilot.begin(q)
    for _ in range(60):  # it moves
        q = pilot.decide(q, np.zeros(7), np.array(POINT)) - 0.01


def test_the_guard_brings_commands_back() -> None:
    model = robot("iiwa14")
    home = np.array(ReachTask().home)
    watch = Watch(PolicyGuard(speed=0.6), model, period=1 / 30)
    assert (watch.allow(home, home) == home).all() and not any(watch.counts.values())
    hasty = watch.allow(home, home + 0.5)
    assert np.abs(hasty - home).max() == pytest.approx(0.02)
    edge = home.copy()
    edge[6] = model.q_max[6]
    assert watch.allow(edge, edge)[6] < model.q_max[6]
    assert watch.counts["speed"] >= 1 and watch.counts["joint"] == 2


def test_deploying_needs_neither_torch_nor_mujoco() -> None:
    code = (
        "import sys; import heptarm.cli.rl.deploy, heptarm.rl.deploy\n"
        "from heptarm.rl.policy import shipped; shipped(feature=True)\n"
        "sys.exit(any(m in sys.modules for m in ('torch', 'mujoco')))"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_film_and_row_of_pictures(reached: EpisodeReport, tmp_path: Path) -> None:
    gif = film(reached, tmp_path / "reach.gif", episodes=1, every=20)
    assert gif.read_bytes()[:6] in (b"GIF87a", b"GIF89a")
    assert film(reached, tmp_path / "reach.png").read_bytes()[:4] == b"\x89PNG"
    gif.write_text("mine")
    with pytest.raises(ha.CommandRejected, match=r"reach\.gif exists .*overwrite=True"):
        film(reached, gif)
    assert gif.read_text() == "mine"
    with pytest.raises(ha.CommandRejected, match="gif"):
        film(reached, tmp_path / "reach.mp4")


def test_the_command_line_refuses_what_a_policy_with_contacts_has_not() -> None:
    for words, why in (
        (("--follow",), "are of the reach task, not of peg-in-hole"),
        (("--stiffness", "300"), "are of the reach task, not of peg-in-hole"),
        (("--tip", "0.2"), "--at and --tip must be given together"),
        (("--at", "0.6", "0.1", "0.24"), "--at and --tip must be given together"),
        (("--random", "0"), "--random must be at least 1"),
        (("--seconds", "0"), "seconds must be in [0.5, 600] s, got 0 s"),
    ):
        done = refused("rl", "deploy", "peg-in-hole", *words)
        assert done.returncode != 0 and why in done.stderr, done.stderr
    for words in (("--tip", "0.2"), ("--through", "fri"), ("--seconds", "16")):
        done = refused("rl", "deploy", *words)
        assert done.returncode != 0 and "are of policies with contacts" in done.stderr


def test_the_command_line_refuses_before_anything_connects(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    peg, scene = (
        ("peg-in-hole", "--target", "sim://iiwa14?scene=peg-in-hole"),
        "sim://iiwa14?scene=peg-in-hole",
    )
    held = ("--at", "0.6", "0.1", "0.24")
    reach = ("reach", "--target", "sim://iiwa14")
    for words, why in (
        ((*peg, "--speed", "0"), "--speed must be in (0, 1], got 0"),
        ((*reach, "--speed", "1.5"), "--speed must be in (0, 1], got 1.5"),
        ((*peg, "--speed", "0.01"), "set-point's speed must be at least 0.02 m/s for the task peg-in-hole"),
        ((*peg, "--seed", "-1"), "--seed must be in [0, "),
        ((*reach, "--seed", "-1"), "--seed must be in [0, "),
        ((*peg, *held, "--tip", "-0.2"), "--tip must be in (0, 2] m, got -0.2 m"),
        ((*peg, *held, "--tip", "5"), "--tip must be in (0, 2] m, got 5 m"),
        ((*peg, "--twin", "nonsense"), "--twin must be none or a simulator"),
        ((*reach, "--twin", "sim://nothing"), "target must be an address or a simulator"),
        ((*reach, "--follow", "--ask"), "--ask and --follow must not be given together"),
        ((*reach, "--at", "0.5", "0", "0.4", "--follow"), "--at and --follow must not be given together"),
        ((*reach, "--at", "3", "0", "0.4"), "is outside the guard's box"),
        ((*reach, "--random", "0"), "--random must be at least 1"),
        (("peg-in-hole", "--target", "sim://iiwa14?speed=2"), f"--target '{scene}&speed=2'"),
    ):
        done = refused("rl", "deploy", *words)
        assert done.returncode == 1 and why in done.stderr and "Traceback" not in done.stderr, done.stderr
    assert not list(tmp_path.iterdir())


def test_the_speed_of_the_command_is_the_ceiling_of_the_arm(monkeypatch: pytest.MonkeyPatch) -> None:
    arm = Mock(robot=robot("iiwa14"), speed=1.0, is_virtual=True)
    arm.record.side_effect = ha.NotReady("as far as here")
    monkeypatch.setattr(CommandTarget, "connect", lambda _: nullcontext(arm))
    for before, after in ((1.0, 0.2), (0.1, 0.1)):  # that of a saved target may be lower
        arm.speed = before
        with pytest.raises(ha.NotReady, match="as far as here"):
            deploy_command(
                Path("peg-in-hole"), speed=0.2, target=CommandTarget(text=f"{ARM}?scene=peg-in-hole")
            )
        assert arm.speed == after


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.timeout(600)
def test_the_command_line_inserts_a_peg_and_records_it(tmp_path: Path) -> None:
    target = "sim://iiwa14?scene=peg-in-hole&sensors=noisy:1"
    out = tmp_path / "inserted"
    words = ("--random", "2", "--latency", "0.02", "--out", str(out), "--target", target)
    done = run("rl", "deploy", "peg-in-hole", *words)
    assert done.returncode == 0, done.stderr
    report = EpisodeReport.load(out.with_suffix(".npz"))
    assert report.success.any() and report.peak_force.max() < 30.0
    assert report.facts["guard"] == {"force": 0} and report.facts["latency"] == 0.02
    recording = ha.load(out.with_suffix(".mcap"))
    assert recording.complete and len(recording) > 2000
    assert report.facts["recording"] == str(out.with_suffix(".mcap"))
    assert 0.0 < report.facts["twin"]["largest"]["q"] < 0.1 and "alike" in report.facts["twin"]


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.timeout(600)
def test_the_law_of_torques_inserts_a_peg_and_is_guarded() -> None:
    policy, target = shipped_contact(PegInHole), "sim://iiwa14?scene=peg-in-hole&sensors=noisy:1&speed=0.5"
    error = np.array([0.002, -0.001, 0.0005, 0.01, 0.02, 0.0])
    with ha.connect(target, watchdog=5.0) as arm, held_peg(arm) as hole:
        origin = policy.task.presumed(hole, error)
        settings = ContactSettings(through="fri", latency=0.02, stale=2.0)
        report = deploy_contact(arm, policy, origin, [error], settings=settings)
        assert report.success.all() and report.facts["through"] == "fri" and report.peak_force.max() < 30.0
        report = deploy_contact(arm, policy, origin, [error], settings=replace(settings, peak=2.0))
        assert report.facts["ended"] == ["force"] and not report.success.any()
        assert report.peak_force.max() > 2.0


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.timeout(600)
def test_a_force_above_the_guard_ends_the_episode_at_rest() -> None:
    with ha.connect("sim://iiwa14?scene=peg-in-hole&speed=0.5", watchdog=5.0) as arm, held_peg(arm) as hole:
        policy = shipped_contact(PegInHole)
        error = np.array([0.0, 0.0, -0.001, 0.0, 0.0, 0.0])
        gentle = ContactSettings(peak=2.0, stale=2.0)
        beside = hole.shifted(y=0.02, frame="tool")
        report = deploy_contact(arm, policy, policy.task.presumed(beside, error), [error], settings=gentle)
        assert report.facts["guard"] == {"force": 1} and not report.success.any()
        broken = shipped_contact(PegInHole)
        broken.layers[-1] = (broken.layers[-1][0], np.full(5, np.nan, dtype=np.float32))
        with pytest.raises(ha.CommandRejected, match="an action of the policy must be finite"):
            deploy_contact(
                arm, broken, policy.task.presumed(hole, error), [error], settings=ContactSettings(stale=2.0)
            )
        arm.wait_for_rest()


class SlowGripper:
    """A gripper that takes longer than a servo motion waits for set-points."""

    def __init__(self) -> None:
        self.calls: list[str] = []

    def close(self) -> None:
        time.sleep(1.5)
        self.calls.append("close")

    def open(self) -> None:
        self.calls.append("open")


@pytest.mark.slow
def test_set_points_go_on_while_a_gripper_closes() -> None:
    task = PickPlace()
    closing: Any = [(np.zeros((task.observation_size, 4)), np.array([0.0, 0.0, 0.0, 1.0]))]
    still = Policy(
        task, layers=closing, mean=np.zeros(task.observation_size), std=np.ones(task.observation_size)
    )
    gripper: Any = SlowGripper()
    with ha.connect(ARM, watchdog=5.0) as arm:
        arm.move(ha.ptp(ha.deg(0, 25, 0, -90, 0, 65, 0)))
        here = arm.pose()
        settings = ContactSettings(frame="flange", seconds=2.5, stale=0.6)
        report = retry(
            lambda: deploy_contact(
                arm, still, here, settings=settings, bodies=lambda: {"cube": here}, gripper=gripper
            ),
            starved,
        )
    assert report.distances.shape == (1, 25) and gripper.calls[-1] == "close"


def test_an_episode_that_a_force_ends_has_failed_at_full_depth_too() -> None:
    run = object.__new__(_Run)
    run._task = PegInHole()
    assert all(run._failed(missing) > PegInHole().radius for missing in (-1e-3, 0.0, 0.02))


def test_the_speed_of_the_command_holds_on_the_way_to_the_start(monkeypatch: pytest.MonkeyPatch) -> None:
    arm = Mock(robot=robot("iiwa14"), speed=1.0, is_virtual=True)
    arm.record.side_effect = ha.NotReady("as far as here")
    monkeypatch.setattr(CommandTarget, "connect", lambda _: nullcontext(arm))
    with pytest.raises(ha.NotReady, match="as far as here"):
        deploy_command(speed=0.05, target=CommandTarget(text=ARM))
    assert arm.speed == 0.05
