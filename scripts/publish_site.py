"""Put a built site into a folder of its version, beside those of other versions.

    python3 scripts/publish_site.py docs/_build/html SITE            as the version of pyproject.toml
    python3 scripts/publish_site.py docs/_build/html SITE --as main

Any web server can then serve SITE: versions.json lists the versions for the sidebar, and index.html leads to
the newest release. It needs nothing but Python's standard library.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9.+-]*")
_PAGE = """<!doctype html>
<meta charset="utf-8">
<title>heptarm</title>
<meta http-equiv="refresh" content="0; url={0}/index.html">
<link rel="canonical" href="{0}/index.html">
<a href="{0}/index.html">heptarm {0}</a>
"""


def own_version() -> str:
    """The version in pyproject.toml."""
    found = re.search(r'^version = "(.*)"', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.M)
    assert found is not None
    return found[1]


def publish(built: Path, site: Path, version: str) -> list[str]:
    """Copy a built site to SITE/VERSION, in the place of an earlier one, and write what leads to the versions.

    Returns:
        The versions of the site: names such as "main" first, then releases, the newest first.

    Raises:
        ValueError: no built site, or a name that cannot be a folder's.
    """
    if not (built / "index.html").is_file():
        raise ValueError(f"{built} must be a built site, but has no index.html; run make docs")
    if not _NAME.fullmatch(version):
        raise ValueError(f"version must be of letters, digits and . + -, got {version!r}")
    shutil.rmtree(site / version, ignore_errors=True)
    shutil.copytree(built, site / version)
    versions = sorted((page.parent.name for page in site.glob("*/index.html")), key=_order, reverse=True)
    (site / "versions.json").write_text(json.dumps(versions) + "\n", encoding="utf-8")
    releases = [name for name in versions if name[0].isdigit()]
    (site / "index.html").write_text(_PAGE.format((releases or versions)[0]), encoding="utf-8")
    return versions


def _order(version: str) -> tuple[bool, list[int], str]:
    """Sorts releases by their numbers, and names above them."""
    return not version[0].isdigit(), [int(number) for number in re.findall(r"\d+", version)], version


def main() -> int:
    """Publish, and print the versions."""
    parser = argparse.ArgumentParser(description="Put a built site beside those of other versions.")
    parser.add_argument("built", type=Path, help="docs/_build/html")
    parser.add_argument("site", type=Path, help="the folder that is served")
    parser.add_argument(
        "--as", dest="version", default=own_version(), help="its version; that of pyproject.toml"
    )
    given = parser.parse_args()
    try:
        print(*publish(given.built, given.site, given.version), sep="\n")
    except ValueError as error:
        print(f"publish_site.py: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
