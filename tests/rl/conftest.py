"""Threads of torch sleep while they wait: those that spin take the processor from the tests beside these."""

from __future__ import annotations

import os

os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
