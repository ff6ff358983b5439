"""Logs of the nodes under test: in a folder that only a run leaves behind that has failed."""

from __future__ import annotations

import functools
import os
import shutil
import tempfile
from pathlib import Path

import pytest


@functools.cache
def folder() -> Path:
    """The folder, made when it is first asked for."""
    return Path(tempfile.mkdtemp(prefix="heptarm-nodes-"))


def new() -> Path:
    """An empty log."""
    descriptor, path = tempfile.mkstemp(dir=folder(), prefix="node-", suffix=".log")
    os.close(descriptor)
    return Path(path)


def delete(exitstatus: int) -> None:
    """Delete the logs at the end of a run, unless a test has failed."""
    if (
        exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED)
        and folder.cache_info().currsize
    ):
        shutil.rmtree(folder(), ignore_errors=True)
