"""The shapes of fingers in direct contact along their paths, one finger after the other."""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import inner, kernel
from fastncm.kernels.nodal import (
    NodalProblem,
    contact_direction,
    place_axis,
)
from fastncm.kernels.shared import share
from fastncm.path import surface_rows as rows
from fastncm.path.surface_failure import why_unsolved
from fastncm.path.surface_predict import forget, predict, remember
from fastncm.path.surface_slip import choose_senses, finish_friction, grip, hold_new, regrip
from fastncm.path.surface_way import (
    AFRESH,
    EARLIER,
    FOLLOWED,
    arrive,
    base_overlap,
    copy_state,
    has_jumped,
    is_free,
    longest_free_move,
    missing_energy,
    note_snap,
    on_the_way,
    set_goal,
    stays_free,
    step_on,
    straighten,
    unseen_overlap,
)
from fastncm.sqp import status
from fastncm.sqp.surface import solve_surface
from fastncm.sqp.surface_state import NEAR, ROUNDING, evaluate, mean_deflection

#: Longest move of the target (finger lengths, radians) from one solve to the next, and the longest
#: that is not divided any more: so well is the end of a branch located.
_LONGEST_MOVE, _PLACE = 0.1, 5e-7
#: Energy, over what is stored, that may be missing or too much after a move within a branch.
_UNEXPLAINED = 0.05
#: Iterations of the SQP before a move is divided, and on the whole way to a position: of 3,682
#: random rows that are solved, one takes as many.
_ITERATIONS, _MOST = 25, 1000
#: Rounds in which contacts change between stick and slip.
_ROUNDS = 20
#: Longest move at whose beginning contacts are tried that stick from the first.
_STICKS = 1e-4
#: Slide (of the position) that settles which contacts slide and which stick.
_SLIDE = 1e-3
#: Smallest part of the friction by which it grows, where a finger was solved without.
_LEAST_FRICTION = 0.01
#: What is known of the finger at the position before: nothing, that it is free, its contact.
_LOST, _FREE, _TOUCHING = range(3)
#: Farthest (finger lengths) that a target is moved aside to come from a place without contact.
_FARTHEST = 64.0


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
def _solve_move(problem, d, walk, share, mu, tolerance):
    """Solve with the target at `share` of the move, from the last solved state.

    Returns ``(status, iterations)``.
    """
    work, state = walk.work, walk.work.state
    x, y, angle = on_the_way(problem, d, walk, share)
    motion = (x - walk.place[0], y - walk.place[1], angle - walk.place[2])
    work.rubs[0] = mu > 0.0
    if mu > 0.0:
        choose_senses(state, motion, x, y, False)
    result, total, _ = solve_surface(problem, d, x, y, angle, work, tolerance, _ITERATIONS)
    moved = motion[0] * motion[0] + motion[1] * motion[1] + motion[2] * motion[2]
    if mu > 0.0 and result != status.CONVERGED and moved < _STICKS * _STICKS:
        copy_state(walk.kept, state)
        evaluate(problem, d, walk.place[0], walk.place[1], walk.place[2], work)
        hold_new(state, motion, walk.place[0], walk.place[1], NEAR)
        result, count, _ = solve_surface(problem, d, x, y, angle, work, tolerance, _ITERATIONS)
        total += count
    if mu == 0.0 or result != status.CONVERGED:
        return result, total
    last = walk.last
    turned = motion[0] * last[0] + motion[1] * last[1] + motion[2] * last[2] < 0.0
    for turn in range(_ROUNDS):
        deflection = mean_deflection(problem, d, state, work.size[0])
        if regrip(state, walk.kept, motion, x, y, mu, turn, deflection, turned) == 0:
            finish_friction(state, mu)
            return result, total
        result, count, _ = solve_surface(problem, d, x, y, angle, work, tolerance, _ITERATIONS)
        total += count
        if result != status.CONVERGED:
            return result, total
    return status.MAX_ITERATIONS, total


