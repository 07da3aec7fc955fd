"""Exact solutions of the snap-fit scenes, by shooting on the equilibrium equation.

The truth that tests compare with; it imports nothing of the package it checks.

The target pushes with one force F at one point p of a jaw that is fixed to the finger's tip
section. Then for every s, with r = (x, y) and theta = psi + gamma,

    x' = cos(theta)            EI(s) psi' = M(s) = (p - r(s)) x F
    y' = sin(theta)      kappa G A(s) gamma = F . (-sin(theta), cos(theta))

F is normal to the contact, or, where the target slides along the jaw with friction, on the edge of
the friction cone. Seen from the tip section, p and F's direction depend only on where it touches.
So the equation is integrated from the tip to the clamp in the frame of the tip section, for a given
force N and a given place t on the jaw, and the whole finger is then turned and moved so that the
clamp lies where it belongs. What is left is a root of two equations (the target's point meets the
jaw's) in the two unknowns N and t. All inputs are plain numbers in SI units, angles in radians.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np
from scipy.integrate import OdeSolution, solve_ivp
from scipy.optimize import minimize_scalar

Feature = Literal["edge", "corner"]
Vector = np.ndarray

ODE_TOLERANCE = 1e-13
"""Relative and absolute tolerance of DOP853; its floor is about 2e-14."""
CLOSED = 1e-12
"""Largest accepted residual of the contact conditions, relative to the finger's length."""
STALLED = 1e-14
"""Newton stops where the residual is below this, the error of the integration."""
DIFFERENCE = 1e-7
"""Step of the difference quotients in the unknowns, which are of order one."""
NEWTON_STEPS = 30
SHEAR_STEPS = 4
"""gamma is of order F/(kappa G A) < 0.01, where Newton's error is below 1e-16 after three steps."""


@dataclass(frozen=True)
class ShootingCase:
    """A straight finger from the clamp (0, 0) along x, a jaw at its tip, and a target.

    The jaw's outside lies to the left of the walk from `a` to `b` (undeformed positions). It is
    straight, or an arc where `jaw_radius` is given. The target is a circle with its centre at
    (position, path_y), or, where `target_radius` is None, a block with its corner there that
    occupies x >= position, y >= path_y. It moves towards -x.
    """

    a: tuple[float, float]
    b: tuple[float, float]
    path_y: float
    target_radius: float | None = None
    jaw_radius: float | None = None
    convex: bool = True
    length: float = 0.057
    thickness: float = 0.0032
    thickness_tip: float | None = None  # None: uniform; otherwise linear from clamp to tip
    width: float = 0.0095
    young: float = 2.62e9
    poisson: float = 0.35
    shear: bool = False
    mu: float = 0.0  # friction of a target that slides towards -x; negative: towards +x

    def thickness_at(self, s: float) -> float:
        """w(s) in m."""
        tip = self.thickness if self.thickness_tip is None else self.thickness_tip
        return self.thickness + (tip - self.thickness) * s / self.length

    def bending_stiffness(self, s: float) -> float:
        """EI(s) in N m^2, I = b w^3 / 12."""
        return self.young * self.width * self.thickness_at(s) ** 3 / 12.0

    def shear_stiffness(self, s: float) -> float:
        """kappa G A(s) in N, eq. (20)."""
        kappa = (5.0 + 5.0 * self.poisson) / (6.0 + 5.0 * self.poisson)
        return kappa * self.young / (2.0 + 2.0 * self.poisson) * self.width * self.thickness_at(s)


SNAPFIT_CIRCLE = ShootingCase(
    a=(0.057, 0.0105), b=(0.0762, 0.0016), path_y=0.0105, target_radius=0.0089
)
"""Example II(a) of Lan & Lee 2008."""
SNAPFIT_CORNER = ShootingCase(a=(0.057, 0.0085), b=(0.076, 0.0016), path_y=0.0026, jaw_radius=0.05)
"""Example II(b) of Lan & Lee 2008, the arc bulging towards the target."""


