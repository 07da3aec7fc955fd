"""A finger in direct contact as its SQP sees it: its energy, and how far it is from a solution."""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.nodal import Nodal, carry_forces, make_nodal, place_axis, place_surface
from fastncm.sqp.flexibility import Chain, make_chain

#: Error of a gap in finger lengths that is due to rounding.
ROUNDING = 1e-15
#: Points closer to the target than this (finger lengths) take part in the subproblem.
NEAR = 0.004
#: Weight of the relative violation at the clamp, and the smallest part of the largest moment that
#: counts as its moment.
_AT_CLAMP, _SMALLEST = 0.1, 1e-4


class SurfaceWork(NamedTuple):
    """One finger's state, the workspace of its step, and the iterate that a line search starts
    from.

    psi, gamma: (N + 1,), force, shear: (K,) of the iterate; size: (1,) the last node that takes
    part, beyond which the finger is straight; penalty: (1,) of penetration in the merit function;
    leaps: (1,) steps that have raised the residual; passes: (1,) passes along the finger so far.
    rubs: (1,) bool, whether contacts have friction: then there is no energy to fall.
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
    rubs: np.ndarray


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
        np.zeros(1, np.bool_),
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
    place_surface(problem, d, x, y, angle, work.state, NEAR)
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
def penetration(state):
    """Sum of all penetrations."""
    total = 0.0
    for k in range(1, state.gap.shape[0]):
        total += max(0.0, -state.gap[k])
    return total
