"""The package as a whole: its names, and that importing it is cheap and quiet."""

from __future__ import annotations

import subprocess
import sys

import pytest

import heptarm


def test_every_public_name_is_there() -> None:
    for name in heptarm.__all__:  # type: ignore[attr-defined]
        assert getattr(heptarm, name) is not None
        assert name in dir(heptarm)
    with pytest.raises(AttributeError, match="nothing"):
        _ = heptarm.nothing  # type: ignore[attr-defined]


def test_the_names_of_fri_are_there_without_a_socket() -> None:
    from heptarm import fri

    for name in fri.__all__:  # type: ignore[attr-defined]
        assert getattr(fri, name) is not None
        assert name in dir(fri)
    with pytest.raises(AttributeError, match="nothing"):
        _ = fri.nothing  # type: ignore[attr-defined]
    code = (
        "import sys, heptarm.fri.session.events; assert not {'socket', 'heptarm.fri.loop'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], timeout=60, check=True)


def test_importing_costs_nothing_and_connecting_needs_no_simulator() -> None:
    code = (
        "import sys, heptarm\n"
        "assert 'numpy' not in sys.modules\n"
        "heptarm.connect, heptarm.ptp\n"
        "bad = [m for m in sys.modules if m.startswith(('heptarm.sim', 'mujoco', 'jpype', 'ruckig'))]\n"
        "assert not bad, bad\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("modes", "from heptarm import modes"),
        ("when", "from heptarm import when"),
        ("conect", "did you mean 'connect'?"),
        ("zzz", "heptarm has no attribute 'zzz'"),
    ],
)
def test_a_wrong_name_of_the_package_is_answered_with_the_right_one(name: str, said: str) -> None:
    program = f"import heptarm as ha\ntry:\n    ha.{name}\nexcept AttributeError as error:\n    print(error)"
    done = subprocess.run([sys.executable, "-c", program], check=False, capture_output=True, text=True)
    assert said in done.stdout, done.stderr
