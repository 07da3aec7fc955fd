"""The discretised contact problem of a jaw, as the rivals get it: compiled, exact, dimensionless.

    minimise V(q) = 1/2 q.H q   so that   g(q) >= 0,      psi'(u) = sum_k q_k phi_k(u), u = s/L

Lengths in units of L, forces of EI/L^2. It imports nothing of the package; a scene is a
`shooting.ShootingCase`. The rivals are told which part of the jaw touches (its edge or its corner
a), so that g is one smooth function, the best case for an optimiser; where the answer contradicts
it, `rivals.follow` asks again with the other part. g is a signed distance, so its multiplier is
the contact force. Multipliers, poses and normals as in Lan & Lee 2008, eqs. (1), (2), (9), (10),
with the jaw turned by psi.
"""

import math
from typing import Literal, NamedTuple

import numpy as np
from numba import njit
from numpy.polynomial import Legendre, Polynomial

from support import shooting

Basis = Literal["legendre", "monomial"]
EDGE, CORNER = 0, 1
FEATURES: tuple[shooting.Feature, ...] = ("edge", "corner")
SPARE_POINTS = 5
"""Gauss points beyond the order: at these rotations the tip's place is exact to 1e-14 L."""

AX, AY, TX, TY, NX, NY, MX, MY, RHO, RADIUS, PATH_Y = range(11)
"""Columns of the geometry: corner a, tangent and outward normal there, the arc's centre and signed
radius (0: straight; positive: convex) in the tip's frame; the target's radius (0: a block), its
height in space."""


class JawProblem(NamedTuple):
    """Arrays of the problem with n modes and Q Gauss points."""

    stiffness: np.ndarray  # (n, n): H
    slope: np.ndarray  # (Q, n): int_0^u phi_k at the Gauss points
    end: np.ndarray  # (n,): int_0^1 phi_k
    weights: np.ndarray  # (Q,)
    geometry: np.ndarray  # (11,)


def jaw_problem(case: shooting.ShootingCase, order: int, basis: Basis = "legendre") -> JawProblem:
    """The problem of a uniform finger without shear, with `order` modes."""
    assert case.thickness_tip is None and not case.shear
    if basis == "legendre":
        modes = [np.sqrt(2 * k + 1) * Legendre.basis(k, domain=[0.0, 1.0]) for k in range(order)]
    else:
        modes = [(k + 1) * Polynomial.basis(k) for k in range(order)]  # psi = sum q_k u^(k+1), (7)
    nodes, weights = np.polynomial.legendre.leggauss(order + SPARE_POINTS)
    u, weights = (nodes + 1.0) / 2.0, weights / 2.0
    values = np.column_stack([mode(u) for mode in modes])
    integrals = np.column_stack([mode.integ(lbnd=0.0)(np.append(u, 1.0)) for mode in modes])
    return JawProblem(
        np.ascontiguousarray(values.T @ (weights[:, None] * values)),
        np.ascontiguousarray(integrals[:-1]),
        np.ascontiguousarray(integrals[-1]),
        weights,
        geometry(case),
    )


def geometry(case: shooting.ShootingCase) -> np.ndarray:
    """The jaw and the target as numbers, see AX ... PATH_Y."""
    a, b = (np.array(p) / case.length - [1.0, 0.0] for p in (case.a, case.b))
    chord = math.dist(a, b)
    tangent = (b - a) / chord
    left = np.array([-tangent[1], tangent[0]])
    centre, rho = np.zeros(2), 0.0
    if case.jaw_radius is not None:
        rho = (1.0 if case.convex else -1.0) * case.jaw_radius / case.length
        half = math.asin(chord / 2.0 / rho)
        centre = (a + b) / 2.0 - rho * math.cos(half) * left
        left = (a - centre) / rho
        tangent = np.array([left[1], -left[0]])
    radius = (case.target_radius or 0.0) / case.length
    return np.array([*a, *tangent, *left, *centre, rho, radius, case.path_y / case.length])


