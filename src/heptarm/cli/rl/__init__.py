"""`heptarm rl`: policies are trained, evaluated and deployed, and demonstrations recorded, many at once if you like.

Each command is a function here; the work is that of `heptarm.rl`. Options become jobs in `jobs`, results a table.
"""
