"""One finger in direct contact on its way: where the target is, and where it goes.

The base turns about its pivot while the target goes straight on in space, so that in the base's
frame, where the finger is solved, the target comes on an arc.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.nodal import Nodal, NodalProblem, make_nodal
from fastncm.path.surface_predict import Strides, forget, make_strides
from fastncm.sqp.surface_state import SurfaceWork, make_surface_work

#: How a finger in contact came here: along the path; at this position, which is not reached along
#: the path, from beside the finger or by a snap; so at an earlier one; or the path begins here, in
#: contact.
FOLLOWED, AFRESH, EARLIER, COLD = range(4)
#: What is known of the push of the target on the finger: contact force, its moment about the clamp,
#: sum of the normal forces, strain energy.
PUSH_X, PUSH_Y, PUSH_MOMENT, PUSH_NORMAL, PUSH_ENERGY = range(5)
PUSH = 5


class Walk(NamedTuple):
    """One finger on its way.

    work: state and solver; straight: the finger without contact, deepest: (1,) its deepest point;
    kept: the last solved state, strides: those before. place: (3,) of the target there, base: (1,)
    direction of the finger's base; move: (3,) from there to the goal, by what the target itself
    moves and by what it turns in the base's frame, while the base turns by turn: (1,). push:
    (PUSH,) of the last solved state, trial: (PUSH,) that of the one after it. clear: (1,) how far
    the target is from the straight finger, at least, where there is none. last: (3,) the part of
    the move before; lost: (1,) how the finger came into contact (FOLLOWED and so on). free_move:
    (1,) the longest one that shows that there is no contact. snap: (2,) the first snap on the way
    to the goal: the path's position there, and the energy released; 0 where none is. ended: (1,)
    where on the path the branch that the finger was on has ended (NaN: it has not). only_follows:
    (1,) whether positions that are not reached along the branch are left unsolved.
    """

    work: SurfaceWork
    straight: Nodal
    kept: Nodal
    strides: Strides
    deepest: np.ndarray
    place: np.ndarray
    base: np.ndarray
    move: np.ndarray
    turn: np.ndarray
    push: np.ndarray
    trial: np.ndarray
    clear: np.ndarray
    last: np.ndarray
    lost: np.ndarray
    free_move: np.ndarray
    snap: np.ndarray
    ended: np.ndarray
    only_follows: np.ndarray


def make_walk(problem: NodalProblem, only_follows: bool = False) -> Walk:
    """Room for a walk."""
    nodes = len(problem.arc)
    return Walk(
        make_surface_work(problem),
        make_nodal(problem),
        make_nodal(problem),
        make_strides(nodes, nodes + 1 + problem.points.shape[1]),
        np.ones(1, np.int64),
        np.zeros(3),
        np.zeros(1),
        np.zeros(3),
        np.zeros(1),
        np.zeros(PUSH),
        np.zeros(PUSH),
        np.zeros(1),
        np.zeros(3),
        np.zeros(1, np.int64),
        np.zeros(1),
        np.zeros(2),
        np.zeros(1),
        np.full(1, only_follows),
    )


@inlined
def copy_state(source, target):
    """Copy all that a solve begins with: angles, forces, stick and slip, what was seen where."""
    for i in range(source.psi.shape[0]):
        target.psi[i], target.gamma[i] = source.psi[i], source.gamma[i]
    for k in range(source.force.shape[0]):
        target.force[k], target.shear[k] = source.force[k], source.shear[k]
        target.along[k], target.stuck[k] = source.along[k], source.stuck[k]
        target.anchor_x[k], target.anchor_y[k] = source.anchor_x[k], source.anchor_y[k]
        target.pace[k], target.doubt[k] = source.pace[k], source.doubt[k]
        target.px[k], target.py[k], target.node[k] = source.px[k], source.py[k], source.node[k]
        target.seen_x[k], target.seen_y[k], target.seen[k] = (
            source.seen_x[k],
            source.seen_y[k],
            source.seen[k],
        )


@inner
def straighten(walk):
    """Back to the finger without contact."""
    for state in (walk.work.state, walk.kept):
        copy_state(walk.straight, state)
    walk.work.size[0] = walk.straight.psi.shape[0] - 1
    for c in range(walk.push.shape[0]):
        walk.push[c] = 0.0
    forget(walk.strides)


@inlined
def _turned(x, y, angle):
    """The vector `x`, `y` turned by `angle`."""
    if angle == 0.0:
        return x, y
    sin, cos = np.sin(angle), np.cos(angle)
    return cos * x - sin * y, sin * x + cos * y


@inlined
def set_goal(problem, d, walk, goal, base):
    """The move from ``walk.place`` to `goal`, (3,) in the frame of a base of the direction `base`:
    the base turns about its pivot while the target goes straight on in space."""
    arm, turn = problem.arm[d], base - walk.base[0]
    x, y = _turned(arm + goal[0], goal[1], turn)
    walk.move[0], walk.move[1] = x - (arm + walk.place[0]), y - walk.place[1]
    walk.move[2], walk.turn[0] = goal[2] - walk.place[2], turn


@inlined
def arrive(walk, goal, base):
    """The target is at the `goal`, to the last digit."""
    for c in range(3):
        walk.place[c] = goal[c]
    walk.base[0] = base


@inlined
def on_the_way(problem, d, walk, share):
    """Placement ``(x, y, angle)`` of the target at `share` of the move."""
    arm = problem.arm[d]
    x = arm + walk.place[0] + share * walk.move[0]
    y = walk.place[1] + share * walk.move[1]
    x, y = _turned(x, y, -share * walk.turn[0])
    return x - arm, y, walk.place[2] + share * walk.move[2]


@inlined
def step_on(problem, d, walk, share):
    """Take `share` of the move: ``walk.place`` and the rest of the move, in the base's new frame.

    The move keeps its length, that of the whole.
    """
    walk.place[0], walk.place[1], walk.place[2] = on_the_way(problem, d, walk, share)
    walk.base[0] += share * walk.turn[0]
    walk.move[0], walk.move[1] = _turned(walk.move[0], walk.move[1], -share * walk.turn[0])


@inlined
def path_position(problem, d, i, walk):
    """The path's position, on the way to that of number `i`, where the target is."""
    if problem.motion[d, i, 2] != 0.0:
        return walk.base[0]
    x, _ = _turned(problem.arm[d] + walk.place[0], walk.place[1], walk.base[0])
    return x  # the base stands: a place in space
