"""Every public function with every bad value: the enumeration for tests of values and of the arm.

A call that works is derived from the annotations of a function; then one argument at a time is replaced by something
that it cannot mean. A new public function is covered by itself. `VECTORS`, `ARGUMENTS` and `ACCEPTED` have only what
annotations do not show: sizes, arguments that have to fit together, and values that have a documented meaning.
"""

from __future__ import annotations

import contextlib
import enum
import inspect
import math
import operator
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import heptarm
import heptarm.laws
from heptarm import Cause, HeptarmError, Pose, Result
from heptarm.do import notify
from heptarm.fri import SessionState
from heptarm.modes import CartesianImpedance, Position
from heptarm.planning import find_path
from heptarm.record.demonstration import Demonstrations
from heptarm.values.robot import robot
from heptarm.values.state import State
from heptarm.when import force

ROBOT = robot("iiwa14")
HOME = heptarm.deg(0, 30, 0, -90, 0, 60, 0)
POSE = Pose.of((0.5, 0.1, 0.5), (0.0, 1.0, 0.0, 0.0))
OTHER = Pose.of((0.5, 0.3, 0.5), (0.0, 1.0, 0.0, 0.0))
HUGE = 10**400


def _nothing(*_: object) -> None:
    """A callback."""


#: Something that works, by one of the alternatives of an annotation.
BY_ANNOTATION: dict[str, object] = {
    "float": 0.5,
    "int": 1,
    "str": "z",
    "bool": False,
    "Pose": POSE,
    "Redundancy": heptarm.Redundancy(e1=0.1),
    "Dynamics": heptarm.Dynamics(),
    "Condition": force > 10.0,
    "Mode": Position(),
    "Motion": heptarm.ptp(HOME),
    "CartesianImpedance": CartesianImpedance(),
    "RobotModel": ROBOT,
    "CompiledLaw": heptarm.laws.low_pass(),
    "State": State(),
    "Tool": heptarm.Tool("bad-values"),
    "KnownTool": heptarm.Tool("bad-values"),
    "Workpiece": heptarm.Workpiece("bad-values"),
    "Shape": heptarm.shapes.sphere(0.01),
    "ShapeKind": "box",
    "CollisionGuard": heptarm.CollisionGuard.of(20.0),
    "Trajectory": heptarm.Trajectory.of((0.0, 1.0, 2.0), (HOME, HOME + 0.1, HOME)),
    "Result": Result(Cause.FINISHED),
    "Action": notify("x"),
    "Trigger": heptarm.Trigger(force > 10.0, notify("x")),
    "Law": _nothing,
    "Callable": _nothing,
    "SignalValue": True,
    "SessionState": SessionState.IDLE,
    "Fault": "emergency_stop",
}
#: Number of entries of an array, by the name of the parameter; 7 otherwise.
VECTORS = {
    "xyz": 3,
    "quat": 4,
    "centre": 3,
    "plane": 3,
    "rotvec": 3,
    "direction": 3,
    "point": 3,
    "com": 3,
    "size": 3,
    "inertia": 6,
    "wrench": 6,
    "twist": 6,
    "wrench_max": 6,
    "dwrench_max": 6,
    "times": 3,
}
#: A path that a search has found.
FOUND = find_path(heptarm.CollisionModel("iiwa14"), start=HOME, goal=HOME + 0.1)
#: Arguments that a name does not give away, by function and parameter.
ARGUMENTS: dict[str, dict[str, object]] = {
    "Pose": {"quat": (0.0, 0.0, 0.0, 1.0)},
    "PartialPose": dict.fromkeys("xyzabc", 0.5),
    "Pose.from_matrix": {"matrix": np.eye(4)},
    "Trajectory": {"q": np.zeros((3, 7))},
    "Trajectory.of": {"q": np.zeros((3, 7))},
    "Trajectory.load": {"path": "no such file"},
    "load": {"path": "no such file"},
    "replay_in_sim": {"recording": "no such file"},
    "load_episodes": {"folder": "no such folder", "labels": ("success",)},
    "save_hdf5": {"episodes": Demonstrations(Path("no such folder"), ()), "file": "no such folder/x.hdf5"},
    "save_lerobot": {"episodes": Demonstrations(Path("no such folder"), ()), "folder": "no such folder"},
    "Arm.episodes": {"folder": "no such folder", "cameras": (), "streams": None, "reset": None},
    "export_model": {"path": "no such format"},
    "record_client": {"path": "no folder of mine/run.mcap"},
    "Recording.__getitem__": {"name": "q"},
    "Recording.chart": {"signals": "q"},
    "Arm.camera": {"source": _nothing, "pose": None, "matrix": None, "frame": "flange"},
    "Arm.record": {"path": "no folder of mine/run.mcap"},
    "Camera": {"place": (1.5, 0.0, 1.0), "target": (0.2, 0.0, 0.5), "size": (64, 48), "frame": "base"},
    "Limits": {"q_max": np.full(7, 1.0)},
    "Tool.frame": {"name": "tip"},
    "circ": {"via": OTHER},
    "circle_through": {"via": OTHER, "end": POSE.shifted(0.1)},
    "SineImpedance.lissajous": {"plane": "xy"},
    "SineImpedance.spiral": {"plane": "xy"},
    "Arm.set_override": {"value": 1.0},
    "Arm.fri": {"kind": "monitor"},
    "Arm.touch": {"distance": 0.01, "force": 5.0},
    "Arm.touch_twice": {"distance": 0.01, "force": 5.0},
    "connect": {"target": "127.0.0.1:9"},
    "CollisionModel": {"robot": "iiwa14"},
    **{
        f"{verb}_batch": {"q": np.array([HOME, HOME + 0.1])} for verb in ("forward", "jacobian", "redundancy")
    },
    "solve_batch": {
        "poses": np.eye(4)[None] + np.array([[0, 0, 0, 0.5], [0, 0, 0, 0], [0, 0, 0, 0.5], [0, 0, 0, 0]]),
        "e1": (0.1,),
        "status": (2,),
        "near": np.array([HOME]),
    },
    "CollisionModel.first_on": {"path": (HOME, HOME)},
    "CollisionModel.is_free": {"first": HOME, "last": HOME},
    "CollisionModel.distances": {"q": (HOME, HOME)},
    "CollisionModel.add": {"name": "post", "shape": heptarm.shapes.sphere(0.1), "at": POSE, "color": None},
    "CollisionModel.add_points": {"cloud": [[0.5, 0.0, 0.5]], "color": None},
    "CollisionModel.remove": {"body": "cube"},
    "CollisionModel.set_color": {"body": "cube", "color": (0.9, 0.2, 0.1)},
    "CollisionModel.color": {"body": "cube"},
    "CollisionModel.of": {"outline": heptarm.CollisionModel("iiwa14").outline()},
    "CollisionModel.become": {"other": heptarm.CollisionModel("iiwa14", scene="table")},
    "CollisionModel.allowing": {"pairs": (("cube", "table"),)},
    "Mesh": {
        "vertices": np.vstack([np.zeros(3), 0.1 * np.eye(3)]),
        "faces": np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
    },
    "find_path": {
        "world": heptarm.CollisionModel("iiwa14"),
        "start": HOME,
        "goal": HOME + 0.1,
        "timeout": 60.0,
        "states": 100,
        "known": None,
        "stop": None,
        "progress": None,
    },
    "Arm.find_path": {
        "goal": HOME + 0.1,
        "avoid": heptarm.CollisionModel("iiwa14"),
        "timeout": 60.0,
        "states": 100,
        "stop": None,
        "progress": None,
    },
    "Arm.loaded": {"model": heptarm.CollisionModel("iiwa14")},
    "Arm.follow": {"path": FOUND, "watch": None, "stop": None, "on_progress": None},
    "Upright": {"axis": "z", "within": 0.1, "direction": (0, 0, 1)},
    "OnPlane": {"point": (0.5, 0.0, 0.5), "normal": (0.0, 0.0, 1.0)},
    "OnLine": {"point": (0.5, 0.0, 0.5), "direction": (1.0, 0.0, 0.0)},
    "Region.touching": {"point": (0.5, 0.0, 0.5), "axis": (0.0, 0.0, -1.0)},
    "Region": {"pose": POSE, "box": (0.1, 0.1, 0.1)},
    "Region.of": {"pose": POSE, "box": (0.1, 0.1, 0.1)},
    "height_map": {"heights": [[0.1, 0.2]], "cell": 0.1},
    **{
        f"CollisionModel.{verb}": {"body": "cube"}
        for verb in ("place", "hold", "release", "pose", "held", "shapes")
    },
    "CollisionModel.first_together": {"t": (0.0, 1.0), "q": (HOME, HOME), "others": {}},
    "CollisionModel.with_arm": {"name": "right", "at": POSE.shifted(1.2)},
    "CollisionModel.wait_for_change": {"revision": 0, "timeout": 0.01},
    "Workspace": {"box": ((0.3, -0.5, 0.05), (0.8, 0.5, 0.9))},
    "spiral": {"radius": 0.003},
    "Spiral": {"radius": 0.003},
    "CollisionGuard.named": {"part": heptarm.CollisionGuard.of(20.0).parts[0], "state": None},
    **{
        f"{band}.{side}": {"low": 0.5, "high": 1.5}
        for band in ("force.along", "torque[]", "io[]")
        for side in ("inside", "outside")
    },
}
#: A recording of three states.
RECORDING = heptarm.Recording(
    Path("run.mcap"), {"robot": "iiwa14"}, {"t": np.arange(3.0), "q": np.zeros((3, 7))}, (), (), True
)
#: Functions that only heptarm itself calls.
INTERNAL = ("LiveMemory", "Memory", "Output.on", "Params", "RedundancyBatch", "Stats.of")
_OPEN = "NaN keeps the default"
_FREE = "infinite: no limit"
#: Values with a documented meaning that their type does not show: function or parameter, the bad value, the meaning.
ACCEPTED: dict[tuple[str, str], str] = {
    **{
        (f"CollisionModel.{name}.color", "array"): "red, green, blue"
        for name in ("add", "add_points", "set_color")
    },
    **{(f"PartialPose.{name}", "nan"): "keeps this coordinate" for name in "xyzabc"},
    **{("Dynamics", bad): _OPEN for bad in ("nan", "nan array")},
    ("PoseLimits", "inf"): _FREE,
    **{
        (f"{one}.{parameter}", bad): meaning
        for one in ("param", "Param")
        for parameter, bads, meaning in (
            ("value", ("empty list", "matrix", "too long"), "a parameter has any shape"),
            ("low", ("-inf",), _FREE),
            ("high", ("inf",), _FREE),
            ("rate", ("inf", "inf array"), "at once"),
        )
        for bad in bads
    },
    ("Redundancy.e1", "nan"): _OPEN,
    ("ptp.target", "nan array"): "NaN keeps this joint",
    ("hand_guide.q_min", "nan array"): _OPEN,
    ("hand_guide.q_max", "nan array"): _OPEN,
    ("hold.seconds", "inf"): "until it is cancelled",
    ("Limits.reach", "inf"): _FREE,
    ("Limits.of.reach", "inf"): _FREE,
    ("SineImpedance.total_time", "nan"): _OPEN,
    ("SineImpedance.hold_time", "nan"): _OPEN,
    ("timed.timed.total_time", "nan"): _OPEN,
    ("timed.timed.hold_time", "nan"): _OPEN,
    ("solve.e1", "nan"): _OPEN,
    ("force.tolerance", "nan"): "any accuracy will do",
    ("torque.tolerance", "nan"): "any accuracy will do",
    **{
        (f"Output.{part}", bad): "the guard keeps the last target"
        for part in ("q", "tau", "wrench", "pose", "e1")
        for bad in ("nan", "inf", "-inf", "nan array", "inf array")
    },
    **{
        (f"Client.command.{part}", "nan array"): "keeps the last target"
        for part in ("q", "tau", "wrench", "pose")
    },
    ("Trajectory.positions", "empty list"): "no times",
    ("Trajectory.positions", "too long"): "any number of times",
    ("height_map.heights", "matrix"): "two rows",
    ("CollisionModel.add_points.cloud", "matrix"): "two points",
    ("find_path.keep", "empty list"): "no constraint",
    ("Arm.find_path.keep", "empty list"): "no constraint",
}
#: Operators of conditions and poses; the others are those that every object has.
OPERATORS: dict[str, Callable[[Any, Any], object]] = {
    "__gt__": operator.gt,
    "__lt__": operator.lt,
    "__getitem__": operator.getitem,
    "__and__": operator.and_,
    "__or__": operator.or_,
    "__xor__": operator.xor,
    "__matmul__": operator.matmul,
}
#: Public names that a program receives and never makes: what heptarm reports.
REPORTS = (
    *(
        "Arm",
        "Arms",
        "CameraStream",
        "Circle",
        "Clearance",
        "Collision",
        "CompiledLaw",
        "Contact",
        "Demonstration",
        "Demonstrations",
        "Detour",
        "Episode",
        "EpisodeSet",
        "Deviation",
        "FollowedPath",
        "ForeseenCollision",
        "Fri",
        "Gripper",
        "Insertion",
        "JointServo",
        "LiveMemory",
        "LimitApproach",
        "Path",
        "SearchStats",
        "MotionEvent",
        "MotionHandle",
        "MotionOfArms",
        "Outcome",
        "Picture",
        "Pictures",
        "PoseServo",
        "ProgramPreview",
        "Recording",
        "RepeatedMotion",
        "StatesOfArms",
        "TakenChunk",
        "TouchOnPath",
        "Twin",
        "TwistServo",
        "VelocityServo",
    ),
    *("Recovery", "Replay", "Report", "Result", "Scenario", "ServoStats", "State", "States", "Stats"),
)


