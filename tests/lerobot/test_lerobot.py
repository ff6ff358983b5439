"""LeRobot's own commands with heptarm's plug-ins: a robot is recorded, replayed, learnt from, driven and judged."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
#: An environment with LeRobot: that of scripts/setup_lerobot.sh, or another one.
PYTHON = Path(os.environ.get("LEROBOT_PYTHON", ROOT / "build" / "lerobot" / "bin" / "python"))
FPS = 15
ROBOT = (
    "--robot.type=heptarm",
    "--robot.target=sim://iiwa14?scene=bins",
    "--robot.gripper=scene",
    "--robot.speed=0.5",
    "--robot.bodies=[part_1]",
    f"--robot.cameras={{front: {{type: heptarm, width: 96, height: 96, fps: {FPS}}}}}",
    "--play_sounds=false",
)

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not PYTHON.exists(), reason="no LeRobot here: scripts/setup_lerobot.sh"),
]


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """Where LeRobot keeps its data."""
    return tmp_path / "home"


def run(home: Path, command: str, *arguments: str) -> str:
    """Run one of LeRobot's commands, or Python, and return what it said."""
    offline = {"HF_HUB_OFFLINE": "1", "HF_LEROBOT_HOME": str(home)}
    done = subprocess.run(
        [str(PYTHON.parent / command), *arguments],
        check=False,
        capture_output=True,
        text=True,
        timeout=1200,
        env=os.environ | offline,
    )
    assert done.returncode == 0, done.stderr[-4000:]
    return done.stderr + done.stdout


def test_a_task_is_recorded_replayed_learnt_and_judged(home: Path, tmp_path: Path) -> None:
    run(
        home,
        "lerobot-record",
        *ROBOT,
        "--teleop.type=heptarm_script",
        "--teleop.task=pick-place",
        "--dataset.repo_id=me/pick",
        "--dataset.no_stamp=true",
        "--dataset.push_to_hub=false",
        "--dataset.video=false",
        "--dataset.num_episodes=2",
        "--dataset.single_task=put the cube into the other bin",
        f"--dataset.fps={FPS}",
        "--dataset.episode_time_s=13",
        "--dataset.reset_time_s=0",
    )
    look = """
import json, numpy as np
from lerobot.datasets import LeRobotDataset
data = LeRobotDataset("me/pick")
state, episode = np.array(data.hf_dataset["observation.state"]), np.array(data.hf_dataset["episode_index"])
ends = [(state[episode == n][0, -3:].tolist(), state[episode == n][-1, -3:].tolist()) for n in range(data.num_episodes)]
print(json.dumps([data.features["observation.state"]["names"], list(data[0]["observation.images.front"].shape), ends]))
"""
    names, shape, ends = json.loads(run(home, "python", "-c", look).splitlines()[-1])
    assert names[0] == "joint_1.pos" and names[7:] == [
        "gripper.pos",
        *(f"part_1_{axis}.pos" for axis in "xyz"),
    ]
    assert shape == [3, 96, 96]
    for (_, y, _), (_, goal_y, goal_z) in ends:
        assert 0.15 < y < 0.25 and -0.3 < goal_y < -0.1 and goal_z == pytest.approx(0.226, abs=0.01)
    assert ends[0][0] != ends[1][0], "the cube always begins at the same place"

    run(home, "lerobot-replay", *ROBOT, "--dataset.repo_id=me/pick", "--dataset.episode=0")
    trained = tmp_path / "trained"
    run(
        home,
        "lerobot-train",
        *(
            "--dataset.repo_id=me/pick",
            "--policy.type=act",
            "--policy.device=cpu",
            "--policy.push_to_hub=false",
        ),
        *("--policy.chunk_size=30", "--policy.n_action_steps=15", "--policy.dim_model=128"),
        *("--policy.pretrained_backbone_weights=null", "--batch_size=4", "--steps=4", "--save_freq=4"),
        *("--num_workers=0", "--wandb.enable=false", f"--output_dir={trained}"),
    )
    policy = f"--policy.path={trained / 'checkpoints' / 'last' / 'pretrained_model'}"
    said = run(
        home,
        "lerobot-rollout",
        *ROBOT,
        policy,
        "--policy.device=cpu",
        f"--fps={FPS}",
        "--duration=3",
        "--task=put it",
    )
    assert "Duration limit reached" in said
    judged = tmp_path / "judged"
    run(
        home,
        "lerobot-eval",
        *(policy, "--policy.device=cpu", "--env.type=heptarm", "--env.task=pick-place"),
        *("--eval.n_episodes=1", "--eval.batch_size=1", f"--output_dir={judged}"),
    )
    found = json.loads((judged / "eval_info.json").read_text())
    assert found["overall"]["n_episodes"] == 1 and found["overall"]["pc_success"] == 0.0, (
        "four steps teach nothing"
    )

    # without pictures: the place of the body is the state of the environment
    assert run(home, "python", "-m", "lerobot_env_heptarm.state_set", "me/pick", "me/pick-state").count(
        "2 episodes"
    )
    blind = tmp_path / "blind"
    run(
        home,
        "lerobot-train",
        *("--dataset.repo_id=me/pick-state", "--policy.type=act", "--policy.device=cpu"),
        *("--policy.push_to_hub=false", "--policy.chunk_size=30", "--policy.n_action_steps=15"),
        *("--policy.dim_model=128", "--policy.use_vae=false", "--policy.pretrained_backbone_weights=null"),
        "--batch_size=4",
        *("--steps=4", "--save_freq=4", "--num_workers=0", "--wandb.enable=false", f"--output_dir={blind}"),
    )
    policy = f"--policy.path={blind / 'checkpoints' / 'last' / 'pretrained_model'}"
    judged = tmp_path / "judged-blind"
    run(
        home,
        "lerobot-eval",
        *(policy, "--policy.device=cpu", "--env.type=heptarm", "--env.task=pick-place", "--env.size=0"),
        *("--env.engine=stepped", "--eval.n_episodes=1", "--eval.batch_size=1", f"--output_dir={judged}"),
    )
    assert json.loads((judged / "eval_info.json").read_text())["overall"]["n_episodes"] == 1


