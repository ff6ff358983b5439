"""Devices on and beside the arm: signals, the smartPAD, tools and frames, the operator of a simulator."""
