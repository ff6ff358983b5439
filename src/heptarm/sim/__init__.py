"""The virtual cabinet: a simulated LBR under the real cabinet application.

A command comes in at `runtime` (from Java) or `plant` (from Python), `planning` makes a trajectory of it, `controller`
gives a set-point each millisecond, `control_laws` turns set-points into torques, `plant` steps the physics.
`fri` is the controller side of FRI.
"""
