"""Training of a policy: PPO in torch, its settings, several workers. Nothing outside this package needs torch."""
