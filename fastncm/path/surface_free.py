"""Where a straight finger is free of its target, and how deep it lies in it where it is not."""

import numpy as np

from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.distance import ELLIPSE, HALF_PLANE
from fastncm.kernels.nodal import place_point, place_surface
from fastncm.path.surface_way import step_on
from fastncm.sqp.surface_state import ROUNDING

#: A straight finger nearer to the target than this (finger lengths) is taken to touch on its way.
_TOUCH = 1e-3
#: Longest move, over half the target's least width, from which a finger without contact is taken
#: to have none: in a longer one it may have passed through.
_THROUGH = 0.5


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
def _see_beside(straight, k):
    """A node beside a corner of the target does not touch it, but that may lie on the other side of
    the finger: its gap is what was seen."""
    if straight.gap[k] == 0.0 and straight.seen[k] < 0.0:
        straight.gap[k] = straight.seen[k]


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
        _see_beside(straight, walk.deepest[0])
        if straight.gap[walk.deepest[0]] < -ROUNDING:
            return False
    place_surface(problem, d, x, y, angle, straight, 0.0)
    for k in range(1, straight.gap.shape[0]):
        if k < problem.arc.shape[0]:
            _see_beside(straight, k)
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
