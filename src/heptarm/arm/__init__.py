"""The arm as a program sees it: connect, move, servo, FRI, devices.

`arm` has the one class, `connect` makes it. `link` keeps the connection to the cabinet, `translate` turns values into
messages and back; `motion`, `devices` and `fri` are the arm's components. Simulation is not here: see `heptarm.sim`.
"""
