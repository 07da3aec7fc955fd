"""The algorithm of Lan & Lee (2008) to the letter, as far as it runs.

psi is a monomial in s (7), `order` >= 4; M points of the surface with the sharper corner stay
outside the other one: of the jaw before a circle (10a), of the block before a jaw (10b); SQP with
an active set and BFGS from the unit matrix (11)-(13); the force from the moment at the clamp, its
direction turned by friction (14)-(17). Compiled, to be judged by its mathematics.

The printed line search halves the step as long as V rises. V is at its minimum where the finger is
undeformed, so that it never moves: line_search = "printed" keeps it as evidence. The least repair
("merit"): V + nu sum(max(0, -g_j)) must fall instead. Two more, of details that the text leaves
open: s is in units of L, and the update is damped (Powell 1978) where it would lose definiteness.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numba import njit

from support import rivals_problem as rp
from support import shooting
from support.rivals import Answer

ITERATIONS = 200
CHANGES = 100
"""Of the active set, in one quadratic program."""
SHORTEST = 1e-10
ARMIJO = 1e-4
DAMPING = 0.2
ROUNDING = 1e-12
ROUNDING_OF_V = 1e-15
CONVERGED, OUT_OF_ITERATIONS, NO_STEP, NO_ACTIVE_SET = range(4)


class PaperRival:
    """The paper's algorithm with `order` coefficients, M points and one tolerance."""

    def __init__(
        self,
        case: shooting.ShootingCase,
        order: int,
        points: int,
        tolerance: float,
        line_search: Literal["merit", "printed"] = "merit",
    ) -> None:
        self.case, self.tolerance, self.merit = case, tolerance, line_search == "merit"
        self.problem = rp.jaw_problem(case, order, "monomial")
        self.points = jaw_points(case, points) if case.target_radius else block_points(case, points)
        self.cold = np.zeros(order)

    def solve(self, feature: int, position: float, before: Sequence[np.ndarray]) -> Answer:
        """The contact at `position` (m); which part touches is the algorithm's own affair."""
        start = before[-1] if before else self.cold
        place = position / self.case.length
        q, multipliers, iterations, status = minimise(
            start, *self.problem, self.points, place, self.tolerance, self.merit
        )
        force = rp.force_unit(self.case) * self._recovered(q, multipliers, place)
        pose = rp.tip_pose(self.problem, q)
        return Answer(status == CONVERGED, force, pose, int(iterations), q)

    def _recovered(self, q: np.ndarray, multipliers: np.ndarray, place: float) -> np.ndarray:
        """(14)-(17) at the mean of the touching points, in units of EI/L^2."""
        touching = np.flatnonzero(multipliers > 0.0)
        if not len(touching):
            return np.zeros(2)
        pose = rp.tip_pose(self.problem, q)
        at, normal = np.zeros(2), np.zeros(2)
        first = np.empty(3)
        for j in touching:
            where = np.empty(2)
            _gap_of_point(self.problem.geometry, self.points[j], place, pose, first, where)
            at += multipliers[j] * where / multipliers[touching].sum()
            normal += multipliers[j] * first[:2]
        normal /= np.hypot(*normal)
        tangent = np.array([normal[1], -normal[0]])
        if tangent[0] > 0.0:  # friction pulls the way the target goes, towards -x
            tangent = -tangent
        push = normal + self.case.mu * tangent
        force: np.ndarray = q[0] / (at[0] * push[1] - at[1] * push[0]) * push  # psi'(0) = q_0
        return force


def jaw_points(case: shooting.ShootingCase, count: int) -> np.ndarray:
    """(M, 2): from a to b, seen from the undeformed tip."""
    a, b = (np.array(p) / case.length - [1.0, 0.0] for p in (case.a, case.b))
    numbers = rp.geometry(case)
    if case.jaw_radius is None:
        return a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)
    centre = numbers[[rp.MX, rp.MY]]
    first, last = (np.arctan2(*(p - centre)[::-1]) for p in (a, b))
    angle = np.linspace(first, last, count)
    return centre + abs(numbers[rp.RHO]) * np.column_stack([np.cos(angle), np.sin(angle)])


