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

from heptarm._library import extension_file
from heptarm.errors import CommandRejected, ShapeError
from heptarm.fri.loop import law_interface as interface
from heptarm.fri.loop.compiled import LibraryLaw
from heptarm.fri.loop.parameters import Param
from heptarm.model.dynamics import ROTOR, rigid_bodies
from heptarm.values.checks import Array, array, flag, frozen, instance, integer, numbers, scalar, within, word
from heptarm.values.pose import Pose
from heptarm.values.robot import Body, RobotModel
from heptarm.values.shape import ORIGIN

#: Kind of a session.
Kind: TypeAlias = Literal["torque", "position", "wrench"]
_ANYWHERE = (math.nan,) * 7
_ZEROS7, _ZEROS6, _ZEROS3 = (0.0,) * 7, (0.0,) * 6, (0.0,) * 3
#: Time constant of the low pass of the velocities [s].
FILTER = 0.002
#: Fraction of the robot's torques that a law may use.
TORQUE_FRACTION = 0.3
#: Largest stiffness of the flange, as that of Sunrise's Cartesian impedance, and of a joint [N/m, Nm/rad].
STIFFNESS: Array = frozen([5000.0] * 3 + [300.0] * 3)
JOINT_STIFFNESS = 2000.0
#: Largest mass and damping of a flange that moves under forces [kg, kg m²], [N s/m, Nm s/rad].
MASS: Array = frozen([500.0] * 3 + [50.0] * 3)
DAMPING: Array = frozen([1e4] * 3 + [1e3] * 3)
#: Largest force and moment that a law exerts [N, Nm].
WRENCH: Array = frozen([150.0] * 3 + [50.0] * 3)
#: Further away than anything that an arm reaches [m].
FAR = 1e3


