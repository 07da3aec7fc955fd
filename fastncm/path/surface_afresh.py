"""A position of a finger in direct contact that is not reached along its path: the finger is solved
afresh, with the target coming from beside, or snaps to a shape that is found so."""

from fastncm.kernels.cache import inner
from fastncm.path.surface_branch import note_snap
from fastncm.path.surface_free import is_free
from fastncm.path.surface_move import ITERATIONS, approach
from fastncm.path.surface_predict import forget
from fastncm.path.surface_slip import choose_senses, grip
from fastncm.path.surface_way import (
    AFRESH,
    COLD,
    FOLLOWED,
    PUSH_ENERGY,
    arrive,
    copy_state,
    set_goal,
    straighten,
)
from fastncm.sqp import status
from fastncm.sqp.surface import solve_surface

#: Slide (of the position) that settles which contacts slide and which stick.
_SLIDE = 1e-3
#: Smallest part of the friction by which it grows, where a finger was solved without.
_LEAST_FRICTION = 0.01
#: Farthest (finger lengths) that a target is moved aside to come from a place without contact.
_FARTHEST = 64.0


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
        result, count, _ = solve_surface(problem, d, x, y, angle, work, tolerance, ITERATIONS)
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
        result, count, _ = solve_surface(problem, d, x, y, angle, work, tolerance, ITERATIONS)
        total += count
        if result != status.CONVERGED:
            return result, total
        grip(state)
        copy_state(state, walk.kept)
    forget(walk.strides)
    result, count = approach(problem, d, i, walk, problem.mu[d], False, tolerance, trace)
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
def come_from_aside(problem, d, i, goal, base, walk, tolerance, trace):
    """Solve with the target at `goal`, at position `i` or on the way there, coming from beside the
    finger: how it came here along the path is not known. Returns ``(status, iterations)``."""
    straighten(walk)
    walk.base[0] = base
    side = 1.0 if problem.left else -1.0
    if not _set_aside(problem, d, goal, side, walk):
        return status.INFEASIBLE, 0
    at, released = walk.snap[0], walk.snap[1]
    result, iterations = approach(problem, d, i, walk, 0.0, False, tolerance, trace)
    if result == status.CONVERGED and problem.mu[d] > 0.0:
        result, count = _slide_in(problem, d, goal, i, walk, tolerance, trace)
        iterations += count
    walk.snap[0], walk.snap[1] = at, released  # what snaps on this way does not on the path
    walk.lost[0] = AFRESH if i > 0 else COLD
    return result, iterations


@inner
def snap(problem, d, i, goal, base, walk, tolerance, trace):
    """Go on to position `i` from where the branch has ended, from the shape that the finger snaps
    to there: the straight one, or that of a target coming from beside. Returns ``(status,
    iterations)``."""
    place, turned = (walk.place[0], walk.place[1], walk.place[2]), walk.base[0]
    stored, total = walk.push[PUSH_ENERGY], 0
    if is_free(problem, d, place[0], place[1], place[2], walk):
        straighten(walk)
        walk.lost[0] = FOLLOWED
    else:
        result, total = come_from_aside(problem, d, i, place, turned, walk, tolerance, trace)
        if result != status.CONVERGED:
            return result, total
    arrive(walk, place, turned)
    note_snap(problem, d, i, walk, stored - walk.push[PUSH_ENERGY])
    set_goal(problem, d, walk, goal, base)
    result, count = approach(problem, d, i, walk, problem.mu[d], True, tolerance, trace)
    return result, total + count
