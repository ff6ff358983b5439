"""Wire protocol of heptarm without IO: messages, frames, session state machine, clock synchronisation.

`messages` and `codes` are generated from schema/; the other modules turn bytes into events and messages into bytes.
There is no socket, thread or clock here: `heptarm.io` and `heptarm.arm.link.link` have them.
"""