@inner
def _approach(problem, d, i, walk, mu, strict, tolerance, trace):
    """Move the target from ``walk.place`` by ``walk.move``, in as many steps as it takes.

    A step that seems to lead to another branch is divided, as one that is not solved. Where it
    leads there in the shortest one, too, the finger snaps; but never to where more energy is stored
    than the target brings, unless the way is not `strict`, as it is none of the path's. Returns
    ``(status, iterations)``; on success ``walk.place`` is the goal, else it is where the branch
    ends, or where `_MOST` iterations had led to.
    """
    work, move = walk.work, walk.move
    length = max(max(abs(move[0]), abs(move[1])), max(abs(move[2]), abs(walk.turn[0])))
    longest = min(1.0, _LONGEST_MOVE / length) if length > 0.0 else 1.0
    free = walk.free_move[0] / length if length > 0.0 else 1.0
    share, total, left = longest, 0, 1.0
    careful, jumped = True, False
    while True:
        share = min(share, left)
        if walk.push[3] == 0.0:
            share = min(share, free)
        last_try = share * length <= _PLACE
        predict(walk.strides, walk.kept, move, share, work.state)
        result, count = _solve_move(problem, d, walk, share, mu, tolerance)
        total += count
        trace.solves[0] += 1
        solved, missing = result == status.CONVERGED, 0.0
        if solved:
            missing = missing_energy(problem, d, walk, share, mu)
            most = _UNEXPLAINED * max(walk.push[4], walk.trial[4])
            odd = walk.push[3] > 0.0 and abs(missing) > most
            passed = walk.trial[3] == 0.0 and share > free
            if careful and last_try:
                solved = not odd or missing > 0.0
            elif careful:
                solved = not (odd or passed or has_jumped(problem, walk))
            jumped = jumped or not solved
            if solved and odd:
                note_snap(problem, d, i, walk, walk.push[4] - walk.trial[4])
                walk.lost[0] = AFRESH
        if solved:
            remember(walk.strides, walk.kept, move, share)
            copy_state(work.state, walk.kept)
            for c in range(walk.push.shape[0]):
                walk.push[c] = walk.trial[c]
            left -= share
            for c in range(3):
                walk.last[c] = share * move[c]
            step_on(problem, d, walk, share)
            if left <= 1e-12:
                return result, total
            share = min(2.0 * share, longest)
            if total <= _MOST:
                continue
        copy_state(walk.kept, work.state)
        forget(walk.strides)
        if total > _MOST:
            return status.MAX_ITERATIONS, total
        share *= 0.25
        if last_try:
            if strict or not jumped:
                return status.BRANCH_ENDS, total
            share, careful, jumped = longest, False, False


@inner
def _rub(problem, d, walk, tolerance):
    """Solve with all contacts sliding, with friction that grows from none to all of it in as many
    steps as it takes. Returns ``(status, iterations)``."""
    work, state = walk.work, walk.work.state
    motion = (walk.move[0], walk.move[1], walk.move[2])
    x, y, angle = walk.place[0], walk.place[1], walk.place[2]
    work.rubs[0] = True
    share, step, total = 0.0, 1.0, 0
    while True:
        choose_senses(state, motion, x, y, True)
        for k in range(state.along.shape[0]):
            state.along[k] *= share + step
        result, count, _ = solve_surface(problem, d, x, y, angle, work, tolerance, _ITERATIONS)
        total += count
        if result == status.CONVERGED:
            copy_state(state, walk.kept)
            share += step
            if share == 1.0:
                return result, total
            step = min(2.0 * step, 1.0 - share)
            continue
        copy_state(walk.kept, state)
        step *= 0.25
        if step < _LEAST_FRICTION:
            return result, total


@inner
def _slide_in(problem, d, goal, i, walk, tolerance, trace):
    """Put friction on a finger that was solved without at the `goal` of position `i`, as if the
    target had slid for long; where friction lets nothing slide, as if it had stuck there. Returns
    ``(status, iterations)``."""
    work, state = walk.work, walk.work.state
    for c in range(3):
        walk.move[c] = _SLIDE * problem.motion[d, i, c]
        walk.place[c] = goal[c] - walk.move[c]
    walk.turn[0] = 0.0
    result, total = _rub(problem, d, walk, tolerance)
    if result != status.CONVERGED:
        for k in range(state.force.shape[0]):
            state.along[k], state.stuck[k] = 0.0, False
        work.rubs[0] = False
        x, y, angle = walk.place[0], walk.place[1], walk.place[2]
        result, count, _ = solve_surface(problem, d, x, y, angle, work, tolerance, _ITERATIONS)
        total += count
        if result != status.CONVERGED:
            return result, total
        grip(state)
        copy_state(state, walk.kept)
    forget(walk.strides)
    result, count = _approach(problem, d, i, walk, problem.mu[d], False, tolerance, trace)
    return result, total + count


