"""What is kept of each solved position: the row, with the error estimate of the contact force.

Equilibrium gives the moment along the finger exactly once the contact force is known, ``M(s) = (p -
r(s)) x F``. Where it differs from ``E I psi'`` the chosen modes cannot follow: ``rho = M - E I
psi'`` consists of just the modes that are left out, ``rho_l = B . J_l`` with B the contact's wrench
on the tip and J_l the tip's derivative by the mode (and likewise the shear force against ``kappa G
A gamma``). What leaving them out does to the force follows by linearising the conditions of all
modes about the solution: with y the adjoint shape (`path.tip.adjoint`; without friction the change
of shape by a unit of force, over its compliance),

    d lambda = - sum_l rho_l y_l,    y_l = J_l . (adjoint wrench) - (K y)_l,

where K is the force's own stiffness, and the Hessian is close to 1 for the modes left out. So the
error of the force is of second order in rho. The sum runs over the first modes left out. Of a
contact that sticks, the friction force is another unknown, with an adjoint shape of its own.
"""

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels import rod
from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.lanewise import dot
from fastncm.kernels.workspace import NUMBER, Layout
from fastncm.path import frictionless, rubbing
from fastncm.path.lanes import MOST

# --- columns of a row ----------------------------------------------------------------------------
# What is looked at of every row comes first: it shares a line of the cache.
(
    STATUS,
    KIND,
    INTERVAL,
    FEATURE,
    STICKING,
    ESTIMATE,
    RESIDUAL,
    DISCRETE,
    POSITION,
    DIRECTION,
    FORCE,
    FORCE_RATE,
    NORMAL_X,
    NORMAL_Y,
    NORMAL_X_RATE,
    NORMAL_Y_RATE,
    RUB,
    RUB_RATE,
    SIDE,
    ITERATIONS,
    STRAIN,
    ENERGY,
    CONTACT_X,
    CONTACT_Y,
    CONTACT_X_RATE,
    CONTACT_Y_RATE,
    TIP_X,
    TIP_Y,
    TIP_ANGLE,
    CONTACTS,
) = range(30)
#: Two of them are free, so that every row begins with a line of the cache.
COLUMNS = 32

# RUB: friction force along t = (-ny, nx), n the normal; SIDE: friction over normal force where the
# contact slides (signed), else 0; STICKING: contacts that stick; DIRECTION: sense of the target's
# motion along x, +1 or -1, by which the insertion force is counted; DISCRETE: the part of the
# estimate that is due to the M points of a point form, and to rounding of the gap, beyond
# FORCE_ROUNDING: more modes do not mend it.

# --- kinds of rows -------------------------------------------------------------------------------
#: A requested position; and located events, which stand between the positions INTERVAL and INTERVAL
#: + 1: first touch, loss of contact, a change of feature seen from before and from after it.
AT_POSITION, TOUCH, RELEASE, BEFORE_CHANGE, AFTER_CHANGE = range(5)

#: Feature of a row with several loaded constraints, or of a point form: no single smooth contact.
SEVERAL = 14

#: The estimate is SAFETY times the signed leading term, which may vanish by chance, plus RESERVE
#: times the size of its summands; compared with the true error on both scenes
#: (tests/path/test_estimate.py).
SAFETY = 1.5
RESERVE = 0.2
#: Relative error of the force per unit of KKT residual, and the arithmetic's own, at least.
ALGEBRAIC = 4.0
FORCE_ROUNDING = 4e-14
#: Share of the force that is left of it where its error may be as large as itself: an estimate of a
#: thousand million says that nothing is known.
LEAST_KNOWN = 1e-9


