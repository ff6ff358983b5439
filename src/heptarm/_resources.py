"""Files that come with the package: the compiled cabinet and its sources, in a checkout as in a wheel."""

from __future__ import annotations

from pathlib import Path

from heptarm.errors import HeptarmError

_PACKAGE = Path(__file__).resolve().parent
_JARS = ("heptarm-core.jar", "heptarm-app.jar", "heptarm-doubles-not-for-robots.jar")


def jars() -> list[Path]:
    """Returns the paths of the compiled cabinet: core, app and the doubles.

    Raises:
        HeptarmError: the cabinet of this checkout has not been compiled.
    """
    paths = [_PACKAGE / "sim" / "jars" / name for name in _JARS]
    missing = [path.name for path in paths if not path.exists()]
    if missing:
        raise HeptarmError(
            f"the virtual cabinet is not compiled: {', '.join(missing)} missing",
            hint="type `make cabinet` in the checkout, or install the heptarm wheel",
        )
    return paths


def cabinet_sources() -> Path:
    """Returns the folder that holds ``core/src``, ``app/src``, ``without``, ``app2``, ``project`` and ``project2``.

    Raises:
        HeptarmError: the installation is incomplete.
    """
    packed, checkout = _PACKAGE / "_cabinet", _PACKAGE.parent.parent / "cabinet"
    for folder in (packed, checkout):
        if (folder / "core" / "src").is_dir():
            return folder
    raise HeptarmError(
        "this installation lacks the cabinet's sources", hint="reinstall heptarm from its wheel"
    )
