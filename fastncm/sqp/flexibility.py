"""The Newton step of a finger in direct contact, in O(N): flexibilities carried along the finger.

A finger clamped at its base answers a force ``f`` on node i with ``dz_i = m_i + S_i f``, where
``dz = (dx, dy, dpsi)``, S is a 3 x 3 flexibility and m the step that the finger up to there takes
by itself. Both are carried from node to node; each term of the Lagrangian's Hessian is of rank one:

* bending and shear of an interval add their compliances ``h / B`` and ``1 / (C h)``;
* the force carried by an interval stiffens it against turning: ``k = h F . e(theta)`` on ``theta``;
* a touching point's normal turns with the target's curvature and its arm with the section;
* a contact that holds is a rank-one term of infinite stiffness, and its multiplier the reaction.

A term ``-k a (b . dz)`` turns S into ``S - S a k b^T S / (1 + k b^T S a)`` (Sherman and Morrison).
This is block elimination of the KKT matrix from the clamp to the tip, whose pivots are the
``1 + k b^T S a`` and ``c^T S b``: as many of the one as of the other must be negative for a minimum
(Sylvester's law of inertia). With friction the force's direction ``b`` is not the gap's gradient
``c``, and S is not symmetric. The way back from the tip gives forces and step.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import inlined
from fastncm.kernels.nodal import friction_ratio, next_contact

#: Rank-one terms of a touching point: its normal's turn, its arm's turn, the contact itself, and
#: the grip of one that sticks.
_NORMAL, _ARM, _CONTACT, _GRIP = range(4)
#: A pivot that is this part of its summands is 0.
_HELD = 1e-14


class Wide(NamedTuple):
    """Workspace of `sqp.wide_chain`; no terms elsewhere.

    node: (5, 5), node_step, node_force: (5,) flexibility, step and force of a node; flexibility:
    (7, 7), step, force: (7,) of an interval's variables; left, right, column: (7,). turn: (N + 1,
    9), terms: (K, 4, 9): as in `Chain`, with rows of 7.
    """

    node: np.ndarray
    node_step: np.ndarray
    node_force: np.ndarray
    flexibility: np.ndarray
    step: np.ndarray
    force: np.ndarray
    left: np.ndarray
    right: np.ndarray
    column: np.ndarray
    turn: np.ndarray
    terms: np.ndarray


class Chain(NamedTuple):
    """Workspace and result of a pass along the finger, for N intervals and K contact points.

    turn: (N + 1, 5): of theta in each interval, its step m, the row of its flexibility (3), 1 /
    pivot. terms: (K, 4, 5): of each touching point's terms likewise. dpsi, dgamma: (N + 1,) step;
    dx, dy: (N + 1,); force, shear: (K,) multipliers; gap: (K,) linearised gaps; touching, mark:
    (K,) bool, the working set and its change. soft, shift: (K,) compliance of the spring that holds
    a contact, and what is added to its gap, 0 but in `sqp.interior`; slack, push: (K,) gaps and
    forces there; ends: (2, 2) of `sqp.subproblem`. order: (K,), wide: workspace.
    """

    turn: np.ndarray
    terms: np.ndarray
    dpsi: np.ndarray
    dgamma: np.ndarray
    dx: np.ndarray
    dy: np.ndarray
    force: np.ndarray
    shear: np.ndarray
    gap: np.ndarray
    touching: np.ndarray
    mark: np.ndarray
    soft: np.ndarray
    shift: np.ndarray
    slack: np.ndarray
    push: np.ndarray
    ends: np.ndarray
    order: np.ndarray
    wide: Wide


def _make_wide(nodes, points):
    return Wide(
        np.zeros((5, 5)),
        np.zeros(5),
        np.zeros(5),
        np.zeros((7, 7)),
        np.zeros(7),
        np.zeros(7),
        np.zeros(7),
        np.zeros(7),
        np.zeros(7),
        np.zeros((nodes, 9)),
        np.zeros((points, 4, 9)),
    )


def make_chain(problem):
    """A workspace for the fingers of `problem`."""
    n = problem.step.shape[0] + 1
    k = n + 1 + problem.points.shape[1]
    on_side = problem.points.shape[1] > 0 and problem.shear_flexibility.max() > 0.0
    wide = problem.printed_section or on_side
    return Chain(
        np.zeros((n, 5)),
        np.zeros((k, 4, 5)),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(k),
        np.zeros(k),
        np.zeros(k),
        np.zeros(k, np.bool_),
        np.zeros(k, np.bool_),
        np.zeros(k),
        np.zeros(k),
        np.zeros(k),
        np.zeros(k),
        np.zeros((2, 2)),
        np.zeros(k, np.int64),
        _make_wide(n, k) if wide else _make_wide(0, 0),
    )


@inlined
def is_wide(chain):
    """Whether steps are those of `sqp.wide_chain`."""
    return chain.wide.turn.shape[0] > 0


@inlined
def _columns(s, a):
    """``S a`` for the flexibility `s` (9,), row by row, and a force `a` (3,)."""
    return (
        s[0] * a[0] + s[1] * a[1] + s[2] * a[2],
        s[3] * a[0] + s[4] * a[1] + s[5] * a[2],
        s[6] * a[0] + s[7] * a[1] + s[8] * a[2],
    )


@inlined
def _rows(s, b):
    """``b^T S``."""
    return (
        b[0] * s[0] + b[1] * s[3] + b[2] * s[6],
        b[0] * s[1] + b[1] * s[4] + b[2] * s[7],
        b[0] * s[2] + b[1] * s[5] + b[2] * s[8],
    )


@inlined
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def _reduce(s, m, column, row, weight, step):
    """Flexibility and step after a rank-one term: ``S - column weight row``, ``m - column weight
    step``."""
    u, v, w = weight * column[0], weight * column[1], weight * column[2]
    return (
        (
            s[0] - u * row[0],
            s[1] - u * row[1],
            s[2] - u * row[2],
            s[3] - v * row[0],
            s[4] - v * row[1],
            s[5] - v * row[2],
            s[6] - w * row[0],
            s[7] - w * row[1],
            s[8] - w * row[2],
        ),
        (m[0] - u * step, m[1] - v * step, m[2] - w * step),
    )


@inlined
def _keep(out, step, row, inverse):
    out[0], out[1], out[2], out[3], out[4] = step, row[0], row[1], row[2], inverse


@inlined
def _term(s, m, a, b, k, out):
    """Add the term ``-k a (b . dz)``. Returns ``(S, m, excess of negative pivots)``."""
    column, row, step = _columns(s, a), _rows(s, b), _dot(b, m)
    inverse = 1.0 / (1.0 + k * _dot(b, column))
    _keep(out, step, row, inverse)
    s, m = _reduce(s, m, column, row, k * inverse, step)
    negative = 0
    if inverse < 0.0:
        negative = 1 if k * _dot(a, b) < 0.0 else -1
    return s, m, negative


@inlined
def _hold(s, m, a, c, gap, soft, out):
    """Hold the contact with the gap's gradient `c` by a force along `a`, through a spring of the
    compliance `soft`. Returns as `_term`.

    What the contacts before hold already, as of two points at one place, needs no force.
    """
    column, row, step = _columns(s, a), _rows(s, c), gap + _dot(c, m)
    pivot = _dot(c, column) + soft
    spread = abs(c[0] * column[0]) + abs(c[1] * column[1]) + abs(c[2] * column[2])
    inverse = 1.0 / pivot if abs(pivot) > _HELD * spread else 0.0
    _keep(out, step, row, inverse)
    s, m = _reduce(s, m, column, row, inverse, step)
    return s, m, -1 if inverse < 0.0 else 0


@inlined
def _answer(kept, f):
    """What the kept term's displacement is with the force `f` on its node from beyond."""
    return (kept[0] + kept[1] * f[0] + kept[2] * f[1] + kept[3] * f[2]) * kept[4]