#: Workspace and result of `measure`. turn: (Q, LANES); wrench, kept, moved, unit: (3, LANES);
#: left_out, adjoint: (n, LANES) of the modes that are left out; total, size: (LANES,); row:
#: (COLUMNS, LANES).
MEASURING = Layout(
    "Measuring",
    MOST,
    {
        "turn": (NUMBER, ("points", LANES)),
        "wrench": (NUMBER, (3, LANES)),
        "kept": (NUMBER, (3, LANES)),
        "moved": (NUMBER, (3, LANES)),
        "unit": (NUMBER, (3, LANES)),
        "left_out": (NUMBER, ("beyond", LANES)),
        "adjoint": (NUMBER, ("beyond", LANES)),
        "total": (NUMBER, (LANES,)),
        "size": (NUMBER, (LANES,)),
        "row": (NUMBER, (COLUMNS, LANES)),
    },
)


@inlined
def of_truth(error):
    """An error in shares of the force that was found, as one in shares of the true force, which may
    be smaller by it: where it is as large as the force itself, nothing is known."""
    return error / max(1.0 - error, LEAST_KNOWN)


@inlined
def _copy(values, out, column):
    for lane in range(LANES):
        out[column, lane] = values[lane]


@inner
def measure(problem, lanes, at):
    """Fill the rows of all active lanes from their converged state; `lanes` must come from
    `correct`.

    ``at.row`` is overwritten except for KIND, INTERVAL and DIRECTION, which stay zero.
    """
    gap, out = lanes.gap, at.row
    _copy(lanes.t, out, POSITION)
    _copy(lanes.force, out, FORCE)
    _copy(lanes.force_rate, out, FORCE_RATE)
    _copy(gap[c.GX], out, NORMAL_X)
    _copy(gap[c.GY], out, NORMAL_Y)
    _copy(gap[c.PX], out, CONTACT_X)
    _copy(gap[c.PY], out, CONTACT_Y)
    _copy(lanes.pose[0], out, TIP_X)
    _copy(lanes.pose[1], out, TIP_Y)
    _copy(lanes.pose[2], out, TIP_ANGLE)
    _copy(lanes.residual, out, RESIDUAL)
    _copy(lanes.iterations, out, ITERATIONS)
    _copy(gap[c.FEATURE], out, FEATURE)
    _copy(lanes.rub, out, RUB)
    _copy(lanes.rub_rate, out, RUB_RATE)
    _copy(lanes.side, out, SIDE)
    _copy(lanes.sticks, out, STICKING)
    out[CONTACTS] = 1.0
    dot(lanes.u, lanes.u, out[ENERGY])
    for lane in range(LANES):
        out[ENERGY, lane] *= 0.5
    _strain(problem, lanes, at)
    _estimate(problem, lanes, at)
    _rates(problem, lanes, out)


@inner
def _strain(problem, lanes, at):
    """Largest ``|M(s)| / (w / w0)^2`` over clamp, tip and Gauss points: surface strain in units of
    w0 / (2 L)."""
    gap, moment, strain = lanes.gap, at.turn, at.row[STRAIN]
    for lane in range(LANES):
        lanes.fx[lane] = lanes.force[lane] * gap[c.GX, lane] - lanes.rub[lane] * gap[c.GY, lane]
    for lane in range(LANES):
        lanes.fy[lane] = lanes.force[lane] * gap[c.GY, lane] + lanes.rub[lane] * gap[c.GX, lane]
    # (p - r) x F, with the node's place r the integral of its axis' direction
    for q in range(moment.shape[0]):
        for lane in range(LANES):
            lanes.work[q, lane] = (
                lanes.fy[lane] * lanes.cos[q, lane] - lanes.fx[lane] * lanes.sin[q, lane]
            )
    rod.running_integral(problem.rule.integral, lanes.work, moment)
    base, at_tip = at.total, lanes.loaded[2]
    for lane in range(LANES):
        x, y = lanes.pose[0, lane], lanes.pose[1, lane]
        base[lane] = at_tip[lane] + x * lanes.fy[lane] - y * lanes.fx[lane]
    for lane in range(LANES):
        strain[lane] = max(abs(base[lane]), abs(at_tip[lane]) * lanes.strain_end[lane])
    for q in range(moment.shape[0]):
        for lane in range(LANES):
            bent = abs(base[lane] - moment[q, lane]) * lanes.strain[q, lane]
            strain[lane] = max(strain[lane], bent)


