"""Sunrise applications of other people: compiled, started, and driven by their clients."""
