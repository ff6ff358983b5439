"""Each task with contacts: it can be solved, nothing is done by itself, Gymnasium and Stable-Baselines3 accept it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import warnings
from dataclasses import fields, replace
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="gymnasium is not installed")

import gymnasium

from heptarm.errors import CommandRejected, LimitError, ShapeError, Unreachable
from heptarm.rl import register
from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.contact.pick_place import PickPlace
from heptarm.rl.contact.polish import Polish
from heptarm.rl.contact.push import Push
from heptarm.rl.contact.task import ContactTask, Moment
from heptarm.rl.deploy_contact import ContactSettings, check_contact
from heptarm.rl.env import ContactEnv
from heptarm.rl.evaluate import evaluate
from heptarm.rl.sim.contact_batch import BatchContact
from heptarm.rl.sim.episodes import BatchSettings
from heptarm.rl.sim.simulate import simulate
from heptarm.rl.task import ReachTask
from heptarm.rl.tasks import TASKS, environment, task_from_dict, task_named
from heptarm.values.camera import Camera
from heptarm.values.pose import Pose

CONTACT = [name for name, kind in TASKS.items() if issubclass(kind, ContactTask)]
TWO = BatchSettings(envs=2, starts="together", seed=3, threads=1)


@pytest.mark.parametrize("name", CONTACT)
def test_who_knows_everything_succeeds_and_who_does_nothing_does_not(name: str) -> None:
    task = task_named(name)
    assert isinstance(task, ContactTask)
    arms = BatchContact(task, TWO)
    _, left = arms.outcome()
    assert left.min() > 2.0 * task.radius
    force = np.zeros(2)
    for _ in range(task.steps - 1):
        step = arms.step(arms.teach())
        force = np.maximum(force, step.force)
    assert step.distance.max() <= task.radius
    assert step.reward.min() > 0.2
    assert force.max() <= 40.0


@pytest.mark.parametrize("kind", TASKS.values(), ids=list(TASKS))
def test_gymnasium_and_stable_baselines_find_nothing_to_complain_of(kind: type) -> None:
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make(environment(kind), task=kind(steps=8)).unwrapped
    check_env(env, skip_render_check=True)
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(env)
    many = gymnasium.make_vec(environment(kind), num_envs=2, task=kind(steps=8))
    seen, _ = many.reset(seed=1)
    assert many.observation_space.contains(seen)
    for index in range(8):
        seen, reward, terminated, truncated, info = many.step(many.action_space.sample())
        assert many.observation_space.contains(seen)
        assert reward.shape == info["distance"].shape == (2,)
        assert not terminated.any() and truncated.all() == (index == 7)
    assert env.spec is None or env.spec.id == environment(kind)


def test_a_batch_goes_on_after_a_load_as_if_nothing_had_been() -> None:
    task = PickPlace(steps=20)
    arms = BatchContact(task, TWO)
    for _ in range(5):
        arms.step(arms.teach())
    other = BatchContact(task, BatchSettings(envs=2, seed=9, threads=2))
    other.load(arms.save())
    action = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 4))
    for _ in range(10):
        assert (arms.step(action).observation == other.step(action).observation).all()


def test_bodies_are_seen_where_they_are_placed() -> None:
    task = Push()
    arms = BatchContact(task, TWO)
    assert arms.bodies()["puck"][:, :2] == pytest.approx(arms.target[:, :2])
    turned = np.array([[0.01, 0.02, -0.1, 0.3, -0.2, 0.5]])
    assert arms._seen_from_origin(arms._in_base(turned)) == pytest.approx(turned)


def test_what_was_polished_is_remembered_where_the_force_was_right() -> None:
    task = Polish()
    target = np.array([0.0, 0.0, 0.0, 10.0])
    rest = np.zeros(6)
    now = Moment(rest, rest, np.array([0, 0, -10.0, 0, 0, 0]), target, memory=np.zeros(task.memory_size))
    assert task.remember(now).sum() == 1.0
    weak = Moment(rest, rest, np.array([0, 0, -5.0, 0, 0, 0]), target, memory=task.remember(now))
    moved = Moment(np.array([0, 0.03, 0, 0, 0, 0]), rest, weak.wrench, target, memory=weak.memory)
    assert task.remember(moved).sum() == 1.0
    assert task.missing(moved) == pytest.approx(task.length * 23 / 24)


def test_an_observation_shows_what_is_asked_for() -> None:
    task = Push(observation=("wrench", "joints", "pose"), history=(0,))
    assert task.observation == ("joints", "pose", "wrench")
    arms = simulate(task, TWO)
    seen = arms.reset(seed=1)
    assert seen.shape == (2, task.observation_size)
    model = task.model
    there = (seen[:, :7] + 1.0) / 2.0 * (model.q_max - model.q_min) + model.q_min
    assert there == pytest.approx(arms.q)
    full = Push(history=(0,), softest=0.5)
    assert (
        full.observation_size
        == replace(full, observation=("pose", "wrench")).observation_size + len(Push.axes) + 1
    )
    assert task_from_dict(json.loads(json.dumps(task.as_dict()))) == task
    wrong: Any
    for wrong in ("pose", ("torque",), (), ("pose", "pose"), (3,)):
        with pytest.raises((CommandRejected, ShapeError), match="observation must"):
            Push(observation=wrong)


def test_a_task_of_ones_own_is_known_by_its_name_or_refused() -> None:
    with pytest.raises(CommandRejected, match=r"task must be one of reach, .*got 'juggle'"):
        gymnasium.make("heptarm/Push-v0", task="juggle")
    with pytest.raises(ShapeError, match="task must be a"):
        gymnasium.make("heptarm/Push-v0", task=3)

    class Broken(Push):
        name = "broken"

        def scene(self) -> str:
            return "<mujoco><worldbody><geom size='none'/></worldbody></mujoco>"

    class Handless(Push):
        name = "handless"

        def scene(self) -> str:
            return "<mujoco><worldbody/></mujoco>"

    class Loose(Push):
        name = "loose"

        def scene(self) -> str:
            return (
                "<mujoco><worldbody><body name='tool'><geom size='0.01'/></body>"
                "<body name='rod'><site name='tip'/></body></worldbody></mujoco>"
            )

    class Far(Push):
        name = "far"
        origin = Pose.of((1.4, 0.0, 0.2), (0.0, 1.0, 0.0, 0.0))

    with pytest.raises(Unreachable, match="a start of the task far must be within reach"):
        simulate(Far(), TWO)
    with pytest.raises(CommandRejected, match="the scene of broken cannot be read"):
        simulate(Broken(), TWO)
    with pytest.raises(CommandRejected, match="a body `tool` with a site `tip`"):
        simulate(Handless(), TWO)
    with pytest.raises(CommandRejected, match="a body `tool` with a site `tip`"):
        simulate(Loose(), TWO)
    with pytest.raises(CommandRejected, match="no teacher"):
        ContactTask.teach(Push(), Moment(*(np.zeros(6),) * 4))


@pytest.mark.parametrize(
    ("name", "wrong", "why"),
    [
        ("targets", lambda *_: np.zeros(2), r"targets\(\) .* shape \(2, k\) for 2 arms, got shape \(2,\)"),
        ("targets", lambda *_: np.zeros((1, 4)), r"targets\(\) .*, got shape \(1, 4\)"),
        (
            "starts",
            lambda *_: np.zeros((2, 3)),
            r"starts\(\) .* shape \(2, 6\) for 2 arms, got shape \(2, 3\)",
        ),
        (
            "bodies",
            lambda *_: {"duck": np.zeros((2, 6))},
            r"needs bodies of the scene .*\(puck\): got 'duck'",
        ),
        ("bodies", lambda *_: {"puck": np.zeros(6)}, r"bodies\(\)\['puck'\] .*, got shape \(6,\)"),
        ("bodies", lambda *_: None, r"must return a dictionary of poses, got None"),
        ("look", lambda *_: np.zeros((2, 5)), r"look\(\) .* \(2, 6\) .* \(2, 5\) .*look_size"),
        ("hidden", lambda *_: np.zeros((2, 1)), r"hidden\(\) .* \(2, 0\) .* \(2, 1\) .*hidden_size"),
        ("remember", lambda *_: np.zeros((2, 1)), r"remember\(\) .* \(2, 0\) .* \(2, 1\) .*memory_size"),
        ("reward", lambda *_: np.zeros((2, 1)), r"reward\(\) .* shape \(2,\) for 2 arms, got shape \(2, 1\)"),
        ("reward", lambda *_: np.full(2, np.nan), r"reward\(\) .* must be finite .*, got nan at \[0\]"),
        ("missing", lambda *_: 0.0, r"missing\(\) .*, got shape \(\)"),
        ("missing", lambda _, now: now.pose @ np.eye(3), r"missing\(\) of the task wrong fails for 2 arms"),
        ("teach", lambda *_: np.zeros((2, 6)), r"teach\(\) .* \(2, 2\) .* got shape \(2, 6\)"),
        ("teach", ContactTask.teach, "has_teacher of the task wrong needs a function `teach`"),
        ("box", property(lambda _: np.zeros(6)), "box .* must be two arrays of shape"),
        ("box", property(lambda _: (np.zeros(6), np.zeros(3))), r"box\[1\] .* \(6,\), got shape \(3,\)"),
        ("box", property(lambda _: (np.ones(6), np.zeros(6))), "got 1 above 0 m of axis 0"),
        ("axes", (0, 0), r"axes .* each once, got \(0, 0\)"),
        ("axes", (0, 6), r"axes .* some of 0 to 5"),
        ("axes", (), r"axes .* got \(\)"),
        ("has_gripper", True, "has_gripper of the task wrong needs an actuator `gripper`"),
        ("frequency", 4.0, "rate of the task wrong must divide the 4 Hz of its simulation"),
        ("frequency", 24.0, r"must divide the 24 Hz .*got 10 Hz \(12 Hz does"),
    ],
)
def test_what_a_function_of_a_task_does_wrongly_is_named(name: str, wrong: Any, why: str) -> None:
    kind = type("Wrong", (Push,), {"name": "wrong", name: wrong})
    with pytest.raises((CommandRejected, LimitError, ShapeError), match=why):
        simulate(kind(), TWO)


def test_what_cannot_be_registered_is_refused_before_it_is() -> None:
    class OfAnother(Push):
        name = "peg-in-hole"

    class OfParent(Push):
        pass

    class Loud(Push):
        name = "Loud Task"

    class PegInHole(Push):
        name = "another-peg"

    before, known = dict(TASKS), set(gymnasium.registry)
    for wrong, why in (
        (OfAnother, "name and class of a task must be its own: peg-in-hole"),
        (OfParent, "OfParent must have a name of its own in lower case"),
        (Loud, "must have a name of its own in lower case, such as press-plate, got 'Loud Task'"),
        (PegInHole, "name and class of a task must be its own: another-peg with heptarm/PegInHole-v0"),
        (Push(), r"kind must be a subclass of ContactTask.*heptarm.rl.register\(Push\)"),
        ("x", "kind must be a subclass of ContactTask, got 'x'"),
    ):
        with pytest.raises((CommandRejected, ShapeError), match=why):
            register(wrong)  # type: ignore[arg-type]
    assert before == TASKS and known == set(gymnasium.registry)


def test_a_class_of_a_reloaded_module_is_registered_in_place_of_the_one_before() -> None:
    def made() -> type[ContactTask]:
        class Juggle(Push):
            name = "juggle-twice"

        return Juggle

    try:
        for kind in (made(), made()):
            register(kind)
            assert TASKS["juggle-twice"] is kind
    finally:
        TASKS.pop("juggle-twice", None)
        gymnasium.registry.pop("heptarm/Juggle-v0", None)


def test_an_environment_has_no_other_task_than_that_of_its_name() -> None:
    for made, name in (
        (gymnasium.make, "PegInHole"),
        (gymnasium.make_vec, "PegInHole"),
        (gymnasium.make_vec, "Reach"),
    ):
        with pytest.raises(
            CommandRejected, match=r"task must be .* in the environment .*, got push .*Push-v0"
        ):
            made(f"heptarm/{name}-v0", task=Push())
    assert gymnasium.make("heptarm/Push-v0", task=Push(steps=3)).unwrapped.task.steps == 3


@pytest.mark.parametrize("kind", [kind for kind in TASKS.values() if kind is not ReachTask])
def test_numbers_outside_their_range_are_refused(kind: type) -> None:
    for number in fields(kind):
        if number.metadata.get("unit"):
            with pytest.raises(LimitError, match=rf"{number.name} must be .*{number.metadata['unit']}"):
                kind(**{number.name: -1.0})


def test_a_policy_may_choose_the_stiffness() -> None:
    task = PegInHole(softest=0.25, tilt=1e-3, height=1e-6, steps=60)
    assert task.action_size == 6 and task.observation_size == len(task.history) * 16
    env = gymnasium.make("heptarm/PegInHole-v0", task=task)
    assert env.action_space.shape == (6,) and env.reset(seed=1)[0] in env.observation_space
    arms = BatchContact(task, TWO)
    arms.reset(np.tile([2.5e-3, 0, 0, 0, 0, 0], (2, 1)))
    down = np.array([[0.0, 0, 0.5, 0, 0, -1.0], [0.0, 0, 0.5, 0, 0, 1.0]])  # one compliant, one stiff
    for _ in range(50):
        step = arms.step(down)
    full = task.leash * task.stiffness
    assert step.force == pytest.approx([0.25 * full, full], rel=0.15)
    assert arms.teach().shape == (2, 6)
    with pytest.raises(LimitError, match="softest"):
        PegInHole(softest=0.0)
    with pytest.raises(CommandRejected, match='through must be "fri"'):
        check_contact(task, ContactSettings(), 1.0)


PICTURES = """
import gymnasium, heptarm.rl, numpy as np, sys
from gymnasium.utils.env_checker import check_env
from heptarm.rl.contact.pick_place import PickPlace
from heptarm.values.camera import Camera

