"""The Newton step of `sqp.flexibility` where contacts depend on the shear on both sides of a node.

So it is where the section turns by ``psi + gamma``, as printed (Lan & Lee 2008, (6)), and where a
point of the target touches the finger's side: the force that it gives changes the shear at its
node, and with it the side's slope, hence its own direction. Left out of the derivatives, that makes
the steps of Newton's method many, the more so the shorter the intervals are.

The bending u and the shear angle v of the interval before a node are carried along, and the
contacts of a node are held in the interval after it. The variables of interval i are ``(x, y, psi,
u, v)`` of node i - 1, and u and v of the interval.
"""

from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.nodal import next_contact
from fastncm.sqp.flexibility import (
    _ARM,
    _CONTACT,
    _GRIP,
    _HELD,
    _NORMAL,
    contact_terms,
    list_contacts,
    moved_gaps,
)

#: Variables of a node, and of an interval.
_NODE, _ALL = 5, 7


@inlined
def _bend(wide, out, a, b, k, constant, hold):
    """Add the term ``-k a (b . dz)``, or hold ``b . dz = -constant`` by a force along `a`, through
    a spring of the compliance `k`.

    Returns the excess of negative pivots.
    """
    flexibility, step, column = wide.flexibility, wide.step, wide.column
    shift, pivot, spread, same = constant, 0.0, 0.0, 0.0
    for i in range(_ALL):
        column[i] = 0.0
        row = 0.0
        for j in range(_ALL):
            column[i] += flexibility[i, j] * a[j]
            row += b[j] * flexibility[j, i]
        out[1 + i] = row
        shift += b[i] * step[i]
    for i in range(_ALL):
        pivot += b[i] * column[i]
        spread += abs(b[i] * column[i])
        same += a[i] * b[i]
    if hold:
        inverse = 1.0 / (pivot + k) if abs(pivot + k) > _HELD * spread else 0.0
    else:
        inverse = 1.0 / (1.0 + k * pivot)
    weight = inverse if hold else k * inverse
    for i in range(_ALL):
        step[i] -= weight * column[i] * shift
        for j in range(_ALL):
            flexibility[i, j] -= weight * column[i] * out[1 + j]
    out[0], out[1 + _ALL] = shift, inverse
    if inverse >= 0.0:
        return 0
    return 1 if k * same < 0.0 and not hold else -1


@inlined
def _answer(kept, f):
    total = kept[0]
    for i in range(_ALL):
        total += kept[1 + i] * f[i]
    return total * kept[1 + _ALL]


@inlined
def _spread(problem, v, before, along_x, along_y, out):
    """A vector over a node's (x, y, section) as one over the interval's variables; before: of the
    node before the interval, else of the one after it, the last."""
    out[0], out[1], out[2], out[3] = v[0], v[1], v[2], 0.0
    half = 0.5 * v[2] if problem.printed_section else 0.0
    if before:
        out[4], out[5], out[6] = half, 0.0, half
    else:
        turn = along_x * v[0] + along_y * v[1]
        out[2] += turn
        out[4], out[5], out[6] = 0.0, 0.5 * turn + v[2], turn + 2.0 * half


@inlined
def _add_side(by, sense, before, out):
    """Add what the side's shape around the node does: `by` (2,) of its mean shear angle and of its
    bending."""
    bent, sheared = sense * by[1], sense * by[0]
    if before:
        out[3] += bent
        out[4] += 0.5 * sheared
        out[5] += bent
        out[6] += 0.5 * sheared
    else:
        out[5] += bent
        out[6] += sheared


@inner
def _hold_node(problem, d, state, chain, j, interval, own):
    """Add the terms of all contacts on node `j`. Returns the excess of negative pivots."""
    wide, mu, excess = chain.wide, problem.mu[d], 0
    h = problem.step[interval - 1]
    along_x, along_y = -h * state.sin[interval], h * state.cos[interval]
    before = j < interval
    p = next_contact(state, -1, j)
    while p >= 0:
        force = state.force[p]
        if force != 0.0 or chain.touching[p]:
            c, b, a, e, v, w = contact_terms(state, p, j, mu)
            if force != 0.0:
                _spread(problem, e, before, along_x, along_y, wide.left)
                _spread(problem, v, before, along_x, along_y, wide.right)
                _add_side(state.tilts[p], -1.0, before, wide.right)
                out = wide.terms[p, _NORMAL]
                n = _bend(wide, out, wide.left, wide.right, force, 0.0, False)
                _spread(problem, (0.0, 0.0, 1.0), before, along_x, along_y, wide.left)
                _spread(problem, w, before, along_x, along_y, wide.right)
                out = wide.terms[p, _ARM]
                o = _bend(wide, out, wide.left, wide.right, force, 0.0, False)
                # of a target's point, neither is symmetric: as if both only took away
                excess += n + o if p < state.first.shape[0] + 1 else -abs(n) - abs(o)
            if chain.touching[p]:
                _spread(problem, a, before, along_x, along_y, wide.left)
                _spread(problem, c, before, along_x, along_y, wide.right)
                _add_side(state.deepens[p], 1.0, before, wide.right)
                gap = state.gap[p] + chain.shift[p] if own == 1.0 else -1.0
                out = wide.terms[p, _CONTACT]
                excess += _bend(wide, out, wide.left, wide.right, chain.soft[p], gap, True)
                if state.stuck[p]:
                    _spread(problem, b, before, along_x, along_y, wide.left)
                    slide = state.slide[p] if own == 1.0 else 0.0
                    out = wide.terms[p, _GRIP]
                    excess += _bend(wide, out, wide.left, wide.left, 0.0, slide, True)
        p = next_contact(state, p, j)
    return excess