def force_unit(case: shooting.ShootingCase) -> float:
    """EI/L^2 in N."""
    return case.bending_stiffness(0.0) / case.length**2


@njit(cache=True, error_model="numpy")
def pose_of(q, slope, end, weights, pose, rate):
    """The tip's pose (x, y, psi) and its derivatives (3, n), both overwritten."""
    pose[:] = 0.0
    rate[:] = 0.0
    for k in range(len(q)):
        pose[2] += end[k] * q[k]
        rate[2, k] = end[k]
    for i in range(len(weights)):
        psi = 0.0
        for k in range(len(q)):
            psi += slope[i, k] * q[k]
        dx, dy = weights[i] * np.cos(psi), weights[i] * np.sin(psi)
        pose[0] += dx
        pose[1] += dy
        for k in range(len(q)):
            rate[0, k] -= dy * slope[i, k]
            rate[1, k] += dx * slope[i, k]


@njit(cache=True, error_model="numpy")
def gap_of_pose(feature, geometry, position, pose, first, second):
    """The gap between a part of the jaw and the target at `position`; its derivatives by the pose
    (3,) and (3, 3) are overwritten."""
    if feature == EDGE or geometry[RADIUS] > 0.0:
        height = geometry[PATH_Y]
        return point_gap(feature, geometry, position, height, pose, first, second)
    # corner a under the block
    ax, ay, cos, sin = geometry[AX], geometry[AY], np.cos(pose[2]), np.sin(pose[2])
    arm_x, arm_y = cos * ax - sin * ay, sin * ax + cos * ay
    first[0], first[1], first[2] = 0.0, -1.0, -arm_x
    second[:] = 0.0
    second[2, 2] = arm_y
    return geometry[PATH_Y] - pose[1] - arm_y


@njit(cache=True, error_model="numpy")
def point_gap(feature, geometry, px, py, pose, first, second):
    """The gap between a part of the jaw and the circle (a point for a block) about (px, py).

    The point is q = R^T (p - r) in the tip's frame, in the distance field of the part, whose
    gradient is n and whose Hessian curvature t t^T.
    """
    x, y, cos, sin = pose[0], pose[1], np.cos(pose[2]), np.sin(pose[2])
    ax, ay, rho = geometry[AX], geometry[AY], geometry[RHO]
    dx, dy = px - x, py - y
    qx, qy = cos * dx + sin * dy, cos * dy - sin * dx
    curvature = 0.0
    if feature == EDGE and rho == 0.0:
        nx, ny = geometry[NX], geometry[NY]
        field = nx * (qx - ax) + ny * (qy - ay)
    else:
        ex, ey, sign, radius = qx - ax, qy - ay, 1.0, 0.0
        if feature == EDGE:
            ex, ey, radius = qx - geometry[MX], qy - geometry[MY], rho
            sign = 1.0 if rho > 0.0 else -1.0
        distance = np.hypot(ex, ey)
        field = sign * distance - radius
        nx, ny, curvature = sign * ex / distance, sign * ey / distance, sign / distance
    # dq/d(x, y) = -R^T, dq/dpsi = (q_y, -q_x)
    tx, ty = -ny, nx
    along = np.array([-(cos * tx - sin * ty), -(sin * tx + cos * ty), tx * qy - ty * qx])
    first[0], first[1] = -(cos * nx - sin * ny), -(sin * nx + cos * ny)
    first[2] = nx * qy - ny * qx
    for i in range(3):
        for j in range(3):
            second[i, j] = curvature * along[i] * along[j]
    # d2q/dpsi2 = -q, d2q/dpsi d(x, y) = -dR^T/dpsi
    second[2, 2] -= nx * qx + ny * qy
    second[0, 2] += sin * nx + cos * ny
    second[1, 2] += -cos * nx + sin * ny
    second[2, 0], second[2, 1] = second[0, 2], second[1, 2]
    return field - geometry[RADIUS]


