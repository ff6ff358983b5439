"""Simulated arms for training: batched MuJoCo, the plant of the virtual cabinet, MuJoCo Warp on a GPU."""
