"""The published site: a folder for each version, a list of them, and a first page that leads to the newest release."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scripts.publish_site import main, own_version, publish


def built(folder: Path, text: str) -> Path:
    folder.mkdir()
    (folder / "index.html").write_text(text)
    return folder


def test_versions_stand_beside_each_other(tmp_path: Path) -> None:
    site = tmp_path / "site"
    site.mkdir()
    old, new = built(tmp_path / "old", "old"), built(tmp_path / "new", "new")
    assert publish(new, site, "main") == ["main"]
    assert "url=main/index.html" in (site / "index.html").read_text()
    for version in ("0.9.0", "0.10.0", "0.2.1"):
        publish(old, site, version)
    assert json.loads((site / "versions.json").read_text()) == ["main", "0.10.0", "0.9.0", "0.2.1"]
    assert "url=0.10.0/index.html" in (site / "index.html").read_text()
    (site / "0.9.0/left.html").touch()
    assert publish(new, site, "0.9.0") == ["main", "0.10.0", "0.9.0", "0.2.1"]
    assert [page.read_text() for page in (site / "0.9.0").iterdir()] == ["new"]


def test_what_is_no_site_or_no_name_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    site = built(tmp_path / "site", "")
    with pytest.raises(ValueError, match="version must be of letters"):
        publish(site, tmp_path / "to", "../elsewhere")
    monkeypatch.setattr("sys.argv", ["publish_site.py", str(tmp_path), str(tmp_path / "to")])
    assert main() == 2 and "has no index.html; run make docs" in capsys.readouterr().err
    assert not (tmp_path / "to").exists()
    assert own_version()[0].isdigit()
