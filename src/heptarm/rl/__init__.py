"""Learning: the task of reaching a point, a batched simulator, PPO, policies without torch."""