@inlined
def contact_terms(state, k, j, mu):
    """Vectors of touching point `k` on node `j`: gradient c of its gap; tangent b, the gradient of
    its slide; direction a of the force that its multiplier measures; derivative e of the force by
    the turn of the normal, and the gradients v of that turn and w of what the arm's change adds to
    its moment."""
    arm_x, arm_y = state.px[k] - state.x[j], state.py[k] - state.y[j]
    nx, ny = state.nx[k], state.ny[k]
    ratio = friction_ratio(state, k, mu)
    qx, qy = nx - ratio * ny, ny + ratio * nx
    c = (nx, ny, arm_x * ny - arm_y * nx)
    b = (-ny, nx, arm_x * nx + arm_y * ny)
    a = (qx, qy, arm_x * qy - arm_y * qx)
    e = (-qy, qx, arm_x * qx + arm_y * qy)
    if k < state.first.shape[0] + 1:  # a node in the target's distance field
        bend = -state.curvature[k]
        v = (bend * b[0], bend * b[1], bend * b[2])
        w = (0.0, 0.0, qx * arm_x + qy * arm_y)
    else:  # a target's point on the finger's side, which turns with the section
        cos, sin, bend = state.section_cos[j], state.section_sin[j], state.bend[k]
        v = (bend * cos, bend * sin, bend * (arm_x * sin - arm_y * cos) - 1.0)
        w = (qy, -qx, 0.0)
    return c, b, (c if state.stuck[k] else a), e, v, w


