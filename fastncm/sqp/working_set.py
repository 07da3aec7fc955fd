"""The quadratic program of a finger in direct contact: many contacts enter and leave at once.

Primal-dual active set: solve with the working set held, let go of the contacts that pull, take in
the points that penetrate, until none does. Each trial is one pass along the finger of O(N). What
changes at once is bounded by what a string would do: where a finger is held down beyond the true
end of its contact it pulls there, and where it is held too short it presses, by the force per node
next to the end times the number of nodes too many or too few. So the ends of a contact come out
after a few passes however many nodes they move over. Where that does not settle, nodes change one
by one, the last first, which ends for any P-matrix (K. G. Murty, 1974; Judice & Pires, 1994).
"""

import numpy as np

from fastncm.kernels.cache import inlined, inner
from fastncm.sqp.flexibility import carry_back, carry_flexibility
from fastncm.sqp.printed_section import solve_printed_chain

#: Passes that may change many nodes, and passes altogether, before the quadratic program gives up.
_AT_ONCE = 30
_PASSES = 200
#: Contacts of a run beyond its end that must stand for a force per node.
_RUN = 4
#: What rounding leaves of a gap, and of a force relative to the largest.
_ROUNDING = 1e-15
#: `solve_subproblem` found no working set.
UNSETTLED = -99


@inner
def solve_chain(problem, d, state, chain, size, own):
    """Step and multipliers with the working set ``chain.touching`` held; own: 1 for a Newton step,
    0 for the answer to a target that comes nearer by 1 at all contacts.

    Returns the excess of negative pivots.
    """
    if problem.printed_section:
        return solve_printed_chain(problem, d, state, chain, size, own)
    excess = carry_flexibility(problem, d, state, chain, size, own)
    carry_back(problem, d, state, chain, size, own)
    return excess


@inlined
def _pulls(chain, k, largest):
    return chain.touching[k] and chain.force[k] < -_ROUNDING * largest


@inlined
def _penetrates(chain, k):
    return not chain.touching[k] and chain.gap[k] < -_ROUNDING


@inlined
def _overhang(chain, end, inward):
    """By how many nodes a run of contacts is too long (> 0) or too short (< 0) at its `end`, as a
    string."""
    share = 0.5 * (chain.force[end + inward] + chain.force[end + 2 * inward])
    if share <= 0.0:
        return 1
    nodes = np.ceil(-chain.force[end] / share)
    return int(min(max(nodes, -chain.force.shape[0]), chain.force.shape[0]))


@inlined
def _is_run(chain, end, inward, first, beyond):
    """True where `_RUN` contacts stand side by side from `end` on, within [first, beyond)."""
    if not first <= end + (_RUN - 1) * inward < beyond or not first <= end < beyond:
        return False
    for i in range(_RUN):
        if not chain.touching[end + i * inward]:
            return False
    return True


@inlined
def _shorten(chain, end, inward, first, beyond):
    """Let go of a run's contacts from its `end` on that a string would not hold; run: [first,
    beyond)."""
    for i in range(_overhang(chain, end, inward)):
        if first <= end + i * inward < beyond:
            chain.mark[end + i * inward] = False


@inlined
def _lengthen(chain, end, outward, first, beyond):
    """Take in the points of the zone [first, beyond) that a string would touch next to a run's
    `end`."""
    missing = -_overhang(chain, end, -outward)
    for i in range(1, missing + 1):
        if first <= end + i * outward < beyond:
            chain.mark[end + i * outward] = True
    return missing > 0


@inner
def change_working_set(chain, begin, end, largest):
    """One change of the working set among the points [begin, end), which stand side by side:
    contacts that pull leave, points that penetrate enter.

    Returns how many of either there are; the set stays as it is where there are none.
    """
    touching, mark, gap = chain.touching, chain.mark, chain.gap
    wrong = 0
    for k in range(begin, end):
        mark[k] = touching[k]
    k = begin
    while k < end:
        first = k
        if touching[k]:
            while k < end and touching[k]:
                if _pulls(chain, k, largest):
                    wrong += 1
                    mark[k] = False
                k += 1
            if _pulls(chain, first, largest) and k - first >= _RUN:
                _shorten(chain, first, 1, first, k)
            if _pulls(chain, k - 1, largest) and k - first >= _RUN:
                _shorten(chain, k - 1, -1, first, k)
        elif _penetrates(chain, k):
            worst = k
            while k < end and _penetrates(chain, k):
                wrong += 1
                if gap[k] < gap[worst]:
                    worst = k
                k += 1
            grown = False
            if _is_run(chain, first - 1, -1, begin, end):
                grown = _lengthen(chain, first - 1, 1, first, k)
            if _is_run(chain, k, 1, begin, end):
                grown = _lengthen(chain, k, -1, first, k) or grown
            if not grown:
                mark[worst] = True
        else:
            k += 1
    if wrong > 0:
        for k in range(begin, end):
            touching[k] = mark[k]
    return wrong


@inner
def _change_one(chain, largest):
    """Change the last point of those that are wrong. Returns whether there was one."""
    for k in range(chain.force.shape[0] - 1, 0, -1):
        if _pulls(chain, k, largest) or _penetrates(chain, k):
            chain.touching[k] = not chain.touching[k]
            return True
    return False


@inner
def solve_subproblem(problem, d, state, chain, size):
    """Step and multipliers of the quadratic program about the evaluated state, left in `chain`.

    ``chain.touching`` is the working set to begin with, and the active set on return; the nodes up
    to `size` take part. Returns ``(excess of negative pivots or UNSETTLED, passes)``.
    """
    nodes, points = problem.arc.shape[0], chain.force.shape[0]
    for passes in range(1, _PASSES + 1):
        excess = solve_chain(problem, d, state, chain, size, 1.0)
        largest, total = 0.0, 0.0
        for k in range(points):
            largest = max(largest, abs(chain.force[k]))
            total += chain.force[k]
        if not np.isfinite(total):
            return UNSETTLED, passes
        if passes <= _AT_ONCE:
            wrong = change_working_set(chain, 1, nodes + 1, largest)
            settled = wrong + change_working_set(chain, nodes + 1, points, largest) == 0
        else:
            settled = not _change_one(chain, largest)
        if settled:
            return excess, passes
    return UNSETTLED, _PASSES
