"""The shapes of fingers in direct contact along their paths, one finger after the other."""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import inner, kernel
from fastncm.kernels.nodal import NodalProblem, contact_direction, place_axis
from fastncm.kernels.shared import share
from fastncm.path import surface_rows as rows
from fastncm.path.surface_afresh import come_from_aside, snap
from fastncm.path.surface_failure import why_unsolved
from fastncm.path.surface_free import (
    base_overlap,
    is_free,
    longest_free_move,
    stays_free,
    unseen_overlap,
)
from fastncm.path.surface_move import approach
from fastncm.path.surface_way import (
    AFRESH,
    EARLIER,
    FOLLOWED,
    PUSH_ENERGY,
    PUSH_NORMAL,
    arrive,
    path_position,
    set_goal,
    straighten,
)
from fastncm.sqp import status
from fastncm.sqp.surface_state import ROUNDING

#: What is known of the finger at the position before: nothing, that it is free, its contact.
_LOST, _FREE, _TOUCHING = range(3)


class SurfaceTrace(NamedTuple):
    """Solved paths, dimensionless.

    rows: (D, P, surface_rows.COLUMNS). psi, gamma: (D, P, N + 1) and contact: (D, P, K, 5), s,
    place and force on the finger of the contact points, in the base's frame; with no entries where
    they are not kept. solves: (1,) shapes solved; passes: (1,) along a finger.
    """

    rows: np.ndarray
    psi: np.ndarray
    gamma: np.ndarray
    contact: np.ndarray
    solves: np.ndarray
    passes: np.ndarray


def make_surface_trace(problem: NodalProblem, shapes: bool) -> SurfaceTrace:
    """Room for the results; `shapes`: whether these are kept."""
    designs, positions = problem.positions.shape
    nodes, kept = len(problem.arc), positions if shapes else 0
    return SurfaceTrace(
        np.zeros((designs, positions, rows.COLUMNS)),
        np.zeros((designs, kept, nodes)),
        np.zeros((designs, kept, nodes)),
        np.zeros((designs, kept, nodes + 1 + problem.points.shape[1], 5)),
        np.zeros(1, np.int64),
        np.zeros(1, np.int64),
    )


@inner
def _free_row(problem, d, i, result, overlap, row):
    """The row of a straight finger: no contact, or no way to have any."""
    for column in range(rows.COLUMNS):
        row[column] = 0.0
    reach = problem.arm[d]
    for j in range(problem.step.shape[0]):
        reach += problem.step[j]
    row[rows.POSITION], row[rows.STATUS] = problem.positions[d, i], result
    row[rows.TIP_X] = reach * np.cos(problem.base[d, i])
    row[rows.TIP_Y] = reach * np.sin(problem.base[d, i])
    row[rows.TIP_ANGLE] = problem.base[d, i]
    row[rows.OVERLAP] = overlap


@inner
def _store_shape(problem, d, i, state, trace):
    for j in range(state.psi.shape[0]):
        trace.psi[d, i, j], trace.gamma[d, i, j] = state.psi[j], state.gamma[j]
    for k in range(state.force.shape[0]):
        if state.force[k] == 0.0:
            continue
        own = k <= problem.arc.shape[0]
        qx, qy = contact_direction(state, k, problem.mu[d])
        trace.contact[d, i, k, 0] = problem.arc[state.node[k]] if own else state.seen_x[k]
        trace.contact[d, i, k, 1], trace.contact[d, i, k, 2] = state.px[k], state.py[k]
        trace.contact[d, i, k, 3] = state.force[k] * qx
        trace.contact[d, i, k, 4] = state.force[k] * qy


