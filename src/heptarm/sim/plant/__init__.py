"""The physics: MuJoCo's arm, payload, external load, IO image, and the state shared with Java.

`plant` advances everything by one tick. Commands come in as `Order`; the state goes out through the shared memory.
"""
