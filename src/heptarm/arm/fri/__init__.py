"""FRI sessions of an arm: checking the request, the running session, and the diagnosis of a failed one.

The protocol and the 1 kHz loop are in `heptarm.fri`; this package opens a session on the cabinet and connects both.
"""
