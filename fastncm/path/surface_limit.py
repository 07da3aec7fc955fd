"""The friction up to which fingers in direct contact reach positions behind the ends of their
branches: the critical one, where friction locks."""

import numpy as np

from fastncm.kernels.nodal import NodalProblem
from fastncm.path import surface_rows as rows
from fastncm.path.surface_trace import SurfaceTrace, make_surface_trace, trace_surfaces
from fastncm.path.surface_way import AFRESH, Walk, make_walk
from fastncm.sqp import status

#: To what share of mu the critical friction is found.
_CLOSE = 5e-7
#: Part of mu below which it is not friction that locks.
_SLIGHT = 1e-3
#: Iterations times nodes after which it is not looked for any further.
_MOST_WORK = 2_000_000


def find_critical_friction(problem: NodalProblem, tolerance: float, trace: SurfaceTrace) -> None:
    """Write the critical friction into the first row of each finger with friction that is not on
    the branch from first touch, which has ended before; by bisection, each time from the path's
    start. A row that is reached with less friction, and to which no snap leads, has no
    equilibrium."""
    state, lost = trace.rows[:, :, rows.STATUS], trace.rows[:, :, rows.LOST]
    behind = (state == status.BRANCH_ENDS) | ((state == status.CONVERGED) & (lost == AFRESH))
    off = (state > status.NO_CONTACT) | behind
    first = off.argmax(axis=1)
    found = behind[np.arange(len(first)), first] & (problem.mu > 0.0)
    designs = np.flatnonzero(found)
    for d in designs:
        part = select_fingers(problem, slice(d, d + 1))
        part = part._replace(positions=part.positions[:, : first[d] + 1].copy(), mu=part.mu.copy())
        walk, way = make_walk(part, only_follows=True), make_surface_trace(part, shapes=False)
        low, high = 0.0, float(problem.mu[d])
        close = _CLOSE * high
        trial, row, nodes = close, trace.rows[d, first[d]], len(problem.arc)
        work = row[rows.ITERATIONS] * nodes
        while high - low > close and work < _MOST_WORK:
            part.mu[0] = trial
            if _gets_through(part, walk, tolerance, way):
                low = trial
            else:
                high = trial
            trial = 0.5 * (low + high)
            work += way.rows[0, :, rows.ITERATIONS].sum() * nodes
        if high - low > close or 0.0 < low < _SLIGHT * problem.mu[d]:
            continue
        row[rows.CRITICAL] = low
        snaps = row[rows.RELEASED] > 0.0 or np.isnan(row[rows.END])
        if low > 0.0 and not snaps:  # it locks: what is found beyond is no answer
            row[rows.STATUS] = status.NO_EQUILIBRIUM


def select_fingers(problem: NodalProblem, chosen: slice) -> NodalProblem:
    """The problem of some of its fingers."""
    arrays = {
        name: getattr(problem, name)[chosen]
        for name in NodalProblem._fields
        if isinstance(getattr(problem, name), np.ndarray) and name not in ("step", "arc")
    }
    return problem._replace(**arrays)


def _gets_through(part: NodalProblem, walk: Walk, tolerance: float, way: SurfaceTrace) -> bool:
    """Whether the one finger of `part` is followed to the last position, in contact."""
    trace_surfaces(part, walk, tolerance, way)
    return bool(way.rows[0, -1, rows.STATUS] == status.CONVERGED)
