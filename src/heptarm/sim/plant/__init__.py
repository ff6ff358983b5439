"""The physics: MuJoCo's arm, payload, external load, IO image, and the state shared with Java.

`plant` advances everything by one tick, and its head explains how. Commands come in as `MotionCommand`; the
state goes out through the shared memory.
"""
