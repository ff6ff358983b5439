"""The nodes take a key from a file, never as a parameter that everybody in the ROS network can read."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import MagicMock

import pytest

from heptarm.errors import CommandRejected
from heptarm.io.keys import new_key, write_key_file
from heptarm.ros.node.driver import Driver
from heptarm.ros.node.parameters import PARAMETERS, NodeConfiguration


def test_a_dump_of_the_parameters_has_no_key(tmp_path: Path) -> None:
    key = new_key()
    write_key_file(tmp_path / "cell.key", key)
    assert "key" not in {parameter.name for parameter in PARAMETERS}
    with pytest.raises(CommandRejected, match="unknown parameter 'key'"):
        NodeConfiguration.of({"key": key})
    configuration = NodeConfiguration.of({"target": "sim://iiwa7", "key_file": str(tmp_path / "cell.key")})
    assert key not in str(configuration.values)
    driver = Driver(configuration, MagicMock())
    try:
        assert driver.arm.connection.options.key == key.encode()
    finally:
        driver.close()
