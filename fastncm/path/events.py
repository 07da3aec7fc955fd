"""Events between the positions of a path: first touch, loss of contact, change of the contact
feature.

The peak of the insertion force is often one of them (the contact reaches the jaw's corner a): a
kink or a jump, which no grid of positions hits. Each is found by Newton's method in the target's
position, on the branch whose feature is held although the contact may have passed its end, so that
everything is smooth; all events of a chunk of designs at once.
"""

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.problem import Problem
from fastncm.path import rows
from fastncm.path.boundary import boundary
from fastncm.path.review import BEGINS, CHANGES, ENDS, Review
from fastncm.path.run import solve_states
from fastncm.path.snap import END_ENERGY, END_MU, END_POSITION, END_ROW
from fastncm.path.states import States, make_states, some
from fastncm.path.touch import locate_touches
from fastncm.path.trace import Trace
from fastncm.sqp import status

Array = np.ndarray

#: Newton steps in the target's position, and the length of a step (finger lengths) that is the
#: last: what it leaves is of the order of its square. (A limit near the rounding error would be met
#: or not by chance.)
_STEPS = 12
_LAST_STEP = 1e-9
#: KKT residual of the states at events: they are few, and a peak is quoted to more digits than a
#: row.
_TIGHT = 1e-12


def locate_events(problem: Problem, tolerance: float, trace: Trace, seen: Review) -> None:
    """Locate the events of all designs of a solved trace, and write their rows behind its
    positions. seen: its `review`."""
    positions = problem.positions.shape[1]
    tolerance = min(tolerance, _TIGHT)
    begins, ends, changes = (
        (seen.design[seen.event == event], seen.interval[seen.event == event])
        for event in (BEGINS, ENDS, CHANGES)
    )
    found = [
        _touches(problem, tolerance, trace, rows.TOUCH, *begins),
        _touches(problem, tolerance, trace, rows.RELEASE, *ends),
        *_changes(problem, tolerance, trace, positions, *changes),
    ]
    _append(trace, positions, [states for states in found if len(states.t)])


def _touches(
    problem: Problem, tolerance: float, trace: Trace, kind: int, design: Array, interval: Array
) -> States:
    """Undeformed fingers where contact begins or ends: no force, but its rate."""
    before, after = problem.positions[design, interval], problem.positions[design, interval + 1]
    if kind == rows.RELEASE:
        before, after = after, before
    t = locate_touches(problem, design, before, after)
    states = make_states(design, t, np.full(len(t), -1), trace.shapes.shape[2])
    if not len(t):
        return states
    touching = interval + 1 if kind == rows.TOUCH else interval
    states.side[:] = trace.rows[design, touching, rows.SIDE]
    solve_states(problem, tolerance, states)
    # where two features touch at once, that of the row beside goes on without a kink
    beside = np.minimum(trace.rows[design, touching, rows.FEATURE], c.VOID)
    doubtful = np.flatnonzero((beside != states.row[:, rows.FEATURE]) & (beside < c.VOID))
    if len(doubtful):
        held = some(states, doubtful)
        held.hold[:] = beside[doubtful]
        solve_states(problem, tolerance, held)
        same = np.abs(held.u).max(axis=1) <= _LAST_STEP
        for mine, new in zip(states, held, strict=True):
            mine[doubtful[same]] = new[same]
    # solved where there is nothing to solve yet: what counts are the rates; the rest is rounding
    states.u[:] = 0.0
    for column in (rows.FORCE, rows.ENERGY, rows.STRAIN, rows.RESIDUAL, rows.ESTIMATE, rows.RUB):
        states.row[:, column] = 0.0
    states.row[:, rows.KIND], states.row[:, rows.INTERVAL] = kind, interval
    return states


def _changes(
    problem: Problem,
    tolerance: float,
    trace: Trace,
    positions: int,
    design: Array,
    interval: Array,
) -> tuple[States, States, States]:
    """States just before and just after the changes of feature in the intervals, those that were
    found, and the states behind a snap."""
    goal = trace.rows[design, interval + 1, rows.FEATURE].astype(np.int64)
    near, far = problem.positions[design, interval], problem.positions[design, interval + 1]
    held = trace.rows[design, interval, rows.FEATURE]
    side_after = trace.rows[design, interval + 1, rows.SIDE]
    states = make_states(design, near, held, trace.shapes.shape[2])
    states.u[:] = trace.shapes[design, interval]
    states.force[:] = trace.rows[design, interval, rows.FORCE]
    states.side[:] = trace.rows[design, interval, rows.SIDE]
    located = _walk_to_change(problem, tolerance, states, goal, near, far)
    early = located & ((states.t - near) / (far - near) > 1.0)
    interval = interval.copy()
    if early.any():
        _mend_early_rows(problem, tolerance, trace, some(states, early), interval[early] + 1)
        interval[early] += 1
    before = some(states, located)
    after = some(states, located)
    after.hold[:] = goal[located]
    after.side[:] = side_after[located]
    for side, kind in ((before, rows.BEFORE_CHANGE), (after, rows.AFTER_CHANGE)):
        if len(side.t):
            solve_states(problem, tolerance, side)
        side.row[:, rows.KIND], side.row[:, rows.INTERVAL] = kind, interval[located]
    snaps, both = before.good & ~after.good, before.good & after.good
    behind = _note_snaps(problem, tolerance, trace, positions, some(before, snaps))
    return some(before, both | snaps), some(after, both), behind


