"""One move of the target on a finger in direct contact: in as many steps as it takes."""

from fastncm.kernels.cache import inner
from fastncm.path.surface_branch import buckles, has_jumped, missing_energy, note_snap
from fastncm.path.surface_predict import forget, predict, remember
from fastncm.path.surface_rows import doubted_forces
from fastncm.path.surface_slip import choose_senses, finish_friction, hold_new, regrip
from fastncm.path.surface_way import (
    AFRESH,
    PUSH,
    PUSH_ENERGY,
    PUSH_NORMAL,
    copy_state,
    on_the_way,
    step_on,
)
from fastncm.sqp import status
from fastncm.sqp.surface import solve_surface
from fastncm.sqp.surface_state import NEAR, evaluate, mean_deflection

#: Longest move of the target (finger lengths, radians) from one solve to the next, and the longest
#: that is not divided any more: so well is the end of a branch located.
_LONGEST_MOVE, _PLACE = 0.1, 5e-7
#: Energy, over what is stored, that may be missing or too much after a move within a branch.
_UNEXPLAINED = 0.05
#: Iterations of the SQP before a move is divided, and on the whole way to a position: of 3,682
#: random rows that are solved, one takes as many.
ITERATIONS, _MOST = 25, 1000
#: Rounds in which contacts change between stick and slip.
_ROUNDS = 20
#: Part of the normal forces that may be in doubt of where contacts stick before a move is divided,
#: and the longest one, over the longest of all, that is not: much shorter ones lose their way
#: between stick and slip where friction is nearly all that the finger bears.
_DOUBTED, _DOUBTFUL = 0.01, 0.25
#: Longest move at whose beginning contacts are tried that stick from the first.
_STICKS = 1e-4


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
    result, total, _ = solve_surface(problem, d, x, y, angle, work, tolerance, ITERATIONS)
    moved = motion[0] * motion[0] + motion[1] * motion[1] + motion[2] * motion[2]
    if mu > 0.0 and result != status.CONVERGED and moved < _STICKS * _STICKS:
        copy_state(walk.kept, state)
        evaluate(problem, d, walk.place[0], walk.place[1], walk.place[2], work)
        hold_new(state, motion, walk.place[0], walk.place[1], NEAR)
        result, count, _ = solve_surface(problem, d, x, y, angle, work, tolerance, ITERATIONS)
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
        result, count, _ = solve_surface(problem, d, x, y, angle, work, tolerance, ITERATIONS)
        total += count
        if result != status.CONVERGED:
            return result, total
    return status.MAX_ITERATIONS, total


@inner
def approach(problem, d, i, walk, mu, strict, tolerance, trace):
    """Move the target from ``walk.place`` by ``walk.move``, in as many steps as it takes.

    A step that seems to lead to another branch is divided, as one that is not solved. Where it
    leads there in the shortest one, too, the finger snaps; but never to where more energy is stored
    than the target brings, unless the way is not `strict`, as it is none of the path's. A step that
    leaves in doubt where contacts stick is divided, too, if shorter ones are solved. Returns
    ``(status, iterations)``; on success ``walk.place`` is the goal, else it is where the branch
    ends, or where `_MOST` iterations had led to.
    """
    work, move = walk.work, walk.move
    length = max(max(abs(move[0]), abs(move[1])), max(abs(move[2]), abs(walk.turn[0])))
    longest = min(1.0, _LONGEST_MOVE / length) if length > 0.0 else 1.0
    free = walk.free_move[0] / length if length > 0.0 else 1.0
    share, total, left = longest, 0, 1.0
    careful, jumped, doubted = True, False, 0.0
    while True:
        share = min(share, left)
        if walk.push[PUSH_NORMAL] == 0.0:
            share = min(share, free)
        last_try = share * length <= _PLACE
        predict(walk.strides, walk.kept, move, share, work.state)
        result, count = _solve_move(problem, d, walk, share, mu, tolerance)
        total += count
        trace.solves[0] += 1
        solved, missing, unsure = result == status.CONVERGED, 0.0, False
        if solved:
            missing = missing_energy(problem, d, walk, share, mu)
            most = _UNEXPLAINED * max(walk.push[PUSH_ENERGY], walk.trial[PUSH_ENERGY])
            odd = walk.push[PUSH_NORMAL] > 0.0 and abs(missing) > most
            locks = buckles(problem, d, walk, share)
            passed = walk.trial[PUSH_NORMAL] == 0.0 and share > free
            if careful and last_try:
                solved = not locks and (not odd or missing > 0.0)
            elif careful:
                solved = not (locks or odd or passed or has_jumped(problem, walk))
            jumped = jumped or not solved
            if solved and mu > 0.0 and doubted >= 0.0 and share > _DOUBTFUL * longest:
                most = _DOUBTED * walk.trial[PUSH_NORMAL]
                if doubted_forces(problem, d, work) > most:
                    solved, doubted, unsure = False, share, True
            if solved and odd:
                note_snap(problem, d, i, walk, walk.push[PUSH_ENERGY] - walk.trial[PUSH_ENERGY])
                walk.lost[0] = AFRESH
        if solved:
            remember(walk.strides, walk.kept, move, share)
            copy_state(work.state, walk.kept)
            for c in range(PUSH):
                walk.push[c] = walk.trial[c]
            left -= share
            for c in range(3):
                walk.last[c] = share * move[c]
            step_on(problem, d, walk, share)
            if left <= 1e-12:
                return result, total
            share, doubted = min(2.0 * share, longest), min(doubted, 0.0)
            if total <= _MOST:
                continue
        copy_state(walk.kept, work.state)
        if total > _MOST:
            return status.MAX_ITERATIONS, total
        if doubted > 0.0 and not unsure:  # shorter ones fail: as it was, then
            share, doubted = doubted, -1.0
            continue
        share *= 0.25
        if unsure:
            continue
        forget(walk.strides)
        if last_try:
            if strict or not jumped:
                return status.BRANCH_ENDS, total
            share, careful, jumped = longest, False, False
