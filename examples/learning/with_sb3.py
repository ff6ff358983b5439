"""Push a puck, learned by Stable-Baselines3's PPO, as its own examples are written; needs stable-baselines3."""

import os

import gymnasium as gym
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env

import heptarm.rl  # noqa: F401  registers the environments

STEPS = int(os.environ.get("STEPS", "200000"))

model = PPO("MlpPolicy", make_vec_env("heptarm/Push-v0", n_envs=4), n_steps=64, gamma=0.97, device="cpu")
model.learn(total_timesteps=STEPS)
env = gym.make("heptarm/Push-v0")
observation, _ = env.reset(seed=1)
for _ in range(10):
    action, _ = model.predict(observation, deterministic=True)
    observation, reward, terminated, truncated, info = env.step(action)
print("action:", action.tolist(), "missing:", info["distance"], "m")