# ------------------------------------------------------------------------------------------------- bad values


def bad_values(annotation: str, parameter: str) -> Iterator[tuple[str, object]]:
    """Names and values of what a parameter cannot mean, or can only mean by its annotation."""
    parts = alternatives(annotation)
    size = VECTORS.get(parameter, 7)
    yield "nan", math.nan
    yield "inf", math.inf
    yield "-inf", -math.inf
    yield "none", None
    yield "str", "no such thing"
    yield "bool", True
    yield "huge", HUGE
    yield "-huge", -HUGE
    yield "object", object()
    yield "empty list", []
    yield "generator", (value for value in (0.1,) * size)
    yield "complex", 1j
    yield "bytes", b"x"
    yield "masked", np.ma.masked
    yield "matrix", np.full((2, 3), 0.1)
    yield "masked array", np.ma.masked_array(np.full(size, 0.1), mask=[True] + [False] * (size - 1))
    if any(
        "ArrayLike" in part
        or part in ("Array", "Floats", "Directional", "Given", "Initial")
        or part.startswith("tuple[float")
        for part in parts
    ):
        yield "nan array", [math.nan] + [0.1] * (size - 1)
        yield "inf array", [math.inf] + [0.1] * (size - 1)
        yield "bool in array", [True] + [0.1] * (size - 1)
        yield "bool array", np.full(size, True)
        yield "huge in array", [HUGE] + [0.1] * (size - 1)
        yield "str in array", ["1"] + [0.1] * (size - 1)
        yield "too long", np.full(size + 1, 0.1)
        yield "ragged", [[0.1], [0.1, 0.2]]
    else:
        yield "array", np.full(3, 0.1)
        yield "fraction", 1.5
        yield "negative", -1


