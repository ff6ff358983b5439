"""Numbers of joints in the order of the arm's: in messages their names come in any order, and some are left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from heptarm.bridge.driver import Driver
from heptarm.errors import ShapeError
from heptarm.values.arrays import Array


def positions(driver: Driver, names: Sequence[str], values: Sequence[float]) -> Array:
    """Joint positions of a message in the arm's order, shape (7,) [rad]; joints left out stay where they are.

    Args:
        driver: whose arm it is.
        names: of the joints, in any order; empty: all, in the arm's order.
        values: positions [rad].

    Raises:
        ShapeError: an unknown name, a name twice, or not as many numbers as names.
    """
    return _ordered(driver, names, values, driver.arm.state.q_cmd)


def wishes(driver: Driver, names: Sequence[str], values: Sequence[float]) -> Array:
    """Likewise numbers of joints; those of joints left out are NaN."""
    return _ordered(driver, names, values, np.full(7, np.nan))


def velocities(driver: Driver, names: Sequence[str], values: Sequence[float]) -> Array:
    """Likewise joint velocities [rad/s]; joints left out have none."""
    return _ordered(driver, names, values, np.zeros(7))


def _ordered(driver: Driver, names: Sequence[str], values: Sequence[float], others: Array) -> Array:
    joints = driver.configuration.joints
    order = list(names) or list(joints)
    if len(order) != len(values) or len(set(order)) != len(order):
        raise ShapeError(f"{len(values)} numbers for the joints {order}; one for each is wanted")
    result = others.copy()
    for name, value in zip(order, values):
        if name not in joints:
            raise ShapeError(f"unknown joint {name!r}", hint=f"the joints are {', '.join(joints)}")
        result[joints.index(name)] = value
    return result
