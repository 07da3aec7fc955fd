"""One finger in direct contact on its way: where the target is, where it goes, what it meets.

The base turns about its pivot while the target goes straight on in space, so that in the base's
frame, where the finger is solved, the target comes on an arc.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.distance import ELLIPSE, HALF_PLANE
from fastncm.kernels.nodal import (
    Nodal,
    NodalProblem,
    make_nodal,
    place_point,
    place_surface,
)
from fastncm.path.surface_predict import Strides, forget, make_strides
from fastncm.sqp.surface_state import (
    ROUNDING,
    SurfaceWork,
    make_surface_work,
    strain_energy,
)

#: A solve that turns the finger by more (rad), or the contact force by more than this cosine, is
#: not trusted to have stayed on its branch while shorter moves can be tried.
_LARGEST_TURN, _SAME_WAY = 0.8, 0.5
#: A straight finger nearer to the target than this (finger lengths) is taken to touch on its way.
_TOUCH = 1e-3
#: Longest move, over half the target's least width, from which a finger without contact is taken
#: to have none: in a longer one it may have passed through.
_THROUGH = 0.5
#: How a finger in contact came here: along the path, at this position from beside the finger, since
#: the target was not to be reached along the path, or at an earlier one.
FOLLOWED, AFRESH, EARLIER = range(3)


class Walk(NamedTuple):
    """One finger on its way.

    work: state and solver; straight: the finger without contact, deepest: (1,) its deepest point;
    kept: the last solved state, strides: those before. place: (3,) of the target there, base: (1,)
    direction of the finger's base; move: (3,) from there to the goal, by what the target itself
    moves and by what it turns in the base's frame, while the base turns by turn: (1,). push: (5,)
    of the last solved state: contact force, its moment about the clamp, sum of the normal forces,
    strain energy; trial: (5,) that of the one after it; clear: (1,) how far the target is from the
    straight finger, at least, where there is none. last: (3,) the part of the move before; lost:
    (1,) whether the finger in contact was FOLLOWED from where there was none, or approached AFRESH.
    free_move: (1,) the longest one that shows that there is no contact. snap: (2,) the first snap
    on the way to the goal: the path's position there, and the energy released; 0 where none is.
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


def make_walk(problem: NodalProblem) -> Walk:
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
        np.zeros(5),
        np.zeros(5),
        np.zeros(1),
        np.zeros(3),
        np.zeros(1, np.int64),
        np.zeros(1),
        np.zeros(2),
    )


@inner
def longest_free_move(problem, d):
    """The longest move of the target `d` that cannot take it through a finger unseen."""
    if problem.shape == HALF_PLANE:
        return np.inf
    if problem.shape == ELLIPSE:
        return _THROUGH * min(problem.vertices[d, 0, 0], problem.vertices[d, 0, 1])
    narrow, count = np.inf, problem.vertices.shape[1]
    for i in range(count):
        x, y = problem.vertices[d, i, 0], problem.vertices[d, i, 1]
        ex, ey = (
            problem.vertices[d, (i + 1) % count, 0] - x,
            problem.vertices[d, (i + 1) % count, 1] - y,
        )
        wide = 0.0
        for k in range(count):
            wide = max(
                wide, ex * (problem.vertices[d, k, 1] - y) - ey * (problem.vertices[d, k, 0] - x)
            )
        narrow = min(narrow, wide / np.sqrt(ex * ex + ey * ey))
    return _THROUGH * 0.5 * narrow


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


@inner
def is_free(problem, d, x, y, angle, walk):
    """True where the undeformed finger does not overlap the target, its clamped section left out.

    Then there is no contact: straight is the minimum of the energy. The point that was deepest the
    last time is looked at first.
    """
    straight = walk.straight
    turn_sin, turn_cos = np.sin(angle), np.cos(angle)
    if problem.nodes_touch and walk.deepest[0] < problem.arc.shape[0] + 1:
        place_point(problem, d, walk.deepest[0], x, y, turn_sin, turn_cos, straight, 0.0)
        if straight.gap[walk.deepest[0]] < -ROUNDING:
            return False
    place_surface(problem, d, x, y, angle, straight, 0.0)
    for k in range(1, straight.gap.shape[0]):
        if straight.gap[k] < straight.gap[walk.deepest[0]]:
            walk.deepest[0] = k
    return straight.gap[walk.deepest[0]] >= -ROUNDING


@inner
def longest_reach(problem, d):
    """How far from its pivot the straight finger reaches, at most."""
    reach = 0.0
    for k in range(problem.offset.shape[1]):
        reach = max(reach, abs(problem.offset[d, k]))
    return reach + problem.arm[d] + 1.0