@dataclass(frozen=True)
class ShootingResult:
    """The equilibrium at one position. Forces act on the finger."""

    case: ShootingCase
    feature: Feature
    position: float  # m
    force_x: float  # N
    force_y: float  # N
    normal_force: float  # N
    contact_xy: Vector  # m, shape (2,)
    tip_pose: Vector  # x (m), y (m), psi (rad), shape (3,)
    psi0_slope: float  # psi'(0), 1/m
    energy: float  # J
    max_strain: float  # largest w/2 |psi'| along the finger
    _seen_from_tip: OdeSolution  # x/L, y/L, psi, -V over u = s/L

    def axis(self, s: Vector) -> Vector:
        """The finger at arc lengths s (n,): rows x, y (m), psi, gamma (rad), moment (N m)."""
        x_tip, y_tip, psi_tip = self.tip_pose
        x, y, psi, _ = self._seen_from_tip(s / self.case.length)
        r = np.array([[x_tip], [y_tip]]) + self.case.length * _turn(psi_tip) @ np.array([x, y])
        psi = psi + psi_tip
        force = np.array([self.force_x, self.force_y])
        moment = _cross(self.contact_xy[:, None] - r, force)
        gamma = [_shear_angle(self.case, si, pi, *force) for si, pi in zip(s, psi, strict=True)]
        return np.array([*r, psi, gamma, moment])


def solve(
    case: ShootingCase,
    position: float,
    feature: Feature | None = None,
    near: tuple[float, float] | None = None,
) -> ShootingResult:
    """The equilibrium with the target at `position` (m); where there are several, that found from
    `near`, a normal force (N) and a place (see `_jaw`).

    `feature` is "edge" (the segment's or arc's interior touches the circle or the block's corner)
    or "corner" (the jaw's corner a touches the circle or the block's underside); None lets the
    position of `peak_position` decide. Raises ValueError where there is no such contact.
    """
    if feature is None:
        feature = "edge" if position >= peak_position(case).position else "corner"
    if feature == "edge":
        start = np.array([0.0, touch_place(case)])
    else:
        peak = peak_position(case)
        turn = 0.0
        if case.target_radius is None:
            turn = math.atan2(-peak.force_x, -peak.force_y)  # until the normal is vertical
        start = np.array([peak.normal_force / _force_unit(case), turn])

    if near is not None:
        start = np.array([near[0] / _force_unit(case), near[1]])

    def miss(unknowns: Vector) -> Vector:
        target, normal = _contact(case, feature, *unknowns)
        if feature == "corner" and case.target_radius is None:  # anywhere on the underside
            return np.array([target[1] - case.path_y / case.length, normal[0]])
        return target - np.array([position, case.path_y]) / case.length

    scaled_force, place = _newton(miss, start)
    if scaled_force <= 0.0 or (feature == "edge" and not 0.0 <= place <= 1.0):
        raise ValueError(
            f"no contact of the jaw's {feature} at {position} m: "
            f"scaled force {scaled_force:.3g}, place {place:.3g}"
        )
    return _result(case, feature, position, scaled_force, place)


@lru_cache
def peak_position(case: ShootingCase) -> ShootingResult:
    """The event where the contact reaches corner a, still with the edge's normal.

    The insertion force has its kink there; the result's `position` is the event's.
    """

    def miss(unknowns: Vector) -> Vector:
        target, _ = _contact(case, "edge", unknowns[0], 0.0)
        return np.array([target[1] - case.path_y / case.length])

    (scaled_force,) = _newton(miss, np.array([0.0]))
    target, _ = _contact(case, "edge", scaled_force, 0.0)
    return _result(case, "edge", target[0] * case.length, scaled_force, 0.0)


def touch_position(case: ShootingCase) -> float:
    """The position (m) at which the target first touches the undeformed jaw's edge."""
    target, _ = _contact(case, "edge", 0.0, touch_place(case))
    return float(target[0] * case.length)


@lru_cache
def touch_place(case: ShootingCase) -> float:
    """Where the undeformed jaw's edge is first touched, from 0 at a to 1 at b."""

    def miss(unknowns: Vector) -> Vector:
        target, _ = _contact(case, "edge", 0.0, unknowns[0])
        return np.array([target[1] - case.path_y / case.length])

    (place,) = _newton(miss, np.array([0.5]))
    return float(place)


