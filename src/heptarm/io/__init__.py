"""The only access to the outside: sockets, shared memory and clocks.

The protocol machines in `heptarm.wire` and `heptarm.fri` work on bytes and times; this package provides them.
An OSError never leaves this package: it becomes an error of `heptarm.errors`.
"""
