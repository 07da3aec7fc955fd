"""Where a branch ends in the lanes: what the finger snaps to, and what is said of it."""

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.gap import closest_gap
from fastncm.path import newton
from fastncm.path.slip import slip
from fastncm.path.walk import stored_energy

#: Move of the target (in finger lengths) from which on none is tried that is shorter: a branch that
#: does not get further ends there.
SHORTEST_MOVE = 1e-9
#: How far from the end of a branch (in finger lengths) what is known behind it is asked for.
_NEAR_END = 1e-7

#: What is said of the end of a branch of equilibria with friction: the row that failed first,
#: beyond it; the target's position at the end; the friction up to which the finger slides at that
#: row (NaN: not known, or not asked, since the path goes on; 0: not sought yet); and the energy
#: that a snap to the other equilibrium there releases (NaN: there is none; while the friction is
#: not sought yet: what is stored at the end). All zero where no branch ends.
END_ROW, END_POSITION, END_MU, END_ENERGY = range(4)
ENDS = 4


@inlined
def note_end(end, row, position, energy):
    """Write into `end` (ENDS,) that the branch ends at `position`, on the way to `row`, and the
    energy that a snap releases there (NaN: there is none). The critical friction is not known."""
    end[END_ROW], end[END_POSITION] = row, position
    end[END_MU], end[END_ENERGY] = np.nan, energy


@inlined
def note_loss(end, row, position, stored):
    """Write into `end` (ENDS,) that a branch with friction is lost at `position`, with the energy
    `stored`, unless that is told of an earlier row. For `path.limit` to explain."""
    if end[END_POSITION] == 0.0 or np.isnan(end[END_MU]):
        note_end(end, row, position, stored)
        end[END_MU] = 0.0


@inner
def _note_snap(i, lanes, walk, lane, trace):
    """Say that the finger snaps on the way to position `i`, where, and what that releases."""
    end = trace.ends[lanes.design[lane]]
    released = stored_energy(walk, lane)
    for k in range(lanes.u.shape[0]):
        released -= 0.5 * lanes.u[k, lane] ** 2
    if end[END_POSITION] == 0.0 and released > 0.0:
        note_end(end, i, walk.t[lane], released)


@inner
def go_over(i, over, lanes, walk, trace):
    """Take what is found beyond the end of a branch in the lanes with friction whose designs may go
    `over` it (D,), and say that the finger snaps there.

    It is found from the shortest move, or where that leads nowhere from the shortest that did.
    """
    for lane in range(LANES):
        if not walk.falls[lane] or lanes.mu[lane] == 0.0 or not over[lanes.design[lane]]:
            continue
        if walk.over[lane] or abs(lanes.t[lane] - walk.t[lane]) <= SHORTEST_MOVE:
            lanes.good[lane] = True
            _note_snap(i, lanes, walk, lane, trace)


@inner
def snap_back(problem, i, behind, lanes, walk, tolerance, most, trace):
    """Solve the lanes that failed from the state that is known `behind` the end of their branch; or
    from the straight finger, where only the jaw's far side keeps it from being free: there the
    finger has lost its hold and has snapped back behind the target.

    Only from where no move gets further, which is the place that ``trace.ends`` tells. behind:
    `path.states.States` of all designs, or of none; most: Newton steps.
    """
    any_snaps = False
    for lane in range(LANES):
        walk.busy[lane] = lanes.active[lane]
        lanes.active[lane] = lanes.active[lane] and not lanes.good[lane]
        if not lanes.active[lane]:
            continue
        d, t = lanes.design[lane], lanes.t[lane]
        lanes.active[lane] = abs(t - walk.t[lane]) <= SHORTEST_MOVE
        if not lanes.active[lane]:
            continue
        gap = closest_gap(problem.kind, -1, problem.jaw, problem.target, d, t, 1.0, 0.0, 1.0, 0.0)
        feature = gap[c.FEATURE]
        far = feature == c.ON_RETURN or feature == c.FAR_RETURN or feature == c.A_BACK
        known = behind.good.shape[0] > 0 and behind.good[d] and abs(behind.t[d] - t) <= _NEAR_END
        lanes.active[lane] = far or known
        if far or known:
            any_snaps = True
            for k in range(lanes.u.shape[0]):
                lanes.u[k, lane] = behind.u[d, k] if known else 0.0
            dragged = (gap[c.GY] <= 0.0) == (t > walk.t[lane])
            lanes.side[lane] = lanes.mu[lane] if dragged else -lanes.mu[lane]
            lanes.side[lane] = behind.side[d] if known else lanes.side[lane]
            lanes.sticks[lane] = False
            lanes.force[lane] = behind.force[d] if known else 0.0
            lanes.rub[lane] = lanes.side[lane] * lanes.force[lane]
    if any_snaps:
        newton.correct(problem, lanes, tolerance, most)
        for lane in range(LANES):
            if lanes.active[lane] and lanes.rubs[0]:
                lanes.slipped[lane] = slip(problem, lanes, lane)
            if lanes.active[lane] and lanes.good[lane]:
                _note_snap(i, lanes, walk, lane, trace)
    for lane in range(LANES):
        lanes.active[lane] = walk.busy[lane]
