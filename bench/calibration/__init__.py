"""How well calibration finds what the simulator hides, and what live pictures cost."""
