"""Scenarios: circles, splines, ellipses."""

from __future__ import annotations

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.testing.catalogue.motions import near_pose
from heptarm.testing.measure import above, below, holds, near, note, record
from heptarm.testing.scenario import Risk, scenario
from heptarm.testing.stage import HOME
from heptarm.values.checks import Array
from heptarm.values.motion.circle import arc, circ, normal_of
from heptarm.values.motion.line import lin
from heptarm.values.motion.spline import ellipse, spl, spline, spline_joints
from heptarm.values.pose import Pose, deg

#: Tolerance of a path [m].
_TRUE = 5e-4


def _moved(pose: Pose, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Pose:
    return Pose(pose.xyz + [x, y, z], pose.quat)


def _misses(t: Array, points: Array, knot: Array) -> float:
    """Distance of a point from the curve through points at times; between them a cubic, since states may be rare."""
    slopes = np.gradient(points, t, axis=0)
    near_ones = np.argsort(np.linalg.norm(points - knot, axis=1))[:3]
    least = float("inf")
    for k in {min(max(int(i) + shift, 0), len(t) - 2) for i in near_ones for shift in (-1, 0)}:
        step, u = t[k + 1] - t[k], np.linspace(0.0, 1.0, 101)[:, None]
        curve = (1 + 2 * u) * (1 - u) ** 2 * points[k] + u**2 * (3 - 2 * u) * points[k + 1]
        curve = curve + step * u * (1 - u) * ((1 - u) * slopes[k] - u * slopes[k + 1])
        least = min(least, float(np.linalg.norm(curve - knot, axis=1).min()))
    return least


@scenario(line=1, rows="C7 C8 C9", needs=("circ",))
def circle(arm: Arm) -> None:
    """CIRC through a point: on the circle, with a uniform rotation or one that follows the tangent."""
    start = arm.wait_for_rest().pose
    centre = start.xyz + [0.0, 0.06, 0.0]
    via = Pose(centre + [-0.06, 0.0, 0.0], start.quat)
    end = Pose(centre + [0.0, 0.06, 0.0], start.quat) @ Pose.xyz_abc(0, 0, 0, *deg(0, 20, 0))
    recording = record(arm, circ(via, end, speed_mps=0.1))
    radii = np.linalg.norm(recording.xyz - centre, axis=1)
    near(radii, np.full(len(radii), 0.06), _TRUE, "radii", unit="m")
    below(_misses(recording.t_pose, recording.xyz, via.xyz), _TRUE, "it passes the point at", unit="m")
    near_pose(arm, end, "at the end")
    half = recording.states[int(np.argmin(np.linalg.norm(recording.xyz - via.xyz, axis=1)))].pose
    near(half.angle_to(start), np.radians(10), 0.03, "halfway it has turned half", unit="rad")
    back = arc(end, -2.0, centre=centre, reference="path", orientation="constant", speed_mps=0.2)
    arm.move(back)
    there = arm.wait_for_rest().pose
    near(
        float(np.linalg.norm(there.xyz - centre)),
        0.06,
        _TRUE,
        "radius at the end of the motion back",
        unit="m",
    )
    near(there.angle_to(end), 2.0, 5e-3, "with the tangent it has turned by", unit="rad")


@scenario(line=1, rows="C10 C11 C12", needs=("circ",))
def arcs(arm: Arm) -> None:
    """Arcs by centre, plane and angle, in three planes and an oblique one; points that define no arc are refused."""
    from heptarm.errors import CommandRejected

    planes: tuple[str | tuple[float, float, float], ...] = ("xy", "xz", "yz", (1.0, 1.0, 1.0))
    for plane in planes:
        start = arm.wait_for_rest().pose
        normal = normal_of(plane)
        radius = 0.04 * np.cross(normal, (0.0, 1.0, 0.0) if abs(normal[1]) < 0.9 else (1.0, 0.0, 0.0))
        centre = start.xyz + radius
        long = float(np.linalg.norm(radius))
        recording = record(arm, arc(start, 0.9, centre=centre, plane=plane, speed_mps=0.1))
        lever = recording.xyz - centre
        near(np.linalg.norm(lever, axis=1), np.full(len(lever), long), _TRUE, f"radii, {plane}", unit="m")
        near(lever @ normal, np.zeros(len(lever)), _TRUE, f"offset out of {plane}", unit="m")
        swept = np.arccos(np.clip((lever[0] @ lever[-1]) / long**2, -1, 1))
        near(swept, 0.9, 0.05, f"angle, {plane}", unit="rad")
        arm.move(lin(start, speed_mps=0.3))
    try:
        arc(start, 1.0, centre=start.xyz)
        holds(False, "an arc about itself is refused")
    except CommandRejected as error:
        note(error.text)
    middle, end = _moved(start, 0.0, 0.03, 0.0), _moved(start, 0.0, 0.06, 0.0)
    try:
        arm.move([lin(start), circ(middle, end)])
        holds(False, "an arc along a line is refused")
    except CommandRejected as error:
        note(error.text)


@scenario(line=1, rows="C16 C17 B13", needs=("spline",))
def splines(arm: Arm) -> None:
    """A spline of curved, straight and circular segments passes through its points without a stop."""
    start = arm.wait_for_rest().pose
    knots = [_moved(start, 0.03, 0.04, 0.02), _moved(start, 0.0, 0.09, 0.03), _moved(start, 0.0, 0.13, 0.03)]
    far, end = _moved(start, -0.04, 0.17, 0.03), _moved(start, -0.08, 0.13, 0.03)
    path = spline([knots[0], spl(knots[1]), lin(knots[2]), circ(far, end)], speed_mps=0.08)
    recording = record(arm, path)
    for place, knot in enumerate((*knots, far, end)):
        below(
            _misses(recording.t_pose, recording.xyz, knot.xyz), _TRUE, f"it misses point {place} by", unit="m"
        )
    near_pose(arm, end, "at the end")
    moving = recording.speeds[
        np.flatnonzero(recording.speeds > 0.04)[0] : np.flatnonzero(recording.speeds > 0.04)[-1]
    ]
    above(float(moving.min()), 0.3 * 0.08, "slowest on the path", unit="m/s")


@scenario(line=1, rows="C18 B17", needs=("spline_joints",))
def joint_splines(arm: Arm) -> None:
    """A matrix of joint positions is followed row by row, without a stop."""
    rows = HOME + np.outer(np.sin(np.linspace(0, np.pi, 9))[1:], deg(12, 5, 8, 6, 0, 8, 25))
    rows = np.vstack([rows[:-1], HOME + deg(0, 0, 0, 0, 0, 0, 1)])
    recording = record(arm, spline_joints(list(rows), speed=0.4))
    for place in (1, 4, 6):
        below(
            _misses(recording.t, recording.q_cmd, rows[place]), 5e-3, f"it misses row {place} by", unit="rad"
        )
    near(arm.wait_for_rest().q, rows[-1], 1e-3, "last row", unit="rad")


@scenario(line=1, rows="C13 C14 C26", needs=("spline",))
def ellipses(arm: Arm) -> None:
    """Ellipses in three planes and an oblique one, with ramps of speed at their ends."""
    planes: tuple[str | tuple[float, float, float], ...] = ("xy", "xz", "yz", (0.0, 0.6, 0.8))
    for plane in planes:
        start = arm.wait_for_rest().pose
        normal = normal_of(plane)
        first = 0.04 * np.cross(normal, (0.0, 1.0, 0.0) if abs(normal[1]) < 0.9 else (1.0, 0.0, 0.0))
        centre, a, b = start.xyz + first, float(np.linalg.norm(first)), 0.025
        turn = 1.2 if plane != "xy" else 2 * np.pi
        recording = record(arm, ellipse(start, b, centre=centre, plane=plane, angle=turn, speed_mps=0.15))
        lever = recording.xyz - centre
        along, across = -first / a, np.cross(normal, -first / a)
        ones = (lever @ along / a) ** 2 + (lever @ across / b) ** 2
        near(ones, np.ones(len(ones)), 0.04, f"equation of the ellipse, {plane}")
        near(lever @ normal, np.zeros(len(lever)), _TRUE, f"offset out of {plane}", unit="m")
        if plane == "xy":
            below(_misses(recording.t_pose, recording.xyz, start.xyz), _TRUE, "closed within", unit="m")
            ramp = recording.speeds[:3]
            below(float(ramp.min()), 0.075, "it begins slowly", unit="m/s")
        else:
            arm.move(lin(start, speed_mps=0.3))


@scenario(line=1, rows="C8", needs=("circ", "lin"), risk=Risk.FREE)
def orientations(arm: Arm) -> None:
    """Interpolation of the orientation: from start to end, constant, or by the joints."""
    start = arm.wait_for_rest().pose
    target = _moved(start, y=0.06) @ Pose.xyz_abc(0, 0, 0, *deg(15, 0, 0))
    for control, turned in (("constant", 0.0), ("variable", np.radians(15)), ("joint", np.radians(15))):
        arm.move(lin(target, orientation=control, speed_mps=0.2))
        pose = arm.wait_for_rest().pose
        near(pose.xyz, target.xyz, _TRUE, f"place, {control}", unit="m")
        near(pose.angle_to(start), turned, 3e-3, f"turned, {control}", unit="rad")
        arm.move(lin(start, speed_mps=0.3))
