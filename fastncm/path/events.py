"""Events between the positions of a path: first touch, loss of contact, change of the contact feature.

The peak of the insertion force is often one of them (the contact reaches the jaw's corner a): a kink or a
jump, which no grid of positions hits. Each is found by Newton's method in the target's position, on the
branch whose feature is held although the contact may have passed its end, so that everything is smooth.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import driver, inner, kernel
from fastncm.kernels.constants import LANES
from fastncm.kernels.trig import sincos
from fastncm.path import newton, rows
from fastncm.path.boundary import boundary
from fastncm.path.lanes import make_lanes
from fastncm.path.touch import locate_touch
from fastncm.path.trace import EVENTS, begin_block
from fastncm.sqp import status

#: Newton steps in the target's position, and the last step's length (finger lengths) that ends them.
_STEPS = 12
_LOCATED = 1e-13
#: Newton steps for the shape at each of them.
_SHAPE_STEPS = 8


class Search(NamedTuple):
    """Each lane's next event; all (LANES,).

    begin: first interval not searched yet; used: event slots filled; kind, interval: of the next event;
    pending: still to be located; goal: the feature behind a change; far: position of the row behind it.
    """

    begin: np.ndarray
    used: np.ndarray
    kind: np.ndarray
    interval: np.ndarray
    pending: np.ndarray
    goal: np.ndarray
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
        np.zeros(LANES, np.int64),
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
def _towards_change(problem, lanes, goal, far, pending):
    """One Newton step of all pending lanes' target towards the end of their held feature.

    goal: (LANES,) the feature behind it; far: (LANES,) the position of the next row, which bounds the step;
    pending: (LANES,) bool, cleared where located, and where there is no boundary (``lanes.good`` is then False).
    """
    modes = lanes.u.shape[0]
    for lane in range(LANES):
        if not pending[lane]:
            continue
        d = lanes.design[lane]
        sin, cos = sincos(lanes.pose[2, lane])
        e, ex, ey, ep, known = boundary(
            lanes.hold[lane],
            goal[lane],
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
        reach = abs(far[lane] - lanes.t[lane])
        if not known or not abs(move) < 4.0 * reach + 1e-6:
            lanes.good[lane] = False
            pending[lane] = False
            continue
        pending[lane] = abs(move) > _LOCATED
        lanes.t[lane] += move
        lanes.force[lane] += move * lanes.force_rate[lane]
        for k in range(modes):
            lanes.u[k, lane] += move * lanes.u_rate[k, lane]


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
    newton.evaluate(problem, lanes)
    newton.factorise(problem, lanes)
    newton.rates(lanes)
    lanes.residual[:] = 0.0
    lanes.iterations[:] = 0
    rows.measure(problem, lanes, measuring)
    _keep(lanes, at, measuring.row, trace)


@inner
def _changes(problem, lanes, at, measuring, tolerance, trace):
    """Rows just before and just after the feature changes among the next events."""
    pending, goal, far = at.pending, at.goal, at.far
    for lane in range(LANES):
        pending[lane] = at.kind[lane] == rows.BEFORE_CHANGE
        lanes.active[lane] = pending[lane]
        if pending[lane]:
            i, d = at.interval[lane], lanes.design[lane]
            _set_row(lanes, lane, i, trace)
            goal[lane] = int(trace.rows[d, i + 1, rows.FEATURE])
            far[lane] = trace.rows[d, i + 1, rows.POSITION]
    for _ in range(_STEPS):
        newton.correct(problem, lanes, tolerance, _SHAPE_STEPS)
        newton.rates(lanes)
        left = False
        for lane in range(LANES):
            pending[lane] = pending[lane] and lanes.good[lane]
            lanes.active[lane] = lanes.active[lane] and lanes.good[lane]
            left = left or pending[lane]
        if not left:
            break
        _towards_change(problem, lanes, goal, far, pending)
    for lane in range(LANES):
        if lanes.active[lane]:
            near = trace.rows[lanes.design[lane], at.interval[lane], rows.POSITION]
            between = (lanes.t[lane] - near) * (lanes.t[lane] - far[lane]) <= 0.0
            lanes.good[lane] = lanes.good[lane] and not pending[lane] and between
            lanes.active[lane] = lanes.good[lane]
    rows.measure(problem, lanes, measuring)
    _keep(lanes, at, measuring.row, trace)
    for lane in range(LANES):
        lanes.hold[lane] = goal[lane]
        at.kind[lane] = rows.AFTER_CHANGE
    newton.correct(problem, lanes, tolerance, _SHAPE_STEPS)
    newton.rates(lanes)
    rows.measure(problem, lanes, measuring)
    _keep(lanes, at, measuring.row, trace)


@driver
def locate_events(problem, tolerance, trace):
    """Locate the events of all designs of a solved trace, and write their rows behind its positions."""
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
    """Find the next event of each lane. Returns whether there are touches, and whether there are changes."""
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
