"""SciPy's `root` and `least_squares` on the equilibrium of a sliding contact, with friction or not.

The discretisation is that of `rivals_problem`. Friction has no energy to minimise, but the
equilibrium is a square system in the modes q (n) and the normal force N:

    H q - N (w + mu w_t) dpose/dq = 0,    g(q) = 0,

where w = dg/dpose is the wrench of a unit normal force about the tip and w_t that of a unit force
along the tangent, in the direction in which the target drags the finger. The Jacobian is exact and
compiled; the part of the jaw that touches is given, as for the optimisers.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numba import njit
from scipy.optimize import least_squares, root

from support import rivals_problem as rp
from support import shooting
from support.rivals import Answer, extrapolated

Method = Literal["root", "least_squares"]
ITERATIONS = 200
FIRST_FORCE = 1e-3


class RootRival:
    """One of the two methods, with `order` modes and one tolerance."""

    def __init__(
        self, case: shooting.ShootingCase, method: Method, order: int, tolerance: float
    ) -> None:
        self.case, self.method, self.tolerance = case, method, tolerance
        self.problem = rp.jaw_problem(case, order)
        self.cold = np.append(np.zeros(order), FIRST_FORCE)

    def solve(self, feature: int, position: float, before: Sequence[np.ndarray]) -> Answer:
        """The contact at `position` (m) of this part of the jaw; states are q and N."""
        place, start = position / self.case.length, extrapolated(before, self.cold)
        scene = (*self.problem, feature, place, self.case.mu)
        if self.method == "root":
            found = root(sliding, start, scene, jac=sliding_slope, tol=self.tolerance)
        else:
            tight = dict.fromkeys(("ftol", "xtol", "gtol"), self.tolerance)
            found = least_squares(sliding, start, sliding_slope, args=scene, method="lm",
                                  max_nfev=ITERATIONS, **tight)  # fmt: skip
        q, normal = found.x[:-1], found.x[-1]
        pose, first = rp.tip_pose(self.problem, q), np.empty(3)
        rp.gap_of_pose(feature, self.problem.geometry, place, pose, first, np.empty((3, 3)))
        push = first[:2] + self.case.mu * np.array([first[1], -first[0]])
        force = rp.force_unit(self.case) * normal * push
        closed = np.abs(found.fun).max() <= max(1e2 * self.tolerance, 1e-12)
        success = bool(found.success) and closed and normal > 0.0
        return Answer(success, force, pose, int(found.nfev), found.x)


@njit(cache=True, error_model="numpy")
def wrench(feature, geometry, position, mu, pose, total, by_pose):
    """The wrench (3,) of a unit normal force with its friction, and its derivatives by the pose
    (3, 3), both overwritten; returns the gap."""
    first, second = np.empty(3), np.empty((3, 3))
    gap = rp.gap_of_pose(feature, geometry, position, pose, first, second)
    # the contact from the tip: on the circle, at the block's corner, or the jaw's corner a
    radius = geometry[rp.RADIUS]
    arm_x = position + radius * first[0] - pose[0]
    arm_y = geometry[rp.PATH_Y] + radius * first[1] - pose[1]
    under = feature == rp.CORNER and radius == 0.0
    if under:
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        arm_x = cos * geometry[rp.AX] - sin * geometry[rp.AY]
        arm_y = sin * geometry[rp.AX] + cos * geometry[rp.AY]
    tx, ty = first[1], -first[0]
    total[0], total[1] = first[0] + mu * tx, first[1] + mu * ty
    total[2] = first[2] + mu * (arm_x * ty - arm_y * tx)
    for j in range(3):
        turn_x, turn_y = second[1, j], -second[0, j]
        move_x, move_y = radius * second[0, j], radius * second[1, j]
        if under:
            move_x, move_y = (-arm_y, arm_x) if j == 2 else (0.0, 0.0)
        elif j == 0:
            move_x -= 1.0
        elif j == 1:
            move_y -= 1.0
        by_pose[0, j] = second[0, j] + mu * turn_x
        by_pose[1, j] = second[1, j] + mu * turn_y
        spun = move_x * ty - move_y * tx + arm_x * turn_y - arm_y * turn_x
        by_pose[2, j] = second[2, j] + mu * spun
    return gap


@njit(cache=True, error_model="numpy")
def sliding(z, stiffness, slope, end, weights, geometry, feature, position, mu):
    """The residual (n + 1,) at z, q and N."""
    n = len(z) - 1
    pose, rate, total = np.empty(3), np.empty((3, n)), np.empty(3)
    rp.pose_of(z[:n], slope, end, weights, pose, rate)
    out = np.empty(n + 1)
    out[n] = wrench(feature, geometry, position, mu, pose, total, np.empty((3, 3)))
    for k in range(n):
        out[k] = 0.0
        for m in range(n):
            out[k] += stiffness[k, m] * z[m]
        for i in range(3):
            out[k] -= z[n] * total[i] * rate[i, k]
    return out


@njit(cache=True, error_model="numpy")
def sliding_slope(z, stiffness, slope, end, weights, geometry, feature, position, mu):
    """The residual's Jacobian (n + 1, n + 1)."""
    n = len(z) - 1
    pose, rate, total, by_pose = np.empty(3), np.empty((3, n)), np.empty(3), np.empty((3, 3))
    rp.pose_of(z[:n], slope, end, weights, pose, rate)
    wrench(feature, geometry, position, mu, pose, total, by_pose)
    first = np.empty(3)
    rp.gap_of_pose(feature, geometry, position, pose, first, np.empty((3, 3)))
    out = np.zeros((n + 1, n + 1))
    for k in range(n):
        for i in range(3):
            out[k, n] -= total[i] * rate[i, k]
            out[n, k] += first[i] * rate[i, k]
        for m in range(n):
            out[k, m] = stiffness[k, m]
            for i in range(3):
                for j in range(3):
                    out[k, m] -= z[n] * by_pose[i, j] * rate[i, k] * rate[j, m]
    for i in range(len(weights)):  # of the tip's place, eq. (1)
        psi = 0.0
        for k in range(n):
            psi += slope[i, k] * z[k]
        pull = z[n] * weights[i] * (total[0] * np.cos(psi) + total[1] * np.sin(psi))
        for k in range(n):
            for m in range(n):
                out[k, m] += pull * slope[i, k] * slope[i, m]
    return out