@njit(cache=True, error_model="numpy")
def gap(q, slope, end, weights, geometry, feature, position):
    """g(q)."""
    pose, rate = np.empty(3), np.empty((3, len(q)))
    pose_of(q, slope, end, weights, pose, rate)
    return gap_of_pose(feature, geometry, position, pose, np.empty(3), np.empty((3, 3)))


@njit(cache=True, error_model="numpy")
def gap_gradient(q, slope, end, weights, geometry, feature, position):
    """dg/dq (n,)."""
    pose, rate, first = np.empty(3), np.empty((3, len(q))), np.empty(3)
    pose_of(q, slope, end, weights, pose, rate)
    gap_of_pose(feature, geometry, position, pose, first, np.empty((3, 3)))
    out = np.zeros(len(q))
    for i in range(3):
        for k in range(len(q)):
            out[k] += first[i] * rate[i, k]
    return out


@njit(cache=True, error_model="numpy")
def gap_hessian(q, slope, end, weights, geometry, feature, position):
    """d2g/dq2 (n, n)."""
    n = len(q)
    pose, rate, first, second = np.empty(3), np.empty((3, n)), np.empty(3), np.empty((3, 3))
    pose_of(q, slope, end, weights, pose, rate)
    gap_of_pose(feature, geometry, position, pose, first, second)
    out = np.zeros((n, n))
    for k in range(n):
        for m in range(n):
            for i in range(3):
                for j in range(3):
                    out[k, m] += second[i, j] * rate[i, k] * rate[j, m]
    for i in range(len(weights)):  # of the tip's place, eq. (1)
        psi = 0.0
        for k in range(n):
            psi += slope[i, k] * q[k]
        pull = -weights[i] * (first[0] * np.cos(psi) + first[1] * np.sin(psi))
        for k in range(n):
            for m in range(n):
                out[k, m] += pull * slope[i, k] * slope[i, m]
    return out


@njit(cache=True, error_model="numpy")
def energy(q, stiffness):
    """V (2)."""
    total = 0.0
    for k in range(len(q)):
        for m in range(len(q)):
            total += 0.5 * q[k] * stiffness[k, m] * q[m]
    return total


@njit(cache=True, error_model="numpy")
def energy_gradient(q, stiffness):
    """dV/dq (n,)."""
    out = np.zeros(len(q))
    for k in range(len(q)):
        for m in range(len(q)):
            out[k] += stiffness[k, m] * q[m]
    return out


def tip_pose(problem: JawProblem, q: np.ndarray) -> np.ndarray:
    """The tip's pose (3,)."""
    pose = np.empty(3)
    pose_of(q, problem.slope, problem.end, problem.weights, pose, np.empty((3, len(q))))
    return pose


def direction(problem: JawProblem, feature: int, position: float, pose: np.ndarray) -> np.ndarray:
    """The force on the finger (2,) for each unit of the gap's multiplier."""
    first = np.empty(3)
    gap_of_pose(feature, problem.geometry, position, pose, first, np.empty((3, 3)))
    return first[:2]


def contradicted(geometry: np.ndarray, feature: int, position: float, pose: np.ndarray) -> bool:
    """Whether the solution with this part of the jaw is touched beside that part."""
    x, y, cos, sin = pose[0], pose[1], math.cos(pose[2]), math.sin(pose[2])
    if feature == CORNER and geometry[RADIUS] == 0.0:  # a is not yet under the block
        return bool(x + cos * geometry[AX] - sin * geometry[AY] < position)
    dx, dy = position - x, geometry[PATH_Y] - y
    ex, ey = cos * dx + sin * dy - geometry[AX], cos * dy - sin * dx - geometry[AY]
    before_a = bool(geometry[TX] * ex + geometry[TY] * ey < 0.0)
    return before_a if feature == EDGE else not before_a
