"""`heptarm`: the entry point of the command line."""

from __future__ import annotations

import os
import sys

from heptarm.cli.app import app
from heptarm.cli.commands import learning, looking, motion, simulator
from heptarm.errors import HeptarmError

__all__ = ["app", "learning", "looking", "main", "motion", "simulator"]


def main() -> None:
    """Entry point: errors of heptarm are one sentence on standard error and exit code 1."""
    try:
        code = app()
    except HeptarmError as error:
        if os.environ.get("HEPTARM_DEBUG"):
            raise
        print(f"heptarm: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:  # the reader of our output has gone, as in `heptarm state --watch | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    sys.exit(code if isinstance(code, int) else 0)


if __name__ == "__main__":
    main()
