"""The step of simulated time: a set-point a tick, as on a cabinet."""

#: Its length [s], and [ns].
TICK, TICK_NS = 1e-3, 1_000_000