def _note_snaps(
    problem: Problem, tolerance: float, trace: Trace, positions: int, states: States
) -> States:
    """The branch of equilibria ends at `states` (S,): beyond its change of feature it turns back.

    The finger snaps to the equilibrium that the row behind is of, followed back to there: those are
    returned. The first snap of a path is told. Where no energy is released to such an equilibrium
    with friction, the rows behind are of another branch than that from first touch, and
    NO_EQUILIBRIUM until contact is lost and begins again.
    """
    d, row = states.design, states.row[:, rows.INTERVAL].astype(np.int64) + 1
    behind = make_states(d, states.t, np.full(len(d), -1), trace.shapes.shape[2])
    behind.u[:] = trace.shapes[d, row]
    behind.force[:] = trace.rows[d, row, rows.FORCE]
    behind.side[:] = trace.rows[d, row, rows.SIDE]
    if len(d):
        solve_states(problem, tolerance, behind)
    released = states.row[:, rows.ENERGY] - behind.row[:, rows.ENERGY]
    falls = behind.good & (released > _LAST_STEP * states.row[:, rows.ENERGY])
    behind.row[:, rows.KIND], behind.row[:, rows.INTERVAL] = rows.AFTER_CHANGE, row - 1
    first = falls & (trace.ends[d, END_POSITION] == 0.0)
    told = d[first]
    trace.ends[told, END_ROW], trace.ends[told, END_POSITION] = row[first], states.t[first]
    trace.ends[told, END_ENERGY], trace.ends[told, END_MU] = released[first], np.nan
    for lost in np.flatnonzero(~falls & (problem.mu[d] > 0.0)):
        if trace.ends[d[lost], END_POSITION] == 0.0:
            stored = states.row[lost, rows.ENERGY]
            trace.ends[d[lost]] = row[lost], states.t[lost], 0.0, stored
        state = trace.rows[d[lost], row[lost] : positions, rows.STATUS]
        free = np.flatnonzero(state == status.NO_CONTACT)
        state[: free[0] if len(free) else None] = status.NO_EQUILIBRIUM
    return some(behind, falls)


def _walk_to_change(
    problem: Problem, tolerance: float, states: States, goal: Array, near: Array, far: Array
) -> Array:
    """Move the targets of `states` to where their held features end; returns which got there.

    A state is lost without a boundary, and with a step much longer than the interval, which is far
    outside of what the linearisation can tell. The change may lie behind the interval: see
    `_mend_early_rows`.
    """
    located = np.zeros(len(goal), dtype=bool)
    pending = np.arange(len(goal))
    for _ in range(_STEPS):
        if not len(pending):
            break
        moving = states if len(pending) == len(goal) else some(states, pending)
        solve_states(problem, tolerance, moving)
        pose = moving.row[:, [rows.TIP_X, rows.TIP_Y, rows.TIP_ANGLE]]
        d = moving.design
        e, by_pose = boundary(
            moving.hold, goal[pending], problem.jaw[d], problem.target[d], moving.t, pose
        )
        slope = (by_pose * moving.pose_rate).sum(axis=1) - by_pose[:, 0]
        move = -e / np.where(slope == 0.0, np.nan, slope)
        reach = 4.0 * np.abs(far[pending] - near[pending])
        keep = moving.good & (np.abs(move) < reach)  # False for NaN
        move = np.where(keep, move, 0.0)
        moving.t[:] += move
        moving.force[:] += move * moving.row[:, rows.FORCE_RATE]
        moving.u[:] += move[:, None] * moving.u_rate
        if moving is not states:
            for mine, new in zip(states, moving, strict=True):
                mine[pending] = new
        share = (moving.t - near[pending]) / (far[pending] - near[pending])
        there = keep & (np.abs(move) <= _LAST_STEP)
        located[pending[there]] = ((-_LAST_STEP < share) & (share < 2.0))[there]
        pending = pending[keep & ~there]
    return located


def _mend_early_rows(
    problem: Problem, tolerance: float, trace: Trace, states: States, i: Array
) -> None:
    """Solve the rows `i` again whose feature turned out to change only behind them.

    Close to a jump both features are in equilibrium; the row had left the branch too early.
    """
    states.t[:] = problem.positions[states.design, i]
    solve_states(problem, tolerance, states)
    d, i = states.design[states.good], i[states.good]
    trace.rows[d, i] = states.row[states.good]
    trace.shapes[d, i] = states.u[states.good]


def _append(trace: Trace, positions: int, found: list[States]) -> None:
    """Write all events into the slots of their designs, in the order of the path, as many as
    there is room for."""
    if not found:
        return
    design = np.concatenate([states.design for states in found])
    row = np.concatenate([states.row for states in found])
    shape = np.concatenate([states.u for states in found])
    trace.solves[0] += len(design)
    order = np.lexsort((row[:, rows.KIND], row[:, rows.INTERVAL], design))
    design, row, shape = design[order], row[order], shape[order]
    first = np.searchsorted(design, design)  # of each design's events
    slot = np.arange(len(design)) - first
    kept = slot < trace.rows.shape[1] - positions
    trace.rows[design[kept], positions + slot[kept]] = row[kept]
    trace.shapes[design[kept], positions + slot[kept]] = shape[kept]
