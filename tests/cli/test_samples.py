"""`heptarm sim app` with the samples on heptarm's core, which stream targets: they need a machine that has time."""

from __future__ import annotations

import shutil

import pytest

from tests.cli.test_application import SAMPLES, sim


@pytest.mark.skipif(shutil.which("javac") is None, reason="no javac here")
@pytest.mark.parametrize(
    ("name", "said"),
    [
        (
            "Visit",
            (
                "square = FINISHED",
                "curve = FINISHED",
                "interrupted = CANCELLED",
                "touched = CONDITION by condition 3",
                "refused = items[0].motion.q[1]: A2 must be in",
            ),
        ),
        (
            "Stir",
            ("spoon, moving its bowl", "stirred = CANCELLED", "mm to the side", "lamp 1.0", "ready = true"),
        ),
    ],
)
def test_an_application_on_heptarms_core_needs_no_network(name: str, said: tuple[str, ...]) -> None:
    done = sim(SAMPLES, "--app-class", name)
    assert done.returncode == 0, done.stdout + done.stderr
    for text in said:
        assert text in done.stderr
