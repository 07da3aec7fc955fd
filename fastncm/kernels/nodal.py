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

Surface points: k = 0 ... N are the nodes on the side that touches, k = N + 1 is the tip's other
corner.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import driver, inlined, inner
from fastncm.kernels.distance import distance
from fastncm.kernels.trig import sincos


class NodalProblem(NamedTuple):
    """D fingers in direct contact that share the number of intervals N and the shape of target.

    step: (N,) lengths h of the intervals. bending: (D, N) B / h; flexibility: (D, N) h / B;
    shear_flexibility: (D, N) 1 / (C h), 0 without shear, with B and C at midpoints. thickness: (D,
    N) w / w_clamp there. offset: (D, N + 2) rho, half the thickness with its sign (positive: left;
    0 where the axis touches). vertices: (D, V, 2), shape: of the target (`kernels.distance`).
    positions: (D, P), in the order to solve; placement: (D, P, 3) of the target in the base's frame
    there; motion: (D, P, 3), its derivative along the way, in the sense in which the path is
    passed. base: (D, P) direction of the finger's base in space; arm: (D,) from its pivot, the
    origin, to the clamp. mu: (D,) of sliding friction. left: 1 where the left side touches.
    printed_section: 1 where psi + gamma turns the section.
    """

    step: np.ndarray
    bending: np.ndarray
    flexibility: np.ndarray
    shear_flexibility: np.ndarray
    thickness: np.ndarray
    offset: np.ndarray
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
    """One finger's state and evaluation; N intervals, K = N + 2 surface points.

    psi, gamma: (N + 1,) (gamma_i belongs to interval i >= 1); sin, cos: (N + 1,) of theta; x, y:
    (N + 1,) nodes; section_sin, section_cos: (N + 1,) of what turns the section. fx, fy: (N + 1,)
    what the middle of interval i carries of the forces beyond; moment: (N + 1,) theirs there.

    Of the surface points, (K,). px, py: place; gap, nx, ny, curvature: `kernels.distance`, in the
    base's frame (far from the target the gap is a lower bound); seen_x, seen_y, seen: where in the
    target's frame the distance was last worked out, and what it was; force: multiplier lambda;
    along: sense of sliding, +1 where friction acts along ``t = (-ny, nx)``, 0 without; stuck: bool,
    held along t, too, by the force shear; anchor_x, anchor_y: at this point of the target's frame;
    slide: how far it has moved from there along t.
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


@driver
def make_nodal(intervals):
    """A straight finger of N intervals, not yet evaluated."""
    n, k = intervals + 1, intervals + 2
    return Nodal(
        np.zeros(n), np.zeros(n), np.zeros(n), np.ones(n), np.zeros(n), np.zeros(n), np.zeros(n),
        np.ones(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(k), np.zeros(k), np.zeros(k),
        np.zeros(k), np.zeros(k), np.zeros(k), np.zeros(k), np.zeros(k), np.full(k, -np.inf),
        np.zeros(k), np.zeros(k), np.zeros(k, np.bool_), np.zeros(k), np.zeros(k), np.zeros(k),
        np.zeros(k),
    )  # fmt: skip


@inlined
def node_of(k, intervals):
    """The node to which surface point `k` belongs."""
    return min(k, intervals)


@inner
def place_axis(problem, state, size):
    """Angles, positions and sections of all nodes; beyond node `size` the finger is straight."""
    psi, gamma, sin, cos = state.psi, state.gamma, state.sin, state.cos
    intervals = problem.step.shape[0]
    for i in range(1, size + 1):
        s, c = sincos(0.5 * (psi[i - 1] + psi[i]) + gamma[i])
        sin[i] = s
        cos[i] = c
    share = 1.0 if problem.printed_section else 0.0
    for i in range(1, size + 1):
        s, c = sincos(psi[i] + share * gamma[i])
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
def place_point(problem, d, k, x, y, turn_sin, turn_cos, state, margin):
    """Surface point `k` and its gap to the target at `x`, `y`, turned by an angle of that sine and
    cosine.

    The gap of an unloaded point that is certainly above `margin` is not worked out: a distance
    changes by no more than the point moves.
    """
    j, offset = node_of(k, problem.step.shape[0]), problem.offset[d, k]
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
    if state.stuck[k]:
        moved_x, moved_y = qx - state.anchor_x[k], qy - state.anchor_y[k]
        state.slide[k] = moved_y * nx - moved_x * ny


@inner
def place_surface(problem, d, x, y, angle, state, margin):
    """`place_point` of all surface points."""
    turn_sin, turn_cos = np.sin(angle), np.cos(angle)
    for k in range(state.px.shape[0]):
        place_point(problem, d, k, x, y, turn_sin, turn_cos, state, margin)


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


@inner
def carry_forces(problem, d, state, size):
    """What each interval up to `size` carries of the contact forces beyond it: `fx`, `fy`,
    `moment`. Returns the moment at the clamp."""
    intervals = problem.step.shape[0]
    mu = problem.mu[d]
    fx, fy, moment = 0.0, 0.0, 0.0
    for i in range(size, 0, -1):
        for k in range(i, state.force.shape[0] if i == intervals else i + 1):
            if state.force[k] != 0.0:
                qx, qy = contact_direction(state, k, mu)
                qx, qy = state.force[k] * qx, state.force[k] * qy
                fx, fy = fx + qx, fy + qy
                moment += (state.px[k] - state.x[i]) * qy - (state.py[k] - state.y[i]) * qx
        half = 0.5 * problem.step[i - 1]
        moment += half * (state.cos[i] * fy - state.sin[i] * fx)
        state.fx[i], state.fy[i], state.moment[i] = fx, fy, moment
        moment += half * (state.cos[i] * fy - state.sin[i] * fx)
    return moment