cameras = {
    "front": Camera(place=(1.2, -0.5, 0.7), target=(0.6, 0, 0.2), size=(64, 48), shadows=False),
    "wrist": Camera(place=(0.1, 0, 0.02), target=(0, 0, 0.2), frame="flange", size=(48, 48), shadows=False),
}
words = {"pictures": cameras, "render_mode": "rgb_array"}
env = gymnasium.make("heptarm/PickPlace-v0", task=PickPlace(steps=3), **words).unwrapped
first, _ = env.reset(seed=1)
assert env.observation_space.contains(first) and first["front"].shape == (48, 64, 3)
assert np.ptp(first["wrist"]) > 50
for index in range(3):
    seen, _, _, truncated, _ = env.step(np.array([0.0, 0.0, 1.0, -1.0]))
    assert env.observation_space.contains(seen) and truncated == (index == 2)
changed = np.abs(seen["wrist"].astype(int) - first["wrist"]).max()
assert changed > 20, changed  # the last picture is of this episode, in which the gripper went down
assert env.render().shape == (480, 640, 3) and np.ptp(env.render()) > 50
reach = gymnasium.make("heptarm/Reach-v0", render_mode="rgb_array").unwrapped
reach.reset(seed=1)
check_env(reach)
again, _ = env.reset(seed=1)
assert (again["front"] == first["front"]).all()
check_env(env)
if "stable_baselines3" in sys.argv:
    from stable_baselines3.common.env_checker import check_env

    check_env(env)
"""


@pytest.mark.long
@pytest.mark.slow
def test_pictures_are_observations() -> None:
    libraries = [name for name in ("stable_baselines3",) if find_spec(name)]
    for driver in ("egl", "osmesa"):
        environment = {**os.environ, "MUJOCO_GL": driver}
        done = subprocess.run(
            [sys.executable, "-c", PICTURES, *libraries],
            env=environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )
        if done.returncode == 0:
            return
    pytest.fail(done.stderr)


def test_pictures_have_names_of_their_own() -> None:
    with pytest.raises(CommandRejected, match='pictures must not be named "state"'):
        ContactEnv("push", pictures={"state": Camera()})
    with pytest.raises(ShapeError, match=r"pictures\['front'\] must be a Camera"):
        ContactEnv("push", pictures={"front": 3})  # type: ignore[dict-item]


def test_any_function_of_observations_is_evaluated() -> None:
    report = evaluate(lambda seen: np.zeros((len(seen), 2)), 2, task=Push(steps=5))
    assert report.success_rate == 0.0 and report.targets.shape == (2, 4)