def shared_library() -> Path:
    """The library with the laws: the compiled part of heptarm.

    Raises:
        Unavailable: it is missing.
    """
    return Path(extension_file())


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
    frame: Pose | None = None,
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
    """Impedance of the flange or a frame on it, in base axes, with a compliant posture in the null space; by torques.

    `rt.memory` has `goal` (the goal that it follows), `error` [m, rad], `force` [N, Nm] and `saturated`, the number of
    cycles in which force, moment or a torque was limited.

    Args:
        goal: of the flange, or of `frame`, in the base; None: where it is. Live: `rt.params.goal`, x y z [m] and
            quaternion x y z w.
        frame: what is held, in the flange, such as the tip of a tool; None: the flange. It is the centre of stiffness.
        stiffness: along and about the axes of the base, shape (6,) [N/m, Nm/rad].
        damping: ratio; the damping follows from the stiffness and the mass that the held frame shows.
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
    held = ORIGIN if frame is None else instance(frame, Pose, "frame")
    return ReadyLaw(
        "cartesian_impedance",
        {
            "robot": lambda arm: Param(rigid_bodies(arm, load, rotor=ROTOR), live=False),
            "frame": Param(held.array, live=False),
            "goal": _pose(goal),
            "stiffness": _vector(
                stiffness, "stiffness", high=STIFFNESS, unit="N/m or Nm/rad", rate=2.0 * STIFFNESS
            ),
            "damping": _number(damping, "damping", high=2.0, rate=10.0),
            "force_max": _number(force_max, "force_max", high=500.0, unit="N", rate=1000.0),
            "moment_max": _number(moment_max, "moment_max", high=100.0, unit="Nm", rate=200.0),
            "speed": _number(speed, "speed", high=2.0, above=True, unit="m/s"),
            "turn_speed": _number(turn_speed, "turn_speed", high=6.0, above=True, unit="rad/s"),
            "posture": _joints(posture, "posture", rate=1.0),
            "posture_stiffness": _number(
                posture_stiffness, "posture_stiffness", high=500.0, unit="Nm/rad", rate=1000.0
            ),
            "tau_max": _torques(tau_max),
            "filter": Param(FILTER, live=False),
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
            "robot": lambda arm: Param(rigid_bodies(arm, load, rotor=ROTOR), live=False),
            "goal": _joints(goal, "goal"),
            "stiffness": _vector(
                stiffness, "stiffness", high=(JOINT_STIFFNESS,) * 7, unit="Nm/rad", rate=2.0 * JOINT_STIFFNESS
            ),
            "damping": _number(damping, "damping", high=2.0, rate=10.0),
            "smoothing": _number(smoothing, "smoothing", high=10.0, unit="s", rate=1.0),
            "speed": _speeds(speed),
            "tau_max": _torques(tau_max),
            "filter": Param(FILTER, live=False),
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
    given = numbers(((-FAR,) * 3, (FAR,) * 3) if box is None else box, "box", "two corners")
    if given.shape != (2, 3):
        raise ShapeError(f"box must have shape (2, 3), got {given.shape}", parameter="box", value=box)
    return ReadyLaw(
        "free_guiding",
        {
            "robot": lambda arm: Param(rigid_bodies(arm, rotor=ROTOR), live=False),
            "damping": _vector(damping, "damping", high=(100.0,) * 7, unit="Nm s/rad", rate=200.0),
            "box": Param(given, low=-FAR, high=FAR, unit="m", rate=0.5, check=_check_box, name="box"),
            "wall_stiffness": _number(wall_stiffness, "wall_stiffness", high=1e4, unit="N/m", rate=2e4),
            "wall_damping": _number(wall_damping, "wall_damping", high=1e3, unit="N s/m", rate=2e3),
            "force_max": _number(force_max, "force_max", high=500.0, unit="N", rate=1000.0),
            "q_low": lambda arm: Param(arm.q_min, live=False),
            "q_high": lambda arm: Param(arm.q_max, live=False),
            "margin": _number(margin, "margin", high=1.0, unit="rad", rate=1.0),
            "joint_stiffness": _number(joint_stiffness, "joint_stiffness", high=1e3, unit="Nm/rad", rate=2e3),
            "extra_mass": _number(
                0.0 if extra is None else extra.mass, "extra_mass", high=50.0, unit="kg", rate=2.0
            ),
            "extra_com": _vector(
                _ZEROS3 if extra is None else extra.com,
                "extra_com",
                low=-1.0,
                high=(1.0,) * 3,
                unit="m",
                rate=0.5,
            ),
            "gravity": Param((0.0, 0.0, -9.81), live=False),
            "tau_max": _torques(tau_max),
            "filter": Param(FILTER, live=False),
        },
        {"force": _ZEROS3, "dq": _ZEROS7, "started": 0.0, "saturated": 0.0},
        kind="torque",
    )


def reflected_force(
    *,
    force_max: float = 40.0,
    moment_max: float = 5.0,
    damping: npt.ArrayLike = (2.0, 2.0, 2.0, 2.0, 1.0, 0.5, 0.5),
    tank: float = 1.0,
    passive: bool = True,
    tau_max: npt.ArrayLike | None = None,
) -> ReadyLaw:
    """Guide the arm by hand and feel the wrench of another one, its follower; gravity is compensated.

    The wrench comes late, over a network, and a follower at a stiff wall would make the leader's hand swing up. So an
    observer counts the energy that the torques take from the hand, and they give back no more than that (passivity in
    the time domain). `rt.memory` has `energy`, what is left [J], `fraction` of the wrench that is felt now, and
    `saturated`, the number of cycles in which wrench or torques were limited.

    Args:
        force_max: largest force that is felt [N].
        moment_max: largest moment that is felt [Nm].
        damping: of the joints, shape (7,) [Nm s/rad].
        tank: most energy that is kept for later [J].
        passive: False: without the observer, to compare; the leader may become unstable then.
        tau_max: largest torques, shape (7,) [Nm]; None: 30 % of the robot's.
    """
    return ReadyLaw(
        "reflected_force",
        {
            "robot": lambda arm: Param(rigid_bodies(arm, rotor=ROTOR), live=False),
            "wrench": _vector(
                _ZEROS6, "wrench", low=-WRENCH, high=WRENCH, unit="N or Nm", rate=50.0 * WRENCH
            ),
            "force_max": _number(force_max, "force_max", high=100.0, unit="N", rate=200.0),
            "moment_max": _number(moment_max, "moment_max", high=20.0, unit="Nm", rate=40.0),
            "damping": _vector(damping, "damping", high=(100.0,) * 7, unit="Nm s/rad", rate=200.0),
            "tank": Param(within(tank, "tank", 0.0, 10.0, unit="J"), live=False),
            "is_passive": Param(float(flag(passive, "passive")), live=False),
            "tau_max": _torques(tau_max),
            "filter": Param(FILTER, live=False),
        },
        {
            "wrench": _ZEROS6,
            "energy": 0.0,
            "fraction": 1.0,
            "dq": _ZEROS7,
            "q": _ZEROS7,
            "tau": _ZEROS7,
            "started": 0.0,
            "saturated": 0.0,
        },
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
            "robot": lambda arm: Param(rigid_bodies(arm, rotor=ROTOR), live=False),
            "wrench": _vector(wrench, "wrench", low=-WRENCH, high=WRENCH, unit="N or Nm", rate=5.0 * WRENCH),
            "mass": _vector(mass, "mass", high=MASS, above=True, unit="kg or kg m²", rate=MASS),
            "damping": _vector(damping, "damping", high=DAMPING, unit="N s/m or Nm s/rad", rate=DAMPING),
            "stiffness": _vector(
                stiffness, "stiffness", high=STIFFNESS, unit="N/m or Nm/rad", rate=2.0 * STIFFNESS
            ),
            "dead_band": _number(dead_band, "dead_band", high=100.0, unit="N", rate=100.0),
            "moment_dead_band": _number(
                moment_dead_band, "moment_dead_band", high=30.0, unit="Nm", rate=30.0
            ),
            "speed": _number(speed, "speed", high=1.0, above=True, unit="m/s"),
            "turn_speed": _number(turn_speed, "turn_speed", high=3.0, above=True, unit="rad/s"),
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
            "robot": lambda arm: Param(rigid_bodies(arm, rotor=ROTOR), live=False),
            "goal": _pose(goal),
            "turn": Param(np.ravel(turn), live=False),
            "force_axes": Param(chosen, live=False),
            # zero along axes that are controlled by position
            "wrench": _vector(
                exerted,
                "wrench",
                low=-WRENCH * chosen,
                high=WRENCH * chosen,
                unit="N or Nm",
                rate=5.0 * WRENCH,
            ),
            "mass": _vector(mass, "mass", high=MASS, above=True, unit="kg or kg m²", rate=MASS),
            "damping": _vector(
                damping, "damping", high=DAMPING, above=True, unit="N s/m or Nm s/rad", rate=DAMPING
            ),
            "speed": _number(speed, "speed", high=1.0, above=True, unit="m/s"),
            "turn_speed": _number(turn_speed, "turn_speed", high=3.0, above=True, unit="rad/s"),
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
            "goal": _joints(goal, "goal"),
            "speed": _speeds(speed),
            "acceleration": _limits(acceleration, "acceleration", "ddq_max", fraction=0.25, unit="rad/s²"),
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
            "goal": _joints(goal, "goal"),
            "speed": _speeds(speed),
            "acceleration": _limits(acceleration, "acceleration", "ddq_max", fraction=0.25, unit="rad/s²"),
            "jerk": _limits(jerk, "jerk", "dddq_max", fraction=0.25, unit="rad/s³"),
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
            "goal": _joints(goal, "goal"),
            "frequency": _number(frequency, "frequency", high=100.0, above=True, unit="Hz", rate=50.0),
            "damping": _number(damping, "damping", high=5.0, rate=10.0),
            "order": Param(float(order), live=False),
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
            "frequency": _number(frequency, "frequency", high=500.0, above=True, unit="Hz", rate=250.0),
            "damping": _number(damping, "damping", high=5.0, rate=10.0),
            "order": Param(float(order), live=False),
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
            "push": _vector(force, "push", low=-WRENCH[:3], high=WRENCH[:3], unit="N", rate=100.0),
            "first": Param(first, live=False),
            "second": Param(second, live=False),
            "amplitude": _number(amplitude, "amplitude", high=100.0, unit="N", rate=50.0),
            # the phase is frequency times time: a change on the way would be a step of the force
            "frequency": Param(rate, live=False),
            "second_frequency": Param(rate * within(ratio, "ratio", 0.0, 10.0, above=True), live=False),
            "phase": _number(phase, "phase", low=-FAR, high=FAR, unit="rad", rate=3.0),
            "rise": Param(within(rise, "rise", 0.1, 600.0, unit="s"), live=False),
            "is_spiral": Param(float(pattern == "spiral"), live=False),
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


_ByRobot: TypeAlias = Callable[[RobotModel], Param]


def _number(
    value: float,
    name: str,
    *,
    low: float = 0.0,
    high: float,
    above: bool = False,
    unit: str = "",
    rate: float = math.inf,
) -> Param:
    return Param(
        scalar(value, name, unit=unit), low=low, high=high, above=above, unit=unit, rate=rate, name=name
    )


def _vector(
    value: npt.ArrayLike,
    name: str,
    *,
    low: npt.ArrayLike = 0.0,
    high: npt.ArrayLike,
    above: bool = False,
    unit: str = "",
    rate: npt.ArrayLike = math.inf,
) -> Param:
    """A vector as long as its upper bound."""
    given = array(value, len(np.asarray(high)), name)
    return Param(given, low=low, high=high, above=above, unit=unit, rate=rate, name=name)


def _pose(goal: Pose | None) -> Param:
    """A goal of the flange; the law follows it at its largest speeds."""
    given = _ANYWHERE if goal is None else instance(goal, Pose, "goal").array
    return Param(given, low=-FAR, high=FAR, unit="m", nan=True, check=_check_pose, name="goal")


def _joints(values: npt.ArrayLike | None, name: str, *, rate: float = math.inf) -> _ByRobot:
    """Joint positions within the robot's limits; None: where the arm is."""
    given = array(_ANYWHERE if values is None else values, 7, name, nan=values is None)
    return lambda arm: Param(given, low=arm.q_min, high=arm.q_max, unit="rad", nan=True, rate=rate, name=name)


