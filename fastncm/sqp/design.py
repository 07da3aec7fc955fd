"""One design in front of one target position: what the SQP evaluates.

    minimise  V(u) = 1/2 u^T u    subject to    g_k(pose(u); t) >= 0,  k = 0 ... K-1

The design fills the first lane of the lane-wise kernels (`kernels.rod`), so that every formula
exists once.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels import points as contact
from fastncm.kernels import rod
from fastncm.kernels.cache import inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.gap import store


class Design(NamedTuple):
    """A design's tables and geometry, dimensionless.

    slope: (m, Q, LANES), end: (m, LANES), of which lane 0 counts; weights: (Q,); jaw, target: of
    all designs, see `kernels.constants`, and `which` of them this is; kind: CIRCLE or BLOCK; form:
    of the constraints; points: M of the point forms.
    """

    slope: np.ndarray
    end: np.ndarray
    weights: np.ndarray
    jaw: np.ndarray
    target: np.ndarray
    which: int
    kind: int
    form: int
    points: int


class Evaluation(NamedTuple):
    """Values and derivatives at one point, overwritten by `evaluate` and `add_curvature`.

    u: (m, LANES); sin, cos, work: (Q, LANES); pose: (3, LANES); gradient: (2, m, LANES), d(x,
    y)/du; gaps: (GAP_COLUMNS, K); jacobian: (K, m), dg/du; block: (m, m, LANES); force: (2, LANES).
    """

    u: np.ndarray
    sin: np.ndarray
    cos: np.ndarray
    work: np.ndarray
    pose: np.ndarray
    gradient: np.ndarray
    gaps: np.ndarray
    jacobian: np.ndarray
    block: np.ndarray
    force: np.ndarray


def make_evaluation(modes: int, quadrature_points: int, constraints: int) -> Evaluation:
    """Work arrays for one design."""
    return Evaluation(
        np.zeros((modes, LANES)),
        np.zeros((quadrature_points, LANES)),
        np.zeros((quadrature_points, LANES)),
        np.zeros((quadrature_points, LANES)),
        np.zeros((3, LANES)),
        np.zeros((2, modes, LANES)),
        np.zeros((c.GAP_COLUMNS, constraints)),
        np.zeros((constraints, modes)),
        np.zeros((modes, modes, LANES)),
        np.zeros((2, LANES)),
    )


@inner
def evaluate(design, t, u, at):
    """Gaps and their gradients at `u` (m,) with the target at `t`."""
    modes = u.shape[0]
    for i in range(modes):
        at.u[i, 0] = u[i]
    rod.tip_pose(design.slope, design.end, design.weights, at.u, at.sin, at.cos, at.pose)
    rod.pose_gradient(design.slope, design.weights, at.sin, at.cos, at.gradient)
    x, y, psi = at.pose[0, 0], at.pose[1, 0], at.pose[2, 0]
    cos, sin = np.cos(psi), np.sin(psi)
    for k in range(at.gaps.shape[1]):
        gap = contact.constraint_gap(
            design.form,
            design.points,
            design.kind,
            k,
            design.jaw,
            design.target,
            design.which,
            t,
            x,
            y,
            cos,
            sin,
        )
        store(gap, at.gaps, k)
        for i in range(modes):
            at.jacobian[k, i] = (
                at.gaps[c.GX, k] * at.gradient[0, i, 0]
                + at.gaps[c.GY, k] * at.gradient[1, i, 0]
                + at.gaps[c.GP, k] * design.end[i, 0]
            )


@inner
def hessian(design, at, multipliers, out):
    """Hessian of the Lagrangian ``V - sum_k lambda_k g_k`` at the evaluated point. out: (m, m),
    both halves."""
    modes = out.shape[0]
    at.force[:, 0] = 0.0
    at.block[:, :, 0] = 0.0
    for k in range(multipliers.shape[0]):
        at.force[0, 0] += multipliers[k] * at.gaps[c.GX, k]
        at.force[1, 0] += multipliers[k] * at.gaps[c.GY, k]
    rod.add_position_hessian(
        design.slope, design.weights, at.sin, at.cos, at.force[0], at.force[1], at.work, at.block
    )
    for i in range(modes):
        for j in range(i + 1):
            out[i, j] = at.block[i, j, 0] + (1.0 if i == j else 0.0)
    for k in range(multipliers.shape[0]):
        if multipliers[k] == 0.0:
            continue
        g = at.gaps[:, k]
        for i in range(modes):
            xi, yi, pi = at.gradient[0, i, 0], at.gradient[1, i, 0], design.end[i, 0]
            wx = g[c.HXX] * xi + g[c.HXY] * yi + g[c.HXP] * pi
            wy = g[c.HXY] * xi + g[c.HYY] * yi + g[c.HYP] * pi
            wp = g[c.HXP] * xi + g[c.HYP] * yi + g[c.HPP] * pi
            for j in range(i + 1):
                out[i, j] -= multipliers[k] * (
                    wx * at.gradient[0, j, 0] + wy * at.gradient[1, j, 0] + wp * design.end[j, 0]
                )
    for i in range(modes):
        for j in range(i):
            out[j, i] = out[i, j]
