"""Training a policy: PPO in torch, its recipe, several workers. Nothing outside this package needs torch."""