@inner
def _estimate(problem, lanes, at):
    """Estimated relative error of the contact force, as derived above."""
    gap, weights, unit, total, size = lanes.gap, problem.rule.weights, at.unit, at.total, at.size
    for i in range(3):
        for lane in range(LANES):
            unit[i, lane] = gap[c.GX + i, lane]
    if lanes.rubs[0]:
        ratio = lanes.moved
        for lane in range(LANES):
            loaded = lanes.force[lane] > 0.0
            ratio[lane] = lanes.rub[lane] / lanes.force[lane] if loaded else lanes.side[lane]
        for i in range(3):
            for lane in range(LANES):
                unit[i, lane] += ratio[lane] * lanes.tangent[i, lane]
    for q in range(lanes.work.shape[0]):
        weight = weights[q]
        for lane in range(LANES):
            lanes.work[q, lane] = weight * (
                unit[1, lane] * lanes.cos[q, lane] - unit[0, lane] * lanes.sin[q, lane]
            )
    rod.project(lanes.beyond, lanes.work, at.left_out)  # rho_l / lambda, but for the tip's turn
    for j in range(lanes.beyond.shape[0]):
        for lane in range(LANES):
            at.left_out[j, lane] += unit[2, lane] * lanes.beyond_end[j, lane]
    if lanes.rubs[0]:
        rubbing.adjoint(lanes, 0, at.wrench, at.kept, at.moved)
    else:
        frictionless.adjoint(lanes, at.wrench, at.moved)
    for lane in range(LANES):
        size[lane] = 0.0
    _answer(problem, lanes, at)
    stiffness = lanes.fx
    for lane in range(LANES):
        stiffness[lane] = abs(lanes.inverse[0, 0, lane] - lanes.penalty[lane])
    for j in range(lanes.beyond.shape[0]):
        for lane in range(LANES):
            size[lane] += at.left_out[j, lane] ** 2 * stiffness[lane]
    for lane in range(LANES):
        at.row[ESTIMATE, lane] = total[lane] ** 2
    if lanes.holds[0]:
        rubbing.adjoint(lanes, 1, at.wrench, at.kept, at.moved)
        _answer(problem, lanes, at)
        for lane in range(LANES):
            at.row[ESTIMATE, lane] += total[lane] ** 2
    # the same of the angle by which the normal turns, whose change with the pose is t . dn
    for i in range(3):
        for lane in range(LANES):
            by_x = gap[c.HXP, lane] if i == 2 else gap[c.HXX + i, lane]
            by_y = gap[c.HYP, lane] if i == 2 else gap[c.HXY + i, lane]
            turns = gap[c.GX, lane] * by_y - gap[c.GY, lane] * by_x
            unit[i, lane] = lanes.force[lane] * turns
    if lanes.rubs[0]:
        rubbing.adjoint_turn(lanes, unit, at.wrench, at.kept, at.moved)
    else:
        frictionless.adjoint_turn(lanes, unit, at.wrench, at.moved)
    _answer(problem, lanes, at)
    for lane in range(LANES):
        missing = np.sqrt(at.row[ESTIMATE, lane] + total[lane] ** 2)
        missing = of_truth(SAFETY * missing + RESERVE * size[lane])
        at.row[ESTIMATE, lane] = missing + ALGEBRAIC * lanes.residual[lane] + FORCE_ROUNDING
    _gap_rounding(problem, lanes, at.row)
    for lane in range(LANES):
        at.row[ESTIMATE, lane] += at.row[DISCRETE, lane]


@inner
def _gap_rounding(problem, lanes, row):
    """What rounding of the gap does to the force beyond FORCE_ROUNDING (relative), into DISCRETE.

    A gap is a difference of numbers as large as the target, its distance and the jaw's arc. A force
    goes with the contact's deflection, which is twice the energy over it; next to a limit point it
    changes the more, by its own stiffness.
    """
    for lane in range(LANES):
        d, force = lanes.design[lane], lanes.force[lane]
        reach = 1.0 + problem.target[d, c.TARGET_RADIUS] + abs(problem.jaw[d, c.RHO])
        rounding = c.GAP_ROUNDING * (reach + abs(lanes.t[lane]))
        stiffness = abs(lanes.inverse[0, 0, lane] - lanes.penalty[lane])
        if force > 0.0:
            stiffness = max(stiffness, 0.5 * force * force / row[ENERGY, lane])
        share = rounding * stiffness / max(force, c.GAP_ROUNDING * stiffness)
        row[DISCRETE, lane] = max(share - FORCE_ROUNDING, 0.0)


