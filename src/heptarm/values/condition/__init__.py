"""Conditions that end motions or fire triggers, and the reports of contacts and collisions.

`condition` has the expression tree, `force` its leaves on forces and torques, `signals` those on signals and the path,
both with the names that users compare.
The cabinet evaluates them; nothing is evaluated here.
"""
