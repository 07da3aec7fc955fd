"""The working set of a finger in direct contact by an interior-point method: the safe way.

Each near point is held by a spring, ``c . dz + gap = s`` with ``s lambda`` the same for all, and
that common value falls from pass to pass (S. J. Wright, "Primal-Dual Interior-Point Methods", 1997,
ch. 6). One pass along the finger is one Newton step, and some ten to thirty of them separate the
contacts from the rest, however many nodes there are and wherever the contacts begin and end.
"""

from fastncm.kernels.cache import inlined, inner
from fastncm.sqp.chain_step import solve_chain

#: Newton steps at most; how clearly force and gap of each point must differ, relative to theirs.
_STEPS, _CLEAR = 50, 1e-6
#: Slack (finger lengths) to begin with where nothing lies in the target.
_SHALLOW = 1e-6
#: Part of the way to the boundary; the smallest factor by which ``s lambda`` falls, and the length
#: of a step after which it does.
_INSIDE, _FASTEST, _LONG = 0.99, 0.02, 0.9


@inlined
def _takes_part(state, k, size):
    return 1 <= state.node[k] <= size and (state.nx[k] != 0.0 or state.ny[k] != 0.0)


@inner
def _start(problem, d, state, chain, size):
    """Slacks and forces to begin with, from the deepest point held alone; where one point cannot
    hold the finger against the stiffness of the forces that there are, from these.

    Returns ``(passes, depth, force)``: how deep that is without forces, 0 where no point
    penetrates, and then nothing is held; and what holds it.
    """
    points = state.gap.shape[0]
    for k in range(points):
        chain.touching[k], chain.soft[k], chain.shift[k] = False, 0.0, 0.0
    solve_chain(problem, d, state, chain, size, 1.0)
    deepest, count = 1, 0
    for k in range(1, points):
        chain.slack[k] = chain.gap[k]
        if _takes_part(state, k, size):
            count += 1
            if chain.gap[k] < chain.gap[deepest] or not _takes_part(state, deepest, size):
                deepest = k
    depth = -chain.gap[deepest]
    if not depth > 0.0:
        return 1, 0.0, 0.0
    chain.touching[deepest] = True
    solve_chain(problem, d, state, chain, size, 1.0)
    force, held = chain.force[deepest], 0.0
    if not force > 0.0:
        depth = _SHALLOW
        for k in range(1, points):
            held += state.force[k]
            chain.slack[k] = state.gap[k]
            if _takes_part(state, k, size):
                depth = max(depth, -state.gap[k])
        force = held
    for k in range(1, points):
        chain.touching[k] = _takes_part(state, k, size)
        chain.slack[k] = max(chain.slack[k], 0.0) + depth
        chain.push[k] = max(force / count, state.force[k] if held > 0.0 else 0.0)
    return 2, depth, force


@inner
def _towards_boundary(state, chain):
    """Length of the step on which all forces and slacks stay positive, at most 1."""
    most = 1.0 / _INSIDE
    for k in range(1, state.gap.shape[0]):
        if chain.touching[k]:
            if chain.force[k] < chain.push[k]:
                most = min(most, chain.push[k] / (chain.push[k] - chain.force[k]))
            if chain.gap[k] < chain.slack[k]:
                most = min(most, chain.slack[k] / (chain.slack[k] - chain.gap[k]))
    return min(1.0, _INSIDE * most)


@inner
def separate(problem, d, state, chain, size):
    """Put into ``chain.touching`` the points that carry force in the solution of the subproblem, or
    where they do not separate clearly, those that carry more of it than their gap.

    Returns ``(whether the finger is pressed at all, passes)``.
    """
    points = state.gap.shape[0]
    passes, depth, force = _start(problem, d, state, chain, size)
    if depth == 0.0:
        return True, passes
    if not force > 0.0:
        return False, passes
    fall = 0.3
    for _ in range(_STEPS):
        passes += 1
        product, count = 0.0, 0
        for k in range(1, points):
            if chain.touching[k]:
                product += chain.push[k] * chain.slack[k]
                count += 1
        if not product > 0.0:
            break
        product *= fall / count
        for k in range(1, points):
            if chain.touching[k]:
                chain.soft[k] = chain.slack[k] / chain.push[k]
                chain.shift[k] = -chain.slack[k] - product / chain.push[k]
        solve_chain(problem, d, state, chain, size, 1.0)
        length = _towards_boundary(state, chain)
        largest = 0.0
        for k in range(1, points):
            if chain.touching[k]:
                chain.push[k] += length * (chain.force[k] - chain.push[k])
                chain.slack[k] += length * (chain.gap[k] - chain.slack[k])
                largest = max(largest, chain.push[k])
        fall = max(1.0 - length, _FASTEST)
        if length > _LONG:
            fall, clear = _FASTEST, True
            for k in range(1, points):
                if chain.touching[k]:
                    lesser = min(chain.push[k] / largest, chain.slack[k] / depth)
                    clear = clear and lesser < _CLEAR
            if clear:
                break
    largest = 0.0
    for k in range(1, points):
        if chain.touching[k]:
            largest = max(largest, chain.push[k])
    for k in range(1, points):
        chain.soft[k], chain.shift[k] = 0.0, 0.0
        if chain.touching[k]:
            chain.touching[k] = chain.push[k] * depth > chain.slack[k] * largest
    return True, passes