def block_points(case: shooting.ShootingCase, count: int) -> np.ndarray:
    """(M, 2): from the block's corner up its face and along its underside, as far as the jaw."""
    step = np.hypot(case.b[0] - case.a[0], case.b[1] - case.a[1]) / case.length / max(count // 2, 1)
    k = np.arange(count)
    distance = step * ((k + 1) // 2)
    return np.column_stack([np.where(k % 2 == 1, 0.0, distance), np.where(k % 2 == 1, distance, 0)])


@njit(cache=True, error_model="numpy")
def _gap_of_point(geometry, point, place, pose, first, where):
    """Gap of one point; d(gap)/d(pose) (3,) and the point in space (2,) are overwritten."""
    second = np.empty((3, 3))
    if geometry[rp.RADIUS] > 0.0:  # (10a): a point of the jaw
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        where[0] = pose[0] + cos * point[0] - sin * point[1]
        where[1] = pose[1] + sin * point[0] + cos * point[1]
        here = geometry.copy()
        here[rp.AX], here[rp.AY] = point[0], point[1]
        py = geometry[rp.PATH_Y]
        return rp.point_gap(rp.CORNER, here, place, py, pose, first, second)
    where[0], where[1] = place + point[0], geometry[rp.PATH_Y] + point[1]  # (10b): of the block
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    dx, dy = where[0] - pose[0], where[1] - pose[1]
    ex, ey = cos * dx + sin * dy - geometry[rp.AX], cos * dy - sin * dx - geometry[rp.AY]
    behind = geometry[rp.TX] * ex + geometry[rp.TY] * ey < 0.0
    part = rp.CORNER if behind else rp.EDGE
    return rp.point_gap(part, geometry, where[0], where[1], pose, first, second)


@njit(cache=True, error_model="numpy")
def gaps(q, slope, end, weights, geometry, points, place, out, jacobian):
    """Gaps (M,) and their derivatives by q (M, n), both overwritten."""
    pose, rate, first, where = np.empty(3), np.empty((3, len(q))), np.empty(3), np.empty(2)
    rp.pose_of(q, slope, end, weights, pose, rate)
    for j in range(len(points)):
        out[j] = _gap_of_point(geometry, points[j], place, pose, first, where)
        for k in range(len(q)):
            jacobian[j, k] = first[0] * rate[0, k] + first[1] * rate[1, k] + first[2] * rate[2, k]


@njit(cache=True, error_model="numpy")
def active_set(hessian, slope_v, gap, jacobian, step, multipliers):
    """min 1/2 d.B d + dV.d so that g + A d >= 0: from no constraint, the most violated one is
    added, the most negative multiplier dropped. False where that does not end."""
    n, count = len(slope_v), len(gap)
    working = np.empty(count, np.int64)
    size = 0
    for _ in range(CHANGES):
        system, right = np.zeros((n + size, n + size)), np.zeros(n + size)
        system[:n, :n], right[:n] = hessian, -slope_v
        for i in range(size):
            system[:n, n + i], system[n + i, :n] = -jacobian[working[i]], jacobian[working[i]]
            right[n + i] = -gap[working[i]]
        try:
            found = np.linalg.solve(system, right)
        except Exception:  # a singular matrix; Numba catches no narrower class
            return False
        step[:] = found[:n]
        worst, at = -ROUNDING, -1
        for i in range(size):
            if found[n + i] < worst:
                worst, at = found[n + i], i
        if at >= 0:
            size -= 1
            working[at] = working[size]
            continue
        worst = -ROUNDING
        for j in range(count):
            value = gap[j]
            for k in range(n):
                value += jacobian[j, k] * step[k]
            if value < worst:
                worst, at = value, j
        if at < 0:
            multipliers[:] = 0.0
            for i in range(size):
                multipliers[working[i]] = max(found[n + i], 0.0)
            return True
        if size == n:
            return False
        working[size] = at
        size += 1
    return False


@njit(cache=True, error_model="numpy")
def minimise(start, stiffness, slope, end, weights, geometry, points, place, tolerance, merit):
    """The SQP: q, multipliers (M,), iterations and status."""
    n, count = len(start), len(points)
    q, hessian, penalty = start.copy(), np.eye(n), 0.0
    g, jacobian, multipliers = np.empty(count), np.empty((count, n)), np.zeros(count)
    g_there, jacobian_there, step = np.empty(count), np.empty((count, n)), np.empty(n)
    gaps(q, slope, end, weights, geometry, points, place, g, jacobian)
    for iteration in range(ITERATIONS):
        slope_v = stiffness @ q
        if not active_set(hessian, slope_v, g, jacobian, step, multipliers):
            return q, multipliers, iteration, NO_ACTIVE_SET
        if np.abs(step).max() <= tolerance and g.min() >= -tolerance:
            return q, multipliers, iteration, CONVERGED
        penalty = max(penalty, 2.0 * multipliers.max())
        here = rp.energy(q, stiffness)
        fall = 0.0
        if merit:
            outside = -np.minimum(g, 0.0).sum()
            here += penalty * outside
            fall = min(slope_v @ step - penalty * outside, 0.0)
        length = 1.0
        while True:
            there = q + length * step
            gaps(there, slope, end, weights, geometry, points, place, g_there, jacobian_there)
            value = rp.energy(there, stiffness)
            if merit:
                value -= penalty * np.minimum(g_there, 0.0).sum()
            if value <= here + ARMIJO * length * fall + merit * ROUNDING_OF_V:
                break
            length *= 0.5
            if length < SHORTEST:
                return q, multipliers, iteration, NO_STEP
        moved = there - q
        bent = stiffness @ moved - (jacobian_there - jacobian).T @ multipliers
        pressed = hessian @ moved
        along, across = moved @ bent, moved @ pressed
        if along < DAMPING * across:
            share = (1.0 - DAMPING) * across / (across - along)
            bent = share * bent + (1.0 - share) * pressed
            along = moved @ bent
        if along > 0.0:
            hessian += np.outer(bent, bent) / along - np.outer(pressed, pressed) / across
        q = there
        g[:], jacobian[:] = g_there, jacobian_there
    return q, multipliers, ITERATIONS, OUT_OF_ITERATIONS
