"""Frozen values that a user passes in and gets back: poses, motions, modes, conditions, tools, states, results.

Plain numbers in SI units, checked when a value is made; numpy is the only dependency. Nothing here knows the protocol,
a connection or a clock: `heptarm.arm.translate` turns these values into messages and back.
"""
