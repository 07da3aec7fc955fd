"""One design in front of one target position: what the SQP evaluates.

    minimise  V(u) = 1/2 u^T u    subject to    g_k(pose(u); t) >= 0,  k = 0 ... K-1

The formulas of the rod are those of `kernels.rod`, for one design alone: its first lane would cost
as much as all lanes do.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels import points as contact
from fastncm.kernels.cache import inner
from fastncm.kernels.gap import store
from fastncm.kernels.trig import sincos


class Design(NamedTuple):
    """A design's tables and geometry, dimensionless.

    slope: (Q, m), end: (m,), weights: (Q,), see `kernels.rod`; jaw, target: of all designs, see
    `kernels.constants`, and `which` of them this is; kind: CIRCLE or BLOCK; form: of the
    constraints; points: M of the point forms.
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
    """Values and derivatives at one point, overwritten by `evaluate`.

    sin, cos: (Q,); pose: (3,); gradient: (2, m), d(x, y)/du; gaps: (GAP_COLUMNS, K); jacobian: (K,
    m), dg/du; force: (2,), the sum of all contact forces, for `add_position_hessian`.
    """

    sin: np.ndarray
    cos: np.ndarray
    pose: np.ndarray
    gradient: np.ndarray
    gaps: np.ndarray
    jacobian: np.ndarray
    force: np.ndarray


def make_evaluation(modes: int, quadrature_points: int, constraints: int) -> Evaluation:
    """Work arrays for one design."""
    return Evaluation(
        np.zeros(quadrature_points),
        np.zeros(quadrature_points),
        np.zeros(3),
        np.zeros((2, modes)),
        np.zeros((c.GAP_COLUMNS, constraints)),
        np.zeros((constraints, modes)),
        np.zeros(2),
    )


@inner
def evaluate(design, t, u, at):
    """Gaps and their gradients at `u` (m,) with the target at `t`."""
    modes = u.shape[0]
    _bend(design, u, at)
    x, y, psi = at.pose[0], at.pose[1], at.pose[2]
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
                at.gaps[c.GX, k] * at.gradient[0, i]
                + at.gaps[c.GY, k] * at.gradient[1, i]
                + at.gaps[c.GP, k] * design.end[i]
            )


@inner
def _bend(design, u, at):
    """Angles at the Gauss points, the tip's pose and its derivatives by the shape `u` (m,)."""
    slope, weights, modes = design.slope, design.weights, u.shape[0]
    at.pose[:] = 0.0
    at.gradient[:, :] = 0.0
    for i in range(modes):
        at.pose[2] += design.end[i] * u[i]
    for q in range(weights.shape[0]):
        theta = 0.0
        for i in range(modes):
            theta += slope[q, i] * u[i]
        sin, cos = sincos(theta)
        at.sin[q], at.cos[q] = sin, cos
        at.pose[0] += weights[q] * cos
        at.pose[1] += weights[q] * sin
        for i in range(modes):
            at.gradient[0, i] -= weights[q] * sin * slope[q, i]
        for i in range(modes):
            at.gradient[1, i] += weights[q] * cos * slope[q, i]


@inner
def add_position_hessian(design, at, out):
    """Add to the lower triangle of `out` (m, m) the Hessian of ``-(fx x + fy y)`` of the tip, with
    the force in ``at.force``."""
    slope = design.slope
    for q in range(slope.shape[0]):
        turned = at.force[0] * at.cos[q] + at.force[1] * at.sin[q]
        for i in range(out.shape[0]):
            share = design.weights[q] * turned * slope[q, i]
            for j in range(i + 1):
                out[i, j] += share * slope[q, j]


@inner
def hessian(design, at, multipliers, out):
    """Hessian of the Lagrangian ``V - sum_k lambda_k g_k`` at the evaluated point. out: (m, m),
    both halves."""
    modes = out.shape[0]
    at.force[:] = 0.0
    for k in range(multipliers.shape[0]):
        at.force[0] += multipliers[k] * at.gaps[c.GX, k]
        at.force[1] += multipliers[k] * at.gaps[c.GY, k]
    for i in range(modes):
        for j in range(i + 1):
            out[i, j] = 1.0 if i == j else 0.0
    add_position_hessian(design, at, out)
    for k in range(multipliers.shape[0]):
        if multipliers[k] == 0.0:
            continue
        g = at.gaps[:, k]
        for i in range(modes):
            xi, yi, pi = at.gradient[0, i], at.gradient[1, i], design.end[i]
            wx = g[c.HXX] * xi + g[c.HXY] * yi + g[c.HXP] * pi
            wy = g[c.HXY] * xi + g[c.HYY] * yi + g[c.HYP] * pi
            wp = g[c.HXP] * xi + g[c.HYP] * yi + g[c.HPP] * pi
            for j in range(i + 1):
                out[i, j] -= multipliers[k] * (
                    wx * at.gradient[0, j] + wy * at.gradient[1, j] + wp * design.end[j]
                )
    for i in range(modes):
        for j in range(i):
            out[j, i] = out[i, j]