def recovered(result: ShootingResult, mu: float) -> Vector:
    """The force (x, y) in N with friction by the paper's base-moment rule (14)-(17), from a result
    without friction.

    The shape stays that without friction. The force along n + mu t, with n the direction of the
    frictionless force and t the contact's tangent towards the target's motion (-x), keeps its
    moment about the clamp: p x N (n + mu t) = EI psi'(0).
    """
    normal = np.array([result.force_x, result.force_y]) / result.normal_force
    tangent = np.array([normal[1], -normal[0]])
    if tangent[0] > 0.0:
        tangent = -tangent
    direction = normal + mu * tangent
    moment = result.case.bending_stiffness(0.0) * result.psi0_slope
    return moment / _cross(result.contact_xy, direction) * direction


def _jaw(case: ShootingCase, feature: Feature, place: float) -> tuple[Vector, Vector]:
    """Undeformed jaw: a point (2,) in m and the outward unit normal (2,) there.

    `place` runs along the edge from 0 at a to 1 at b, or is the angle by which the normal at
    corner a is turned anticlockwise from the edge's.
    """
    if feature == "corner":
        point, normal = _jaw(case, "edge", 0.0)
        return point, _turn(place) @ normal
    a, b = np.array(case.a), np.array(case.b)
    left = np.array([a[1] - b[1], b[0] - a[0]]) / math.dist(a, b)
    if case.jaw_radius is None:
        return a + place * (b - a), left
    half_angle = math.asin(math.dist(a, b) / 2.0 / case.jaw_radius)
    bulge = 1.0 if case.convex else -1.0
    centre = (a + b) / 2.0 - bulge * case.jaw_radius * math.cos(half_angle) * left
    normal = _turn(bulge * half_angle * (1.0 - 2.0 * place)) @ left
    return centre + bulge * case.jaw_radius * normal, normal


def _integrate(
    case: ShootingCase, arm: Vector, force: Vector, dense: bool = False
) -> tuple[Vector, OdeSolution | None]:
    """From the tip (1) to the clamp (0) in u = s/L, in the frame of the tip section.

    `arm` (2,) is the contact point in units of L, `force` (2,) acts there, in N. Returns x/L, y/L,
    psi at the clamp with -V/(N L), and on request the solution for 0 <= u <= 1.
    """
    arm_x, arm_y = float(arm[0]), float(arm[1])
    force_x, force_y = float(force[0]), float(force[1])
    length = case.length

    def slope(u: float, state: Vector) -> list[float]:
        x, y, psi, _ = state
        gamma = _shear_angle(case, u * length, psi, force_x, force_y)
        moment = length * ((arm_x - x) * force_y - (arm_y - y) * force_x)
        curvature = length * moment / case.bending_stiffness(u * length)
        shear_energy = case.shear_stiffness(u * length) * gamma**2 * length
        energy = 0.5 * (moment * curvature + shear_energy) / (_force_unit(case) * length)
        return [math.cos(psi + gamma), math.sin(psi + gamma), curvature, energy]

    done = solve_ivp(
        slope, (1.0, 0.0), np.zeros(4), method="DOP853",
        rtol=ODE_TOLERANCE, atol=ODE_TOLERANCE, dense_output=dense,
    )  # fmt: skip
    return done.y[:, -1], done.sol


def _push(case: ShootingCase, normal: Vector) -> Vector:
    """The force on the finger (2,) per unit of normal force; `normal` (2,) points out of the jaw,
    and a target that slides towards -x drags the finger along."""
    return -normal + case.mu * np.array([-normal[1], normal[0]])


def _contact(
    case: ShootingCase, feature: Feature, scaled_force: float, place: float
) -> tuple[Vector, Vector]:
    """The touching target's centre or corner (2,), in units of L, and the jaw's normal (2,).

    Both in the clamp's frame, for the normal force in units of EI(0)/L^2.
    """
    point, normal = _jaw(case, feature, place)
    arm = (point - np.array([case.length, 0.0])) / case.length
    clamp, _ = _integrate(case, arm, scaled_force * _force_unit(case) * _push(case, normal))
    turn = _turn(-clamp[2])
    radius = (case.target_radius or 0.0) / case.length
    return turn @ (arm - clamp[:2] + radius * normal), turn @ normal


