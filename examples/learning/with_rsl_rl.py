"""Push a puck, learned by RSL-RL's on-policy runner, as its own configurations are written; needs rsl-rl-lib 5."""

import os

from rsl_rl.runners import OnPolicyRunner

from heptarm.rl.contact.push import Push
from heptarm.rl.sim.episodes import BatchSettings
from heptarm.rl.sim.rsl_env import RslArms
from heptarm.rl.sim.simulate import simulate

UPDATES = int(os.environ.get("STEPS", "300"))

env = RslArms(simulate(Push(), BatchSettings(envs=32)))
network = {"class_name": "MLPModel", "hidden_dims": [64, 64], "activation": "elu", "obs_normalization": True}
gaussian = {"class_name": "GaussianDistribution", "init_std": 0.6}
config = {
    "num_steps_per_env": 16,
    "save_interval": 1000,
    "obs_groups": {"actor": ["policy"], "critic": ["policy"]},
    "actor": {**network, "distribution_cfg": gaussian},
    "critic": network,
    "algorithm": {"class_name": "PPO", "num_learning_epochs": 5, "num_mini_batches": 4, "gamma": 0.97},
}
runner = OnPolicyRunner(env, config, log_dir=None, device="cpu")
runner.learn(num_learning_iterations=UPDATES, init_at_random_ep_len=True)
policy = runner.get_inference_policy()
print("action:", policy(env.get_observations())[0].tolist())
