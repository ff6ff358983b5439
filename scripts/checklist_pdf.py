"""Print the checklist of the first day in the built site: `checklist_pdf.py SITE` writes SITE/first-day.pdf.

Chromium prints it; where there is none, the page is left as it is, with a note.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

PAGE, PDF = "guide/real-robot/checklist.html", "first-day.pdf"


def main(site: Path) -> int:
    """Print the page of a site; returns the status to exit with."""
    found = map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))
    browser = next(filter(None, found), None)
    if browser is None:
        print(f"no Chromium: {PDF} is not written", file=sys.stderr)
        return 0
    out = site / PDF
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer"]
    done = subprocess.run(
        [*command, f"--print-to-pdf={out}", (site / PAGE).resolve().as_uri()],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    if done.returncode or not out.exists():
        print(done.stderr, file=sys.stderr)
        return 1
    print(out)
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
