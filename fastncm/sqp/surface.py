"""The active-set SQP for a finger in direct contact: many contacts that enter and leave at once.

Each iteration solves a quadratic program with the Lagrangian's exact Hessian for the step and the
new multipliers. Its working set is changed as a whole (primal-dual active set, in the safeguarded
form of Judice & Pires, "A block principal pivoting algorithm", 1994): contacts that pull leave,
points that would penetrate enter, all at once as long as their number falls, else one by one. Every
trial of a working set is one pass of O(N) (`sqp.flexibility`).
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import driver, inner, kernel
from fastncm.kernels.nodal import (
    Nodal,
    carry_forces,
    make_nodal,
    node_of,
    place_axis,
    place_surface,
)
from fastncm.sqp import status
from fastncm.sqp.flexibility import Chain, carry_back, carry_flexibility, make_chain

#: Passes that may change the working set as a whole without fewer points being wrong.
_PATIENCE = 30
#: Most passes of one quadratic program.
_PASSES = 200
import os
VARIANT = int(os.environ.get("VARIANT", "0"))
TRACE = bool(os.environ.get("TRACE"))


class SurfaceWork(NamedTuple):
    """One finger's state, the workspace of its Newton step, and where a line search began.

    psi, gamma: (N + 1,), force: (K,) of the iterate; size: (1,) the last node that takes part;
    passes: (1,) sweeps along the finger so far.
    """

    state: Nodal
    chain: Chain
    psi: np.ndarray
    gamma: np.ndarray
    force: np.ndarray
    size: np.ndarray
    memory: np.ndarray
    passes: np.ndarray


@driver
def make_surface_work(intervals):
    """A workspace for N intervals, with a straight finger."""
    return SurfaceWork(
        make_nodal(intervals),
        make_chain(intervals),
        np.zeros(intervals + 1),
        np.zeros(intervals + 1),
        np.zeros(intervals + 2),
        np.ones(1, np.int64),
        np.zeros((2, 2)),
        np.zeros(1, np.int64),
    )


@inner
def strain_energy(problem, d, state, size):
    """V in E I / L (Lan & Lee 2008, eq. (2), as discretised in `kernels.nodal`)."""
    energy = 0.0
    for i in range(1, size + 1):
        turned = state.psi[i] - state.psi[i - 1]
        energy += 0.5 * problem.bending[d, i - 1] / problem.step[i - 1] * turned * turned
        if problem.shear_compliance[d, i - 1] > 0.0:
            stiffness = problem.step[i - 1] / problem.shear_compliance[d, i - 1]
            energy += 0.5 * stiffness * state.gamma[i] * state.gamma[i]
    return energy


@inner
def evaluate(problem, d, place, state, size, margin):
    """Positions, gaps and carried forces of the state with the target at `place`: (x, y, angle)."""
    place_axis(problem, state, size)
    place_surface(problem, d, place[0], place[1], place[2], state, margin)
    carry_forces(problem, d, state, size)


@inner
def kkt_residual(problem, d, state, size, rounding):
    """Largest relative violation of the KKT conditions of an evaluated state, from scratch.

    The moment and shear of each interval against those of the contact forces beyond it, over the
    largest; penetration and ``lambda g`` over the mean deflection at the contacts, ``2 V / sum
    lambda``; a negative multiplier over the largest.
    """
    moment, shear, total, largest = rounding, rounding, 0.0, 0.0
    for k in range(state.force.shape[0]):
        total += abs(state.force[k])
        largest = max(largest, abs(state.force[k]))
    residual, slack, slide = 0.0, 0.0, 0.0
    for i in range(1, size + 1):
        bent = problem.bending[d, i - 1] / problem.step[i - 1] * (state.psi[i] - state.psi[i - 1])
        moment = max(moment, abs(bent), abs(state.moment[i]))
        slack = max(slack, abs(bent - state.moment[i]))
        across = state.cos[i] * state.fy[i] - state.sin[i] * state.fx[i]
        sheared = problem.shear_compliance[d, i - 1] * across
        shear = max(shear, abs(state.gamma[i]), abs(sheared))
        slide = max(slide, abs(state.gamma[i] - sheared))
    residual = max(slack / moment, slide / shear)
    deflection = rounding
    if total > 0.0:
        deflection = max(rounding, 2.0 * strain_energy(problem, d, state, size) / total)
    for k in range(state.force.shape[0]):
        residual = max(residual, -state.gap[k] / deflection)
        if state.force[k] != 0.0:
            share = abs(state.force[k]) / largest
            residual = max(residual, abs(state.gap[k]) / deflection * share)
            residual = max(residual, -state.force[k] / largest)
    return residual


@inner
def _overhang(force, end, inward, length):
    """By how many nodes a run of `length` contacts is too long (> 0) or too short (< 0) at `end`.

    Where the finger is held down beyond the true end of its contact, it pulls there like a string:
    with the force per node next to the end, times the number of nodes too many. inward: +1 or -1.
    """
    if length < 4:
        return 1 if force[end] < 0.0 else 0
    share = 0.5 * (force[end + inward] + force[end + 2 * inward])
    if share <= 0.0:
        return 1 if force[end] < 0.0 else 0
    return int(np.ceil(-force[end] / share))


@inner
def change_working_set(chain, candidates, largest):
    """One change of the working set: contacts that pull leave, points that penetrate enter.

    Returns how many contacts pull and points penetrate; the set is left alone where none does.
    """
    touching, mark, force, gap = chain.touching, chain.mark, chain.force, chain.gap
    wrong = 0
    for k in range(1, candidates):
        mark[k] = touching[k]
    k = 1
    while k < candidates:
        first = k
        if touching[k]:  # a run of contacts
            while k < candidates and touching[k]:
                if force[k] < -1e-15 * largest:
                    wrong += 1
                    mark[k] = False
                k += 1
            length = k - first
            low, high = _overhang(force, first, 1, length), _overhang(force, k - 1, -1, length)
            for i in range(first, min(first + low, k)):
                if force[first] < 0.0:
                    mark[i] = False
            for i in range(max(k - high, first), k):
                if force[k - 1] < 0.0:
                    mark[i] = False
        elif gap[k] < -1e-15:  # a zone of penetration
            worst = k
            while k < candidates and not touching[k] and gap[k] < -1e-15:
                wrong += 1
                if gap[k] < gap[worst]:
                    worst = k
                k += 1
            below, above = 0, 0
            for i in range(1, 5):
                below += first - i >= 1 and touching[first - i] and below == i - 1
                above += k + i - 1 < candidates and touching[k + i - 1] and above == i - 1
            grown = False
            if below == 4:
                for i in range(first, min(first - _overhang(force, first - 1, -1, 4) - 1, k)):
                    mark[i] = True
                    grown = True
            if above == 4:
                for i in range(max(k + _overhang(force, k, 1, 4) + 1, first), k):
                    mark[i] = True
                    grown = True
            if not grown:
                mark[worst] = True
        else:
            k += 1
    if wrong > 0:
        for k in range(1, candidates):
            touching[k] = mark[k]
    return wrong


@inner
def solve_subproblem(problem, d, work, candidates):
    """Step and multipliers of the quadratic program about the evaluated state, in ``work.chain``.

    candidates: surface points below it take part. Returns the excess of negative pivots, -99 where
    no working set was found.
    """
    state, chain, size = work.state, work.chain, work.size[0]
    for passes in range(_PASSES):
        work.passes[0] += 1
        excess = carry_flexibility(problem, d, state, chain, size, 1.0)
        carry_back(problem, d, state, chain, size, 1.0)
        largest = 0.0
        for k in range(candidates):
            largest = max(largest, abs(chain.force[k]))
        if passes < _PATIENCE:
            wrong = change_working_set(chain, candidates, largest)
            if wrong == 0:
                return excess
        else:
            last = -1
            for k in range(1, candidates):
                if chain.touching[k]:
                    if chain.force[k] < -1e-15 * largest:
                        last = k
                elif chain.gap[k] < -1e-15:
                    last = k
            if last < 0:
                return excess
            chain.touching[last] = not chain.touching[last]
        if TRACE:
            a, b, n = -1, -1, 0
            for i in range(1, candidates):
                if chain.touching[i]:
                    n += 1
                    if a < 0:
                        a = i
                    b = i
            print("   pass",passes, "now", a, b, n, "excess", excess, "force", largest)
    return -99


@inner
def _penetration(state):
    total = 0.0
    for k in range(1, state.gap.shape[0]):
        total += max(0.0, -state.gap[k])
    return total


@inner
def solve_surface(problem, d, place, work, tolerance, rounding, margin, most):
    """Solve finger `d` with the target at `place` from the state in ``work``.

    Returns ``(status, iterations, residual)``.
    """
    state, chain = work.state, work.chain
    intervals = problem.step.shape[0]
    evaluate(problem, d, place, state, work.size[0], margin)
    penalty = 0.0
    for iteration in range(most):
        candidates = 0
        for k in range(state.gap.shape[0]):
            if state.gap[k] <= margin or state.force[k] != 0.0:
                candidates = k + 1
        size = max(1, node_of(candidates - 1, intervals))
        if size < work.size[0]:
            work.size[0] = size
            evaluate(problem, d, place, state, size, margin)
        elif size > work.size[0]:
            for i in range(work.size[0] + 1, size + 1):
                state.fx[i], state.fy[i], state.moment[i] = 0.0, 0.0, 0.0
            work.size[0] = size
        residual = kkt_residual(problem, d, state, size, rounding)
        if residual <= tolerance:
            return status.CONVERGED, iteration, residual
        for k in range(state.gap.shape[0]):
            chain.touching[k] = 0 < k < candidates and state.force[k] > 0.0
        excess = solve_subproblem(problem, d, work, candidates)
        if excess == -99:
            return status.MAX_ITERATIONS, iteration, residual
        energy, violation = strain_energy(problem, d, state, size), _penetration(state)
        slope = 0.0
        for i in range(1, size + 1):
            bent = problem.bending[d, i - 1] / problem.step[i - 1]
            slope += bent * (state.psi[i] - state.psi[i - 1]) * (chain.dpsi[i] - chain.dpsi[i - 1])
            if problem.shear_compliance[d, i - 1] > 0.0:
                stiffness = problem.step[i - 1] / problem.shear_compliance[d, i - 1]
                slope += stiffness * state.gamma[i] * chain.dgamma[i]
        for i in range(1, size + 1):
            work.psi[i], work.gamma[i] = state.psi[i], state.gamma[i]
        for k in range(state.force.shape[0]):
            work.force[k] = state.force[k]
            penalty = max(penalty, 2.0 * chain.force[k])
        merit = energy + penalty * violation
        slope -= penalty * violation
        length = 1.0
        while True:
            for i in range(1, size + 1):
                state.psi[i] = work.psi[i] + length * chain.dpsi[i]
                state.gamma[i] = work.gamma[i] + length * chain.dgamma[i]
            for k in range(state.force.shape[0]):
                goal = chain.force[k] if k < candidates else 0.0
                state.force[k] = work.force[k] + length * (goal - work.force[k])
            evaluate(problem, d, place, state, size, margin)
            trial = strain_energy(problem, d, state, size) + penalty * _penetration(state)
            if trial <= merit + 1e-4 * length * min(slope, 0.0) + 1e-14 * merit:
                break
            if kkt_residual(problem, d, state, size, rounding) <= (1.0 - 0.1 * length) * residual:
                break
            length *= 0.5
            if length < 1e-6:
                return status.MAX_ITERATIONS, iteration, residual
    return status.MAX_ITERATIONS, most, residual


@kernel
def solve_one(problem, d, place, work, tolerance, rounding, margin, most):
    return solve_surface(problem, d, place, work, tolerance, rounding, margin, most)
