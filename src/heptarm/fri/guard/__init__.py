"""Limits of the commands of an FRI client, and behaviour when commands or messages are missing.

`joint_guard` and `pose_guard` limit commands, `fallback` replaces missing commands, `gap_recovery` estimates the
setpoint after lost messages.
"""
