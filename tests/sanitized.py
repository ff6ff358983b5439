"""A plugin of pytest: the tests of this process use the extension that was built under ASan and UBSan.

`make sanitized` builds it and sets what the sanitizers need. A finding ends the process with a report.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import heptarm

_FILE = Path(__file__).resolve().parent.parent / "build" / "sanitized" / "_native.abi3.so"

_spec = importlib.util.spec_from_file_location("heptarm._native", _FILE)
assert _spec is not None and _spec.loader is not None
_module = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_module)
sys.modules["heptarm._native"] = _module
heptarm._native = _module
