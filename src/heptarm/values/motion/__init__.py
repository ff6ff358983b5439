"""Motions: what `arm.move` and `arm.start` carry out.

One module per kind of path; `dynamics` has the limits and the blending common to all, `orientation` how the
orientation changes along a path. `motion` has the base of all of them.
"""
