"""The simulated arms that a policy is trained on: batched MuJoCo, the virtual cabinet's plant, MuJoCo Warp on a GPU."""
