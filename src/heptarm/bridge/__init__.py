"""Bridges to the protocols of other projects, so that programs written for these drive heptarm's own cabinet.

Each protocol has one module, `libiiwa` for example, with the table of its commands; `bridged_arm` has what all of them
do with an arm, `peer` the bytes of the program at the other end. Requests come in from that program, verbs of `Arm` go
out: nothing here talks to a cabinet, and whatever the program sends, the arm stops when it is lost.
"""