@inner
def _release_node(problem, d, state, chain, j, interval):
    """The way back over `_hold_node`: ``wide.force`` is that on the interval's variables."""
    wide, mu, f = chain.wide, problem.mu[d], chain.wide.force
    h = problem.step[interval - 1]
    along_x, along_y = -h * state.sin[interval], h * state.cos[interval]
    before = j < interval
    count = list_contacts(state, chain, j)
    while count > 0:
        count -= 1
        p = chain.order[count]
        force = state.force[p]
        chain.force[p], chain.shear[p] = 0.0, 0.0
        if force == 0.0 and not chain.touching[p]:
            continue
        c, b, a, e, v, w = contact_terms(state, p, j, mu)
        if chain.touching[p]:
            if state.stuck[p]:
                chain.shear[p] = -_answer(wide.terms[p, _GRIP], f)
                _spread(problem, b, before, along_x, along_y, wide.left)
                _push(f, wide.left, chain.shear[p])
            chain.force[p] = -_answer(wide.terms[p, _CONTACT], f)
            _spread(problem, a, before, along_x, along_y, wide.left)
            _push(f, wide.left, chain.force[p])
        if force != 0.0:
            _spread(problem, (0.0, 0.0, 1.0), before, along_x, along_y, wide.left)
            _push(f, wide.left, -force * _answer(wide.terms[p, _ARM], f))
            _spread(problem, e, before, along_x, along_y, wide.left)
            _push(f, wide.left, -force * _answer(wide.terms[p, _NORMAL], f))


@inlined
def _push(f, along, by):
    for i in range(_ALL):
        f[i] += by * along[i]


@inlined
def _turn_of_interval(out):
    out[0], out[1], out[2], out[3], out[4], out[5], out[6] = 0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 1.0


@inner
def solve_wide_chain(problem, d, state, chain, size, own):
    """`sqp.chain_step.solve_chain` with these variables; the last node's contacts need the interval
    after it, if there is one."""
    wide, f = chain.wide, chain.wide.force
    intervals = problem.step.shape[0]
    node, m = wide.node, wide.node_step
    excess = 0
    for i in range(_NODE):
        m[i] = 0.0
        for j in range(_NODE):
            node[i, j] = 0.0
    for i in range(1, size + 1):
        h = problem.step[i - 1]
        along_x, along_y = -h * state.sin[i], h * state.cos[i]
        for r in range(_ALL):
            for c in range(_ALL):
                wide.flexibility[r, c] = node[r, c] if r < _NODE and c < _NODE else 0.0
            wide.step[r] = m[r] if r < _NODE else 0.0
        wide.flexibility[5, 5] = problem.flexibility[d, i - 1]
        wide.flexibility[6, 6] = problem.shear_flexibility[d, i - 1]
        wide.step[5] = own * (state.psi[i - 1] - state.psi[i])
        wide.step[6] = -own * state.gamma[i]
        _turn_of_interval(wide.left)
        k = h * (state.fx[i] * state.cos[i] + state.fy[i] * state.sin[i])
        excess += _bend(wide, wide.turn[i], wide.left, wide.left, k, 0.0, False)
        if i > 1:
            excess += _hold_node(problem, d, state, chain, i - 1, i, own)
        if i == intervals:
            excess += _hold_node(problem, d, state, chain, i, i, own)
        _to_next_node(wide, along_x, along_y)
    for i in range(_NODE):
        wide.node_force[i] = 0.0
    for i in range(size, 0, -1):
        h = problem.step[i - 1]
        along_x, along_y = -h * state.sin[i], h * state.cos[i]
        q = wide.node_force
        couple = along_x * q[0] + along_y * q[1]
        f[0], f[1], f[2], f[3], f[4] = q[0], q[1], q[2] + couple, 0.0, 0.0
        f[5], f[6] = 0.5 * couple + q[2] + q[3], couple + q[4]
        if i == intervals:
            _release_node(problem, d, state, chain, i, i)
        if i > 1:
            _release_node(problem, d, state, chain, i - 1, i)
        _turn_of_interval(wide.left)
        k = h * (state.fx[i] * state.cos[i] + state.fy[i] * state.sin[i])
        _push(f, wide.left, -k * _answer(wide.turn[i], f))
        chain.dpsi[i] = own * (state.psi[i - 1] - state.psi[i])
        chain.dpsi[i] += problem.flexibility[d, i - 1] * f[5]
        chain.dgamma[i] = problem.shear_flexibility[d, i - 1] * f[6] - own * state.gamma[i]
        for j in range(_NODE):
            wide.node_force[j] = f[j]
    moved_gaps(problem, state, chain, size)
    return excess


@inlined
def _to_next_node(wide, along_x, along_y):
    """Flexibility and step of the node after the interval from those of its variables."""
    # x += along_x (psi + u / 2 + v), y likewise, psi += u: first the columns, then the rows
    big, step, node = wide.flexibility, wide.step, wide.node
    for r in range(_ALL):
        turn = big[r, 2] + 0.5 * big[r, 5] + big[r, 6]
        big[r, 0] += along_x * turn
        big[r, 1] += along_y * turn
        big[r, 2] += big[r, 5]
        big[r, 3], big[r, 4] = big[r, 5], big[r, 6]
    turn = step[2] + 0.5 * step[5] + step[6]
    step[0] += along_x * turn
    step[1] += along_y * turn
    step[2] += step[5]
    step[3], step[4] = step[5], step[6]
    for c in range(_NODE):
        turn = big[2, c] + 0.5 * big[5, c] + big[6, c]
        node[0, c] = big[0, c] + along_x * turn
        node[1, c] = big[1, c] + along_y * turn
        node[2, c] = big[2, c] + big[5, c]
        node[3, c], node[4, c] = big[5, c], big[6, c]
        wide.node_step[c] = step[c]
