"""Events between the positions of a path: first touch, loss of contact, change of the contact
feature.

The peak of the insertion force is often one of them (the contact reaches the jaw's corner a): a
kink or a jump, which no grid of positions hits. Each is found by Newton's method in the target's
position, on the branch whose feature is held although the contact may have passed its end, so that
everything is smooth.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import driver, inner, kernel
from fastncm.kernels.constants import LANES
from fastncm.kernels.trig import sincos
from fastncm.path import newton, rows
from fastncm.path.boundary import boundary
from fastncm.path.lanes import make_lanes
from fastncm.path.touch import locate_touch
from fastncm.path.trace import EVENTS, begin_block
from fastncm.sqp import status

#: Newton steps in the target's position, and the last step's length (finger lengths) that ends
#: them.
_STEPS = 12
_LOCATED = 1e-13
#: Newton steps for the shape at each of them.
_SHAPE_STEPS = 8


class Search(NamedTuple):
    """Each lane's next event; all (LANES,).

    begin: first interval not searched yet; used: event slots filled; kind, interval: of the next
    event; located: whether it was found; early: whether it lies behind the next row; change: where;
    goal: the feature behind a change; near, far: positions of the rows on both sides of the
    interval.
    """

    begin: np.ndarray
    used: np.ndarray
    kind: np.ndarray
    interval: np.ndarray
    located: np.ndarray
    early: np.ndarray
    change: np.ndarray
    goal: np.ndarray
    near: np.ndarray
    far: np.ndarray


@driver
def make_search():
    """A workspace of `locate_events`."""
    return Search(
        np.zeros(LANES, np.int64),
        np.zeros(LANES, np.int64),
        np.zeros(LANES, np.int64),
        np.zeros(LANES, np.int64),
        np.zeros(LANES, np.bool_),
        np.zeros(LANES, np.bool_),
        np.zeros(LANES),
        np.zeros(LANES, np.int64),
        np.zeros(LANES),
        np.zeros(LANES),
    )


@kernel
def _touching(row):
    """True for a row with a solved contact."""
    return row[rows.STATUS] == status.CONVERGED


@inner
def _next_event(d, begin, trace, positions):
    """The first interval from `begin` on with an event: ``(interval, kind)``, or ``(-1, 0)``."""
    for i in range(begin, positions - 1):
        before, after = trace.rows[d, i], trace.rows[d, i + 1]
        if before[rows.STATUS] == status.NO_CONTACT and _touching(after):
            return i, rows.TOUCH
        if _touching(before) and after[rows.STATUS] == status.NO_CONTACT:
            return i, rows.RELEASE
        if (
            _touching(before)
            and _touching(after)
            and before[rows.FEATURE] != after[rows.FEATURE]
            and max(before[rows.FEATURE], after[rows.FEATURE]) < rows.SEVERAL
        ):
            return i, rows.BEFORE_CHANGE
    return -1, 0


@inner
def _set_touch(problem, lanes, lane, i, kind):
    """Put the undeformed finger into `lane`, with the target where contact begins or ends."""
    d = lanes.design[lane]
    free, touching = problem.positions[d, i], problem.positions[d, i + 1]
    if kind == rows.RELEASE:
        free, touching = touching, free
    lanes.t[lane] = locate_touch(problem, d, free, touching)
    lanes.hold[lane] = -1
    lanes.force[lane] = 0.0
    lanes.u[:, lane] = 0.0


@inner
def _set_row(lanes, lane, i, trace):
    """Put the solved position `i` into `lane`, its feature held."""
    d = lanes.design[lane]
    row = trace.rows[d, i]
    lanes.t[lane] = row[rows.POSITION]
    lanes.hold[lane] = int(row[rows.FEATURE])
    lanes.force[lane] = row[rows.FORCE]
    for k in range(lanes.u.shape[0]):
        lanes.u[k, lane] = trace.shapes[d, i, k]


@inner
def _towards_change(problem, lanes, at):
    """One Newton step of the active lanes' target towards the end of their held feature.

    A lane ends being active when it is located, or lost: without a boundary, or with a step that is
    longer than the interval, which is far outside of what the linearisation can tell.
    """
    modes = lanes.u.shape[0]
    for lane in range(LANES):
        if not lanes.active[lane]:
            continue
        d = lanes.design[lane]
        sin, cos = sincos(lanes.pose[2, lane])
        e, ex, ey, ep, known = boundary(
            lanes.hold[lane],
            at.goal[lane],
            problem.jaw,
            problem.target,
            d,
            lanes.t[lane],
            lanes.pose[0, lane],
            lanes.pose[1, lane],
            cos,
            sin,
        )
        slope = -ex
        for k in range(modes):
            slope += lanes.u_rate[k, lane] * (
                ex * lanes.gradient[0, k, lane]
                + ey * lanes.gradient[1, k, lane]
                + ep * lanes.basis.end[k, lane]
            )
        move = -e / slope if slope != 0.0 else np.inf
        if not known or not abs(move) < 4.0 * abs(at.far[lane] - at.near[lane]):
            lanes.active[lane] = False
            continue
        lanes.t[lane] += move
        lanes.force[lane] += move * lanes.force_rate[lane]
        for k in range(modes):
            lanes.u[k, lane] += move * lanes.u_rate[k, lane]
        if abs(move) <= _LOCATED:
            lanes.active[lane] = False
            share = (lanes.t[lane] - at.near[lane]) / (at.far[lane] - at.near[lane])
            at.located[lane] = -_LOCATED < share < 2.0
            at.early[lane] = share > 1.0


@inner
def _keep(lanes, at, measured, trace):
    """Write the measured rows of the good lanes into their next free event slots."""
    positions = trace.multipliers.shape[1]
    for lane in range(LANES):
        if not (lanes.active[lane] and lanes.good[lane]):
            continue
        d = lanes.design[lane]
        slot = positions + at.used[lane]
        at.used[lane] += 1
        row = trace.rows[d, slot]
        for column in range(rows.COLUMNS):
            row[column] = measured[column, lane]
        row[rows.KIND] = at.kind[lane]
        row[rows.INTERVAL] = at.interval[lane]
        if lanes.force[lane] == 0.0:
            row[rows.ESTIMATE] = 0.0
        trace.solves[0] += 1
        for k in range(lanes.u.shape[0]):
            trace.shapes[d, slot, k] = lanes.u[k, lane]


@inner
def _touches(problem, lanes, at, measuring, trace):
    """Rows of the touches and releases among the next events: no force, but its rate."""
    for lane in range(LANES):
        lanes.active[lane] = at.kind[lane] == rows.TOUCH or at.kind[lane] == rows.RELEASE
        lanes.good[lane] = lanes.active[lane]
        if lanes.active[lane]:
            _set_touch(problem, lanes, lane, at.interval[lane], at.kind[lane])
    newton.refresh(problem, lanes)
    lanes.residual[:] = 0.0
    lanes.iterations[:] = 0
    rows.measure(problem, lanes, measuring)
    _keep(lanes, at, measuring.row, trace)


@inner
def _changes(problem, lanes, at, measuring, tolerance, trace):
    """Rows just before and just after the feature changes among the next events."""
    for lane in range(LANES):
        at.located[lane] = False
        lanes.active[lane] = at.kind[lane] == rows.BEFORE_CHANGE
        if lanes.active[lane]:
            i, d = at.interval[lane], lanes.design[lane]
            _set_row(lanes, lane, i, trace)
            at.goal[lane] = int(trace.rows[d, i + 1, rows.FEATURE])
            at.near[lane] = trace.rows[d, i, rows.POSITION]
            at.far[lane] = trace.rows[d, i + 1, rows.POSITION]
    for _ in range(_STEPS):
        newton.correct(problem, lanes, tolerance, _SHAPE_STEPS)
        newton.rates(lanes)
        left = False
        for lane in range(LANES):
            lanes.active[lane] = lanes.good[lane]
            left = left or lanes.active[lane]
        if not left:
            break
        _towards_change(problem, lanes, at)
    _mend_early_rows(problem, lanes, at, measuring, tolerance, trace)
    for side in (rows.BEFORE_CHANGE, rows.AFTER_CHANGE):
        for lane in range(LANES):
            lanes.active[lane] = at.located[lane]
            at.kind[lane] = side
            if side == rows.AFTER_CHANGE:
                lanes.hold[lane] = at.goal[lane]
        newton.correct(problem, lanes, tolerance, _SHAPE_STEPS)
        newton.rates(lanes)
        rows.measure(problem, lanes, measuring)
        _keep(lanes, at, measuring.row, trace)


@inner
def _mend_early_rows(problem, lanes, at, measuring, tolerance, trace):
    """Solve the row behind the interval again where the change turned out to lie behind that row.

    Close to a jump both features are in equilibrium; the row had left the branch too early. The
    lanes get the located state back, and the event belongs to the next interval.
    """
    early = False
    for lane in range(LANES):
        at.early[lane] = at.early[lane] and at.located[lane]
        lanes.active[lane] = at.early[lane]
        early = early or at.early[lane]
        at.change[lane] = lanes.t[lane]
        if at.early[lane]:
            lanes.t[lane] = at.far[lane]
    if not early:
        return
    newton.correct(problem, lanes, tolerance, _SHAPE_STEPS)
    newton.rates(lanes)
    rows.measure(problem, lanes, measuring)
    for lane in range(LANES):
        if not at.early[lane]:
            continue
        at.located[lane] = lanes.good[lane]
        if lanes.good[lane]:
            d, i = lanes.design[lane], at.interval[lane] + 1
            at.interval[lane] = i
            at.begin[lane] = i + 1
            for column in range(rows.COLUMNS):
                trace.rows[d, i, column] = measuring.row[column, lane]
            for k in range(lanes.u.shape[0]):
                trace.shapes[d, i, k] = lanes.u[k, lane]
            trace.multipliers[d, i, 0] = lanes.force[lane]
        lanes.t[lane] = at.change[lane]


@driver
def locate_events(problem, tolerance, trace):
    """Locate the events of all designs of a solved trace, and write their rows behind its
    positions."""
    designs, positions = problem.positions.shape
    points = problem.rule.weights.shape[0]
    lanes = make_lanes(problem)
    at, measuring = make_search(), rows.make_measuring(points)
    for first in range(0, designs, LANES):
        begin_block(problem, first, lanes)
        at.begin[:] = 0
        at.used[:] = 0
        while True:
            touches, changes = _next_events(lanes, at, trace, positions)
            if touches:
                _touches(problem, lanes, at, measuring, trace)
            if changes:
                _changes(problem, lanes, at, measuring, tolerance, trace)
            if not (touches or changes):
                break


@inner
def _next_events(lanes, at, trace, positions):
    """Find the next event of each lane. Returns whether there are touches, and whether there are
    changes."""
    touches, changes = False, False
    for lane in range(LANES):
        at.kind[lane] = 0
        if lanes.design[lane] < 0 or at.used[lane] + 2 > EVENTS:
            continue
        i, found = _next_event(lanes.design[lane], at.begin[lane], trace, positions)
        if i >= 0:
            at.kind[lane], at.interval[lane] = found, i
            at.begin[lane] = i + 1
            touches = touches or found != rows.BEFORE_CHANGE
            changes = changes or found == rows.BEFORE_CHANGE
    return touches, changes
