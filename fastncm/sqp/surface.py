"""The SQP for a finger in direct contact (Lan & Lee 2008, eqs. (11)-(13)), O(N) an iteration.

Each iteration solves a quadratic program with the Lagrangian's exact Hessian
(`sqp.subproblem`) for the step and the new multipliers, and walks along the step until an l1 merit
function or the KKT residual falls. With friction there is no energy to fall: then the residual
alone decides.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.nodal import (
    Nodal,
    carry_forces,
    make_nodal,
    place_axis,
    place_surface,
)
from fastncm.sqp import status
from fastncm.sqp.flexibility import Chain, make_chain
from fastncm.sqp.subproblem import UNSETTLED, solve_subproblem

#: Error of a gap in finger lengths that is due to rounding.
ROUNDING = 1e-15
#: Points closer to the target than this (finger lengths) take part in the subproblem.
_NEAR = 0.004
#: Weight of the relative violation at the clamp, and the smallest part of the largest moment that
#: counts as its moment.
_AT_CLAMP, _SMALLEST = 0.1, 1e-4
#: Share of the predicted fall of the merit function, and of the residual, that a step must bring.
_ARMIJO, _RESIDUAL_FALL = 1e-4, 0.1
#: A full step to more than this part of the residual is halved or doubled where that brings this
#: part of it.
_SLOW, _BETTER = 0.5, 0.5
#: Full steps of a solve with friction that may raise the residual.
_LEAPS = 4
#: Step length at which the line search gives up.
_SHORTEST = 1e-4


class SurfaceWork(NamedTuple):
    """One finger's state, the workspace of its step, and the iterate that a line search starts
    from.

    psi, gamma: (N + 1,), force, shear: (K,) of the iterate; size: (1,) the last node that takes
    part, beyond which the finger is straight; penalty: (1,) of penetration in the merit function;
    leaps: (1,) steps that have raised the residual; passes: (1,) passes along the finger so far.
    """

    state: Nodal
    chain: Chain
    psi: np.ndarray
    gamma: np.ndarray
    force: np.ndarray
    shear: np.ndarray
    size: np.ndarray
    penalty: np.ndarray
    leaps: np.ndarray
    passes: np.ndarray


def make_surface_work(problem):
    """A workspace for the fingers of `problem`, with a straight one."""
    nodes = problem.arc.shape[0]
    points = nodes + 1 + problem.points.shape[1]
    return SurfaceWork(
        make_nodal(problem),
        make_chain(problem),
        np.zeros(nodes),
        np.zeros(nodes),
        np.zeros(points),
        np.zeros(points),
        np.ones(1, np.int64),
        np.zeros(1),
        np.zeros(1, np.int64),
        np.zeros(1, np.int64),
    )


@inlined
def _moment(problem, d, state, i):
    """Bending moment of interval `i`, ``B psi'``."""
    return problem.bending[d, i - 1] * (state.psi[i] - state.psi[i - 1])


@inlined
def _shear_force(problem, d, state, i):
    """Shear force of interval `i` times its length, ``C h gamma``; 0 without shear."""
    flexibility = problem.shear_flexibility[d, i - 1]
    return state.gamma[i] / flexibility if flexibility > 0.0 else 0.0


@inner
def strain_energy(problem, d, state, size):
    """V in E I / L (Lan & Lee 2008, eq. (2), as discretised in `kernels.nodal`)."""
    energy = 0.0
    for i in range(1, size + 1):
        energy += 0.5 * _moment(problem, d, state, i) * (state.psi[i] - state.psi[i - 1])
        energy += 0.5 * _shear_force(problem, d, state, i) * state.gamma[i]
    return energy


@inlined
def energy_slope(problem, d, state, chain, size):
    """Derivative of V along the step in `chain`."""
    slope = 0.0
    for i in range(1, size + 1):
        slope += _moment(problem, d, state, i) * (chain.dpsi[i] - chain.dpsi[i - 1])
        slope += _shear_force(problem, d, state, i) * chain.dgamma[i]
    return slope


@inner
def evaluate(problem, d, x, y, angle, work):
    """Positions, gaps and carried forces of the state with the target at `x`, `y`, `angle`."""
    place_axis(problem, work.state, work.size[0])
    place_surface(problem, d, x, y, angle, work.state, _NEAR)
    carry_forces(problem, d, work.state, work.size[0])