def _result(
    case: ShootingCase, feature: Feature, position: float, scaled_force: float, place: float
) -> ShootingResult:
    """Everything about the solution with these unknowns (see `_contact`)."""
    point, normal = _jaw(case, feature, place)
    arm = (point - np.array([case.length, 0.0])) / case.length
    normal_force = scaled_force * _force_unit(case)
    push = _push(case, normal)
    clamp, seen_from_tip = _integrate(case, arm, normal_force * push, dense=True)
    turn = _turn(-clamp[2])
    contact = case.length * turn @ (arm - clamp[:2])
    force = normal_force * turn @ push
    tip = np.append(-case.length * turn @ clamp[:2], -clamp[2])
    result = ShootingResult(
        case, feature, float(position), float(force[0]), float(force[1]), float(normal_force),
        contact, tip, float(_cross(contact, force) / case.bending_stiffness(0.0)),
        float(-clamp[3] * _force_unit(case) * case.length), 0.0, seen_from_tip,
    )  # fmt: skip
    return replace(result, max_strain=_max_strain(result))


def _max_strain(result: ShootingResult) -> float:
    """Largest w/2 |psi'|, from samples and a search around the largest."""
    case = result.case

    def strain(s: float) -> float:
        moment = float(result.axis(np.array([s]))[4, 0])
        return case.thickness_at(s) / 2.0 * abs(moment) / case.bending_stiffness(s)

    samples = np.linspace(0.0, case.length, 41)
    values = [strain(s) for s in samples]
    best = int(np.argmax(values))
    around = samples[max(best - 1, 0)], samples[min(best + 1, len(samples) - 1)]
    found = minimize_scalar(lambda s: -strain(s), bounds=around, method="bounded")
    return float(max(values[best], -found.fun))


def _newton(miss: Callable[[Vector], Vector], start: Vector) -> Vector:
    """Root of `miss` (all quantities of order one) by Newton with differences and halving."""
    unknowns, residual = start, miss(start)
    for _ in range(NEWTON_STEPS):
        size = np.abs(residual).max()
        if size <= STALLED:
            break
        jacobian = np.column_stack(
            [(miss(unknowns + d) - residual) / DIFFERENCE for d in DIFFERENCE * np.eye(len(start))]
        )
        step = np.linalg.solve(jacobian, -residual)
        trial = miss(unknowns + step)
        while np.abs(trial).max() >= size and np.abs(step).max() > DIFFERENCE:
            step = step / 2.0
            trial = miss(unknowns + step)
        if np.abs(trial).max() >= size:
            break
        unknowns, residual = unknowns + step, trial
    if not np.abs(residual).max() <= CLOSED:
        raise ValueError(f"shooting left a residual of {np.abs(residual).max():.2e} L")
    return unknowns


def _force_unit(case: ShootingCase) -> float:
    """EI(0)/L^2 in N."""
    return case.bending_stiffness(0.0) / case.length**2


def _shear_angle(case: ShootingCase, s: float, psi: float, force_x: float, force_y: float) -> float:
    """gamma with kappa G A gamma = F . (-sin, cos)(psi + gamma), by Newton; 0 without shear."""
    if not case.shear:
        return 0.0
    stiffness = case.shear_stiffness(s)
    gamma = 0.0
    for _ in range(SHEAR_STEPS):
        cos, sin = math.cos(psi + gamma), math.sin(psi + gamma)
        excess = stiffness * gamma - (force_y * cos - force_x * sin)
        gamma -= excess / (stiffness + force_y * sin + force_x * cos)
    return gamma


def _turn(angle: float) -> Vector:
    """The rotation matrix (2, 2)."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos, -sin], [sin, cos]])


def _cross(arm: Vector, force: Vector) -> Vector:
    """arm x force, for shapes (2,) or (2, n)."""
    return np.asarray(arm[0] * force[1] - arm[1] * force[0])