@inner
def _answer(problem, lanes, at):
    """What the modes that are left out do through the adjoint shape ``lanes.down`` and wrench:
    ``at.total`` overwritten with ``sum_l rho_l y_l / lambda``, its summands' sizes added to
    ``at.size``."""
    gap, weights, wrench, turn = lanes.gap, problem.rule.weights, at.wrench, at.turn
    for lane in range(LANES):
        lanes.fx[lane] = lanes.force[lane] * gap[c.GX, lane] - lanes.rub[lane] * gap[c.GY, lane]
    for lane in range(LANES):
        lanes.fy[lane] = lanes.force[lane] * gap[c.GY, lane] + lanes.rub[lane] * gap[c.GX, lane]
    rod.add_up(lanes.slope, lanes.down, turn)  # of the axis at the nodes
    for q in range(turn.shape[0]):
        weight = weights[q]
        for lane in range(LANES):
            sin, cos = lanes.sin[q, lane], lanes.cos[q, lane]
            axial = lanes.fx[lane] * cos + lanes.fy[lane] * sin
            turn[q, lane] = weight * (
                wrench[1, lane] * cos - wrench[0, lane] * sin - axial * turn[q, lane]
            )
    rod.project(lanes.beyond, turn, at.adjoint)  # y_l, but for the tip's turn
    for lane in range(LANES):
        at.total[lane] = 0.0
    for j in range(lanes.beyond.shape[0]):
        for lane in range(LANES):
            at.adjoint[j, lane] += wrench[2, lane] * lanes.beyond_end[j, lane]
        for lane in range(LANES):
            at.total[lane] += at.left_out[j, lane] * at.adjoint[j, lane]
        for lane in range(LANES):
            at.size[lane] += abs(at.left_out[j, lane] * at.adjoint[j, lane])


@inner
def _rates(problem, lanes, out):
    """Derivatives by the target's position of the force's direction and of the contact's place."""
    gap = lanes.gap
    x, y, turn = lanes.pose_rate[0], lanes.pose_rate[1], lanes.pose_rate[2]
    for lane in range(LANES):
        vx, vy, vp = x[lane] - 1.0, y[lane], turn[lane]  # of the tip as the target sees it
        nx = gap[c.HXX, lane] * vx + gap[c.HXY, lane] * vy + gap[c.HXP, lane] * vp
        ny = gap[c.HXY, lane] * vx + gap[c.HYY, lane] * vy + gap[c.HYP, lane] * vp
        out[NORMAL_X_RATE, lane] = nx
        out[NORMAL_Y_RATE, lane] = ny
        d = lanes.design[lane]
        feature = gap[c.FEATURE, lane]
        if feature <= c.FAR_RETURN:  # the contact keeps its distance from the target's point
            radius = problem.target[d, c.TARGET_RADIUS]
            out[CONTACT_X_RATE, lane] = 1.0 + radius * nx
            out[CONTACT_Y_RATE, lane] = radius * ny
        else:  # the contact moves with a point of the jaw (the centre of its arc)
            rho = problem.jaw[d, c.RHO] if feature >= c.ARC_UNDERSIDE else 0.0
            arm_x = gap[c.PX, lane] + rho * gap[c.GX, lane] - lanes.pose[0, lane]
            arm_y = gap[c.PY, lane] + rho * gap[c.GY, lane] - lanes.pose[1, lane]
            out[CONTACT_X_RATE, lane] = x[lane] - vp * arm_y
            out[CONTACT_Y_RATE, lane] = y[lane] + vp * arm_x