def _check_pose(values: Array) -> str:
    norm = float(np.linalg.norm(values[3:]))
    return "" if abs(norm - 1.0) <= 1e-3 else f"the quaternion must have norm 1, got {norm:.6g}"


def _check_box(corners: Array) -> str:
    if (corners[0] < corners[1]).all():
        return ""
    return f"the lower corner of the box must be below the upper one, got {corners.tolist()} m"


def _check_body(body: Body | None, name: str) -> None:
    if body is not None:
        instance(body, Body, name)


def _torques(values: npt.ArrayLike | None) -> _ByRobot:
    """Largest torques; None: a fraction of the robot's."""
    given = None if values is None else _vector(values, "tau_max", high=(math.inf,) * 7, unit="Nm").value
    return lambda arm: Param(
        TORQUE_FRACTION * arm.tau_max if given is None else given,
        low=0.0,
        high=arm.tau_max,
        unit="Nm",
        rate=5.0 * arm.tau_max,
        name="tau_max",
    )


def _limits(values: npt.ArrayLike | None, name: str, limit: str, *, fraction: float, unit: str) -> _ByRobot:
    """Limits of the joints; None: a fraction of the robot's, which has them as `limit`."""
    given = None
    if values is not None:
        given = _vector(values, name, high=(math.inf,) * 7, above=True, unit=unit).value

    def made(arm: RobotModel) -> Param:
        most = np.asarray(getattr(arm, limit))
        return Param(
            fraction * most if given is None else given, low=0.0, high=most, above=True, unit=unit, name=name
        )

    return made


def _speeds(values: npt.ArrayLike | None) -> _ByRobot:
    return _limits(values, "speed", "dq_max", fraction=0.5, unit="rad/s")
