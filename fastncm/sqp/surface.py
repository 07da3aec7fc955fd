"""The SQP for a finger in direct contact (Lan & Lee 2008, eqs. (11)-(13)), O(N) an iteration.

Each iteration solves a quadratic program (`sqp.subproblem`) for the step and the new multipliers,
with the Lagrangian's exact Hessian, and where that has no minimum with that of the strain energy.
It walks along the step until an l1 merit function or the KKT residual falls. With friction there is
no energy to fall: then the residual alone decides.
"""

import numpy as np

from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.nodal import carry_forces, sections_change
from fastncm.sqp import status
from fastncm.sqp.flexibility import is_wide
from fastncm.sqp.subproblem import UNSETTLED, solve_subproblem
from fastncm.sqp.surface_state import (
    NEAR,
    energy_slope,
    evaluate,
    kkt_residual,
    penetration,
    strain_energy,
)

#: Share of the predicted fall of the merit function, and of the residual, that a step must bring.
_ARMIJO, _RESIDUAL_FALL = 1e-4, 0.1
#: A full step to more than this part of the residual is halved or doubled where that brings this
#: part of it.
_SLOW, _BETTER = 0.5, 0.5
#: Full steps of a solve with friction that may raise the residual.
_LEAPS = 4
#: Step length at which the line search gives up.
_SHORTEST = 1e-4


@inlined
def _last_node(problem, state, chain, size):
    """The last node that takes part in the next subproblem: no less than `size`; beyond it the
    finger is straight."""
    last = 1
    for k in range(1, state.gap.shape[0]):
        if state.gap[k] <= NEAR or state.force[k] != 0.0:
            last = max(last, state.node[k])
    if is_wide(chain):  # the shear beyond the last contact matters, too
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
    return excess == 0 or (excess != UNSETTLED and work.rubs[0])


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
        if not work.rubs[0]:
            trial = strain_energy(problem, d, state, size) + penalty * penetration(state)
            if np.isnan(merit):  # seldom needed: worked out here
                _advance(problem, d, x, y, angle, work, 0.0)
                violation = penalty * penetration(state)
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
    if work.rubs[0] and work.leaps[0] < _LEAPS:
        work.leaps[0] += 1
        if _propose(problem, d, work, size, True):
            _advance(problem, d, x, y, angle, work, 1.0)
            return kkt_residual(problem, d, state, size)
    return np.nan


@inner
def solve_surface(problem, d, x, y, angle, work, tolerance, most):
    """Solve finger `d` with the target at `x`, `y`, `angle`, from the state in `work`.

    tolerance: of the KKT residual; most: iterations. Returns ``(status, iterations, residual)``.

    During an iteration each point of the target stays with its section, if that leads anywhere:
    from one section to the next its gap jumps by what the shear on both sides of a force differs,
    too much for a line search.
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
        work.size[0] = _last_node(problem, state, work.chain, work.size[0])
        state.held[0] = problem.points.shape[1] > 0
        fallen = _improve(problem, d, x, y, angle, work, residual)
        if state.held[0]:
            state.held[0] = False
            if np.isnan(fallen):
                fallen = _improve(problem, d, x, y, angle, work, residual)
        if np.isnan(fallen):
            return status.MAX_ITERATIONS, iteration, residual
        residual = fallen
        if sections_change(problem, state):
            evaluate(problem, d, x, y, angle, work)
            residual = kkt_residual(problem, d, state, work.size[0])
    return status.MAX_ITERATIONS, most, residual