def is_array(part: str) -> bool:
    """Whether an annotation is that of an array of numbers."""
    return part in ("npt.ArrayLike", "Array", "Floats", "Directional", "Given", "Initial") or part.startswith(
        ("tuple[float", "Sequence[float")
    )


def alternatives(annotation: str) -> list[str]:
    """The alternatives of an annotation: "A | B[C | D]" is A and B[C | D]."""
    parts, depth, start = [], 0, 0
    for at, char in enumerate(annotation):
        depth += (char in "[(") - (char in "])")
        if char == "|" and not depth:
            parts.append(annotation[start:at].strip())
            start = at + 1
    return [*parts, annotation[start:].strip()]


_NUMBERS = {"float", "SignalValue"}
_REAL = ("fraction", "negative")


def has_meaning(annotation: str, bad: str) -> bool:
    """Whether a value is of an annotated type, so that only its function knows whether it is in range."""
    for part in alternatives(annotation):
        head = part.partition("[")[0]
        if part in ("object", "Any"):
            return True
        if (
            (part == "None" and bad == "none")
            or (part in ("str", "str | Path", "Path") and bad == "str")
            or (part in ("bool", "SignalValue") and bad == "bool")
            or (part in ("float", "SignalValue") and bad in _REAL)
            or (part == "int" and bad == "negative")
            or (head in ("Sequence", "Mapping", "Iterable", "tuple") and bad == "empty list")
            or (head == "Iterable" and bad == "generator")
            or (head in ("npt.ArrayLike", "Directional", "Given", "Initial") and bad in _REAL)
        ):
            return True
    return False


