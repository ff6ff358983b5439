"""From commands to trajectories: paths, also around bodies, inverse kinematics along them, timing within all limits.

Pure computation, once for each command in the caller's thread; the tick only evaluates the result. Targets and limits
of a command are in `targets`, a motion or several as one path in `program` and `spline`, its timing in `time_scaling`,
the search of a path around bodies in `search`, what holds along it in `constraints`.
"""

from heptarm.errors import NoPath
from heptarm.planning.search import find_path
from heptarm.values.motion.planned_path import OnLine, OnPlane, Path, Region, SearchStats, Upright

__all__ = ["NoPath", "OnLine", "OnPlane", "Path", "Region", "SearchStats", "Upright", "find_path"]
