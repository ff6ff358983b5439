"""Push a puck, learned by skrl's PPO on many arms, as skrl's own examples are written; needs skrl 2 and torch."""

import os
from typing import Any

import gymnasium as gym
import torch
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
from skrl.trainers.torch import SequentialTrainer
from torch import nn

import heptarm.rl  # noqa: F401  registers the environments

STEPS = int(os.environ.get("STEPS", "5000"))


class Policy(GaussianMixin, Model):
    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, **spaces)
        GaussianMixin.__init__(self)
        self.net = nn.Sequential(
            nn.Linear(self.num_observations, 64), nn.ELU(), nn.Linear(64, self.num_actions)
        )
        self.log_std_parameter = nn.Parameter(torch.full((self.num_actions,), -0.5))

    def compute(self, inputs: dict[str, Any], role: str) -> tuple[Any, dict[str, Any]]:
        return self.net(inputs["observations"]), {"log_std": self.log_std_parameter}


class Value(DeterministicMixin, Model):
    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, **spaces)
        DeterministicMixin.__init__(self)
        self.net = nn.Sequential(nn.Linear(self.num_observations, 64), nn.ELU(), nn.Linear(64, 1))

    def compute(self, inputs: dict[str, Any], role: str) -> tuple[Any, dict[str, Any]]:
        return self.net(inputs["observations"]), {}


env = wrap_env(gym.make_vec("heptarm/Push-v0", num_envs=32))
spaces = {
    "observation_space": env.observation_space,
    "state_space": env.state_space,
    "action_space": env.action_space,
    "device": env.device,
}
models = {"policy": Policy(**spaces), "value": Value(**spaces)}
memory = RandomMemory(memory_size=16, num_envs=env.num_envs, device=env.device)
cfg = PPO_CFG(rollouts=16, learning_epochs=5, mini_batches=4, discount_factor=0.97)
cfg.experiment.write_interval = cfg.experiment.checkpoint_interval = 0
agent = PPO(models=models, memory=memory, cfg=cfg, **spaces)
SequentialTrainer(env=env, agents=agent, cfg={"timesteps": STEPS, "headless": True}).train()
observation, _ = env.reset()
with torch.no_grad():
    print("action:", agent.models["policy"].net(observation)[0].tolist())
