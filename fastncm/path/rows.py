"""What is kept of each solved position: the row, with the error estimate of the contact force.

Equilibrium gives the moment along the finger exactly once the contact force is known,
``M(s) = (p - r(s)) x F``. Where it differs from ``E I psi'`` the chosen modes cannot follow: ``rho = M - E I psi'``
contains just the modes that are missing. Adding them would turn the finger by ``rho`` more and so make it
more compliant; with the compliance ``A H^-1 A^T`` of the contact the force would fall by

    d lambda / lambda = - |rho|^2 / (lambda^2 A H^-1 A^T),    |rho|^2 = integral rho^2 / (E I) ds

(derivation: with the missing curvature modes k, stationarity gives du_k = rho_k, and A_k lambda = rho_k, so
that ``A du = 0`` over all modes is ``A H^-1 A^T dlambda + rho . rho / lambda = 0``). The same holds for shear
with ``kappa G A``. The force error is of second order in rho, and so is the estimate.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels import rod
from fastncm.kernels.cache import driver, kernel
from fastncm.kernels.constants import LANES

# --- columns of a row ----------------------------------------------------------------------------
(
    POSITION,
    STATUS,
    KIND,
    INTERVAL,
    FORCE,
    FORCE_RATE,
    NORMAL_X,
    NORMAL_Y,
    NORMAL_X_RATE,
    NORMAL_Y_RATE,
    CONTACT_X,
    CONTACT_Y,
    CONTACT_X_RATE,
    CONTACT_Y_RATE,
    TIP_X,
    TIP_Y,
    TIP_ANGLE,
    ENERGY,
    STRAIN,
    RESIDUAL,
    ESTIMATE,
    ITERATIONS,
    FEATURE,
    CONTACTS,
) = range(24)
COLUMNS = 24

# --- kinds of rows -------------------------------------------------------------------------------
#: A requested position; and located events, which stand between the positions INTERVAL and INTERVAL + 1:
#: first touch, loss of contact, a change of feature seen from before and from after it, a smooth peak.
AT_POSITION, TOUCH, RELEASE, BEFORE_CHANGE, AFTER_CHANGE, SMOOTH_PEAK = range(6)

#: Feature of a row with several loaded constraints, or of a point form: no single smooth contact.
SEVERAL = 10

#: The estimate is the leading term of the error; the terms left out were at most this factor where it was
#: compared with the true error (tests/path/test_estimate.py: both scenes, orders 2 to 10, taper, shear).
SAFETY = 2.0
#: Relative error of the force per unit of KKT residual, and the arithmetic's own.
ALGEBRAIC = 4.0
FORCE_ROUNDING = 4e-14


class Measuring(NamedTuple):
    """Workspace and result of `measure`. x, y: (Q, LANES); missing: (LANES,); row: (COLUMNS, LANES)."""

    x: np.ndarray
    y: np.ndarray
    missing: np.ndarray
    row: np.ndarray


@driver
def make_measuring(points):
    """A workspace for `points` Gauss points."""
    return Measuring(
        np.zeros((points, LANES)),
        np.zeros((points, LANES)),
        np.zeros(LANES),
        np.zeros((COLUMNS, LANES)),
    )


@kernel
def measure(problem, lanes, at):
    """Fill the rows of all active lanes from their converged state; `lanes` must come from `correct`.

    ``at.row`` is overwritten except for KIND and INTERVAL, which stay zero.
    """
    basis, rule = lanes.basis, problem.rule
    modes, points = lanes.u.shape[0], lanes.sin.shape[0]
    bending = problem.profile.slope.shape[1]
    gap, out, x, y, missing = lanes.gap, at.row, at.x, at.y, at.missing
    rod.node_positions(rule.integral, lanes.sin, lanes.cos, x, y)
    for lane in range(LANES):
        fx = lanes.force[lane] * gap[c.GX, lane]
        fy = lanes.force[lane] * gap[c.GY, lane]
        lanes.fx[lane], lanes.fy[lane] = fx, fy
        at_clamp = gap[c.PX, lane] * fy - gap[c.PY, lane] * fx
        at_tip = (gap[c.PX, lane] - lanes.pose[0, lane]) * fy - (
            gap[c.PY, lane] - lanes.pose[1, lane]
        ) * fx
        out[STRAIN, lane] = max(abs(at_clamp), abs(at_tip) / basis.ratio[lane] ** 2)
        out[ENERGY, lane] = 0.0
        missing[lane] = 0.0
    for k in range(modes):
        for lane in range(LANES):
            out[ENERGY, lane] += 0.5 * lanes.u[k, lane] * lanes.u[k, lane]
    for q in range(points):
        weight = rule.weights[q]
        for lane in range(LANES):
            lanes.smallest[lane] = 0.0
        for k in range(bending):
            for lane in range(LANES):
                lanes.smallest[lane] += lanes.u[k, lane] * basis.values[k, q, lane]
        for lane in range(LANES):
            moment = (gap[c.PX, lane] - x[q, lane]) * lanes.fy[lane] - (
                gap[c.PY, lane] - y[q, lane]
            ) * lanes.fx[lane]
            slack = moment - basis.stiffness[q, lane] * lanes.smallest[lane]
            missing[lane] += weight * slack * slack / basis.stiffness[q, lane]
            out[STRAIN, lane] = max(
                out[STRAIN, lane], abs(moment) / (basis.area[q, lane] * basis.area[q, lane])
            )
        if basis.shear.shape[0] == 0:
            continue
        for lane in range(LANES):
            lanes.smallest[lane] = 0.0
        for k in range(bending, modes):
            for lane in range(LANES):
                lanes.smallest[lane] += lanes.u[k, lane] * basis.values[k, q, lane]
        for lane in range(LANES):
            across = lanes.fy[lane] * lanes.cos[q, lane] - lanes.fx[lane] * lanes.sin[q, lane]
            slack = across - basis.shear[q, lane] * lanes.smallest[lane]
            missing[lane] += weight * slack * slack / basis.shear[q, lane]
    for lane in range(LANES):
        force = lanes.force[lane]
        lacking = missing[lane] / (force * force * lanes.compliance[lane])
        out[ESTIMATE, lane] = (
            SAFETY * lacking + ALGEBRAIC * lanes.residual[lane] + FORCE_ROUNDING
        )
    _rates(problem, lanes, out)
    for lane in range(LANES):
        out[POSITION, lane] = lanes.t[lane]
        out[FORCE, lane] = lanes.force[lane]
        out[FORCE_RATE, lane] = lanes.force_rate[lane]
        out[NORMAL_X, lane] = gap[c.GX, lane]
        out[NORMAL_Y, lane] = gap[c.GY, lane]
        out[CONTACT_X, lane] = gap[c.PX, lane]
        out[CONTACT_Y, lane] = gap[c.PY, lane]
        out[TIP_X, lane] = lanes.pose[0, lane]
        out[TIP_Y, lane] = lanes.pose[1, lane]
        out[TIP_ANGLE, lane] = lanes.pose[2, lane]
        out[RESIDUAL, lane] = lanes.residual[lane]
        out[ITERATIONS, lane] = lanes.iterations[lane]
        out[FEATURE, lane] = gap[c.FEATURE, lane]
        out[CONTACTS, lane] = 1.0





@kernel
def _rates(problem, lanes, out):
    """Derivatives by the target's position of the force's direction and of the contact's place."""
    gap = lanes.gap
    modes = lanes.u.shape[0]
    x, y, turn = lanes.work[0], lanes.work[1], lanes.work[2]
    for lane in range(LANES):
        x[lane], y[lane], turn[lane] = 0.0, 0.0, 0.0
    for k in range(modes):
        for lane in range(LANES):
            x[lane] += lanes.gradient[0, k, lane] * lanes.u_rate[k, lane]
            y[lane] += lanes.gradient[1, k, lane] * lanes.u_rate[k, lane]
            turn[lane] += lanes.basis.end[k, lane] * lanes.u_rate[k, lane]
    for lane in range(LANES):
        vx, vy, vp = x[lane] - 1.0, y[lane], turn[lane]  # of the tip as the target sees it
        nx = gap[c.HXX, lane] * vx + gap[c.HXY, lane] * vy + gap[c.HXP, lane] * vp
        ny = gap[c.HXY, lane] * vx + gap[c.HYY, lane] * vy + gap[c.HYP, lane] * vp
        out[NORMAL_X_RATE, lane] = nx
        out[NORMAL_Y_RATE, lane] = ny
        d = lanes.design[lane]
        feature = gap[c.FEATURE, lane]
        if feature <= c.ON_B:  # the contact keeps its distance from the target's point
            radius = problem.target[d, c.TARGET_RADIUS]
            out[CONTACT_X_RATE, lane] = 1.0 + radius * nx
            out[CONTACT_Y_RATE, lane] = radius * ny
        else:  # the contact moves with a point of the jaw (the centre of its arc)
            rho = problem.jaw[d, c.RHO] if feature >= c.ARC_UNDERSIDE else 0.0
            arm_x = gap[c.PX, lane] + rho * gap[c.GX, lane] - lanes.pose[0, lane]
            arm_y = gap[c.PY, lane] + rho * gap[c.GY, lane] - lanes.pose[1, lane]
            out[CONTACT_X_RATE, lane] = x[lane] - vp * arm_y
            out[CONTACT_Y_RATE, lane] = y[lane] + vp * arm_x
