"""The wheel's build hook: compiles the cabinet and packs the jars and the cabinet's sources."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CabinetHook(BuildHookInterface[Any]):
    """Runs ``cabinet/build.py`` before a wheel is packed; an editable install leaves it to ``make``."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compiles, and names the folders that ``heptarm install-cabinet`` needs."""
        if version == "editable":
            return
        cabinet = Path(self.root) / "cabinet"
        subprocess.run([sys.executable, str(cabinet / "build.py")], check=True)
        for part in ("core/src", "app/src", "without", "project"):
            build_data["force_include"][str(cabinet / part)] = f"heptarm/_cabinet/{part}"
