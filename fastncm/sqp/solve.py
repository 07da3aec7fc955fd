"""The active-set SQP: the loop (Nocedal & Wright 2006, sec. 18.4; Lan & Lee 2008, eqs. (11)-(13)).

Each iteration solves a quadratic program with the Lagrangian's Hessian (exact, or damped BFGS as in
the paper) for the step and the new multipliers, then walks along the step until an l1 merit
function falls enough. The merit function is what lets it leave the undeformed finger, where the
strain energy is at its minimum and any step raises it (the line search printed in the paper halves
the step there for ever).
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inner
from fastncm.sqp import design as model
from fastncm.sqp import qp, status

#: KKT residual that is accepted where rounding lets it fall no further.
_STALLED = 1e-7


class Options(NamedTuple):
    """Tolerances and limits of the loop.

    tolerance: of the relative KKT residual; rounding: absolute error of a gap that is due to
    arithmetic; iterations: at most; exact: Hessian exact (True) or damped BFGS (False); armijo:
    share of the predicted fall of the merit function that a step must bring; shortest: step length
    at which the line search gives up; longest_turn: by how much a step may turn the tip (rad);
    longest_move: of the target, as a share of the way to the next position (`path.careful`).
    """

    tolerance: float
    rounding: float
    iterations: int
    exact: bool
    armijo: float
    shortest: float
    longest_turn: float
    longest_move: float


class SqpWork(NamedTuple):
    """Workspace for m unknowns and K constraints.

    at, trial: evaluations; qp: see `qp.QpWork`; hessian, shifted: (m, m); step, linear, trial_u,
    change: (m,); multipliers, constant: (K,); working: (m,) and ignored: (K,) of the QP.
    """

    at: model.Evaluation
    trial: model.Evaluation
    qp: qp.QpWork
    hessian: np.ndarray
    step: np.ndarray
    linear: np.ndarray
    trial_u: np.ndarray
    change: np.ndarray
    multipliers: np.ndarray
    constant: np.ndarray
    working: np.ndarray
    ignored: np.ndarray


def make_work(modes: int, quadrature_points: int, constraints: int) -> SqpWork:
    """A workspace of the loop."""
    return SqpWork(
        model.make_evaluation(modes, quadrature_points, constraints),
        model.make_evaluation(modes, quadrature_points, constraints),
        qp.make_qp_work(modes),
        np.zeros((modes, modes)),
        np.zeros(modes),
        np.zeros(modes),
        np.zeros(modes),
        np.zeros(modes),
        np.zeros(constraints),
        np.zeros(constraints),
        np.zeros(modes, np.int64),
        np.zeros(constraints, np.bool_),
    )


@inner
def kkt_residual(u, jacobian, gaps, multipliers, rounding):
    """Largest relative violation of the KKT conditions, from scratch.

    Stationarity ``u - A^T lambda`` over the largest unknown; penetration and ``lambda g`` over the
    work-conjugate deflection ``|A_k u|`` of the contact; a negative multiplier over the largest
    one. All dimensionless.
    """
    largest, force, residual = 0.0, 0.0, 0.0
    for i in range(u.shape[0]):
        largest = max(largest, abs(u[i]))
    for k in range(multipliers.shape[0]):
        force = max(force, abs(multipliers[k]))
    for i in range(u.shape[0]):
        slack = u[i]
        for k in range(multipliers.shape[0]):
            slack -= jacobian[k, i] * multipliers[k]
        if slack != 0.0:
            residual = max(residual, abs(slack) / max(largest, rounding))
    deflection = rounding
    for k in range(multipliers.shape[0]):
        if multipliers[k] != 0.0:
            moved = 0.0
            for i in range(u.shape[0]):
                moved += jacobian[k, i] * u[i]
            deflection = max(deflection, abs(moved))
    for k in range(multipliers.shape[0]):
        gap = gaps[c.GAP, k]
        residual = max(residual, -gap / deflection)
        if multipliers[k] != 0.0:
            residual = max(residual, abs(gap) / deflection * abs(multipliers[k]) / force)
            residual = max(residual, -multipliers[k] / force)
    return residual


@inner
def _merit(u, gaps, penalty):
    """Exact l1 merit function ``V + penalty * sum of penetrations``."""
    energy, penetration = 0.0, 0.0
    for i in range(u.shape[0]):
        energy += 0.5 * u[i] * u[i]
    for k in range(gaps.shape[1]):
        penetration += max(0.0, -gaps[c.GAP, k])
    return energy + penalty * penetration


@inner
def _correct_inertia(work, count):
    """Factor the Hessian for the QP; where it is indefinite, make it positive definite.

    First by the working constraints' own curvature, ``H + rho A_W^T A_W``: it leaves the step along
    the constraints as it is (only steps off them cost more), and is enough where H is positive
    definite on their null space. Then by a growing multiple of the identity. Returns rho; the
    caller corrects the linear term for it.
    """
    modes = work.step.shape[0]
    _copy_square(work.hessian, work.qp.factor)
    if qp.cholesky(work.qp.factor, modes):
        return 0.0
    largest = 0.0
    for i in range(modes):
        largest = max(largest, abs(work.hessian[i, i]))
    norm = 0.0
    for w in range(count):
        for i in range(modes):
            norm = max(norm, work.at.jacobian[work.working[w], i] ** 2)
    rho = 10.0 * largest / norm if norm > 0.0 else 0.0
    for w in range(count):
        row = work.at.jacobian[work.working[w]]
        for i in range(modes):
            for j in range(modes):
                work.hessian[i, j] += rho * row[i] * row[j]
    shift = 0.0
    while True:
        _copy_square(work.hessian, work.qp.factor)
        for i in range(modes):
            work.qp.factor[i, i] += shift
        if qp.cholesky(work.qp.factor, modes):
            return rho
        shift = max(4.0 * shift, 1e-3 * largest)
        if not 0.0 < shift <= 1e12 * largest:  # nor for NaN, which ends no loop
            return -1.0


@inner
def _copy_square(source, target):
    for i in range(source.shape[0]):
        for j in range(source.shape[0]):
            target[i, j] = source[i, j]


@inner
def _solve_subproblem(u, work, count):
    """Step and multipliers from the QP at the evaluated point. Returns ``(qp status, count)``."""
    modes, constraints = u.shape[0], work.multipliers.shape[0]
    rho = _correct_inertia(work, count)
    if rho < 0.0:
        return -1, count
    for i in range(modes):
        work.linear[i] = u[i]
    for w in range(count):
        k = work.working[w]
        for i in range(modes):
            work.linear[i] += rho * work.at.gaps[c.GAP, k] * work.at.jacobian[k, i]
    for k in range(constraints):
        work.constant[k] = work.at.gaps[c.GAP, k]
    result, count = qp.solve_qp(
        work.linear,
        work.at.jacobian,
        work.constant,
        work.working,
        count,
        work.qp,
        work.ignored,
        work.step,
    )
    for k in range(constraints):
        work.multipliers[k] = 0.0
    for w in range(count):
        work.multipliers[work.working[w]] = work.qp.dual[w]
    return result, count


@inner
def _second_order_correction(work, count):
    """Bend the step back to the constraints, whose curvature would make the merit function reject
    it.

    Solves ``A_W e = -(g_W(u + step) )`` for the least ``e`` in the norm of H and adds it to the
    step (Nocedal & Wright 2006, sec. 18.3): the cure of the Maratos effect.
    """
    modes = work.step.shape[0]
    if count == 0 or not qp.factor_schur(work.at.jacobian, work.working, count, work.qp):
        return
    for w in range(count):
        work.qp.dual[w] = -work.trial.gaps[c.GAP, work.working[w]]
    qp.back_solve(work.qp.schur, count, work.qp.dual)
    for w in range(count):
        for i in range(modes):
            work.step[i] += work.qp.dual[w] * work.qp.columns[w, i]


@inner
def _try(design, t, u, length, work, penalty):
    """Evaluate at ``u + length * step`` and return the merit function there."""
    for i in range(u.shape[0]):
        work.trial_u[i] = u[i] + length * work.step[i]
    model.evaluate(design, t, work.trial_u, work.trial)
    return _merit(work.trial_u, work.trial.gaps, penalty)


@inner
def _line_search(design, t, u, work, count, penalty, options):
    """Length of the step that lowers the merit function enough; 0 where there is none.

    The accepted point is left in ``work.trial_u``.
    """
    merit = _merit(u, work.at.gaps, penalty)
    slope = 0.0
    for i in range(u.shape[0]):
        slope += u[i] * work.step[i]
    for k in range(work.constant.shape[0]):
        slope -= penalty * max(0.0, -work.constant[k])
    rounding = 4.0 * np.finfo(np.float64).eps * abs(merit) + penalty * options.rounding
    turn = 0.0
    for i in range(u.shape[0]):
        turn += design.end[i] * work.step[i]
    length = 1.0 if abs(turn) <= options.longest_turn else options.longest_turn / abs(turn)
    corrected = False
    while length >= options.shortest:
        if (
            _try(design, t, u, length, work, penalty)
            <= merit + options.armijo * length * min(slope, 0.0) + rounding
        ):
            return length
        if length == 1.0 and not corrected:
            corrected = True
            for i in range(u.shape[0]):
                work.change[i] = work.step[i]
            _second_order_correction(work, count)
            continue
        if length == 1.0:  # the corrected step is no direction of descent
            for i in range(u.shape[0]):
                work.step[i] = work.change[i]
        length *= 0.5
    return 0.0


@inner
def _update_bfgs(design, t, u, work):
    """Powell's damped BFGS update of the Hessian with the accepted step (Nocedal & Wright 2006,
    18.3).

    The energy's part of the change in gradient is the step itself; the constraints' is
    ``-(A(new) - A(old))^T lambda``, with ``work.trial`` at the new point.
    """
    modes = u.shape[0]
    bs, sbs, sy = work.linear, 0.0, 0.0
    step, change = work.step, work.change
    for i in range(modes):
        step[i] = work.trial_u[i] - u[i]
    for i in range(modes):
        change[i] = step[i]
        for k in range(work.multipliers.shape[0]):
            change[i] -= work.multipliers[k] * (work.trial.jacobian[k, i] - work.at.jacobian[k, i])
    for i in range(modes):
        bs[i] = 0.0
        for j in range(modes):
            bs[i] += work.hessian[i, j] * step[j]
        sbs += step[i] * bs[i]
        sy += step[i] * change[i]
    if not sbs > 0.0:
        return
    if sy < 0.2 * sbs:
        damping = 0.8 * sbs / (sbs - sy)
        for i in range(modes):
            change[i] = damping * change[i] + (1.0 - damping) * bs[i]
        sy = 0.2 * sbs
    for i in range(modes):
        for j in range(modes):
            work.hessian[i, j] += change[i] * change[j] / sy - bs[i] * bs[j] / sbs


@inner
def solve(design, t, u, count, work, options):
    """Minimise the strain energy of `design` with the target at `t`, from the shape `u`.

    u: (m,), start on entry, solution on return. ``work.working[:count]`` and ``work.multipliers``
    are the warm start and, on return, the active set and the contact forces. Returns ``(status,
    count, iterations, residual)``; ``work.at`` is the evaluation at the solution.
    """
    modes = u.shape[0]
    penalty = 0.0
    for i in range(modes):
        for j in range(modes):
            work.hessian[i, j] = 1.0 if i == j else 0.0
    model.evaluate(design, t, u, work.at)
    best = np.inf
    for iteration in range(options.iterations):
        residual = kkt_residual(
            u, work.at.jacobian, work.at.gaps, work.multipliers, options.rounding
        )
        if residual <= options.tolerance:
            return status.CONVERGED, count, iteration, residual
        best = min(best, residual)
        if options.exact:
            model.hessian(design, work.at, work.multipliers, work.hessian)
        result, count = _solve_subproblem(u, work, count)
        if result < 0:
            return status.NUMERICAL_ERROR, count, iteration, residual
        for w in range(count):
            penalty = max(penalty, 2.0 * work.multipliers[work.working[w]])
        if result == qp.INCONSISTENT:
            penalty = max(10.0 * penalty, 1.0)
        length = _line_search(design, t, u, work, count, penalty, options)
        if length == 0.0:
            return _stalled(work, residual, options), count, iteration, residual
        if not options.exact:
            _update_bfgs(design, t, u, work)
        for i in range(modes):
            u[i] = work.trial_u[i]
        model.evaluate(design, t, u, work.at)
    residual = kkt_residual(u, work.at.jacobian, work.at.gaps, work.multipliers, options.rounding)
    if residual <= options.tolerance:
        return status.CONVERGED, count, options.iterations, residual
    return _stalled(work, residual, options), count, options.iterations, residual


@inner
def _stalled(work, residual, options):
    """Status of a loop that came to a standstill: at a solution as good as rounding allows, or at
    none; infeasible where the finger still overlaps the target."""
    if not np.isfinite(residual):
        return status.NUMERICAL_ERROR
    if residual <= _STALLED:
        return status.CONVERGED
    smallest = 0.0
    for k in range(work.at.gaps.shape[1]):
        smallest = min(smallest, work.at.gaps[c.GAP, k])
    return status.INFEASIBLE if smallest < -options.tolerance else status.MAX_ITERATIONS