@inner
def _set_aside(problem, d, goal, side, walk):
    """Put the target beside the finger, on the side that touches, from where it moves to `goal`.

    Returns False where it is in the way there, too.
    """
    reach, clear = 0.0, 0.0
    while reach < _FARTHEST:
        reach = 2.0 * reach + 0.05
        if is_free(problem, d, goal[0], goal[1] + side * reach, goal[2], walk):
            clear = reach
            break
    if clear == 0.0:
        return False
    touching = 0.0
    for _ in range(40):
        reach = 0.5 * (clear + touching)
        if is_free(problem, d, goal[0], goal[1] + side * reach, goal[2], walk):
            clear = reach
        else:
            touching = reach
    walk.place[0], walk.place[1], walk.place[2] = goal[0], goal[1] + side * clear, goal[2]
    walk.move[0], walk.move[1], walk.move[2] = 0.0, -side * clear, 0.0
    walk.turn[0] = 0.0
    return True


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
def _come_from_aside(problem, d, i, goal, base, walk, tolerance, trace):
    """Solve with the target at `goal`, at position `i` or on the way there, coming from beside the
    finger: how it came here along the path is not known. Returns ``(status, iterations)``."""
    straighten(walk)
    walk.base[0] = base
    side = 1.0 if problem.left else -1.0
    if not _set_aside(problem, d, goal, side, walk):
        return status.INFEASIBLE, 0
    at, released = walk.snap[0], walk.snap[1]
    result, iterations = _approach(problem, d, i, walk, 0.0, False, tolerance, trace)
    if result == status.CONVERGED and problem.mu[d] > 0.0:
        result, count = _slide_in(problem, d, goal, i, walk, tolerance, trace)
        iterations += count
    walk.snap[0], walk.snap[1] = at, released  # what snaps on this way does not on the path
    walk.lost[0] = AFRESH if i > 0 else FOLLOWED
    return result, iterations


@inner
def _snap(problem, d, i, goal, base, walk, tolerance, trace):
    """Go on to position `i` from where the branch has ended, from the shape that the finger snaps
    to there: the straight one, or that of a target coming from beside. Returns ``(status,
    iterations)``."""
    place, turned = (walk.place[0], walk.place[1], walk.place[2]), walk.base[0]
    stored, total = walk.push[4], 0
    if is_free(problem, d, place[0], place[1], place[2], walk):
        straighten(walk)
        walk.lost[0] = FOLLOWED
    else:
        result, total = _come_from_aside(problem, d, i, place, turned, walk, tolerance, trace)
        if result != status.CONVERGED:
            return result, total
    arrive(walk, place, turned)
    note_snap(problem, d, i, walk, stored - walk.push[4])
    set_goal(problem, d, walk, goal, base)
    result, count = _approach(problem, d, i, walk, problem.mu[d], True, tolerance, trace)
    return result, total + count


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
    if known != _LOST:
        set_goal(problem, d, walk, goal, base)
        result, iterations = _approach(problem, d, i, walk, problem.mu[d], True, tolerance, trace)
        if result != status.CONVERGED:
            result, count = _snap(problem, d, i, goal, base, walk, tolerance, trace)
            iterations += count
    if result != status.CONVERGED and not is_free(problem, d, goal[0], goal[1], goal[2], walk):
        result, count = _come_from_aside(problem, d, i, goal, base, walk, tolerance, trace)
        iterations += count
        arrive(walk, goal, base)
        return result, iterations
    if result != status.CONVERGED or walk.push[3] == 0.0:
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
        known, solved = _LOST, -1
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
                row[rows.ITERATIONS] = iterations
                row[rows.SNAP], row[rows.RELEASED] = walk.snap[0], walk.snap[1]
                rows.measure(problem, d, i, goal[0], goal[1], work, row)
                if walk.lost[0] != FOLLOWED:
                    row[rows.LOST] = 1.0
                    if walk.lost[0] == AFRESH or row[rows.STICKING] > 0.0:
                        row[rows.ESTIMATE] += 2.0 * problem.mu[d]
                    walk.lost[0] = EARLIER
                if trace.psi.shape[1] > 0:
                    _store_shape(problem, d, i, work.state, trace)
                continue
            known = _FREE if result == status.NO_CONTACT else _LOST
            if known == _FREE:
                walk.lost[0], solved = FOLLOWED, i
            else:
                result = why_unsolved(problem, d, i, solved, result, walk, trace.rows)
            overlap = 0.0
            if result == status.INFEASIBLE:
                overlap = -walk.straight.gap[walk.deepest[0]]
            elif result == status.NO_CONTACT:
                overlap = unseen_overlap(problem, d, goal, walk)
            _free_row(problem, d, i, result, overlap, row)
            row[rows.ITERATIONS] = iterations
            row[rows.SNAP], row[rows.RELEASED] = walk.snap[0], walk.snap[1]
    trace.passes[0] += work.passes[0]


@kernel
def trace_surfaces(problem, walk, tolerance, trace):
    """Solve all positions of all fingers.

    walk: of `make_walk`; tolerance: of the KKT residual; trace: zeros on entry. What does not
    converge is a row with a status.
    """
    _trace(share(problem), share(walk), tolerance, share(trace))