@inner
def _solve_position(problem, d, i, known, walk, tolerance, trace):
    """Solve position `i` with what is known of the one before. Returns ``(status, iterations)``.

    A position that cannot be reached from there, as where the finger snaps, is approached afresh,
    unless the straight finger is free there.
    """
    goal, base = problem.placement[d, i], problem.base[d, i]
    result, iterations = status.MAX_ITERATIONS, 0
    if known == _FREE:
        set_goal(problem, d, walk, goal, base)
        if stays_free(problem, d, walk):
            arrive(walk, goal, base)
            return status.NO_CONTACT, 0
    stored = 0.0
    if known != _LOST:
        set_goal(problem, d, walk, goal, base)
        result, iterations = approach(problem, d, i, walk, problem.mu[d], True, tolerance, trace)
        if result == status.BRANCH_ENDS:
            walk.ended[0], stored = path_position(problem, d, i, walk), walk.push[PUSH_ENERGY]
        if result != status.CONVERGED:
            if walk.only_follows[0]:
                return result, iterations
            result, count = snap(problem, d, i, goal, base, walk, tolerance, trace)
            iterations += count
    touching = result == status.CONVERGED and walk.push[PUSH_NORMAL] > 0.0
    if not touching and not is_free(problem, d, goal[0], goal[1], goal[2], walk):
        result, count = come_from_aside(problem, d, i, goal, base, walk, tolerance, trace)
        if result == status.CONVERGED and walk.push[PUSH_NORMAL] == 0.0:
            result = status.MAX_ITERATIONS  # the target is in the finger, and no point sees it
        iterations += count
        arrive(walk, goal, base)
        return result, iterations
    if not touching:
        if walk.snap[1] == 0.0 and stored > 0.0:  # what it snaps to, if not to this, is not known
            walk.snap[0], walk.snap[1] = walk.ended[0], stored
        straighten(walk)
        walk.clear[0] = 0.0
        result = status.NO_CONTACT
    arrive(walk, goal, base)
    return result, iterations


@inner
def _trace(problem, walk, tolerance, trace):
    """`trace_surfaces` with shared records."""
    work = walk.work
    intervals = problem.step.shape[0]
    for d in range(problem.positions.shape[0]):
        for k in range(walk.straight.seen.shape[0]):
            walk.straight.seen[k], work.state.seen[k] = -np.inf, -np.inf
        place_axis(problem, walk.straight, intervals)
        straighten(walk)
        walk.lost[0], walk.free_move[0] = FOLLOWED, longest_free_move(problem, d)
        known, solved, walk.ended[0] = _LOST, -1, np.nan
        for i in range(problem.positions.shape[1]):
            goal = problem.placement[d, i]
            row = trace.rows[d, i]
            overlap = base_overlap(problem, d, goal[0], goal[1], goal[2], walk.straight)
            if overlap > ROUNDING:
                _free_row(problem, d, i, status.INFEASIBLE, overlap, row)
                straighten(walk)
                known = _LOST
                continue
            walk.snap[1] = 0.0
            result, iterations = _solve_position(problem, d, i, known, walk, tolerance, trace)
            if result == status.CONVERGED:
                known, solved = _TOUCHING, i
                row[rows.POSITION], row[rows.STATUS] = problem.positions[d, i], result
                rows.measure(problem, d, i, goal[0], goal[1], work, row)
                row[rows.LOST], row[rows.END], row[rows.CRITICAL] = (
                    walk.lost[0],
                    walk.ended[0],
                    np.nan,
                )
                walk.ended[0] = np.nan
                if walk.lost[0] == AFRESH or walk.lost[0] == EARLIER:  # how it slid is not known
                    row[rows.ESTIMATE] += 2.0 * problem.mu[d]
                walk.lost[0] = EARLIER if AFRESH <= walk.lost[0] <= EARLIER else FOLLOWED
                if trace.psi.shape[1] > 0:
                    _store_shape(problem, d, i, work.state, trace)
            elif result == status.NO_CONTACT:
                known, solved, walk.ended[0], walk.lost[0] = _FREE, i, np.nan, FOLLOWED
                _free_row(problem, d, i, result, unseen_overlap(problem, d, goal, walk), row)
            else:
                known = _LOST
                result = why_unsolved(problem, d, i, solved, result, walk, trace.rows)
                infeasible = result == status.INFEASIBLE
                overlap = -walk.straight.gap[walk.deepest[0]] if infeasible else 0.0
                _free_row(problem, d, i, result, overlap, row)
                row[rows.END], row[rows.CRITICAL] = walk.ended[0], np.nan
            row[rows.ITERATIONS] = iterations
            row[rows.SNAP], row[rows.RELEASED] = walk.snap[0], walk.snap[1]
            if walk.only_follows[0] and (known == _LOST or walk.snap[1] > 0.0):
                for j in range(i, problem.positions.shape[1]):
                    trace.rows[d, j, rows.STATUS] = status.BRANCH_ENDS
                break
    trace.passes[0] += work.passes[0]


@kernel
def trace_surfaces(problem, walk, tolerance, trace):
    """Solve all positions of all fingers.

    walk: of `make_walk`; tolerance: of the KKT residual; trace: zeros on entry. What does not
    converge is a row with a status.
    """
    _trace(share(problem), share(walk), tolerance, share(trace))