@inner
def stays_free(problem, d, walk):
    """Move the target along ``walk.move`` until it is about to touch the straight finger.

    Each stride is as long as the distance allows (conservative advancement; B. Mirtich,
    "Impulse-based Dynamic Simulation of Rigid Body Systems", 1996, sec. 2.3). Returns whether it
    comes to the end without.
    """
    reach = longest_reach(problem, d)
    speed = np.sqrt(walk.move[0] * walk.move[0] + walk.move[1] * walk.move[1])
    speed += abs(walk.turn[0]) * reach
    left = 1.0 if speed > 0.0 else 0.0
    while walk.clear[0] <= speed * left and left > 0.0:
        share = max(walk.clear[0] - 0.5 * _TOUCH, 0.0) / speed
        left -= share
        step_on(problem, d, walk, share)
        x, y, angle = walk.place[0], walk.place[1], walk.place[2]
        place_surface(problem, d, x, y, angle, walk.straight, _TOUCH)
        walk.clear[0] = np.inf
        for k in range(1, walk.straight.gap.shape[0]):
            walk.clear[0] = min(walk.clear[0], walk.straight.gap[k])
        if walk.clear[0] <= _TOUCH:
            walk.clear[0] = 0.0
            return False
    walk.clear[0] -= speed * left
    return True


@inner
def unseen_overlap(problem, d, goal, walk):
    """How deep an ellipse at `goal` lies in the straight finger's side between two nodes, neither
    of which it touches: the gap between them is a parabola with the ellipse's curvature."""
    if problem.shape != ELLIPSE or not problem.nodes_touch:
        return 0.0
    a, b, h = problem.vertices[d, 0, 0], problem.vertices[d, 0, 1], problem.step[0]
    most = 0.125 * h * h * max(a, b) / min(a, b) ** 2
    if walk.clear[0] > most:
        return 0.0
    straight, depth = walk.straight, 0.0
    place_surface(problem, d, goal[0], goal[1], goal[2], straight, most + h)
    for k in range(2, problem.arc.shape[0]):
        alone = straight.nx[k] == 0.0 and straight.ny[k] == 0.0
        alone = alone or (straight.nx[k - 1] == 0.0 and straight.ny[k - 1] == 0.0)
        bend = 0.5 * (straight.curvature[k - 1] + straight.curvature[k]) * h * h
        if alone or bend <= 0.0:
            continue
        rise = straight.gap[k] - straight.gap[k - 1]
        share = min(max(0.5 - rise / bend, 0.0), 1.0)
        gap = straight.gap[k - 1] + rise * share - 0.5 * bend * share * (1.0 - share)
        depth = max(depth, -gap)
    return depth


@inner
def base_overlap(problem, d, x, y, angle, straight):
    """How deep the side of the clamped section lies in the target."""
    place_point(problem, d, 0, x, y, np.sin(angle), np.cos(angle), straight, 0.0)
    return -straight.gap[0]


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


@inner
def has_jumped(problem, walk):
    """Whether the solved state seems to lie on another branch than the last one: the finger has
    turned far, or the contact force has; the first one pushes away from the side that touches."""
    state, kept, push = walk.work.state, walk.kept, walk.push
    for i in range(1, state.psi.shape[0]):
        if abs(state.psi[i] - kept.psi[i]) > _LARGEST_TURN:
            return True
    fx, fy = state.fx[1], state.fy[1]
    if push[0] == 0.0 and push[1] == 0.0:
        return fy > 0.0 if problem.left else fy < 0.0
    size = np.sqrt((fx * fx + fy * fy) * (push[0] * push[0] + push[1] * push[1]))
    return fx * push[0] + fy * push[1] < _SAME_WAY * size


@inlined
def _power(push, x, y, motion):
    """Work of the target at `x`, `y` against the contact force and moment `push` in the `motion`
    (3,)."""
    moment = push[2] - (x * push[1] - y * push[0])
    return push[0] * motion[0] + push[1] * motion[1] + moment * motion[2]


@inner
def missing_energy(problem, d, walk, share, mu):
    """What was stored and the target's work in `share` of the move (by the trapezoidal rule), less
    what friction has taken and what is stored in the solved state, whose ``walk.trial`` is written.
    """
    state, size, push = walk.work.state, walk.work.size[0], walk.trial
    half = 0.5 * problem.step[0]
    push[0], push[1] = state.fx[1], state.fy[1]
    push[2] = state.moment[1] + half * (state.cos[1] * push[1] - state.sin[1] * push[0])
    push[3], slid = 0.0, 0.0
    for k in range(state.force.shape[0]):
        push[3] += state.force[k]
        if not state.stuck[k]:
            slid += state.force[k] * abs(state.pace[k])
    push[4] = strain_energy(problem, d, state, size)
    x, y, angle = on_the_way(problem, d, walk, share)
    x0, y0, angle0 = walk.place[0], walk.place[1], walk.place[2]
    motion = (x - x0, y - y0, angle - angle0)
    work = 0.5 * (_power(walk.push, x0, y0, motion) + _power(push, x, y, motion))
    taken = 0.0
    if push[3] > 0.0:
        length = np.sqrt(motion[0] ** 2 + motion[1] ** 2 + motion[2] ** 2)
        taken = 0.5 * mu * (walk.push[3] + push[3]) * slid / push[3] * length
    return walk.push[4] + work - taken - push[4]


@inner
def note_snap(problem, d, i, walk, released):
    """On the way to position `i`, the finger snaps where the target is."""
    if walk.snap[1] > 0.0 or released <= 0.0:
        return
    walk.snap[0], walk.snap[1] = walk.base[0], released
    if problem.motion[d, i, 2] == 0.0:  # the base stands: a place in space
        x, _ = _turned(problem.arm[d] + walk.place[0], walk.place[1], walk.base[0])
        walk.snap[0] = x
