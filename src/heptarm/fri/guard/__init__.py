"""Limits of what an FRI client commands, their reports, and the policy for missing commands, as values.

They act in native/fri_guard.c and native/fri_commands.c.
"""