_TURN = (0.0, 0.0, 1.0)


@inlined
def carry_flexibility(problem, d, state, chain, size, own):
    """The way from the clamp to node `size`.

    own: 1 for a Newton step; 0 for the answer to a target that comes nearer by 1 at all contacts.
    Returns the excess of negative pivots, 0 at a minimum.
    """
    mu = problem.mu[d]
    s = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    m = (0.0, 0.0, 0.0)
    excess = 0
    for i in range(1, size + 1):
        h = problem.step[i - 1]
        bend, shear = problem.flexibility[d, i - 1], problem.shear_flexibility[d, i - 1]
        turned = state.psi[i - 1] - state.psi[i]  # what the interval would turn if left alone
        sheared = -state.gamma[i]
        along_x, along_y = -h * state.sin[i], h * state.cos[i]
        step = m[2] + own * (0.5 * turned + sheared)
        flex = s[8] + 0.25 * bend + shear  # of theta
        tip = s[8] + 0.5 * bend  # of psi_i by a couple on theta
        row = (s[6] + along_x * flex, s[7] + along_y * flex, tip)
        column = (s[2] + along_x * flex, s[5] + along_y * flex, tip)
        xy = along_x * along_y * flex
        s = (
            s[0] + along_x * (s[6] + s[2] + along_x * flex),
            s[1] + along_y * s[2] + along_x * s[7] + xy,
            s[2] + along_x * tip,
            s[3] + along_x * s[5] + along_y * s[6] + xy,
            s[4] + along_y * (s[7] + s[5] + along_y * flex),
            s[5] + along_y * tip,
            s[6] + along_x * tip,
            s[7] + along_y * tip,
            s[8] + bend,
        )
        m = (m[0] + along_x * step, m[1] + along_y * step, m[2] + own * turned)
        k = h * (state.fx[i] * state.cos[i] + state.fy[i] * state.sin[i])
        inverse = 1.0 / (1.0 + k * flex)
        _keep(chain.turn[i], step, row, inverse)
        s, m = _reduce(s, m, column, row, k * inverse, step)
        if inverse < 0.0:
            excess += 1 if k < 0.0 else -1
        p = next_contact(state, -1, i)
        while p >= 0:
            force = state.force[p]
            if force == 0.0 and not chain.touching[p]:
                p = next_contact(state, p, i)
                continue
            c, b, a, e, v, w = contact_terms(state, p, i, mu)
            if force != 0.0:
                s, m, n = _term(s, m, e, v, force, chain.terms[p, _NORMAL])
                s, m, o = _term(s, m, _TURN, w, force, chain.terms[p, _ARM])
                excess += n + o if p < state.first.shape[0] + 1 else (n + o) % 2
            if chain.touching[p]:
                gap = state.gap[p] + chain.shift[p] if own == 1.0 else -1.0
                s, m, n = _hold(s, m, a, c, gap, chain.soft[p], chain.terms[p, _CONTACT])
                excess += n
                if state.stuck[p]:
                    slide = state.slide[p] if own == 1.0 else 0.0
                    s, m, n = _hold(s, m, b, b, slide, 0.0, chain.terms[p, _GRIP])
                    excess += n
            p = next_contact(state, p, i)
    return excess