def test_a_script_demonstrates_faster_than_time_and_the_same_for_a_seed(home: Path) -> None:
    module = ("-m", "lerobot_env_heptarm.demonstrate")
    for name in ("me/one", "me/two"):
        assert "of 1 tries were successes" in run(home, "python", *module, name, "--episodes=1", "--jobs=1")
    look = """
import numpy as np
from lerobot.datasets import LeRobotDataset
one, two = (np.array(LeRobotDataset(name).hf_dataset["observation.state"]) for name in ("me/one", "me/two"))
assert one.shape == two.shape and one.shape[1] == 11 and (one == two).all()
assert abs(one[-1, 9] + 0.2) < 0.1, "the cube is in the other bin"
"""
    run(home, "python", "-c", look)


def test_bad_settings_are_refused_before_anything_moves(home: Path) -> None:
    program = """
import math
from lerobot_robot_heptarm import HeptarmRobot, HeptarmRobotConfig
from lerobot.utils.errors import DeviceNotConnectedError
import heptarm as ha
for settings in ({"speed": 0.0}, {"watchdog": 3.0}, {"state": ["torque"]}):
    try:
        HeptarmRobotConfig(target="sim://iiwa14", **settings)
        raise SystemExit(f"accepted {settings}")
    except ValueError as error:
        print(error)
robot = HeptarmRobot(HeptarmRobotConfig(target="sim://iiwa14", state=["torques", "wrench", "pose", "velocities"]))
try:
    robot.get_observation()
except DeviceNotConnectedError as error:
    print(error)
with robot:
    seen = robot.get_observation()
    assert set(seen) == set(robot.observation_features), seen
    here = {name: seen[name] for name in robot.action_features}
    try:
        robot.send_action({**here, "joint_2.pos": math.nan})
        raise SystemExit("accepted nan")
    except ha.HeptarmError as error:
        print(error)
    assert robot.send_action({**here, "joint_1.pos": 9.0})["joint_1.pos"] == robot.arm.robot.q_max[0]
"""
    said = run(home, "python", "-c", program)
    assert "speed must be in (0, 1], got 0" in said and "is not connected" in said and "finite" in said
