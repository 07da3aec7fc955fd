"""Why a position of a finger in direct contact is not solved: what the row says instead.

Three things are told apart: the target has come through the clamp, where no finger can get out of
its way; the nodes are too far apart for the contact; or the branch of equilibria ends.
"""

from fastncm.kernels.cache import inner
from fastncm.path import surface_rows as rows
from fastncm.path.surface_free import base_overlap
from fastncm.path.surface_way import arrive, on_the_way, set_goal
from fastncm.sqp import status
from fastncm.sqp.surface_state import ROUNDING

#: Places between two positions at which the target is looked for in the clamp.
_PLACES = 64
#: A contact nearer to the clamp than so many intervals is not resolved, nor is one whose force was
#: in doubt by this part where it was solved last.
_INTERVALS, _DOUBTED = 2.0, 0.2


@inner
def _comes_through_clamp(problem, d, i, solved, walk, table):
    """Whether the target covers the clamp somewhere between the position `solved` (-1: the way to
    the first one is not known) and `i`."""
    for j in range(solved + 1, i):
        before = table[d, j, rows.STATUS]
        if before == status.INFEASIBLE or before == status.THROUGH_CLAMP:
            return True
    if i == 0:
        return False
    arrive(walk, problem.placement[d, i - 1], problem.base[d, i - 1])
    set_goal(problem, d, walk, problem.placement[d, i], problem.base[d, i])
    for place in range(_PLACES):
        x, y, angle = on_the_way(problem, d, walk, (place + 0.5) / _PLACES)
        if base_overlap(problem, d, x, y, angle, walk.straight) > ROUNDING:
            return True
    return False


@inner
def _is_too_coarse(problem, d, solved, walk, table):
    """Whether the nodes were too far apart for the contact in the last shape that was found, or at
    the position `solved` before."""
    kept = walk.kept
    for k in range(kept.force.shape[0]):
        if kept.force[k] > 0.0:
            own = k <= problem.arc.shape[0]
            s = problem.arc[kept.node[k]] if own else kept.seen_x[k]
            if s < _INTERVALS * problem.step[0]:
                return True
    return solved >= 0 and table[d, solved, rows.ESTIMATE] > _DOUBTED


@inner
def why_unsolved(problem, d, i, solved, result, walk, table):
    """The status of position `i`, which is not solved: more than `result`, that of the last try.

    solved: the last position before that is, or -1; table: (D, P, COLUMNS) rows so far. Changes
    where the target is in `walk`.
    """
    if result == status.INFEASIBLE:
        return result
    if _comes_through_clamp(problem, d, i, solved, walk, table):
        return status.THROUGH_CLAMP
    if _is_too_coarse(problem, d, solved, walk, table):
        return status.TOO_COARSE
    return result