@inlined
def list_contacts(state, chain, j):
    """Write the contact points on node `j` into ``chain.order``, for the way back over them.

    Returns how many there are.
    """
    count = 0
    p = next_contact(state, -1, j)
    while p >= 0:
        chain.order[count] = p
        count += 1
        p = next_contact(state, p, j)
    return count


@inlined
def carry_back(problem, d, state, chain, size, own):
    """The way back from node `size`: contact forces, and the step of every angle."""
    mu = problem.mu[d]
    f = (0.0, 0.0, 0.0)
    for i in range(size, 0, -1):
        count = list_contacts(state, chain, i)
        while count > 0:
            count -= 1
            p = chain.order[count]
            force = state.force[p]
            chain.force[p], chain.shear[p] = 0.0, 0.0
            if force == 0.0 and not chain.touching[p]:
                continue
            c, b, a, e, v, w = contact_terms(state, p, i, mu)
            if chain.touching[p]:
                if state.stuck[p]:
                    grip = -_answer(chain.terms[p, _GRIP], f)
                    chain.shear[p] = grip
                    f = (f[0] + grip * b[0], f[1] + grip * b[1], f[2] + grip * b[2])
                push = -_answer(chain.terms[p, _CONTACT], f)
                chain.force[p] = push
                f = (f[0] + push * a[0], f[1] + push * a[1], f[2] + push * a[2])
            if force != 0.0:
                f = (f[0], f[1], f[2] - force * _answer(chain.terms[p, _ARM], f))
                k = force * _answer(chain.terms[p, _NORMAL], f)
                f = (f[0] - k * e[0], f[1] - k * e[1], f[2] - k * e[2])
        h = problem.step[i - 1]
        k = h * (state.fx[i] * state.cos[i] + state.fy[i] * state.sin[i])
        couple = h * (state.cos[i] * f[1] - state.sin[i] * f[0]) - k * _answer(chain.turn[i], f)
        bend, shear = problem.flexibility[d, i - 1], problem.shear_flexibility[d, i - 1]
        turned = own * (state.psi[i - 1] - state.psi[i]) + bend * (0.5 * couple + f[2])
        chain.dpsi[i] = turned  # of the interval; summed below
        chain.dgamma[i] = -own * state.gamma[i] + shear * couple
        f = (f[0], f[1], f[2] + couple)
    moved_gaps(problem, state, chain, size)


@inlined
def moved_gaps(problem, state, chain, size):
    """Sum up the intervals' steps in `dpsi`, and with them the step of every node and gap."""
    for p in range(state.gap.shape[0]):
        chain.gap[p] = state.gap[p]
    for i in range(1, size + 1):
        h = problem.step[i - 1]
        bent = chain.dpsi[i]
        turn = chain.dpsi[i - 1] + 0.5 * bent + chain.dgamma[i]
        chain.dpsi[i] += chain.dpsi[i - 1]
        chain.dx[i] = chain.dx[i - 1] - h * state.sin[i] * turn
        chain.dy[i] = chain.dy[i - 1] + h * state.cos[i] * turn
        section, sheared = chain.dpsi[i], 0.0
        if is_wide(chain):
            beyond = 0.0
            if i < size:
                beyond = chain.dgamma[i + 1]
                bent += chain.dpsi[i + 1]
            elif size == problem.step.shape[0]:
                beyond = chain.dgamma[i]
            sheared = 0.5 * (chain.dgamma[i] + beyond)
            section += sheared if problem.printed_section else 0.0
        p = next_contact(state, -1, i)
        while p >= 0:
            arm_x, arm_y = state.px[p] - state.x[i], state.py[p] - state.y[i]
            moved_x = chain.dx[i] - arm_y * section
            moved_y = chain.dy[i] + arm_x * section
            chain.gap[p] = state.gap[p] + state.nx[p] * moved_x + state.ny[p] * moved_y
            if is_wide(chain):
                chain.gap[p] += state.deepens[p, 0] * sheared + state.deepens[p, 1] * bent
            p = next_contact(state, p, i)
