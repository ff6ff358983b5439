"""The LBR robots: dimensions, limits, masses and inertias, and the media flanges that KUKA mounts on them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.checks import Array, Value, array, frozen, one_or_each, scalar, shown, within
from heptarm.values.pose import Pose, deg
from heptarm.values.text import columns, fixed, lines


def _no_inertia() -> Array:
    return frozen(np.zeros(6))


@dataclass(frozen=True, slots=True, eq=False)
class Body(Value):
    """A rigid body attached to the flange: a tool or a load.

    Attributes:
        mass: [kg], up to 50.
        com: centre of mass in the flange frame, shape (3,) [m].
        inertia: xx yy zz xy xz yz about the centre of mass, axes of the flange, shape (6,) [kg m²].

    Raises:
        ShapeError: wrong shapes.
        LimitError: a mass outside its range, a number that is not finite, or an inertia that no body has.
    """

    mass: float
    com: Array
    inertia: Array = field(default_factory=_no_inertia)

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", within(self.mass, "mass", 0.0, 50.0, unit="kg"))
        object.__setattr__(self, "com", array(self.com, 3, "com"))
        object.__setattr__(self, "inertia", array(self.inertia, 6, "inertia"))
        least, middle, most = np.linalg.eigvalsh(symmetric(self.inertia)).tolist()
        if least < -1e-12 or least + middle < most - 1e-12:
            raise LimitError(
                f"inertia must be a rigid body's, got principal moments {least:g}, {middle:g}, {most:g} kg m²",
                code=2,
                parameter="inertia",
                value=self.inertia.tolist(),
                allowed="none negative, none above the sum of the other two",
                hint="check the order xx yy zz xy xz yz and that it is about the centre of mass",
            )

    def placed(self, pose: Pose) -> Body:
        """The same body seen from the frame in which its own frame has a pose."""
        turn = pose.rotation
        return Body(self.mass, pose.xyz + turn @ self.com, _entries(turn @ symmetric(self.inertia) @ turn.T))

    def joined(self, other: Body) -> Body:
        """This body and another one in the same frame as one."""
        mass = self.mass + other.mass
        if mass == 0.0:
            return self
        com = (self.mass * self.com + other.mass * other.com) / mass
        inertia = np.zeros((3, 3))
        for body in (self, other):
            by = body.com - com
            inertia += symmetric(body.inertia) + body.mass * (float(by @ by) * np.eye(3) - np.outer(by, by))
        return Body(mass, com, _entries(inertia))


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Friction(Value):
    """Friction of the joints; KUKA publishes none: identify yours by `heptarm.calibration.simulator`.

    With s = tanh(dq / transition): viscous · dq + (coulomb + (breakaway - coulomb) · exp(-(dq / stribeck)²)) · s +
    asymmetry · s² (Armstrong-Hélouvry, Dupont, Canudas de Wit, "A survey of models ... for the control of machines
    with friction", 1994).

    Args:
        viscous: [Nm s/rad], one number for all joints or seven, not negative.
        coulomb: [Nm], likewise.
        transition: joint speed at which the Coulomb friction has 76 % of its value [rad/s], above 0.
        breakaway: at the slowest motion [Nm], likewise; None: as `coulomb`.
        stribeck: joint speed at which 37 % of breakaway beyond Coulomb friction are left [rad/s], above 0.
        asymmetry: by which friction in the positive direction exceeds the mean of both [Nm], of either sign.

    Raises:
        ShapeError: neither one number nor seven.
        LimitError: a number outside its range.
    """

    viscous: Array
    coulomb: Array
    transition: float
    breakaway: Array
    stribeck: float
    asymmetry: Array

    def __init__(
        self,
        viscous: npt.ArrayLike = 0.0,
        coulomb: npt.ArrayLike = 0.0,
        *,
        transition: float = 0.01,
        breakaway: npt.ArrayLike | None = None,
        stribeck: float = 0.05,
        asymmetry: npt.ArrayLike = 0.0,
    ) -> None:
        for name, value, least in (
            ("viscous", viscous, 0.0),
            ("coulomb", coulomb, 0.0),
            ("breakaway", coulomb if breakaway is None else breakaway, 0.0),
            ("asymmetry", asymmetry, -_STRONGEST_FRICTION),
        ):
            numbers = one_or_each(value, 7, name)
            for index, number in enumerate(numbers.tolist()):
                within(number, f"{name}[{index}]", least, _STRONGEST_FRICTION)
            object.__setattr__(self, name, numbers)
        for name, speed in (("transition", transition), ("stribeck", stribeck)):
            object.__setattr__(self, name, within(speed, name, 0.0, 10.0, above=True, unit="rad/s"))

    def torque(self, dq: npt.ArrayLike) -> Array:
        """Torque against which the joints move at speeds `dq`, shape (7,) [Nm]."""
        return self.at(array(dq, 7, "dq"))

    def at(self, dq: Array) -> Array:
        """`torque` of many moments at once, unchecked: shape (..., 7)."""
        turn = np.tanh(dq / self.transition)
        slow = np.exp(-((dq / self.stribeck) ** 2))
        dry = self.coulomb + (self.breakaway - self.coulomb) * slow
        result: Array = self.viscous * dq + (dry + self.asymmetry * turn) * turn
        return result


#: Largest coefficient of friction [Nm], [Nm s/rad].
_STRONGEST_FRICTION = 1e3


@dataclass(frozen=True, slots=True, eq=False)
class Links(Value):
    """The seven moving links of a robot; link i moves with A(i+1).

    Attributes:
        origin: joint's origin in the frame of the link before, shape (7, 3) [m].
        mass: shape (7,) [kg].
        com: centre of mass in the link's frame, shape (7, 3) [m].
        inertia: about the centre of mass in the link's axes, shape (7, 3, 3) [kg m²].
        flange: of the last link, shape (3,) [m].
    """

    origin: Array
    mass: Array
    com: Array
    inertia: Array
    flange: Array


def symmetric(entries: Array) -> Array:
    """Symmetric matrices of xx yy zz xy xz yz: shape (..., 6) to (..., 3, 3)."""
    return np.asarray(entries)[..., [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]


def _entries(inertia: Array) -> Array:
    """Entries xx yy zz xy xz yz of a symmetric matrix."""
    return np.array([*inertia.diagonal(), inertia[0, 1], inertia[0, 2], inertia[1, 2]])


#: Radius of the last link, and of what KUKA mounts on it [m].
FLANGE_RADIUS = 0.047
#: Assumed mean density of a media flange, aluminium with hollows [kg/m³]: KUKA publishes no masses.
_FLANGE_DENSITY = 1800.0
#: Highest media flange [m].
_HIGHEST_FLANGE = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Flange(Value):
    """What KUKA mounts between the last link and the frame that Sunrise calls flange.

    Attributes:
        name: "plain", "touch", or the height in metres where it is another one.
        title: KUKA's name.
        height: of the flange frame above that of a plain flange [m].
    """

    name: str
    title: str
    height: float

    @property
    def body(self) -> Body:
        """Its mass and inertia, in the frame of a plain flange: a disc of assumed density."""
        mass = _FLANGE_DENSITY * np.pi * FLANGE_RADIUS**2 * self.height
        across = mass * (3.0 * FLANGE_RADIUS**2 + self.height**2) / 12.0
        along = 0.5 * mass * FLANGE_RADIUS**2
        return Body(mass, np.array([0.0, 0.0, 0.5 * self.height]), np.array([across, across, along, 0, 0, 0]))


#: The flanges whose height is established, by name; from frames taught on real robots.
FLANGES: dict[str, Flange] = {
    flange.name: flange
    for flange in (Flange("plain", "no media flange", 0.0), Flange("touch", "Media Flange Touch", 0.026))
}
_PLAIN = FLANGES["plain"]


def flange(name: str | float) -> Flange:
    """A flange by its name, "plain" or "touch", or by its height above a plain flange [m], [0, 0.2].

    Raises:
        CommandRejected: there is no such flange; the text lists the names.
        LimitError: the height is out of range.
    """
    if isinstance(name, str) and name in FLANGES:
        return FLANGES[name]
    try:
        height = float(name) if isinstance(name, str) else scalar(name, "flange", unit="m")
    except (ValueError, ShapeError):
        names = ", ".join(FLANGES)
        raise CommandRejected(
            f"flange must be one of {names}, or its height above a plain flange in metres, got {shown(name)}",
            parameter="flange",
            value=name,
            allowed=f"{names}, [0, {_HIGHEST_FLANGE:g}] m",
            hint='for example flange="touch", for the Media Flange Touch of the station setup',
        ) from None
    within(height, "flange", 0.0, _HIGHEST_FLANGE, unit="m")
    same = [flange for flange in FLANGES.values() if flange.height == height]
    return same[0] if same else Flange(f"{height:g}", f"a flange {1e3 * height:g} mm high", height)


#: Acceleration and jerk of every joint in the virtual cabinet; MoveIt configurations have this acceleration.
ACCELERATION = 10.0
JERK = 100.0


@dataclass(frozen=True, slots=True, eq=False)
class RobotModel(Value):
    """A robot of the LBR family. Chain: Rz(A1) Ry(A2) Rz(A3) Ry(-A4) Rz(A5) Ry(A6) Rz(A7).

    Attributes:
        name: short name: "iiwa14", with a media flange "iiwa14+touch".
        title: KUKA's name.
        links: dimensions, masses and inertias of the links; the last one's include the media flange.
        d_bs: base to shoulder [m].
        d_se: shoulder to elbow [m].
        d_ew: elbow to wrist [m].
        d_wf: wrist to flange, with the media flange [m].
        q_min: shape (7,) [rad].
        q_max: shape (7,) [rad].
        dq_max: shape (7,) [rad/s].
        ddq_max: shape (7,) [rad/s²].
        dddq_max: shape (7,) [rad/s³].
        tau_max: shape (7,) [Nm].
        flange: the media flange.
    """

    name: str
    title: str
    links: Links
    d_bs: float
    d_se: float
    d_ew: float
    d_wf: float
    q_min: Array
    q_max: Array
    dq_max: Array
    ddq_max: Array
    dddq_max: Array
    tau_max: Array
    flange: Flange = _PLAIN

    def __hash__(self) -> int:
        """Of its name: results are cached by the model, and a name stands for its numbers."""
        return hash(self.name)

    @property
    def base_name(self) -> str:
        """Its name without the media flange, as in targets: "iiwa14"."""
        return self.name.partition(_SEPARATOR)[0]

    @property
    def rated_load(self) -> float:
        """KUKA's rated load [kg], which is in the name of the model."""
        return float("".join(filter(str.isdigit, self.base_name)))

    def with_flange(self, flange: Flange) -> RobotModel:
        """The same robot with another flange: its kinematics and the mass of its last link follow."""
        if flange == self.flange:
            return self
        bare = self._links_without_flange()
        mass, com, inertia = bare.mass.copy(), bare.com.copy(), bare.inertia.copy()
        if flange.height:
            added = flange.body.placed(Pose.of(bare.flange))
            last = Body(float(mass[6]), com[6], _entries(inertia[6])).joined(added)
            mass[6], com[6], inertia[6] = last.mass, last.com, symmetric(last.inertia)
        links = Links(
            bare.origin,
            frozen(mass),
            frozen(com),
            frozen(inertia),
            frozen(bare.flange + [0.0, 0.0, flange.height]),
        )
        return replace(
            self,
            name=self.base_name + (f"{_SEPARATOR}{flange.name}" if flange.height else ""),
            links=links,
            d_wf=round(self.d_wf - self.flange.height + flange.height, 6),
            flange=flange,
        )

    def _links_without_flange(self) -> Links:
        return self.links if not self.flange.height else ROBOTS[self.base_name].links

    def __str__(self) -> str:
        """A few lines: its name, its dimensions, and the limits of its joints."""
        low, high, fastest = (np.degrees(limit) for limit in (self.q_min, self.q_max, self.dq_max))
        lengths = ", ".join(fixed(1e3 * length, 0) for length in (self.d_bs, self.d_se, self.d_ew, self.d_wf))
        rows = {
            "links": f"{lengths} mm: base, shoulder, elbow, wrist, flange",
            "flange": f"{self.flange.name}: {self.flange.title}",
            "joint": "".join(f"{f'A{i + 1}':>8}" for i in range(7)),
            "lowest [deg]": columns(low, 1),
            "highest [deg]": columns(high, 1),
            "speed [deg/s]": columns(fastest, 1),
            "torque [Nm]": columns(self.tau_max, 0),
        }
        return lines(f"{self.title} ({self.name})", rows)

    @property
    def dh(self) -> Array:
        """Table of Denavit and Hartenberg, standard convention, shape (7, 4): a [m], alpha [rad], d [m], theta [rad].

        Joint i's transformation is Rz(theta + q[i]) Tz(d) Tx(a) Rx(alpha), from the robot's base to its flange.
        """
        quarter = np.pi / 2
        alpha = (-quarter, quarter, quarter, -quarter, -quarter, quarter, 0.0)
        table = np.zeros((7, 4))
        table[:, 1] = alpha
        table[0::2, 2] = self.d_bs, self.d_se, self.d_ew, self.d_wf
        return frozen(table)

    def check(self, q: Array, name: str = "q") -> None:
        """Check joint positions against the limits.

        Raises:
            LimitError: one is outside; the text names axis, value and range in degrees.
        """
        for index in range(7):
            if not self.q_min[index] <= q[index] <= self.q_max[index]:
                low, high, value = np.degrees([self.q_min[index], self.q_max[index], q[index]])
                raise LimitError(
                    f"A{index + 1} must be in [{low:.0f}, {high:.0f}] deg on the {self.title}, got {value:.2f} deg",
                    code=50,
                    parameter=f"{name}[{index}]",
                    value=float(q[index]),
                    allowed=f"[{self.q_min[index]:.4f}, {self.q_max[index]:.4f}] rad",
                    hint=self._advice(q),
                )

    def _advice(self, q: Array) -> str:
        """What to do about joint positions outside the limits: degrees were given, or the target is wrong."""
        meant = np.radians(q)
        if np.abs(q).max() > 2.0 * np.pi and (self.q_min <= meant).all() and (meant <= self.q_max).all():
            return f"angles are in radians: did you mean ha.deg({', '.join(f'{value:g}' for value in q)})?"
        return "keep the target inside the joint limits"


# --------------------------------------------------------------------------------------- the robots, each an entry

_FLANGE = (0.0, 0.0, 0.035)

# joint origins
_ORIGIN_7 = (
    (0, 0, 0.1475),
    (0, -0.0105, 0.1925),
    (0, 0.0105, 0.2075),
    (0, 0.0105, 0.1925),
    (0, -0.0105, 0.2075),
    (0, -0.0707, 0.1925),
    (0, 0.0707, 0.091),
)
_ORIGIN_14 = (
    (0, 0, 0.1475),
    (0, -0.01, 0.2125),
    (0, 0.01, 0.228),
    (0, 0.0105, 0.192),
    (0, -0.0105, 0.2075),
    (0, -0.0707, 0.1925),
    (0, 0.0707, 0.091),
)

# mass, centre of mass x y z, inertia xx yy zz xy xz yz; one row a link
_IIWA7 = (
    (3.394011, 0, -0.034819, 0.123299, 0.021383, 0.020403, 0.007563, 0, 0, 0.003797),
    (4.031991, 0, 0.039793, 0.086944, 0.031697, 0.030080, 0.009666, 0, 0, 0.005889),
    (3.394011, 0, 0.034819, 0.123299, 0.021383, 0.020403, 0.007563, 0, 0, -0.003797),
    (4.031989, 0, -0.039793, 0.086944, 0.031695, 0.030079, 0.009665, 0, 0, -0.005889),
    (1.529239, 0, -0.029824, 0.076267, 0.008485, 0.007136, 0.003848, 0, 0, 0.002806),
    (2.403626, 0, 0.07102, 0.00495, 0.007067, 0.006804, 0.004629, 0, 0, 0.000311),
    (0.259474, 3e-6, -2e-6, 0.013782, 0.000171, 0.000171, 0.000299, 0, 0, 0),
)
_IIWA14 = (
    (5.289529, 0, -0.033795, 0.132404, 0.042462, 0.042838, 0.015870, 0, 0, 0.006341),
    (5.688888, 0.000136, 0.047548, 0.076322, 0.055182, 0.053983, 0.016523, -3.3e-5, 5.6e-5, 0.010034),
    (3.461245, 0, 0.034913, 0.123108, 0.021720, 0.020730, 0.007701, 0, 0, -0.003845),
    (4.122995, 0, -0.039793, 0.086944, 0.032410, 0.030758, 0.009883, 0, 0, -0.006022),
    (1.563756, 0, -0.029824, 0.076267, 0.008677, 0.007297, 0.003935, 0, 0, 0.002869),
    (2.457878, 0, 0.07102, 0.00495, 0.007227, 0.006958, 0.004734, 0, 0, 0.000318),
    (0.265331, 3e-6, -2e-6, 0.013782, 0.000175, 0.000175, 0.000306, 0, 0, 0),
)
_MED7 = (
    (3.271499, 0, -0.034819, 0.123299, 0.020611, 0.019667, 0.007290, 0, 0, 0.003660),
    (3.886413, 0, 0.039793, 0.086944, 0.030552, 0.028995, 0.009317, 0, 0, 0.005676),
    (3.271499, 0, 0.034819, 0.123299, 0.020611, 0.019667, 0.007290, 0, 0, -0.003660),
    (3.886411, 0, -0.039793, 0.086944, 0.030547, 0.028993, 0.009313, 0, 0, -0.005676),
    (1.474048, 0, -0.029824, 0.076267, 0.008179, 0.006879, 0.003709, 0, 0, 0.002704),
    (2.316911, -1e-6, 0.07102, 0.004953, 0.006813, 0.006559, 0.004462, 0, 0, 0.000300),
    (0.250108, 3e-6, -2e-6, 0.013782, 0.000165, 0.000165, 0.000288, 0, 0, 0),
)
_MED14 = (
    (5.591419, 0, -0.033795, 0.132404, 0.044885, 0.045283, 0.016776, 0, 0, 0.006703),
    (6.013411, 0.000136, 0.047546, 0.076324, 0.058330, 0.057062, 0.017466, -3.5e-5, 5.9e-5, 0.010605),
    (3.65879, 0, 0.034913, 0.123108, 0.022960, 0.021913, 0.008140, 0, 0, -0.004065),
    (4.358267, 0, -0.039793, 0.086944, 0.034255, 0.032512, 0.010444, 0, 0, -0.006365),
    (1.653015, 0, -0.029824, 0.076267, 0.009172, 0.007714, 0.004159, 0, 0, 0.003033),
    (2.598211, -1e-6, 0.07102, 0.004953, 0.007640, 0.007355, 0.005004, 0, 0, 0.000336),
    (0.280474, 3e-6, -2e-6, 0.013782, 0.000185, 0.000185, 0.000323, 0, 0, 0),
)


def _robot(
    name: str,
    title: str,
    *,
    origins: tuple[tuple[float, ...], ...],
    rows: tuple[tuple[float, ...], ...],
    speed: tuple[float, ...],
    torque: tuple[float, ...],
) -> RobotModel:
    """A robot from its joint origins [m], its links, and the limits of its joints [deg/s], [Nm]."""
    table, heights = np.array(rows), [origin[2] for origin in (*origins, _FLANGE)]
    d_bs, d_se, d_ew, d_wf = (round(heights[k] + heights[k + 1], 6) for k in (0, 2, 4, 6))
    reach = frozen(deg(170, 120, 170, 120, 170, 120, 175))
    return RobotModel(
        name,
        title,
        Links(
            frozen(origins),
            frozen(table[:, 0].copy()),
            frozen(table[:, 1:4].copy()),
            frozen(symmetric(table[:, 4:])),
            frozen(_FLANGE),
        ),
        d_bs,
        d_se,
        d_ew,
        d_wf,
        q_min=frozen(-reach),
        q_max=reach,
        dq_max=frozen(deg(*speed)),
        ddq_max=frozen(np.full(7, ACCELERATION)),
        dddq_max=frozen(np.full(7, JERK)),
        tau_max=frozen(torque),
    )


_SPEED_7, _TORQUE_7 = (98, 98, 100, 130, 140, 180, 180), (176, 176, 110, 110, 110, 40, 40)
_SPEED_14, _TORQUE_14 = (85, 85, 100, 75, 130, 135, 135), (320, 320, 176, 176, 110, 40, 40)

#: All robots by name. The Med variants have the limits of the iiwa ones. The Med 14's base is taken as the iiwa 14's,
#: since its source differs by 0.5 mm.
ROBOTS: dict[str, RobotModel] = {
    model.name: model
    for model in (
        _robot(
            "iiwa7",
            "LBR iiwa 7 R800",
            origins=_ORIGIN_7,
            rows=_IIWA7,
            speed=_SPEED_7,
            torque=_TORQUE_7,
        ),
        _robot(
            "iiwa14",
            "LBR iiwa 14 R820",
            origins=_ORIGIN_14,
            rows=_IIWA14,
            speed=_SPEED_14,
            torque=_TORQUE_14,
        ),
        _robot(
            "med7",
            "LBR Med 7 R800",
            origins=_ORIGIN_7,
            rows=_MED7,
            speed=_SPEED_7,
            torque=_TORQUE_7,
        ),
        _robot(
            "med14",
            "LBR Med 14 R820",
            origins=_ORIGIN_14,
            rows=_MED14,
            speed=_SPEED_14,
            torque=_TORQUE_14,
        ),
    )
}


def robot(name: str, *, flange: str | float | None = None) -> RobotModel:
    """The robot of that name.

    Args:
        name: "iiwa7", "iiwa14", "med7" or "med14", with a media flange "iiwa14+touch".
        flange: its media flange, see `flange`; None: the one in the name, otherwise a plain one.

    Raises:
        CommandRejected: there is none; the text lists the names. Or name and flange contradict each other.
        LimitError: the height of the flange is out of range.
    """
    base, plus, named = name.partition(_SEPARATOR) if isinstance(name, str) else ("", "", "")
    known = ROBOTS.get(base)
    if known is None:
        names = ", ".join(ROBOTS)
        raise CommandRejected(
            f"robot must be one of {names}, got {shown(name)}",
            parameter="model",
            value=name,
            allowed=names,
            hint="for example robot('iiwa14'), or robot('iiwa14', flange='touch')",
        )
    mounted = _flange_of(named) if plus else None
    if flange is not None:
        given = _flange_of(flange)
        if mounted is not None and mounted != given:
            raise CommandRejected(
                f"flange must be {mounted.name}, which the robot {name} has, got {given.name}",
                parameter="flange",
                value=flange,
                hint="leave out one of them",
            )
        mounted = given
    return known if mounted is None else known.with_flange(mounted)


def known_robot(name: str) -> RobotModel | None:
    """The robot of a name from elsewhere, such as a recording; None: this version does not know it."""
    try:
        return robot(name)
    except CommandRejected:
        return None


#: In the `flange` argument of `robot` the function of this name is hidden.
_flange_of = flange
#: Between the name of a robot and that of its media flange.
_SEPARATOR = "+"
