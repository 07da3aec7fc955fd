"""Whether a move of the target has led to another branch of equilibria, and what is said of it."""

import numpy as np

from fastncm.kernels.cache import inlined, inner
from fastncm.path.surface_free import is_free
from fastncm.path.surface_way import (
    PUSH_ENERGY,
    PUSH_MOMENT,
    PUSH_NORMAL,
    PUSH_X,
    PUSH_Y,
    on_the_way,
    path_position,
)
from fastncm.sqp.surface_state import strain_energy

#: A solve that turns the finger by more (rad), or the contact force by more than this cosine, is
#: not trusted to have stayed on its branch while shorter moves can be tried.
_LARGEST_TURN, _SAME_WAY = 0.8, 0.8
#: Energy over force times depth, between a spring's half and a constant force's whole, that tells
#: them apart.
_CONSTANT = 0.75


@inner
def has_jumped(problem, walk):
    """Whether the solved state seems to lie on another branch than the last one: the finger has
    turned far, or the contact force has; the first one pushes away from the side that touches."""
    state, kept, push = walk.work.state, walk.kept, walk.push
    for i in range(1, state.psi.shape[0]):
        if abs(state.psi[i] - kept.psi[i]) > _LARGEST_TURN:
            return True
    fx, fy = state.fx[1], state.fy[1]
    if push[PUSH_X] == 0.0 and push[PUSH_Y] == 0.0:
        return fy > 0.0 if problem.left else fy < 0.0
    size = np.sqrt(
        (fx * fx + fy * fy) * (push[PUSH_X] * push[PUSH_X] + push[PUSH_Y] * push[PUSH_Y])
    )
    return fx * push[PUSH_X] + fy * push[PUSH_Y] < _SAME_WAY * size


@inlined
def _power(push, x, y, motion):
    """Work of the target at `x`, `y` against the contact force and moment `push` in the `motion`
    (3,)."""
    moment = push[PUSH_MOMENT] - (x * push[PUSH_Y] - y * push[PUSH_X])
    return push[PUSH_X] * motion[0] + push[PUSH_Y] * motion[1] + moment * motion[2]


@inner
def missing_energy(problem, d, walk, share, mu):
    """What was stored and the target's work in `share` of the move (by the trapezoidal rule), less
    what friction has taken and what is stored in the solved state, whose ``walk.trial`` is written.
    """
    state, size, push = walk.work.state, walk.work.size[0], walk.trial
    half = 0.5 * problem.step[0]
    push[PUSH_X], push[PUSH_Y] = state.fx[1], state.fy[1]
    push[PUSH_MOMENT] = state.moment[1] + half * (
        state.cos[1] * push[PUSH_Y] - state.sin[1] * push[PUSH_X]
    )
    push[PUSH_NORMAL], slid = 0.0, 0.0
    for k in range(state.force.shape[0]):
        push[PUSH_NORMAL] += state.force[k]
        if not state.stuck[k]:
            slid += state.force[k] * abs(state.pace[k])
    push[PUSH_ENERGY] = strain_energy(problem, d, state, size)
    x, y, angle = on_the_way(problem, d, walk, share)
    x0, y0, angle0 = walk.place[0], walk.place[1], walk.place[2]
    motion = (x - x0, y - y0, angle - angle0)
    work = 0.5 * (_power(walk.push, x0, y0, motion) + _power(push, x, y, motion))
    taken = 0.0
    if push[PUSH_NORMAL] > 0.0:
        length = np.sqrt(motion[0] ** 2 + motion[1] ** 2 + motion[2] ** 2)
        taken = (
            0.5
            * mu
            * (walk.push[PUSH_NORMAL] + push[PUSH_NORMAL])
            * slid
            / push[PUSH_NORMAL]
            * length
        )
    return walk.push[PUSH_ENERGY] + work - taken - push[PUSH_ENERGY]


@inner
def buckles(problem, d, walk, share):
    """Whether a finger without contact has come to stick to the target and to buckle between there
    and the clamp: it locks. `missing_energy` has been called.

    On the depth by which the target lies in the straight finger a spring's force grows, and stores
    half of what it would by being constant, as that of a strut that buckles is from the first.
    """
    if walk.push[PUSH_NORMAL] > 0.0 or not (walk.trial[PUSH_NORMAL] > 0.0):
        return False
    sticks = False
    for k in range(walk.work.state.force.shape[0]):
        sticks = sticks or walk.work.state.stuck[k]
    if not sticks:
        return False
    x, y, angle = on_the_way(problem, d, walk, share)
    is_free(problem, d, x, y, angle, walk)
    depth = -walk.straight.gap[walk.deepest[0]]
    return walk.trial[PUSH_ENERGY] > _CONSTANT * walk.trial[PUSH_NORMAL] * depth


@inner
def note_snap(problem, d, i, walk, released):
    """On the way to position `i`, the finger snaps where the target is."""
    if walk.snap[1] > 0.0 or released <= 0.0:
        return
    walk.snap[0], walk.snap[1] = path_position(problem, d, i, walk), released
