"""Fixtures of the tests of recordings: the scripted cabinet of the arm's tests."""

from __future__ import annotations

from tests.arm.conftest import peer

__all__ = ["peer"]
