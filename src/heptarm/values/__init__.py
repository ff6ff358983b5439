"""Frozen values, numpy only: poses, motions, states, results, robots."""
