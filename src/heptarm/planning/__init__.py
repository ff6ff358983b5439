"""From commands to trajectories: geometry, inverse kinematics along the path, timing within all limits.

Pure computation, once for each command in the caller's thread; the tick only evaluates the result. Targets and limits
of a command are in `targets`, a motion or several as one path in `program` and `spline`, its timing in `time_scaling`.
"""
