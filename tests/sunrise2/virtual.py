"""A virtual cabinet with heptarm's application for Sunrise 2.x on its own doubles; run as a program.

python -m tests.sunrise2.virtual FRI OPTIONS_OF_THE_CABINET...
"""

from __future__ import annotations

import sys
from pathlib import Path

from heptarm import _resources
from heptarm.sim.runtime import cabinet, jvm

BUILT = Path(__file__).parents[2] / "build" / "cabinet" / "sunrise2"


def main(fri: str, options: list[str]) -> None:
    """Replace doubles and application by those for 2.x, then run the cabinet as ever."""
    core = _resources.jars()[0]
    _resources.jars = lambda: [
        core,
        BUILT / "heptarm-doubles2-not-for-robots.jar",
        BUILT / f"heptarm-app2-fri-{fri}.jar",
    ]
    jvm.APPLICATION = "heptarm.doubles2.Host"
    sys.exit(cabinet.main(options))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
