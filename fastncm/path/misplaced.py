"""How far beside its true place a contact force may act, which only nodes can carry.

A node carries what the finger would carry up to half an interval beside it. A single contact sits
at the vertex of the parabola through its gap and its neighbours', or, where the target is sharper
than an interval, anywhere between with another normal; one at the tip where the gap falls inwards
from there, by the parabola of that slope. At an end of a longer contact, a force that stands out
from the next two is a point load, between this node and the next; a smooth pressure is summed up to
its end, and only a small share of it is misplaced. Moving a force along the finger changes its arm,
and turns it with the target's normal.
"""

import numpy as np

from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.distance import POLYGON, distance

#: Relative change of a cantilever's tip force per relative change of its arm, at a given deflection
#: (``3 E I w / s^3`` and the couple's ``s^2 / 2 E I``), and the misplaced share of a pressure.
_ARM, _PRESSURE = 1.5, 0.05
#: The gap of a neighbour that there is not.
_NONE = 1.0


@inlined
def tip_slope(problem, d, state):
    """By how much the gap at the tip rises along the finger's side, per unit of s; 0 where it
    falls."""
    tip = problem.step.shape[0]
    taper = (problem.offset[d, tip] - problem.offset[d, tip - 1]) / problem.step[tip - 1]
    along_x = state.cos[tip] - taper * state.section_sin[tip]
    along_y = state.sin[tip] + taper * state.section_cos[tip]
    return max(0.0, state.nx[tip] * along_x + state.ny[tip] * along_y)


@inlined
def before_tip(problem, d, state):
    """How far before the tip, which touches, the side is nearest to the target."""
    tip = problem.step.shape[0]
    slope, h = tip_slope(problem, d, state), problem.step[tip - 1]
    if slope == 0.0:
        return 0.0
    return 0.5 * slope * h * h / (max(state.gap[tip - 1], 0.0) + slope * h)


@inlined
def _place(problem, state, k):
    return problem.arc[k] if k < problem.arc.shape[0] else state.seen_x[k]


@inlined
def _change(problem, state, k, share, spacing):
    """Change of the force where `share` of it is moved by `spacing` from point `k`."""
    turn = abs(state.curvature[k]) + abs(state.bend[k])
    return share * spacing * (_ARM / _place(problem, state, k) + turn)


@inlined
def _at_single(problem, state, k, first, last):
    before = state.gap[k - 1] if k > first else _NONE
    after = state.gap[k + 1] if k < last else _NONE
    spread = before + after - 2.0 * state.gap[k]
    if spread <= 0.0:
        return 0.0
    beside = k - 1 if k > first else k + 1
    spacing = abs(_place(problem, state, beside) - _place(problem, state, k))
    off = min(0.5 * abs(before - after) / spread, 0.5)
    change = _change(problem, state, k, off * state.force[k], spacing)
    return max(change, _aslant(state, k) * state.force[k]) if problem.nodes_touch else change


@inlined
def _aslant(state, k):
    """Cosine between the target's normal at node `k` and the side there, which are at right angles
    where the node touches in its true place."""
    along_x, along_y = state.px[k + 1] - state.px[k - 1], state.py[k + 1] - state.py[k - 1]
    size = np.sqrt(along_x * along_x + along_y * along_y)
    return abs(along_x * state.nx[k] + along_y * state.ny[k]) / size


@inlined
def _at_end(problem, state, k, inward, length):
    own, beside = state.force[k], state.force[k + inward]
    third = state.force[k + 2 * inward] if length > 2 else 0.0
    share = 0.5 * max(0.0, abs(own - beside) - 0.5 * third)
    if length == 2:  # both ends see the same difference
        share *= 0.5
    share += _PRESSURE * min(own, beside)
    spacing = abs(_place(problem, state, k + inward) - _place(problem, state, k))
    return _change(problem, state, k, share, spacing)


@inlined
def _at_corner(problem, state, k):
    """Change of the force where node `k`, at the end of a contact, touches about a polygon's corner
    with any normal between those of its edges."""
    if problem.shape != POLYGON or not problem.nodes_touch:
        return 0.0
    return _aslant(state, k) * state.force[k]


@inner
def depth_between(problem, d, angle, state, k):
    """How far a node beside the target's point `k`, which touches, is behind the target, turned by
    `angle`: between the two the finger's side lies in a target that is thin enough."""
    tip, depth = problem.step.shape[0], 0.0
    if not problem.nodes_touch:
        return depth
    turn_sin, turn_cos = np.sin(angle), np.cos(angle)
    for j in range(max(state.node[k] - 1, 1), min(state.node[k] + 1, tip - 1) + 1):
        if state.gap[j] != state.seen[j] or state.nx[j] != 0.0 or state.ny[j] != 0.0:
            continue  # far away, or in front
        g, nx, ny, _ = distance(
            problem.shape, problem.vertices, d, state.seen_x[j], state.seen_y[j]
        )
        nx, ny = turn_cos * nx - turn_sin * ny, turn_sin * nx + turn_cos * ny
        inward = state.section_cos[j] * ny - state.section_sin[j] * nx
        if (inward > 0.0) == (problem.left == 1):
            depth = max(depth, g)
    return depth


@inner
def misplaced_forces(problem, d, state):
    """Change of the sum of normal forces that comes with the places of contacts, at most."""
    tip, last = problem.step.shape[0], problem.step.shape[0]
    first = 1
    if not problem.nodes_touch:
        first, last = tip + 2, state.force.shape[0] - 1
    total, k = 0.0, first
    while k <= last:
        if state.force[k] <= 0.0:
            k += 1
            continue
        begin = k
        while k < last and state.force[k + 1] > 0.0:
            k += 1
        length = k - begin + 1
        if length > 1:
            total += _at_end(problem, state, begin, 1, length) + _at_corner(problem, state, begin)
        if k != tip:
            if length > 1:
                total += _at_end(problem, state, k, -1, length) + _at_corner(problem, state, k)
            else:
                total += _at_single(problem, state, k, first, last)
        elif length == 1:
            beside = before_tip(problem, d, state)
            total += _change(problem, state, k, state.force[k], beside)
        k += 1
    return total


@inner
def unsure_senses(problem, d, state):
    """Change of the contact forces where single nodes may slide the other way: a node whose normal
    is aslant seems to slide where it is only pressed."""
    total, tip = 0.0, problem.step.shape[0]
    if not problem.nodes_touch:
        return total
    for k in range(1, tip):
        alone = state.force[k - 1] <= 0.0 and state.force[k + 1] <= 0.0
        if state.force[k] > 0.0 and alone and not state.stuck[k]:
            if abs(state.pace[k]) < _aslant(state, k):
                total += 2.0 * problem.mu[d] * state.force[k]
    return total
