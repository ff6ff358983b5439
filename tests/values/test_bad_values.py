"""Public values and functions refuse what they cannot mean, each with an error of heptarm that names the parameter."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import pytest

import heptarm
import heptarm.do
import heptarm.fri
import heptarm.model
import heptarm.modes
import heptarm.planning
import heptarm.shapes
import heptarm.testing
import heptarm.when
from heptarm import HeptarmError
from heptarm.fri import Output, Params
from heptarm.modes import CartesianImpedance, SineImpedance
from heptarm.values.checks import array, numbers, shown
from heptarm.when import force, io, path, torque
from tests import bad_values
from tests.bad_values import HOME, HUGE, POSE, REPORTS, Call, made_by, methods_of, wrong

MODULES = (
    *(heptarm, heptarm.fri, heptarm.when, heptarm.modes, heptarm.do, heptarm.model, heptarm.shapes),
    heptarm.planning,
    heptarm.testing,
)
#: Made with a running process or a connection; tests/arm/test_bad_values.py has these.
CONNECTED = (
    *("connect", "connect_all", "target_from_env", "Client", "Recorder", "TwoSignalGripper"),
    *("live", "LiveView", "record_client"),
    *("start_together", "states_together", "stop_all", "run"),
)


def forgetting(method: Any) -> Any:
    """A method that adds bodies, after which they go again."""

    @functools.wraps(method)
    def add(world: heptarm.CollisionModel, *args: Any, **kwargs: Any) -> None:
        known = world.bodies
        method(world, *args, **kwargs)
        for body in set(world.bodies) - set(known):
            world.remove(body)

    return add


class Forgetful(heptarm.CollisionModel):
    """A world that is the same for each call."""

    add = forgetting(heptarm.CollisionModel.add)
    add_points = forgetting(heptarm.CollisionModel.add_points)


#: Values whose methods are called, by the name in a report.
OBJECTS: dict[str, object] = {
    "Pose": POSE,
    "PartialPose": heptarm.PartialPose(z=0.3),
    "Dynamics": heptarm.Dynamics(),
    "Ptp": heptarm.ptp(HOME),
    "Lin": heptarm.lin(POSE),
    "Hold": heptarm.hold(1.0),
    "Spline": heptarm.spline([POSE]),
    "Tool": heptarm.Tool("t", frames={"tip": POSE}),
    "Trajectory": bad_values.BY_ANNOTATION["Trajectory"],
    "CollisionGuard": heptarm.CollisionGuard.of(20.0),
    "CollisionModel": Forgetful("iiwa14", scene="table"),
    "CartesianImpedance": CartesianImpedance(),
    "timed": SineImpedance(),
    "force": force,
    "force.along": force.along("z"),
    "force.normal": force.normal("z"),
    "torque": torque,
    "torque[]": torque[2],
    "io": io,
    "io[]": io["a.b"],
    "path": path,
    "Condition": force > 10.0,
    "Output": Output(),
    "Recording": bad_values.RECORDING,
    "Param": heptarm.param([0.1] * 7, low=0.0),
    "Params.set": Params(*Params.flat({"gain": 1.0}), changed=lambda: None),
}


#: Methods that a program has no reason to call; and `save` and `plot`, which draw and write.
CALLED_BY_HEPTARM = ("given", "longest_duration", "path_time", "plot", "replace", "save", "turn_time")
#: What a correct call raises here: a state without torques is stale; there is no file, library, other arm or body.
EXPECTED: dict[str, type[Exception]] = {
    "CollisionGuard.collision": heptarm.StaleState,
    "CollisionGuard.seen": heptarm.StaleState,
    "Trajectory.load": heptarm.CommandRejected,
    "load": heptarm.CommandRejected,
    "load_episodes": heptarm.CommandRejected,
    "save_hdf5": heptarm.CommandRejected,
    "save_lerobot": heptarm.CommandRejected,
    "mesh": heptarm.CommandRejected,
    "CollisionModel.color": heptarm.CommandRejected,
    "CollisionModel.remove": heptarm.CommandRejected,
    "CollisionModel.seen_by": heptarm.CommandRejected,
    "CollisionModel.set_color": heptarm.CommandRejected,
    "CollisionModel.set_arm": heptarm.CommandRejected,
    "law_from": heptarm.CommandRejected,
    "export_model": heptarm.CommandRejected,
    "replay_in_sim": heptarm.CommandRejected,
}


def functions() -> Iterator[Call]:
    """Every public constructor, function and method that needs no arm."""
    for module in MODULES:
        for name in module.__all__:
            found = getattr(module, name)
            if name in REPORTS or name in CONNECTED or isinstance(found, ModuleType):
                continue
            yield from made_by(name, found)
    for name, instance in OBJECTS.items():
        yield from methods_of(name, instance, skip=CALLED_BY_HEPTARM)


CALLS = list(functions())


@pytest.mark.parametrize("call", CALLS, ids=[call.name for call in CALLS])
def test_what_a_parameter_cannot_mean_is_refused(call: Call) -> None:
    found = list(wrong(call))
    assert not found, "\n".join(found)


@pytest.mark.parametrize("call", CALLS, ids=[call.name for call in CALLS])
def test_the_call_works_with_its_baseline(call: Call) -> None:
    """A refusal means something only if the same call works otherwise."""
    if call.name in EXPECTED:
        with pytest.raises(EXPECTED[call.name]):
            call({})
    else:
        call({})


def test_every_public_class_is_covered() -> None:
    """A new class of values needs an entry in OBJECTS only if it has methods with parameters."""
    covered = {type(instance) for instance in OBJECTS.values()}
    missing = []
    for module in MODULES:
        for name in module.__all__:
            found = getattr(module, name)
            if (
                not inspect.isclass(found)
                or name in (*REPORTS, *CONNECTED)
                or issubclass(found, BaseException)
                or any(issubclass(kind, found) or issubclass(found, kind) for kind in covered)
            ):
                continue
            public = [
                member
                for member, value in vars(found).items()
                if not member.startswith("_")
                and inspect.isfunction(value)
                and len(inspect.signature(value).parameters) > 1
            ]
            if public:
                missing.append(f"{name} has {', '.join(public)}")
    assert not missing, f"add an object to OBJECTS of {__file__}: {missing}"


@pytest.mark.parametrize(
    "value",
    [HUGE, 10**6000, -HUGE, [HUGE] * 7, (True,) * 7, [0.0] * 6 + [True]],
    ids=["huge", "longer than python prints", "-huge", "huge entries", "booleans", "one boolean"],
)
def test_numbers_that_python_or_numpy_would_take_are_refused(value: object) -> None:
    with pytest.raises(HeptarmError) as raised:
        array(value, 7, "q")  # type: ignore[arg-type]
    assert raised.value.parameter == "q" and len(str(raised.value)) < 500


def test_a_recursive_list_is_refused() -> None:
    value: list[object] = []
    value.append(value)
    with pytest.raises(HeptarmError):
        numbers(value, "q")  # type: ignore[arg-type]


def test_any_value_can_be_shown() -> None:
    class Odd:
        def __repr__(self) -> str:
            raise RuntimeError("no text")

    assert shown(Odd()) == "a Odd" and len(shown("x" * 9999)) < 300 and "bits" in shown(10**6000)
