"""Control modes: how the arm holds its set-points, from stiff position control to Cartesian impedance with forces.

A mode is a frozen value that any motion or servo stream accepts. `directions` has the checked numbers per Cartesian
direction that the impedance modes are made of.
"""