# -------------------------------------------------------------------------------------------------- functions


@dataclass(frozen=True)
class Call:
    """A public function with arguments that work.

    Attributes:
        name: such as "Pose.of" or "ptp".
        function: what to call.
        arguments: of a call that works, without those that have a default.
        parameters: annotations of all parameters, by name.
        positional: parameters that are passed by position, such as the operand of an operator.
    """

    name: str
    function: Callable[..., object]
    arguments: Mapping[str, object]
    parameters: Mapping[str, str]
    positional: tuple[str, ...] = ()

    def __call__(self, changes: Mapping[str, object]) -> object:
        """Call it with some arguments replaced."""
        given = {**self.arguments, **changes}
        first = [given.pop(name) for name in self.positional]
        result = self.function(*first, **given)
        if isinstance(result, contextlib.AbstractContextManager) and hasattr(result, "gen"):
            with result:
                return result
        if inspect.isgenerator(result):
            return list(result)
        return result


class NoBaseline(AssertionError):
    """A parameter for which nothing that works is known."""


def call_of(name: str, function: Callable[..., object], *, skip: tuple[str, ...] = (), by: str = "") -> Call:
    """Derive a call that works.

    Raises:
        NoBaseline: add the parameter to `BY_ANNOTATION`, `VECTORS` or `ARGUMENTS`.
    """
    parameters: dict[str, str] = {}
    arguments: dict[str, object] = dict(ARGUMENTS.get(name, {}))
    positional: list[str] = []
    for one in inspect.signature(function).parameters.values():
        if one.name in skip:
            continue
        annotation = annotation_text(one.annotation)
        if one.kind is inspect.Parameter.VAR_KEYWORD:
            parameters.update(keywords_of(annotation, function))
            continue
        parameters[one.name] = annotation
        if one.kind in (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.VAR_POSITIONAL):
            positional.append(one.name)
        if one.name not in arguments and one.default is inspect.Parameter.empty:
            arguments[one.name] = baseline(name, one.name, annotation)
    return Call(by or name, function, arguments, parameters, tuple(positional))


