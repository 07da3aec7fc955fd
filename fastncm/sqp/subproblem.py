"""The quadratic program of a finger in direct contact: step, multipliers and active set.

Solve with the working set held, change it (`sqp.working_set`), until no contact pulls and no point
penetrates. Each trial is one pass along the finger of O(N), and one or a few are the rule. Where
they do not settle, an interior-point method (`sqp.interior`) finds the set.
"""

import numpy as np

from fastncm.kernels.cache import inner
from fastncm.sqp.chain_step import solve_chain
from fastncm.sqp.interior import separate
from fastncm.sqp.working_set import NONE, change_working_set, count_wrong, lone_contact, penetrates

#: Passes of the working set, before and after the interior-point method.
_PASSES = 16
#: What rounding leaves of a gap, and of a force relative to the largest; and after the interior-
#: point method, of the deepest point and of the largest force.
_ROUNDING, _DEGENERATE = 1e-15, 1e-12
#: `solve_subproblem` found no working set.
UNSETTLED = -99


@inner
def _false_position(chain, ends, lone, side):
    """Move the only contact, `lone`, towards the `side` on which the finger penetrates.

    ends: (2, 2), the nodes known on either side of the contact's place, with the slopes of the gaps
    there; modified in place. Returns False where they say nothing.
    """
    low, high = ends[0], ends[1]
    here, there = (low, high) if side > 0 else (high, low)
    if here[0] != NONE and there[0] != NONE:
        there[1] *= 0.5  # Illinois: this end stays
    here[0], here[1] = lone, side * chain.gap[lone + side]
    if there[0] == NONE:
        return False
    apart = int(high[0] - low[0])
    if apart < 1:
        return False
    chain.touching[lone] = False
    if apart == 1:
        chain.touching[int(low[0])], chain.touching[int(high[0])] = True, True
        return True
    step = int(apart * low[1] / (low[1] - high[1]) + 0.5)
    chain.touching[int(low[0]) + min(max(step, 1), apart - 1)] = True
    return True


@inner
def _settle(problem, d, state, chain, size, slack, depth):
    """Change the working set until nothing is wrong with it.

    Returns ``(excess of negative pivots or UNSETTLED, passes)``.
    """
    points = chain.force.shape[0]
    end = size + 1 if size < problem.step.shape[0] else size + 2  # the tip has two corners
    target = problem.arc.shape[0] + 1
    ends = chain.ends
    ends[0, 0], ends[1, 0] = NONE, NONE
    for passes in range(1, _PASSES + 1):
        excess = solve_chain(problem, d, state, chain, size, 1.0)
        largest, total = 0.0, 0.0
        for k in range(points):
            largest = max(largest, abs(chain.force[k]))
            total += chain.force[k]
        if not np.isfinite(total):
            return UNSETTLED, passes
        wrong = count_wrong(chain, 1, end, slack * largest, depth)
        if wrong + count_wrong(chain, target, points, slack * largest, depth) == 0:
            return excess, passes
        lone, side = lone_contact(chain, 1, end, points, depth)
        if lone != NONE:
            if _false_position(chain, ends, lone, side):
                continue
            deepest = lone
            for k in range(1, end):
                if penetrates(chain, k, depth) and chain.gap[k] < chain.gap[deepest]:
                    deepest = k
            chain.touching[lone], chain.touching[deepest] = False, True
            continue
        change_working_set(chain, 1, end, slack * largest, depth)
        change_working_set(chain, target, points, slack * largest, depth)
    return UNSETTLED, _PASSES


@inner
def solve_subproblem(problem, d, state, chain, size):
    """Step and multipliers of the quadratic program about the evaluated state, left in `chain`.

    ``chain.touching`` is the working set to begin with, and the active set on return; the nodes up
    to `size` take part. Returns ``(excess of negative pivots or UNSETTLED, passes)``.
    """
    excess, passes = _settle(problem, d, state, chain, size, _ROUNDING, _ROUNDING)
    if excess != UNSETTLED:
        return excess, passes
    pressed, count = separate(problem, d, state, chain, size)
    passes += count
    if not pressed:
        return UNSETTLED, passes
    depth = 0.0
    for k in range(1, state.gap.shape[0]):
        if chain.touching[k]:
            depth = max(depth, -state.gap[k])
    depth = _ROUNDING + _DEGENERATE * depth
    excess, count = _settle(problem, d, state, chain, size, _DEGENERATE, depth)
    return excess if excess == 0 else UNSETTLED, passes + count