@inner
def kkt_residual(problem, d, state, size):
    """Largest relative violation of the KKT conditions of an evaluated state, from scratch.

    Moment (beyond the rounding of the angles, which a tip much stiffer than the clamp magnifies)
    and shear angle of each interval against those of the contact forces beyond it, over the
    largest; penetration, slide of what sticks and ``lambda g`` over the mean deflection at the
    contacts, ``2 V / sum lambda`` (gaps beyond their own rounding, which a grazing contact's
    deflection may be near); a negative multiplier over the largest. NaN where any is.
    """
    moment, shear, total, largest = ROUNDING, ROUNDING, 0.0, 0.0
    for k in range(state.force.shape[0]):
        total += abs(state.force[k])
        largest = max(largest, abs(state.force[k]))
    slack, sheared_slack, first, energy = 0.0, 0.0, 0.0, 0.0
    for i in range(1, size + 1):
        bent = _moment(problem, d, state, i)
        moment = max(moment, abs(bent), abs(state.moment[i]))
        rounded = ROUNDING * problem.bending[d, i - 1] * (abs(state.psi[i]) + abs(state.psi[i - 1]))
        off = abs(bent - state.moment[i]) - rounded
        first = off if i == 1 else first
        slack = max(slack, off)
        across = state.cos[i] * state.fy[i] - state.sin[i] * state.fx[i] + state.couple[i]
        sheared = problem.shear_flexibility[d, i - 1] * problem.step[i - 1] * across
        shear = max(shear, abs(state.gamma[i]), abs(sheared))
        sheared_slack = max(sheared_slack, abs(state.gamma[i] - sheared))
        energy += bent * (state.psi[i] - state.psi[i - 1])
        energy += _shear_force(problem, d, state, i) * state.gamma[i]
    residual = max(slack / moment, sheared_slack / shear)
    # at the clamp of its own moment, which may be the smaller one
    half = 0.5 * problem.step[0]
    clamp = state.moment[1] + half * (state.cos[1] * state.fy[1] - state.sin[1] * state.fx[1])
    residual = max(residual, _AT_CLAMP * first / (abs(clamp) + _SMALLEST * moment))
    deflection = max(ROUNDING, energy / total) if total > 0.0 else ROUNDING
    for k in range(1, state.force.shape[0]):
        residual = max(residual, (-state.gap[k] - ROUNDING) / deflection)
        if state.force[k] != 0.0:
            share = abs(state.force[k]) / largest
            residual = max(residual, (abs(state.gap[k]) - ROUNDING) / deflection * share)
            residual = max(residual, -state.force[k] / largest)
            if state.stuck[k]:
                residual = max(residual, (abs(state.slide[k]) - ROUNDING) / deflection * share)
    return residual if np.isfinite(energy + total) else np.nan


@inner
def mean_deflection(problem, d, state, size):
    """``2 V / sum lambda``: how far the contacts have moved the finger, by and large."""
    total = 0.0
    for k in range(state.force.shape[0]):
        total += abs(state.force[k])
    return 2.0 * strain_energy(problem, d, state, size) / total if total > 0.0 else 0.0


@inlined
def _penetration(state):
    total = 0.0
    for k in range(1, state.gap.shape[0]):
        total += max(0.0, -state.gap[k])
    return total


@inlined
def _last_node(problem, state, size):
    """The last node that takes part in the next subproblem: no less than `size`; beyond it the
    finger is straight."""
    last = 1
    for k in range(1, state.gap.shape[0]):
        if state.gap[k] <= _NEAR or state.force[k] != 0.0:
            last = max(last, state.node[k])
    if problem.printed_section:  # the shear beyond the last contact matters, too
        last = min(last + 1, problem.step.shape[0])
    last = max(last, size)
    for i in range(size + 1, last + 1):
        state.fx[i], state.fy[i], state.moment[i] = 0.0, 0.0, 0.0
    return last


@inlined
def _advance(problem, d, x, y, angle, work, length):
    """The state at `length` of the step from the iterate, evaluated."""
    state, chain = work.state, work.chain
    for i in range(1, work.size[0] + 1):
        state.psi[i] = work.psi[i] + length * chain.dpsi[i]
        state.gamma[i] = work.gamma[i] + length * chain.dgamma[i]
    for k in range(state.force.shape[0]):
        state.force[k] = work.force[k] + length * (chain.force[k] - work.force[k])
        state.shear[k] = work.shear[k] + length * (chain.shear[k] - work.shear[k])
    evaluate(problem, d, x, y, angle, work)


@inner
def _propose(problem, d, work, size, curved):
    """The step and multipliers of the quadratic program about the iterate, left in ``work.chain``.

    curved: with the Lagrangian's Hessian, which may have more than one minimum, or none; else with
    that of the strain energy alone, where the forces keep their directions: always convex.
    Returns whether there is one; without friction, where there is an energy, it is a minimum.
    """
    state, chain = work.state, work.chain
    for k in range(state.gap.shape[0]):
        chain.touching[k] = k > 0 and state.force[k] > 0.0
        chain.force[k], chain.shear[k] = 0.0, 0.0
        if not curved:
            state.force[k] = 0.0
    if not curved:
        for i in range(1, size + 1):
            state.fx[i], state.fy[i] = 0.0, 0.0
    excess, passes = solve_subproblem(problem, d, state, chain, size)
    work.passes[0] += passes
    if not curved:
        for k in range(state.gap.shape[0]):
            state.force[k] = work.force[k]
        carry_forces(problem, d, state, size)
    return excess == 0 or (excess != UNSETTLED and problem.mu[d] > 0.0)


