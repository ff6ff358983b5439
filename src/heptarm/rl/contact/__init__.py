"""Tasks in which the arm touches things: one definition each, for training, evaluation, Gymnasium and an arm.

`task` is their base: a Cartesian impedance whose set-point a policy moves, on a leash and in a box, and what it
observes. A task adds its scene, what an episode draws, rewards and success. The simulation of all of them is
`heptarm.rl.sim.contact_batch`.
"""
