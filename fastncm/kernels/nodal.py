"""The axis of a finger in direct contact: nodal angles, its own side surface, and what touches it.

The angle psi is piecewise linear between N + 1 nodes, the shear angle gamma constant in each of the
N intervals (the paper's (5), with the mean of neighbouring nodal values squared, has a mode without
energy). With ``theta_i = (psi_{i-1} + psi_i) / 2 + gamma_i``, in units of the finger's length L and
of E I at the clamp:

* position ``r_i = r_{i-1} + h_i (cos theta_i, sin theta_i)``               (Lan & Lee 2008, (1))
* energy ``V = 1/2 sum_i B_i (psi_i - psi_{i-1})^2 / h_i + C_i h_i gamma_i^2``            ((2), (5))
* surface ``p_k = r_j + rho_k (-sin psi_j, cos psi_j)``                                       ((6))

The frame is that of the finger's base: clamp at the origin, ``psi_0 = 0``; base motion and target
motion are one relative motion of the target, given by its placement (x, y, angle).

Contact points: k = 0 ... N are the nodes on the side that touches, k = N + 1 is the tip's other
corner, all against the target's distance field (10a). Then come M points of the target against the
finger's side (10b): each against the section that is nearest, whose side is a parabola.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import inlined
from fastncm.kernels.distance import ELLIPSE, distance
from fastncm.kernels.trig import sincos

#: Gap (finger lengths) of a pair that cannot touch.
FAR = 0.25
#: A target's point leaves its section for the next one beyond this part of the interval to that,
#: and a node that is nearer to such a point does not touch: a little more than half, so that a
#: solve sees one.
_NEARER = 0.55
#: A target lies behind the side where the cosine between its normal and the side's is below this.
_BEHIND = -0.5
#: Rounds in which the point of an arc that has the side's direction is found.
_TURNS = 2
#: Contact points around an ellipse where nodes are too far apart to see it.
AROUND = 64


class NodalProblem(NamedTuple):
    """D fingers in direct contact that share the number of intervals N and the kind of target.

    step: (N,) lengths h of the intervals; arc: (N + 1,) s of the nodes. bending: (D, N) B / h;
    flexibility: (D, N) h / B; shear_flexibility: (D, N) 1 / (C h), 0 without shear, with the means
    of 1 / B and 1 / C over the interval. thickness: (D, N) w / w_clamp in the middle. offset: (D, N
    + 2) rho, half the thickness with its sign (positive: left; 0 where the axis touches).
    nodes_touch: 1 where the nodes are contact
    points; points: (D, M, 2) of the target, in its own frame, that are. vertices: (D, V, 2), shape:
    of the target (`kernels.distance`). positions: (D, P), in the order to solve; placement: (D, P,
    3) of the target in the base's frame there; motion: (D, P, 3), its derivative along the way, in
    the sense in which the path is passed. base: (D, P) direction of the finger's base in space;
    arm: (D,) from its pivot, the origin, to the clamp. mu: (D,) of sliding friction. left: 1 where
    the left side touches. printed_section: 1 where psi + gamma turns the section.
    """

    step: np.ndarray
    arc: np.ndarray
    bending: np.ndarray
    flexibility: np.ndarray
    shear_flexibility: np.ndarray
    thickness: np.ndarray
    offset: np.ndarray
    nodes_touch: int
    points: np.ndarray
    vertices: np.ndarray
    shape: int
    positions: np.ndarray
    placement: np.ndarray
    motion: np.ndarray
    base: np.ndarray
    arm: np.ndarray
    mu: np.ndarray
    left: int
    printed_section: int


class Nodal(NamedTuple):
    """One finger's state and evaluation; N intervals, K = N + 2 + M contact points.

    psi, gamma: (N + 1,) (gamma_i belongs to interval i >= 1); sin, cos: (N + 1,) of theta; x, y:
    (N + 1,) nodes; section_sin, section_cos: (N + 1,) of what turns the section. fx, fy: (N + 1,)
    what the middle of interval i carries of the forces beyond; moment: (N + 1,) theirs there;
    couple: (N + 1,) of the contact forces on gamma_i, where it turns sections, over h.

    Of the contact points, (K,). node: on which they act, and after: (K,) the next one there, after
    first: (N + 1,), of the target's points (-1: none); px, py: place; gap, nx, ny, curvature:
    `kernels.distance`, in the base's frame (far from the target the gap is a lower bound); seen_x,
    seen_y, seen: where in the target's frame the distance was last worked out, and what it was (of
    a target's point: s of the finger where it, or its arc, touches, and s beside itself); force:
    multiplier lambda; along: sense of sliding, +1 where friction acts along ``t = (-ny, nx)``, 0
    without; stuck: bool, held along t, too, by the force shear; anchor_x, anchor_y: at this seen_x,
    seen_y; slide: how far it has moved from there along t; bend: a target's point turns its normal
    by this per unit along the finger's side; deepens, tilts: (K, 2) derivatives of its gap and
    of its normal's angle by the mean shear angle around its node, and by the bending there, that of
    both intervals. held: (1,) bool, whether the points of the target stay with their sections.
    pace: slip per length of the target's move, where it slides; doubt: how far the place to which
    it sticks may be off, or how far a sliding one may have come back.
    """

    psi: np.ndarray
    gamma: np.ndarray
    sin: np.ndarray
    cos: np.ndarray
    x: np.ndarray
    y: np.ndarray
    section_sin: np.ndarray
    section_cos: np.ndarray
    fx: np.ndarray
    fy: np.ndarray
    moment: np.ndarray
    couple: np.ndarray
    node: np.ndarray
    after: np.ndarray
    first: np.ndarray
    px: np.ndarray
    py: np.ndarray
    gap: np.ndarray
    nx: np.ndarray
    ny: np.ndarray
    curvature: np.ndarray
    seen_x: np.ndarray
    seen_y: np.ndarray
    seen: np.ndarray
    force: np.ndarray
    along: np.ndarray
    stuck: np.ndarray
    shear: np.ndarray
    anchor_x: np.ndarray
    anchor_y: np.ndarray
    slide: np.ndarray
    bend: np.ndarray
    deepens: np.ndarray
    tilts: np.ndarray
    held: np.ndarray
    pace: np.ndarray
    doubt: np.ndarray


def make_nodal(problem):
    """A straight finger of `problem`, not yet evaluated."""
    n, m = problem.step.shape[0] + 1, problem.points.shape[1]
    k = n + 1 + m
    node = np.minimum(np.arange(k), n - 1)
    return Nodal(
        np.zeros(n), np.zeros(n), np.zeros(n), np.ones(n), np.zeros(n), np.zeros(n), np.zeros(n),
        np.ones(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), node, np.full(k, -1),
        np.full(n, -1),
        np.zeros(k), np.zeros(k), np.zeros(k), np.zeros(k), np.zeros(k), np.zeros(k), np.zeros(k),
        np.zeros(k), np.full(k, -np.inf), np.zeros(k), np.zeros(k), np.zeros(k, np.bool_),
        np.zeros(k), np.zeros(k), np.zeros(k), np.zeros(k), np.zeros(k), np.zeros((k, 2)),
        np.zeros((k, 2)), np.zeros(1, np.bool_), np.zeros(k), np.zeros(k),
    )  # fmt: skip


@inlined
def next_contact(state, k, j):
    """The contact point after `k` (-1: the first) of those that act on node `j`; -1 after the last.

    A node's own point comes first, at the tip also the other corner, then the target's points.
    """
    tip = state.first.shape[0] - 1
    if k < 0:
        return j
    if k == tip:
        return tip + 1
    return state.first[j] if k <= tip + 1 else state.after[k]


@inlined
def place_axis(problem, state, size):
    """Angles, positions and sections of all nodes; beyond node `size` the finger is straight."""
    psi, gamma, sin, cos = state.psi, state.gamma, state.sin, state.cos
    intervals = problem.step.shape[0]
    for i in range(1, size + 1):
        s, c = sincos(0.5 * (psi[i - 1] + psi[i]) + gamma[i])
        sin[i] = s
        cos[i] = c
    if problem.printed_section:  # the mean of gamma on both sides of the node
        for i in range(1, size + 1):
            beyond = gamma[i + 1] if i < size else (gamma[i] if size == intervals else 0.0)
            s, c = sincos(psi[i] + 0.5 * (gamma[i] + beyond))
            state.section_sin[i] = s
            state.section_cos[i] = c
    else:
        for i in range(1, size + 1):
            s, c = sincos(psi[i])
            state.section_sin[i] = s
            state.section_cos[i] = c
    s, c = sincos(psi[size])
    for i in range(size + 1, intervals + 1):
        psi[i], gamma[i] = psi[size], 0.0
        sin[i], cos[i] = s, c
        state.section_sin[i], state.section_cos[i] = s, c
    for i in range(1, intervals + 1):
        state.x[i] = state.x[i - 1] + problem.step[i - 1] * cos[i]
        state.y[i] = state.y[i - 1] + problem.step[i - 1] * sin[i]


@inlined
def _is_beside_point(problem, d, k, x, y, loaded):
    """Whether the closest point of the target to node `k`, at `x`, `y` in the target's frame, lies
    within half an interval of a point of the target that touches the side by itself; the last ones
    of an ellipse's sharp ends are where nodes touch again.

    Whether the node is `loaded` moves the limit, so that a solve sees one.
    """
    share = 1.0 - _NEARER if loaded else _NEARER
    beside = share * problem.step[k - 1]
    count = problem.points.shape[1] // 2 if problem.shape == ELLIPSE else 0
    for m in range(problem.points.shape[1]):
        if count > 0 and (m % count == 0 or m % count == count - 1):
            continue
        dx, dy = x - problem.points[d, m, 0], y - problem.points[d, m, 1]
        if dx * dx + dy * dy < beside * beside:
            return True
    return False


@inlined
def place_point(problem, d, k, x, y, turn_sin, turn_cos, state, margin):
    """Node or corner `k` and its gap to the target at `x`, `y`, turned by an angle of that sine and
    cosine.

    The gap of an unloaded point that is certainly above `margin` is not worked out: a distance
    changes by no more than the point moves. A node between the finger's ends does not touch the
    target next to a point of it that is a contact point: that touches the side, with the side's
    normal, while the target's may be any there. How deep such a node lies in it stays in `seen`.
    Nor does a node touch what lies behind its side; and where the axis touches, the tip has one
    corner.
    """
    j, offset = min(k, problem.step.shape[0]), problem.offset[d, k]
    if k > j and offset == 0.0:
        state.gap[k] = FAR
        return
    state.px[k] = state.x[j] - offset * state.section_sin[j]
    state.py[k] = state.y[j] + offset * state.section_cos[j]
    dx, dy = state.px[k] - x, state.py[k] - y
    qx, qy = turn_cos * dx + turn_sin * dy, turn_cos * dy - turn_sin * dx
    moved_x, moved_y = qx - state.seen_x[k], qy - state.seen_y[k]
    bound = state.seen[k] - np.sqrt(moved_x * moved_x + moved_y * moved_y)
    if bound > margin and state.force[k] == 0.0:
        state.gap[k], state.nx[k], state.ny[k] = bound, 0.0, 0.0
        return
    g, nx, ny, curvature = distance(problem.shape, problem.vertices, d, qx, qy)
    state.seen_x[k], state.seen_y[k], state.seen[k] = qx, qy, g
    state.gap[k], state.curvature[k] = g, curvature
    state.nx[k], state.ny[k] = turn_cos * nx - turn_sin * ny, turn_sin * nx + turn_cos * ny
    if 0 < k < problem.step.shape[0]:
        inward = state.section_cos[k] * state.ny[k] - state.section_sin[k] * state.nx[k]
        inward = -inward if problem.left else inward
        if _is_beside_point(problem, d, k, qx - g * nx, qy - g * ny, state.force[k] > 0.0):
            state.gap[k], state.nx[k], state.ny[k] = max(g, 0.0), 0.0, 0.0
        elif inward < _BEHIND:
            state.nx[k], state.ny[k] = 0.0, 0.0
    if state.stuck[k]:
        moved_x, moved_y = qx - state.anchor_x[k], qy - state.anchor_y[k]
        state.slide[k] = moved_y * nx - moved_x * ny


@inlined
def place_surface(problem, d, x, y, angle, state, margin):
    """All contact points and their gaps to the target at `x`, `y`, `angle`."""
    turn_sin, turn_cos = np.sin(angle), np.cos(angle)
    tip = problem.step.shape[0]
    if problem.nodes_touch:
        for k in range(tip + 2):
            place_point(problem, d, k, x, y, turn_sin, turn_cos, state, margin)
    else:
        for k in range(tip):
            state.gap[k] = FAR
        for k in range(tip, tip + 2):
            place_point(problem, d, k, x, y, turn_sin, turn_cos, state, margin)
    if problem.points.shape[1] == 0:
        return
    for j in range(tip + 1):
        state.first[j] = -1
    for k in range(state.px.shape[0] - 1, tip + 1, -1):
        _place_target_point(problem, d, k, x, y, turn_sin, turn_cos, state)
        state.after[k] = state.first[state.node[k]]
        state.first[state.node[k]] = k


@inlined
def _nearest_section(problem, k, state):
    """The section nearest to the target's point `k`, from that of the last time; left again only
    where another one is clearly nearer, so that a solve sees one."""
    j, tip = state.node[k], problem.step.shape[0]
    for _ in range(tip + 1):
        dx, dy = state.px[k] - state.x[j], state.py[k] - state.y[j]
        along = dx * state.section_cos[j] + dy * state.section_sin[j]
        if j < tip and along > _NEARER * problem.step[j]:
            j += 1
        elif j > 0 and along < -_NEARER * problem.step[j - 1]:
            j -= 1
        else:
            break
    return j


@inlined
def sections_change(problem, state):
    """Whether another section than its own is the nearest to a point of the target."""
    for k in range(problem.arc.shape[0] + 1, state.px.shape[0]):
        if _nearest_section(problem, k, state) != state.node[k]:
            return True
    return False


@inlined
def _normal_of_end(problem, d, m):
    """Direction of the outward normal of the ellipse `d` at its point `m`, in its own frame."""
    a, b = problem.vertices[d, 0, 0], problem.vertices[d, 0, 1]
    nx, ny = problem.points[d, m, 0] / (a * a), problem.points[d, m, 1] / (b * b)
    size = np.sqrt(nx * nx + ny * ny)
    return nx / size, ny / size


@inlined
def _turn_to(problem, d, m, nx, ny):
    """Angle from the outward normal of the ellipse `d` at its point `m` to the direction `nx`,
    `ny`."""
    mx, my = _normal_of_end(problem, d, m)
    return np.arctan2(mx * ny - my * nx, mx * nx + my * ny)


@inlined
def _slide_to(problem, d, m, nx, ny):
    """The point of the ellipse `d` with the outward normal along `nx`, `ny`, in its own frame, or
    the nearest to it half way from its point `m` to the next ones of this end."""
    a, b = problem.vertices[d, 0, 0], problem.vertices[d, 0, 1]
    count = problem.points.shape[1] // 2
    low, high = 0.0, 0.0
    for other in (m - 1, m + 1):
        if 0 <= other and other // count == m // count:
            half = 0.5 * _turn_to(problem, d, m, *_normal_of_end(problem, d, other))
            low, high = min(low, half), max(high, half)
    off = min(max(_turn_to(problem, d, m, nx, ny), low), high)
    mx, my = _normal_of_end(problem, d, m)
    sin, cos = np.sin(off), np.cos(off)
    ux, uy = cos * mx - sin * my, sin * mx + cos * my
    size = np.sqrt(a * a * ux * ux + b * b * uy * uy)
    return a * a * ux / size, b * b * uy / size


@inlined
def _place_target_point(problem, d, k, x, y, turn_sin, turn_cos, state):
    """Gap and normal of the target's point `k` against the finger's side.

    About the nearest section, in the frame of its normal e and its outward direction o, the side
    has the height ``rho + slope a + bend a^2 / 2`` at the distance a along e: the slope is the
    taper's and the shear's, the bend that of the finger. The force acts on that section, as if they
    were fixed. The points of an ellipse's sharp ends stand for the arcs around
    them, and the one of the side's direction touches.
    """
    tip = problem.step.shape[0]
    m = k - tip - 2
    px, py = problem.points[d, m, 0], problem.points[d, m, 1]
    state.px[k] = x + turn_cos * px - turn_sin * py
    state.py[k] = y + turn_sin * px + turn_cos * py
    if not state.held[0]:
        state.node[k] = _nearest_section(problem, k, state)
    j = state.node[k]
    side = 1.0 if problem.left else -1.0
    low, high = max(j - 1, 0), min(j + 1, tip)
    length = problem.step[low] + (problem.step[high - 1] if high - low == 2 else 0.0)
    thick = side * problem.offset[d, j]
    taper = side * (problem.offset[d, high] - problem.offset[d, low]) / length
    turn = side * (state.psi[high] - state.psi[low]) / length
    # per unit of the axis the side advances by cos gamma - turn thick along the section's normal
    gamma = 0.5 * (state.gamma[max(j, 1)] + state.gamma[high])
    sheared, cosine = sincos(0.0 if problem.printed_section else gamma)
    advance = cosine - turn * thick
    bend = turn / advance
    slope = (taper + side * sheared) / advance
    ex, ey = state.section_cos[j], state.section_sin[j]
    ox, oy = -side * ey, side * ex
    along = (state.px[k] - state.x[j]) * ex + (state.py[k] - state.y[j]) * ey
    state.seen_y[k] = problem.arc[j] + along
    if problem.shape == ELLIPSE and problem.nodes_touch and (px != 0.0 or py != 0.0):
        for _ in range(_TURNS):
            steep = slope + bend * along
            nx, ny = steep * ex - ox, steep * ey - oy
            nx, ny = turn_cos * nx + turn_sin * ny, turn_cos * ny - turn_sin * nx
            px, py = _slide_to(problem, d, m, nx, ny)
            state.px[k] = x + turn_cos * px - turn_sin * py
            state.py[k] = y + turn_sin * px + turn_cos * py
            along = (state.px[k] - state.x[j]) * ex + (state.py[k] - state.y[j]) * ey
    dx, dy = state.px[k] - state.x[j], state.py[k] - state.y[j]
    along, height = dx * ex + dy * ey, dx * ox + dy * oy
    steep = slope + bend * along
    scale = 1.0 / np.sqrt(1.0 + steep * steep)
    gap = (height - thick - along * (slope + 0.5 * bend * along)) * scale
    beyond = along > 0.0 and j == tip  # the tip's own corner touches there
    behind = j == 0 or problem.arc[j] + along < 0.0  # the clamp
    if behind or beyond or gap < -max(2.0 * thick, FAR):
        gap = FAR
    state.gap[k] = gap
    if gap == FAR:  # no step brings it nearer
        scale = 0.0
    state.nx[k], state.ny[k] = (steep * ex - ox) * scale, (steep * ey - oy) * scale
    state.bend[k] = side * bend * scale * scale
    fall, tilt = -scale * along, side * scale * scale
    if not problem.printed_section:  # slope and bend depend on gamma
        slope_by, bend_by = (side * cosine + slope * sheared) / advance, bend * sheared / advance
        state.deepens[k, 0] = fall * (slope_by + 0.5 * along * bend_by)
        state.tilts[k, 0] = tilt * (slope_by + along * bend_by)
    share = side / (length * advance)
    slope_by, bend_by = share * slope * thick, share * (1.0 + bend * thick)
    state.deepens[k, 1] = fall * (slope_by + 0.5 * along * bend_by)
    state.tilts[k, 1] = tilt * (slope_by + along * bend_by)
    state.seen_x[k] = problem.arc[j] + along
    if state.stuck[k]:
        across = ey * state.nx[k] - ex * state.ny[k]
        state.slide[k] = (state.anchor_y[k] - state.seen_y[k]) * across


@inlined
def friction_ratio(state, k, mu):
    """Force along the tangent ``t = (-ny, nx)`` over the normal force at surface point `k`."""
    if state.stuck[k]:
        return state.shear[k] / state.force[k] if state.force[k] != 0.0 else 0.0
    return mu * state.along[k]


@inlined
def contact_direction(state, k, mu):
    """Force on the finger at surface point `k` per unit of the normal force: ``n + ratio t``."""
    ratio = friction_ratio(state, k, mu)
    return state.nx[k] - ratio * state.ny[k], state.ny[k] + ratio * state.nx[k]


@inlined
def carry_forces(problem, d, state, size):
    """What each interval up to `size` carries of the contact forces beyond it: `fx`, `fy`,
    `moment`. Returns the moment at the clamp."""
    mu = problem.mu[d]
    fx, fy, moment = 0.0, 0.0, 0.0
    if problem.printed_section:
        for i in range(state.couple.shape[0]):
            state.couple[i] = 0.0
    for i in range(size, 0, -1):
        k = next_contact(state, -1, i)
        while k >= 0:
            if state.force[k] != 0.0:
                qx, qy = contact_direction(state, k, mu)
                qx, qy = state.force[k] * qx, state.force[k] * qy
                fx, fy = fx + qx, fy + qy
                turn = (state.px[k] - state.x[i]) * qy - (state.py[k] - state.y[i]) * qx
                moment += turn
                if problem.printed_section:
                    after = min(i + 1, state.couple.shape[0] - 1)
                    state.couple[i] += 0.5 * turn / problem.step[i - 1]
                    state.couple[after] += 0.5 * turn / problem.step[after - 1]
            k = next_contact(state, k, i)
        half = 0.5 * problem.step[i - 1]
        moment += half * (state.cos[i] * fy - state.sin[i] * fx)
        state.fx[i], state.fy[i], state.moment[i] = fx, fy, moment
        moment += half * (state.cos[i] * fy - state.sin[i] * fx)
    return moment