@inner
def _rescale(problem, d, x, y, angle, work, fallen):
    """Half or twice a full step that brings little, where that brings more.

    So it is where the solution lies between, or all steps go the same way: the side's shape about a
    target's point is held fixed in derivatives. fallen: the residual after the full step. Returns
    that after the one taken.
    """
    for length in (0.5, 2.0):
        _advance(problem, d, x, y, angle, work, length)
        other = kkt_residual(problem, d, work.state, work.size[0])
        if other < _BETTER * fallen:
            return other
    _advance(problem, d, x, y, angle, work, 1.0)
    return fallen


@inner
def _search(problem, d, x, y, angle, work, residual):
    """Walk along the step until the residual or the merit function falls.

    Returns the residual there; NaN where neither does.
    """
    state, size, penalty = work.state, work.size[0], work.penalty[0]
    merit, slope, length = np.nan, 0.0, 1.0
    while length >= _SHORTEST:
        _advance(problem, d, x, y, angle, work, length)
        fallen = kkt_residual(problem, d, state, size)
        if fallen <= (1.0 - _RESIDUAL_FALL * length) * residual:
            if length == 1.0 and fallen > _SLOW * residual:
                return _rescale(problem, d, x, y, angle, work, fallen)
            return fallen
        if problem.mu[d] == 0.0:
            trial = strain_energy(problem, d, state, size) + penalty * _penetration(state)
            if np.isnan(merit):  # seldom needed: worked out here
                _advance(problem, d, x, y, angle, work, 0.0)
                violation = penalty * _penetration(state)
                merit = strain_energy(problem, d, state, size) + violation
                slope = energy_slope(problem, d, state, work.chain, size) - violation
                _advance(problem, d, x, y, angle, work, length)
            if trial <= merit + _ARMIJO * length * min(slope, 0.0) + 1e-14 * merit:
                return fallen
        length *= 0.5
    return np.nan


@inner
def _improve(problem, d, x, y, angle, work, residual):
    """One step from the iterate in ``work.state``. Returns the residual after it; NaN where there
    is no step.

    With friction, a few full steps may raise the residual: where contacts come and go it need not
    fall on the way to the solution.
    """
    state, chain, size = work.state, work.chain, work.size[0]
    for i in range(1, size + 1):
        work.psi[i], work.gamma[i] = state.psi[i], state.gamma[i]
    for k in range(state.force.shape[0]):
        work.force[k], work.shear[k] = state.force[k], state.shear[k]
    for curved in (True, False):
        if not _propose(problem, d, work, size, curved):
            continue
        for k in range(state.force.shape[0]):
            work.penalty[0] = max(work.penalty[0], 2.0 * chain.force[k])
        fallen = _search(problem, d, x, y, angle, work, residual)
        if not np.isnan(fallen):
            return fallen
        _advance(problem, d, x, y, angle, work, 0.0)
    if problem.mu[d] > 0.0 and work.leaps[0] < _LEAPS:
        work.leaps[0] += 1
        if _propose(problem, d, work, size, True):
            _advance(problem, d, x, y, angle, work, 1.0)
            return kkt_residual(problem, d, state, size)
    return np.nan


@inner
def solve_surface(problem, d, x, y, angle, work, tolerance, most):
    """Solve finger `d` with the target at `x`, `y`, `angle`, from the state in `work`.

    tolerance: of the KKT residual; most: iterations. Returns ``(status, iterations, residual)``.
    """
    state = work.state
    last = 1
    for k in range(1, state.force.shape[0]):
        if state.force[k] != 0.0:
            last = max(last, state.node[k])
    work.size[0], work.penalty[0], work.leaps[0] = last, 0.0, 0
    evaluate(problem, d, x, y, angle, work)
    residual = kkt_residual(problem, d, state, last)
    for iteration in range(most + 1):
        if residual <= tolerance:
            return status.CONVERGED, iteration, residual
        if not np.isfinite(residual):
            return status.NUMERICAL_ERROR, iteration, residual
        work.size[0] = _last_node(problem, state, work.size[0])
        fallen = _improve(problem, d, x, y, angle, work, residual)
        if np.isnan(fallen):
            return status.MAX_ITERATIONS, iteration, residual
        residual = fallen
    return status.MAX_ITERATIONS, most, residual