def annotation_text(annotation: object) -> str:
    """An annotation as its source has it."""
    if isinstance(annotation, str):
        return annotation.strip("\"'") if annotation[:1] in "\"'" else annotation
    if isinstance(annotation, type):
        return annotation.__name__
    return re.sub(r"\b\w+\.", "", str(annotation))


def keywords_of(annotation: str, function: Callable[..., object]) -> dict[str, str]:
    """Keywords and annotations of `**settings: Unpack[Keywords]`."""
    inner = re.fullmatch(r"(?:\w+\.)*Unpack\[(.+)\]", annotation)
    if inner is None:
        return {}
    kind = eval(inner[1], dict(vars(inspect.getmodule(inspect.unwrap(function)))))
    return {name: getattr(hint, "__forward_arg__", str(hint)) for name, hint in kind.__annotations__.items()}


def baseline(function: str, parameter: str, annotation: str) -> object:
    """Something that works for a parameter."""
    for part in alternatives(annotation):
        head = part.rpartition(".")[2].partition("[")[0] if "[" not in part else part.partition("[")[0]
        if is_array(part):
            return np.linspace(0.1, 0.2, VECTORS.get(parameter, 7))
        if head == "Literal":
            return part[part.index("[") + 1 :].split(",")[0].strip(" '\"]")
        if head in BY_ANNOTATION:
            return BY_ANNOTATION[head]
        if head == "Mapping":
            return {"gain": baseline(function, parameter, part[part.index(",") + 1 : -1].strip())}
        if head == "Sequence":
            return [baseline(function, parameter, part[part.index("[") + 1 : -1])]
    raise NoBaseline(
        f"no argument that works is known for {parameter}: {annotation} of {function}(); add it to BY_ANNOTATION, "
        "VECTORS or ARGUMENTS of tests/bad_values.py"
    )


