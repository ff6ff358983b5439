"""Control laws: from a set-point and the measured state to motor torques, one tick at a time.

`active_law` holds the law in force; each control mode and hand guiding has a law of its own.
"""
