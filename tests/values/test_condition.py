"""Conditions are values: built by comparisons and combinations, checked when created, without a truth value."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from math import inf

import pytest

from heptarm.errors import LimitError, ShapeError
from heptarm.values.condition.condition import (
    AllOf,
    AnyOf,
    Condition,
    Inverted,
    OneOf,
    check_condition,
    condition_nodes,
)
from heptarm.values.condition.force import (
    ForceAbove,
    ForceOutside,
    JointTorqueOutside,
    NormalForceAbove,
    ShearForceAbove,
    TorqueOutside,
    force,
    torque,
)
from heptarm.values.condition.signals import PathReached, SignalIs, SignalOutside, io, path
from heptarm.values.pose import Pose, deg

TOUCH = force.along("z") > 15
HIT = abs(torque[3]) > 8
TURNED = Pose.xyz_abc(0.4, 0.1, 0.2, *deg(0, 30, 0))


@pytest.mark.parametrize(
    ("built", "wanted"),
    [
        (force > 10, ForceAbove(10)),
        (10 < force, ForceAbove(10)),  # noqa: SIM300
        (force(frame="base", tolerance=5.0) > 10, ForceAbove(10, frame="base", tolerance=5.0)),
        (force < 10, Inverted(ForceAbove(10))),
        (TOUCH, ForceOutside("z", -1000, 15)),
        (force.along("x") < -3, ForceOutside("x", -3, 1000)),
        (abs(force.along("y")) > 4, ForceOutside("y", -4, 4)),
        (force.along("y").inside(-4, 5), Inverted(ForceOutside("y", -4, 5))),
        (force.normal("z") > 20, NormalForceAbove("z", 20)),
        (force(frame="base").shear("z") > 20, ShearForceAbove("z", 20, frame="base")),
        (force(frame=TURNED).along("x") > 5, ForceOutside("x", -1000, 5, frame=TURNED)),
        (torque(frame=TURNED).about("z") > 2, TorqueOutside("z", -1000, 2, frame=TURNED)),
        (torque[6] > 2, JointTorqueOutside(6, -500, 2)),
        (HIT, JointTorqueOutside(3, -8, 8)),
        (torque.about("x").outside(-1, 2), TorqueOutside("x", -1, 2)),
        (torque(frame="base").about("z") > 2, TorqueOutside("z", -1000, 2, frame="base")),
        (io.user_button, SignalIs("user_button")),
        (~io["MediaFlange.UserButton"], SignalIs("MediaFlange.UserButton", False)),
        (io["Cell.Part"].outside(1, 3), SignalOutside("Cell.Part", 1, 3)),
        (io["Cell.Part"] > 5, SignalOutside("Cell.Part", -1e300, 5)),
        (io["Cell.Part"] < 5, SignalOutside("Cell.Part", 5, 1e300)),
        (path.after(0.1), PathReached(0.1)),
        (path.before_end(0.15, seconds=0.3), PathReached(-0.15, -0.3, reference="destination")),
        (path.before_end(), PathReached(0.0, reference="destination")),
    ],
)
def test_a_comparison_makes_a_value(built: Condition, wanted: Condition) -> None:
    assert built == wanted and hash(built) == hash(wanted)
    assert pickle.loads(pickle.dumps(built)) == built
    assert str(built)


def test_they_combine() -> None:
    both = TOUCH & HIT
    assert both == AllOf((TOUCH, HIT)) and both & io.x == AllOf((TOUCH, HIT, SignalIs("x")))
    either = TOUCH | HIT | io.x
    assert either == AnyOf((TOUCH, HIT, SignalIs("x")))
    assert (TOUCH | HIT) & io.x == AllOf((AnyOf((TOUCH, HIT)), SignalIs("x")))
    assert ~~TOUCH == TOUCH
    either_one = TOUCH ^ HIT
    assert either_one == OneOf(TOUCH, HIT)
    assert str(force(frame=TURNED).shear("x") > 5) == "force across x of axes at a 0 b 30 c 0 deg > 5 N"
    assert str(TOUCH & ~HIT) == "(force along z of tool > 15 N & ~(external torque of A4 outside [-8, 8] Nm))"


def test_nodes_are_in_postfix_order_and_one_of_two_is_written_out() -> None:
    assert [node for node, _ in condition_nodes(~(TOUCH | HIT))] == [TOUCH, HIT, TOUCH | HIT, ~(TOUCH | HIT)]
    written = [node for node, _ in condition_nodes(TOUCH ^ HIT)]
    assert written == [
        TOUCH,
        HIT,
        ~HIT,
        TOUCH & ~HIT,
        TOUCH,
        ~TOUCH,
        HIT,
        ~TOUCH & HIT,
        (TOUCH ^ HIT).expanded,  # type: ignore[attr-defined]
    ]
    assert all(part == TOUCH ^ HIT for _, part in condition_nodes(TOUCH ^ HIT))


@pytest.mark.parametrize(
    "careless",
    [
        lambda: bool(TOUCH),
        lambda: TOUCH and HIT,
        lambda: TOUCH or HIT,
        lambda: not TOUCH,
        lambda: 1 < force.along("z") < 5,
    ],
)
def test_what_only_the_cabinet_knows_is_not_answered_here(careless: Callable[[], object]) -> None:
    with pytest.raises(ShapeError, match="cabinet") as error:
        careless()
    assert "&" in error.value.hint


@pytest.mark.parametrize(
    ("careless", "kind"),
    [
        (lambda: force > -1, LimitError),
        (lambda: force > 1001, LimitError),
        (lambda: force > inf, LimitError),
        (lambda: force > "ten", ShapeError),  # type: ignore[operator]
        (lambda: force(tolerance=0.0) > 5, LimitError),
        (lambda: force.along("w") > 5, ShapeError),
        (lambda: force(frame="") > 5, ShapeError),
        (lambda: force(frame=5.0) > 5, ShapeError),  # type: ignore[arg-type]
        (lambda: force.along("z").outside(5, 5), LimitError),
        (lambda: torque[7] > 5, LimitError),
        (lambda: torque[0] > 501, LimitError),
        (lambda: torque.about("z") > 1001, LimitError),
        (lambda: io[""], ShapeError),
        (lambda: io["a"] > inf, LimitError),
        (lambda: path.after(-0.1), LimitError),
        (lambda: path.before_end(0.1, seconds=-1.0), ShapeError),
        (lambda: path.after(0.1, seconds=5000.0), LimitError),
        (lambda: TOUCH | 5, ShapeError),  # type: ignore[operator]
        (lambda: check_condition("force > 5"), ShapeError),
        (lambda: check_condition((TOUCH ^ HIT) ^ (TOUCH ^ io.a) ^ (HIT ^ io.b)), LimitError),
    ],
)
def test_bad_values_are_refused_when_they_are_made(
    careless: Callable[[], object], kind: type[Exception]
) -> None:
    with pytest.raises(kind):
        careless()
