"""The ready laws: their parameters and memories, in the order of the structures of ready_laws.c.

Torque laws are for `arm.fri("torque", mode=JointImpedance(stiffness=0.0), ...)`: the cabinet compensates gravity and
Coriolis torques there, and adds the law's. A goal of NaN is where the arm is when the law begins.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm._library import Unavailable, extension_file
from heptarm.errors import CommandRejected, ShapeError
from heptarm.fri.loop import law_interface as interface
from heptarm.fri.loop.compiled import LibraryLaw
from heptarm.values.arrays import Array, array, finite, instance, integer, numbers, scalar, within, word
from heptarm.values.pose import Pose
from heptarm.values.robot import Body, RobotModel

#: Kind of a session.
Kind: TypeAlias = Literal["torque", "position", "wrench"]
_ANYWHERE = (math.nan,) * 7
_ZEROS7, _ZEROS6, _ZEROS3 = (0.0,) * 7, (0.0,) * 6, (0.0,) * 3
#: Time constant of the low pass of the velocities [s].
FILTER = 0.002
#: Inertia that a motor is assumed to show behind its gear and its torque control, as in the simulator [kg m²].
ROTOR = 0.1
#: Fraction of the robot's torques that a law may use.
TORQUE_FRACTION = 0.3


def shared_library() -> Path:
    """The library with the laws: the compiled part of heptarm.

    Raises:
        CommandRejected: it is missing.
    """
    try:
        return Path(extension_file())
    except Unavailable as error:
        raise CommandRejected(
            f"the ready laws are not available: {error}", parameter="law", hint=error.hint
        ) from None


def constants(arm: RobotModel, load: Body | None = None) -> Array:
    """`struct robot` of dynamics.h: the links, the load on the flange, the motors; shape (105,)."""
    links = arm.links
    inertia = links.inertia.reshape(7, 9)[:, [0, 4, 8, 1, 2, 5]]
    body = load or Body(0.0, np.zeros(3))
    parts = (
        *(links.origin, links.mass, links.com, inertia, links.flange),
        *([body.mass], body.com, body.inertia, [ROTOR]),
    )
    return np.concatenate([np.ravel(part) for part in parts])


class ReadyLaw(LibraryLaw):
    """A law of this package; made by its functions.

    Args:
        name: of its function in ready_laws.c.
        params: parameters; a function of the robot where they depend on it.
        memory: members of its memory.
        kind: kind of the session that it is for: "torque", "position" or "wrench".
    """

    def __init__(
        self, name: str, params: Mapping[str, Any], memory: Mapping[str, npt.ArrayLike], *, kind: Kind
    ) -> None:
        fixed = {key: value for key, value in params.items() if not callable(value)}
        super().__init__(Path("heptarm._native"), name, fixed, memory)
        self._all = dict(params)
        self.kind: Kind = kind

    def parameters(self, arm: RobotModel) -> Mapping[str, Any]:
        """Parameters and their initial values for a robot."""
        return {key: value(arm) if callable(value) else value for key, value in self._all.items()}

    def load(self, params: interface.Schema, memory: interface.Schema) -> tuple[int, object]:
        """Load the law; see `CompiledLaw.load`."""
        self.path = shared_library()
        return super().load(params, memory)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name}, for sessions of kind {self.kind}>"


def cartesian_impedance(
    goal: Pose | None = None,
    *,
    stiffness: npt.ArrayLike = (1000.0, 1000.0, 1000.0, 60.0, 60.0, 60.0),
    damping: float = 0.7,
    force_max: float = 60.0,
    moment_max: float = 15.0,
    speed: float = 0.25,
    turn_speed: float = 1.0,
    posture: npt.ArrayLike | None = None,
    posture_stiffness: float = 10.0,
    tau_max: npt.ArrayLike | None = None,
    load: Body | None = None,
) -> ReadyLaw:
    """Impedance of the flange in base axes with a compliant posture in the null space, by torques.

    `rt.memory` has `goal` (the goal that it follows), `error` [m, rad], `force` [N, Nm] and `saturated`, the number of
    cycles in which force, moment or a torque was limited.

    Args:
        goal: of the flange in the base; None: where it is. Live: `rt.params.goal`, x y z [m] and quaternion x y z w.
        stiffness: along and about the axes of the base, shape (6,) [N/m, Nm/rad].
        damping: ratio; the damping follows from the stiffness and the mass that the flange shows.
        force_max: largest force of the spring [N].
        moment_max: largest moment of the spring [Nm].
        speed: largest speed of the followed goal [m/s].
        turn_speed: largest angular velocity of the followed goal [rad/s].
        posture: joint positions of the null space, shape (7,) [rad]; None: those at the beginning.
        posture_stiffness: stiffness of every joint in the null space [Nm/rad].
        tau_max: largest torques, shape (7,) [Nm]; None: 30 % of the robot's.
        load: on the flange, beside the load data of the cabinet.
    """
    _check_body(load, "load")
    return ReadyLaw(
        "cartesian_impedance",
        {
            "robot": lambda arm: constants(arm, load),
            "goal": _ANYWHERE if goal is None else instance(goal, Pose, "goal").array,
            "stiffness": _positive(array(stiffness, 6, "stiffness"), "stiffness"),
            "damping": within(damping, "damping", 0.0, 2.0),
            "force_max": within(force_max, "force_max", 0.0, 500.0, unit="N"),
            "moment_max": within(moment_max, "moment_max", 0.0, 100.0, unit="Nm"),
            "speed": within(speed, "speed", 0.0, 2.0, above=True, unit="m/s"),
            "turn_speed": within(turn_speed, "turn_speed", 0.0, 6.0, above=True, unit="rad/s"),
            "posture": _ANYWHERE if posture is None else array(posture, 7, "posture"),
            "posture_stiffness": within(posture_stiffness, "posture_stiffness", 0.0, 500.0, unit="Nm/rad"),
            "tau_max": _torques(tau_max),
            "filter": FILTER,
        },
        {
            "goal": _ZEROS7,
            "error": _ZEROS6,
            "force": _ZEROS6,
            "dq": _ZEROS7,
            "posture": _ZEROS7,
            "started": 0.0,
            "saturated": 0.0,
        },
        kind="torque",
    )


def joint_impedance(
    goal: npt.ArrayLike | None = None,
    *,
    stiffness: npt.ArrayLike = (200.0, 200.0, 150.0, 150.0, 80.0, 50.0, 30.0),
    damping: float = 0.7,
    smoothing: float = 0.1,
    speed: npt.ArrayLike | None = None,
    tau_max: npt.ArrayLike | None = None,
    load: Body | None = None,
) -> ReadyLaw:
    """Joint impedance around a smoothed goal, with the torques of its acceleration M(q) ddq as feed-forward.

    `rt.memory` has `q` and `dq_goal` (the reference), `feed_forward` [Nm] and `saturated`, the number of cycles in
    which a torque was limited.

    Args:
        goal: shape (7,) [rad]; None: where the arm is. Live: `rt.params.goal`.
        stiffness: shape (7,) [Nm/rad].
        damping: ratio of each joint, with its inertia at the present posture.
        smoothing: time constant with which the reference follows the goal [s].
        speed: largest speed of the reference, shape (7,) [rad/s]; None: half of the robot's.
        tau_max: largest torques, shape (7,) [Nm]; None: 30 % of the robot's.
        load: on the flange, beside the load data of the cabinet.
    """
    _check_body(load, "load")
    return ReadyLaw(
        "joint_impedance",
        {
            "robot": lambda arm: constants(arm, load),
            "goal": _ANYWHERE if goal is None else array(goal, 7, "goal"),
            "stiffness": _positive(array(stiffness, 7, "stiffness"), "stiffness"),
            "damping": within(damping, "damping", 0.0, 2.0),
            "smoothing": within(smoothing, "smoothing", 0.0, 10.0, unit="s"),
            "speed": _speeds(speed),
            "tau_max": _torques(tau_max),
            "filter": FILTER,
        },
        {
            "q": _ZEROS7,
            "dq_goal": _ZEROS7,
            "dq": _ZEROS7,
            "feed_forward": _ZEROS7,
            "started": 0.0,
            "saturated": 0.0,
        },
        kind="torque",
    )


def free_guiding(
    *,
    box: npt.ArrayLike | None = None,
    damping: npt.ArrayLike = (2.0, 2.0, 2.0, 2.0, 1.0, 0.5, 0.5),
    wall_stiffness: float = 1500.0,
    wall_damping: float = 60.0,
    force_max: float = 80.0,
    margin: float = 0.1,
    joint_stiffness: float = 100.0,
    extra: Body | None = None,
    tau_max: npt.ArrayLike | None = None,
) -> ReadyLaw:
    """Guide the arm by hand inside virtual walls; gravity is compensated.

    The walls hold the flange in a box and the joints inside their limits. They push with a spring and a damper, and
    never pull. `rt.memory` has `force`, that of the walls [N], and `saturated`, the number of cycles in which it or a
    torque was limited.

    Args:
        box: lower and upper corner for the flange in the base, shape (2, 3) [m]; None: no walls.
        damping: of the joints, shape (7,) [Nm s/rad].
        wall_stiffness: of the walls [N/m].
        wall_damping: of the walls [N s/m].
        force_max: largest force of the walls [N].
        margin: distance to the limits of the joints at which their walls begin [rad].
        joint_stiffness: of these walls [Nm/rad].
        extra: load whose weight the cabinet does not know.
        tau_max: largest torques, shape (7,) [Nm]; None: 30 % of the robot's.
    """
    _check_body(extra, "extra")
    given = numbers(((-1e3,) * 3, (1e3,) * 3) if box is None else box, "box", "two corners")
    if given.shape != (2, 3):
        raise ShapeError(f"box must have shape (2, 3), got {given.shape}", parameter="box", value=box)
    corners = array(given[0], 3, "box"), array(given[1], 3, "box")
    if not (corners[0] < corners[1]).all():
        raise CommandRejected(
            f"the lower corner of the box must be below the upper one, got {corners[0].tolist()} and "
            f"{corners[1].tolist()} m",
            parameter="box",
            value=box,
            hint="box=((x, y, z), (x, y, z)), lower corner first",
        )
    return ReadyLaw(
        "free_guiding",
        {
            "robot": constants,
            "damping": _positive(array(damping, 7, "damping"), "damping"),
            "low": corners[0],
            "high": corners[1],
            "wall_stiffness": within(wall_stiffness, "wall_stiffness", 0.0, 1e4, unit="N/m"),
            "wall_damping": within(wall_damping, "wall_damping", 0.0, 1e3, unit="N s/m"),
            "force_max": within(force_max, "force_max", 0.0, 500.0, unit="N"),
            "q_low": lambda arm: arm.q_min,
            "q_high": lambda arm: arm.q_max,
            "margin": within(margin, "margin", 0.0, 1.0, unit="rad"),
            "joint_stiffness": within(joint_stiffness, "joint_stiffness", 0.0, 1e3, unit="Nm/rad"),
            "extra_mass": 0.0 if extra is None else extra.mass,
            "extra_com": _ZEROS3 if extra is None else extra.com,
            "gravity": (0.0, 0.0, -9.81),
            "tau_max": _torques(tau_max),
            "filter": FILTER,
        },
        {"force": _ZEROS3, "dq": _ZEROS7, "started": 0.0, "saturated": 0.0},
        kind="torque",
    )


def admittance(
    *,
    mass: npt.ArrayLike = (8.0, 8.0, 8.0, 0.4, 0.4, 0.4),
    damping: npt.ArrayLike = (200.0, 200.0, 200.0, 8.0, 8.0, 8.0),
    stiffness: npt.ArrayLike = _ZEROS6,
    wrench: npt.ArrayLike = _ZEROS6,
    dead_band: float = 3.0,
    moment_dead_band: float = 0.5,
    speed: float = 0.2,
    turn_speed: float = 0.8,
) -> ReadyLaw:
    """Let the flange of a position-controlled arm move under the external wrench like a mass on a spring and a damper.

    `rt.memory` has `wrench` (external, base axes, after the dead band [N, Nm]), `offset` from the beginning [m, rad],
    `velocity` and `saturated`, the number of cycles in which a speed was limited.

    Args:
        mass: along and about the axes of the base, shape (6,) [kg, kg m²].
        damping: shape (6,) [N s/m, Nm s/rad].
        stiffness: towards the pose at the beginning, shape (6,) [N/m, Nm/rad].
        wrench: that pushes in addition, shape (6,) [N, Nm]; pressing on a surface with it is force control.
        dead_band: external force that does not move the flange [N].
        moment_dead_band: external moment that does not turn it [Nm].
        speed: largest speed [m/s].
        turn_speed: largest angular velocity [rad/s].
    """
    return ReadyLaw(
        "admittance_of_the_flange",
        {
            "robot": constants,
            "wrench": array(wrench, 6, "wrench"),
            "mass": _positive(array(mass, 6, "mass"), "mass", above=True),
            "damping": _positive(array(damping, 6, "damping"), "damping"),
            "stiffness": _positive(array(stiffness, 6, "stiffness"), "stiffness"),
            "dead_band": within(dead_band, "dead_band", 0.0, 100.0, unit="N"),
            "moment_dead_band": within(moment_dead_band, "moment_dead_band", 0.0, 30.0, unit="Nm"),
            "speed": within(speed, "speed", 0.0, 1.0, above=True, unit="m/s"),
            "turn_speed": within(turn_speed, "turn_speed", 0.0, 3.0, above=True, unit="rad/s"),
        },
        {
            "q": _ZEROS7,
            "offset": _ZEROS6,
            "velocity": _ZEROS6,
            "wrench": _ZEROS6,
            "started": 0.0,
            "saturated": 0.0,
        },
        kind="position",
    )


def hybrid(
    goal: Pose | None = None,
    *,
    force_axes: npt.ArrayLike = (0, 0, 1, 0, 0, 0),
    wrench: npt.ArrayLike = (0.0, 0.0, -10.0, 0.0, 0.0, 0.0),
    frame: Pose | None = None,
    mass: npt.ArrayLike = (8.0, 8.0, 8.0, 0.4, 0.4, 0.4),
    damping: npt.ArrayLike = (800.0, 800.0, 800.0, 40.0, 40.0, 40.0),
    speed: float = 0.1,
    turn_speed: float = 0.5,
) -> ReadyLaw:
    """Exert forces along some axes of a frame and follow a goal along the others: hybrid force and position control.

    Without contact the flange moves at the wrench divided by the damping. `rt.memory` has, in axes of the frame,
    `wrench` (external [N, Nm]), `error` to the followed `goal` [m, rad] and `velocity` along the force-controlled axes;
    `saturated` is the number of cycles in which a speed was limited.

    Args:
        goal: of the flange in the base; None: where it is. Live: `rt.params.goal`. Along force-controlled axes it does
            not count.
        force_axes: 1 for each axis of the frame that is controlled by force, 0 for the others, shape (6,).
        wrench: that the flange exerts along those axes, shape (6,) [N, Nm]. Live: `rt.params.wrench`.
        frame: whose orientation in the base the axes have; None: that of the base.
        mass: along and about the force-controlled axes, shape (6,) [kg, kg m²].
        damping: shape (6,) [N s/m, Nm s/rad]. The stiffer the surface, the more it needs.
        speed: largest speed of the followed goal, and along force-controlled axes [m/s].
        turn_speed: largest angular velocity of both [rad/s].
    """
    chosen, exerted = array(force_axes, 6, "force_axes"), array(wrench, 6, "wrench")
    if not np.isin(chosen, (0.0, 1.0)).all():
        raise CommandRejected(
            f"force_axes must be 1 or 0 for each axis, got {chosen.tolist()}",
            parameter="force_axes",
            value=chosen.tolist(),
        )
    if (exerted[chosen == 0.0] != 0.0).any():
        raise CommandRejected(
            f"wrench must be 0 along axes that are not controlled by force, got {exerted.tolist()}",
            parameter="wrench",
            value=exerted.tolist(),
            hint="set the axis to 1 in force_axes",
        )
    turn = np.eye(3) if frame is None else instance(frame, Pose, "frame").rotation
    return ReadyLaw(
        "hybrid_of_the_flange",
        {
            "robot": constants,
            "goal": _ANYWHERE if goal is None else instance(goal, Pose, "goal").array,
            "turn": np.ravel(turn),
            "force_axes": chosen,
            "wrench": exerted,
            "mass": _positive(array(mass, 6, "mass"), "mass", above=True),
            "damping": _positive(array(damping, 6, "damping"), "damping", above=True),
            "speed": within(speed, "speed", 0.0, 1.0, above=True, unit="m/s"),
            "turn_speed": within(turn_speed, "turn_speed", 0.0, 3.0, above=True, unit="rad/s"),
        },
        {
            "goal": _ZEROS7,
            "q": _ZEROS7,
            "wrench": _ZEROS6,
            "error": _ZEROS6,
            "velocity": _ZEROS6,
            "started": 0.0,
            "saturated": 0.0,
        },
        kind="position",
    )


def minimum_jerk(
    goal: npt.ArrayLike | None = None,
    *,
    speed: npt.ArrayLike | None = None,
    acceleration: npt.ArrayLike | None = None,
) -> ReadyLaw:
    """Move to a goal that may change at any time, along polynomials of least jerk; all joints arrive together.

    `rt.memory` has `left`, the time to the goal [s], and the setpoint `q`, `dq`, `ddq`.

    Args:
        goal: shape (7,) [rad]; None: where the arm is. Live: `rt.params.goal`.
        speed: largest speeds, shape (7,) [rad/s]; None: half of the robot's.
        acceleration: largest accelerations, shape (7,) [rad/s²]; None: a quarter of the robot's.
    """
    return ReadyLaw(
        "minimum_jerk_targets",
        {
            "goal": _ANYWHERE if goal is None else array(goal, 7, "goal"),
            "speed": _speeds(speed),
            "acceleration": _quarter(acceleration, "acceleration", "ddq_max"),
        },
        {"q": _ZEROS7, "dq": _ZEROS7, "ddq": _ZEROS7, "goal": _ZEROS7, "left": 0.0, "started": 0.0},
        kind="position",
    )


def jerk_limited(
    goal: npt.ArrayLike | None = None,
    *,
    speed: npt.ArrayLike | None = None,
    acceleration: npt.ArrayLike | None = None,
    jerk: npt.ArrayLike | None = None,
) -> ReadyLaw:
    """Move to a goal that may change at any time, each joint on its own as fast as its limits allow, without overshoot.

    The joints arrive at different times; `minimum_jerk` lets them arrive together. `rt.memory` has the setpoint `q`,
    `dq`, `ddq`, and `is_there`, 1 once all have arrived.

    Args:
        goal: shape (7,) [rad]; None: where the arm is. Live: `rt.params.goal`, for instance from a camera at 30 Hz.
        speed: largest speeds, shape (7,) [rad/s]; None: half of the robot's. Live, as the others.
        acceleration: largest accelerations, shape (7,) [rad/s²]; None: a quarter of the robot's.
        jerk: largest jerks, shape (7,) [rad/s³]; None: a quarter of the robot's.
    """
    return ReadyLaw(
        "jerk_limited_targets",
        {
            "goal": _ANYWHERE if goal is None else array(goal, 7, "goal"),
            "speed": _speeds(speed),
            "acceleration": _quarter(acceleration, "acceleration", "ddq_max"),
            "jerk": _quarter(jerk, "jerk", "dddq_max"),
        },
        {"q": _ZEROS7, "dq": _ZEROS7, "ddq": _ZEROS7, "is_there": 0.0, "started": 0.0},
        kind="position",
    )


def low_pass(
    goal: npt.ArrayLike | None = None, *, frequency: float = 1.0, order: int = 2, damping: float = 1.0
) -> ReadyLaw:
    """Follow a goal through a low pass; `rt.memory` has the setpoint `q` and, of second order, `dq`.

    Args:
        goal: shape (7,) [rad]; None: where the arm is. Live: `rt.params.goal`.
        frequency: corner frequency [Hz].
        order: 1 or 2.
        damping: ratio of a filter of second order; 1 is the fastest one without overshoot.
    """
    integer(order, "order", 1, 2)
    return ReadyLaw(
        "low_pass_of_targets",
        {
            "goal": _ANYWHERE if goal is None else array(goal, 7, "goal"),
            "frequency": within(frequency, "frequency", 0.0, 100.0, above=True, unit="Hz"),
            "damping": within(damping, "damping", 0.0, 5.0),
            "order": float(order),
        },
        {"q": _ZEROS7, "dq": _ZEROS7, "started": 0.0},
        kind="position",
    )


def low_pass_readings(*, frequency: float = 10.0, order: int = 1, damping: float = 1.0) -> ReadyLaw:
    """Filter what the arm measures, while it follows its motion of the cabinet.

    `rt.memory` has the filtered `dq` [rad/s], `tau` and `tau_ext` [Nm] and `wrench` [N, Nm]. For laws of your own in C,
    heptarm_filter.h has the same filters.

    Args:
        frequency: corner frequency [Hz]. Live: `rt.params.frequency`.
        order: 1 or 2.
        damping: ratio of a filter of second order; 1 is the fastest one without overshoot.
    """
    integer(order, "order", 1, 2)
    return ReadyLaw(
        "low_pass_of_readings",
        {
            "frequency": within(frequency, "frequency", 0.0, 500.0, above=True, unit="Hz"),
            "damping": within(damping, "damping", 0.0, 5.0),
            "order": float(order),
        },
        {
            "dq": _ZEROS7,
            "tau": _ZEROS7,
            "tau_ext": _ZEROS7,
            "wrench": _ZEROS6,
            "rate": (0.0,) * 27,
            "started": 0.0,
        },
        kind="position",
    )


def search(
    pattern: str = "spiral",
    *,
    push: npt.ArrayLike = (0.0, 0.0, -10.0),
    amplitude: float = 8.0,
    frequency: float = 1.0,
    ratio: float = 1.5,
    phase: float = 0.0,
    rise: float = 5.0,
) -> ReadyLaw:
    """Search by a force in the plane across a push: an Archimedean spiral, or a Lissajous figure.

    For `arm.fri("wrench", mode=CartesianImpedance(...))`: the deflection is the force divided by the stiffness.
    `rt.memory` has `force` [N], `turns`, and `done`, 1 once the figure has its full size.

    Args:
        pattern: "spiral" or "lissajous".
        push: force of the push in the base, shape (3,) [N].
        amplitude: largest force across it [N].
        frequency: turns of the spiral, or frequency along the first direction [Hz].
        ratio: frequency along the second direction of a Lissajous figure divided by that along the first one.
        phase: of the second direction [rad].
        rise: time in which the figure grows to its full size [s].
    """
    word(pattern, "pattern", ("spiral", "lissajous"))
    force = array(push, 3, "push")
    first, second = across(force)
    rate = within(frequency, "frequency", 0.0, 15.0, above=True, unit="Hz")
    return ReadyLaw(
        "search_by_force",
        {
            "push": force,
            "first": first,
            "second": second,
            "amplitude": within(amplitude, "amplitude", 0.0, 100.0, unit="N"),
            "frequency": rate,
            "second_frequency": rate * within(ratio, "ratio", 0.0, 10.0, above=True),
            "phase": finite(phase, "phase", unit="rad"),
            "rise": within(rise, "rise", 0.1, 600.0, unit="s"),
            "is_spiral": float(pattern == "spiral"),
        },
        {"force": _ZEROS3, "turns": 0.0, "done": 0.0},
        kind="wrench",
    )


def across(direction: Array) -> tuple[Array, Array]:
    """Two unit vectors across a direction and across each other; those of x and y for a direction along z."""
    length = float(np.linalg.norm(direction))
    axis = direction / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    start = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    first = start - (start @ axis) * axis
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first) * (1.0 if axis[np.argmax(np.abs(axis))] >= 0.0 else -1.0)


def _positive(values: Array, name: str, *, above: bool = False) -> Array:
    """Numbers that are not negative; with `above`, positive."""
    wrong = values <= 0.0 if above else values < 0.0
    if wrong.any():
        index = int(np.argmax(wrong))
        bound = "above 0" if above else "0 or more"
        raise CommandRejected(
            f"{name} must be {bound}, got {scalar(values[index], name):g} at index {index}",
            parameter=f"{name}[{index}]",
            value=float(values[index]),
            allowed=bound,
        )
    return values


def _check_body(body: Body | None, name: str) -> None:
    if body is not None:
        instance(body, Body, name)


def _torques(values: npt.ArrayLike | None) -> Array | Callable[[RobotModel], Array]:
    if values is None:
        return lambda arm: TORQUE_FRACTION * arm.tau_max
    return _positive(array(values, 7, "tau_max"), "tau_max")


def _speeds(values: npt.ArrayLike | None) -> Array | Callable[[RobotModel], Array]:
    if values is None:
        return lambda arm: 0.5 * arm.dq_max
    return _positive(array(values, 7, "speed"), "speed", above=True)


def _quarter(values: npt.ArrayLike | None, name: str, limit: str) -> Array | Callable[[RobotModel], Array]:
    """Limits of the joints; None: a quarter of the robot's, which has them as `limit`."""
    if values is None:
        return lambda arm: 0.25 * np.asarray(getattr(arm, limit))
    return _positive(array(values, 7, name), name, above=True)