def methods_of(name: str, instance: object, *, skip: tuple[str, ...] = ()) -> Iterator[Call]:
    """Methods, settable properties and operators of an object."""
    kind = type(instance)
    for member in dir(kind):
        if member in skip:
            continue
        found = inspect.getattr_static(kind, member)
        if member in OPERATORS and member in {
            known
            for base in kind.__mro__[:-1]
            for known in vars(base)
            if not isinstance(instance, tuple | dict)
        }:
            function = getattr(instance, member)
            call = call_of(f"{name}.{member}", function)
            (operand,) = call.parameters
            bound = _operated(OPERATORS[member], instance)
            yield Call(call.name, bound, call.arguments, call.parameters, (operand,))
        elif member.startswith("_"):
            continue
        elif inspect.isfunction(found):
            yield call_of(f"{name}.{member}", getattr(instance, member))
        elif isinstance(found, property) and found.fset is not None:
            parameter = list(inspect.signature(found.fset).parameters.values())[1]
            annotation = annotation_text(parameter.annotation)
            yield Call(
                f"{name}.{member}",
                _setter(instance, member),
                {parameter.name: getattr(instance, member)},
                {parameter.name: annotation},
                (parameter.name,),
            )


def _operated(operation: Callable[[Any, Any], object], instance: object) -> Callable[..., object]:
    return lambda operand: operation(instance, operand)


def _setter(instance: object, name: str) -> Callable[..., object]:
    return lambda value: setattr(instance, name, value)


def made_by(name: str, found: object) -> Iterator[Call]:
    """Constructor, class methods and static methods of a class; or the function itself."""
    if inspect.isfunction(found):
        yield call_of(name, found)
    elif inspect.isclass(found) and not issubclass(found, BaseException | enum.Enum):
        if name not in INTERNAL:
            yield call_of(name, found)
        for member in dir(found):
            if (
                not member.startswith("_")
                and f"{name}.{member}" not in INTERNAL
                and isinstance(inspect.getattr_static(found, member), classmethod | staticmethod)
            ):
                yield call_of(f"{name}.{member}", getattr(found, member))


# ------------------------------------------------------------------------------------------------------ check


def wrong(call: Call, *, only_meaningless: bool = False) -> Iterator[str]:
    """What goes wrong with bad values, in words.

    Args:
        call: the call.
        only_meaningless: leave out values that only the function itself can refuse, such as -1 for a number: on an arm
            they may be carried out.
    """
    for parameter, annotation in call.parameters.items():
        for bad, value in bad_values(annotation, parameter):
            if only_meaningless and has_meaning(annotation, bad):
                continue
            if (call.name, bad) in ACCEPTED or (f"{call.name}.{parameter}", bad) in ACCEPTED:
                continue
            what = f"{call.name}({parameter}={bad})"
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("error")
                    call({parameter: value})
            except HeptarmError as error:
                if not error.text or not (error.parameter or parameter in error.text):
                    yield f"{what} raises an error that does not name the parameter: {error}"
            except TypeError:
                pass
            except OSError as error:  # of a path
                if not has_meaning(annotation, bad):
                    yield f"{what} raises {error}"
            except BaseException as error:
                yield f"{what} raises {type(error).__name__}: {error}"
            else:
                if not has_meaning(annotation, bad):
                    yield f"{what} is accepted"
