"""Exports: the arm with its flange, its tool and its scene as a model for other programs, in URDF, SDF, MJCF and USD.

What the simulator compiles is read once, as a tree of bodies (`tree`), and written by one writer per format
(`xml_formats`, `usd`). So all formats have the same frames, masses and limits, those of the virtual cabinet;
nothing is read back here.
"""
