"""Committed files match the schema, and the schema itself is checked."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ERRORS = '[[error]]\ncode = 1\nname = "x"\nclass = "LimitError"\ntitle = "t"\nadvice = "a"\n'
FRAME = """
[protocol]
name = "t"
major = 1
minor = 0
port = 1
magic = 1
max_body = 10
[header]
fields = []
[enum.E]
doc = ""
values = []
[flags]
[union.U]
doc = ""
tag = "u8"
members = [{ tag = 1, type = "A" }]
"""


def test_generated_files_agree_with_the_schema() -> None:
    command = [sys.executable, str(ROOT / "schema" / "generate.py"), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ('[struct.A]\ndoc = ""\nfields = [{ name = "u", type = "list<U>" }]\n[message]\n', "recursive"),
        ('[struct.A]\ndoc = ""\nfields = [{ name = "u", type = "f32" }]\n[message]\n', "unknown type"),
        (
            '[struct.A]\ndoc = ""\nfields = [{ name = "u", type = "u8", maxx = 1 }]\n[message]\n',
            "unknown attributes",
        ),
        (
            '[struct.A]\ndoc = ""\nfields = []\n'
            + "".join(
                f'[message.{n}]\nid = 1\nfrom = "both"\nkind = "link"\ndoc = ""\nfields = []\n' for n in "MN"
            ),
            "share an id",
        ),
    ],
)
def test_a_wrong_schema_is_refused(tmp_path: Path, text: str, complaint: str) -> None:
    import spec

    (tmp_path / "protocol.toml").write_text(FRAME + text)
    (tmp_path / "errors.toml").write_text(ERRORS)
    with pytest.raises(ValueError, match=complaint):
        spec.load(tmp_path)


def test_every_code_becomes_an_error_that_exists() -> None:
    from heptarm import errors
    from heptarm.wire.codes import MEANINGS

    for code, meaning in MEANINGS.items():
        assert issubclass(getattr(errors, meaning.error), errors.HeptarmError), code
