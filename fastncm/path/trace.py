"""The finger's shapes along the target's path, for a whole chunk of designs in one call."""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.problem import fill_basis
from fastncm.path import newton, rows, stick
from fastncm.path.snap import (
    END_MU,
    END_POSITION,
    ENDS,
    SHORTEST_MOVE,
    go_over,
    note_end,
    note_loss,
    snap_back,
)
from fastncm.path.touch import is_inside, locate_touch, undeformed_gap
from fastncm.path.walk import doubt_leaps, forget, predict, remember, stored_energy
from fastncm.sqp import status

#: Longest move of the target (in finger lengths) from one solve to the next; longer ones are
#: divided. One that fails is tried again with a quarter of it, down to the shortest (`path.snap`);
#: one that does not is followed by a longer one. Moves that are tried for one position, at most.
LONGEST_MOVE = 0.05
_SHORTER, _LONGER = 0.25, 2.0
_MOST_MOVES = 10_000
#: Just above 1: a way that is divided into moves of a length again gives that length.
_SAME_MOVE = 1.0 + 1e-12
#: Distance (finger lengths) up to which two places are one.
_SAME_PLACE = 1e-9
#: Newton steps in the lanes before a position is left over for the SQP.
NEWTON_STEPS = 8
#: Most events kept per design on the way in, and again on each way after the target turns back:
#: touch and release, and up to three feature changes of two rows each.
EVENTS = 8

#: Contacts that are kept of a row: more than three hold the tip's pose fast more than once.
MOST_CONTACTS = 4


class Trace(NamedTuple):
    """Solved paths, dimensionless.

    rows: (D, N + E, rows.COLUMNS): the N positions, then up to E located events in the order of the
    path (unused ones have the KIND 0). shapes: (D, N + E, m) unknowns. contacts: (D, N, C, 4), of
    the rows with several contacts: place (x, y) and force (x, y) of each. ends: (D,
    ENDS) where a branch with friction ends (`path.limit`). solves: (1,) shapes solved, those of
    events and of steps in between included.
    """

    rows: np.ndarray
    shapes: np.ndarray
    contacts: np.ndarray
    ends: np.ndarray
    solves: np.ndarray


def make_trace(
    designs: int, positions: int, modes: int, constraints: int, events: int = EVENTS
) -> Trace:
    """Room for the results of a problem with that many constraints."""
    count, contacts = positions + events, min(constraints, MOST_CONTACTS)
    return Trace(
        np.zeros((designs, count, rows.COLUMNS)),
        np.zeros((designs, count, modes)),
        np.zeros((designs, positions, contacts, 4)),
        np.zeros((designs, ENDS)),
        np.zeros(1, np.int64),
    )


@inner
def begin_block(problem, first, lanes):
    """Put the designs from `first` on into the lanes; a lane without a design has the index -1."""
    designs = problem.positions.shape[0]
    lanes.rubs[0], lanes.holds[0] = False, False
    for lane in range(LANES):
        lanes.mu[lane] = problem.mu[first + lane] if first + lane < designs else 0.0
        lanes.rubs[0] = lanes.rubs[0] or lanes.mu[lane] > 0.0
        lanes.rub[lane], lanes.rub_rate[lane], lanes.side[lane] = 0.0, 0.0, 0.0
        lanes.design[lane] = first + lane if first + lane < designs else -1
        lanes.active[lane] = False
        if first + lane < designs:
            fill_basis(problem, first + lane, lane, lanes)


@inner
def _clear(first, trace):
    """Zero the rows and shapes of the designs from `first` on."""
    for d in range(first, min(first + LANES, trace.rows.shape[0])):
        for i in range(trace.rows.shape[1]):
            for column in range(rows.COLUMNS):
                trace.rows[d, i, column] = 0.0
            for k in range(trace.shapes.shape[2]):
                trace.shapes[d, i, k] = 0.0


@inner
def begin_position(problem, i, lanes, walk, trace):
    """Find the lanes with contact at position `i` and where they come from; write the others' rows.

    An overlap within rounding (a path that starts at first touch) is no contact yet. A target that
    comes out of the inside of the jaw is INFEASIBLE.

    A position is approached from the last one solved, or, from the undeformed shape, from the place
    of first touch (for the first position: of a target that comes from beyond the tip): ``walk.t``.
    The lanes with contact are left ``walk.going``. Returns whether there are any.
    """
    contact = False
    for lane in range(LANES):
        d = lanes.design[lane]
        lanes.active[lane] = False
        lanes.hold[lane] = -1
        lanes.sticks[lane], lanes.side[lane] = False, 0.0
        walk.going[lane] = False
        if d < 0:
            continue
        t = problem.positions[d, i]
        if undeformed_gap(problem, d, t) >= -c.GAP_ROUNDING:
            forget(walk, lane, t)
            row = trace.rows[d, i]
            row[rows.POSITION] = t
            row[rows.STATUS] = status.NO_CONTACT
            row[rows.TIP_X] = 1.0
            row[rows.FEATURE] = c.VOID
            continue
        if walk.lost[lane]:
            continue
        if walk.feature[lane] == c.VOID:
            free, reach = problem.positions[d, i - 1] if i > 0 else t, LONGEST_MOVE
            while undeformed_gap(problem, d, free) < 0.0 and reach < 64.0:
                free += reach
                reach *= 1.5
            walk.t[lane] = locate_touch(problem, d, free, t)
            if is_inside(problem, d, walk.t[lane]):
                trace.rows[d, i, rows.POSITION] = t
                trace.rows[d, i, rows.STATUS] = status.INFEASIBLE
                continue
            if lanes.mu[lane] > 0.0:
                stick.begin_contact(problem, lanes, walk, lane)
                sense = np.sign(t - walk.t[lane])
                limit = stick.locking_friction(problem, lanes, walk, lane, sense)
                if limit <= lanes.mu[lane]:
                    walk.lost[lane] = True
                    if trace.ends[d, END_POSITION] == 0.0:
                        note_end(trace.ends[d], i, walk.t[lane], np.nan)
                        trace.ends[d, END_MU] = limit
                    continue
        walk.going[lane] = True
        contact = True
    return contact


@inner
def aim(problem, i, lanes, walk):
    """Move the targets of the lanes that are ``walk.going`` towards position `i`, in equal moves of
    at most ``walk.room``. Returns whether any is."""
    moving = False
    for lane in range(LANES):
        lanes.active[lane] = walk.going[lane]
        if walk.going[lane]:
            moving = True
            goal = problem.positions[lanes.design[lane], i]
            left = goal - walk.t[lane]
            moves = np.ceil(abs(left) / walk.room[lane])
            lanes.t[lane] = goal if moves <= 1.0 else walk.t[lane] + left / moves
    return moving


@inner
def _go_on(problem, i, longest, over, lanes, walk):
    """Which lanes are still ``walk.going`` after a move to position `i`, and how long the next move
    may be: shorter and shorter ones, and the last one that fell, if their designs may go `over`
    it."""
    for lane in range(LANES):
        if not lanes.active[lane]:
            continue
        if lanes.good[lane]:
            walk.going[lane] = lanes.t[lane] != problem.positions[lanes.design[lane], i]
            walk.room[lane] = min(_LONGER * walk.room[lane], longest)
        elif walk.room[lane] > SHORTEST_MOVE and not walk.over[lane]:
            left = abs(problem.positions[lanes.design[lane], i] - walk.t[lane])
            walk.room[lane] = _SHORTER * min(walk.room[lane], left)
            walk.lost[lane] = False
        elif walk.fell[lane] > 0.0 and over[lanes.design[lane]] and not walk.over[lane]:
            walk.room[lane], walk.over[lane] = _SAME_MOVE * walk.fell[lane], True
            walk.lost[lane] = False
        else:
            walk.going[lane] = False


@inner
def is_genuine(problem, lanes, lane):
    """False where jaw and block touch beyond the end of what is said to touch.

    The gaps of the closed form are those between a point and a whole line. For two convex bodies
    the one that is closed first lies within both; it need not for a jaw that turns far around.
    """
    d, feature = lanes.design[lane], lanes.gap[c.FEATURE, lane]
    if problem.kind != c.BLOCK:
        return True
    x, y = lanes.gap[c.PX, lane], lanes.gap[c.PY, lane]
    t, length = lanes.t[lane], problem.target[d, c.TARGET_LENGTH]
    if feature == c.A_UNDERSIDE or feature == c.B_UNDERSIDE or feature == c.ARC_UNDERSIDE:
        return x >= t - _SAME_PLACE and (length == 0.0 or x <= t + length + _SAME_PLACE)
    if feature >= c.A_UNDERSIDE and feature < c.VOID:  # a face
        return y >= problem.target[d, c.TARGET_Y] - _SAME_PLACE
    if feature == c.FAR_RETURN:
        cos, sin = np.cos(lanes.pose[2, lane]), np.sin(lanes.pose[2, lane])
        x, y = x - lanes.pose[0, lane], y - lanes.pose[1, lane]
        along = (cos * x + sin * y - problem.jaw[d, c.AX]) * problem.jaw[d, c.TRX]
        along += (cos * y - sin * x - problem.jaw[d, c.AY]) * problem.jaw[d, c.TRY]
        return along <= _SAME_PLACE
    return True


@inner
def store(i, lanes, measured, trace):
    """Copy the measured rows and the shapes of the good lanes into the trace at position `i`.

    measured: (rows.COLUMNS, LANES).
    """
    for lane in range(LANES):
        if not (lanes.active[lane] and lanes.good[lane]):
            continue
        d = lanes.design[lane]
        for column in range(rows.COLUMNS):
            trace.rows[d, i, column] = measured[column, lane]
        for k in range(lanes.u.shape[0]):
            trace.shapes[d, i, k] = lanes.u[k, lane]


@inner
def trace_paths(problem, tolerance, longest, over, behind, lanes, walk, measuring, trace):
    """Solve all positions of all designs in the closed form, `LANES` designs side by side.

    tolerance: of the KKT residual; longest: move of the target from one solve to the next; over:
    (D,) bool, whether a path with friction goes on behind a snap (`path.snap`); behind: `States`
    of all designs, to which they snap where no move leads (``good``), or of none; trace: `Trace`,
    whose rows and shapes are overwritten, the others zeros on entry.

    A position that Newton's method does not reach in the shortest moves either is left with the
    status MAX_ITERATIONS: for the SQP (`path.careful`) to try. With friction nothing is tried
    beyond it before contact is lost and begins again: it would be another branch of equilibria than
    that from first touch.
    """
    designs, positions = problem.positions.shape
    for first in range(0, designs, LANES):
        begin_block(problem, first, lanes)
        _clear(first, trace)
        for lane in range(LANES):
            forget(walk, lane, 0.0)
        for i in range(positions):
            contact = begin_position(problem, i, lanes, walk, trace)
            for lane in range(LANES):
                walk.touching[lane] = walk.going[lane]
                walk.room[lane] = longest
            for _ in range(_MOST_MOVES):
                if not aim(problem, i, lanes, walk):
                    break
                predict(lanes, walk)
                if lanes.rubs[0]:
                    stick.assume(lanes, walk)
                newton.correct(problem, lanes, tolerance, NEWTON_STEPS)
                if lanes.rubs[0]:
                    stick.settle(problem, lanes, walk, tolerance, NEWTON_STEPS)
                doubt_leaps(lanes, walk)
                if lanes.rubs[0]:
                    go_over(i, over, lanes, walk, trace)
                snap_back(problem, i, behind, lanes, walk, tolerance, NEWTON_STEPS, trace)
                newton.rates(lanes)
                if lanes.rubs[0]:
                    stick.keep(lanes, walk)
                remember(lanes, walk)
                for lane in range(LANES):
                    trace.solves[0] += lanes.active[lane]
                _go_on(problem, i, longest, over, lanes, walk)
            for lane in range(LANES):
                lanes.active[lane] = walk.touching[lane]
                if walk.touching[lane] and lanes.good[lane]:
                    lanes.good[lane] = not walk.going[lane] and is_genuine(problem, lanes, lane)
            if contact:
                rows.measure(problem, lanes, measuring)
                store(i, lanes, measuring.row, trace)
            for lane in range(LANES):
                d = lanes.design[lane]
                solved = lanes.active[lane] and lanes.good[lane]
                if not solved and lanes.active[lane] and lanes.mu[lane] > 0.0:
                    note_loss(trace.ends[d], i, walk.t[lane], stored_energy(walk, lane))
                if not solved and (lanes.active[lane] or walk.lost[lane]):
                    row = trace.rows[d, i]
                    row[rows.POSITION] = problem.positions[d, i]
                    row[rows.STATUS] = status.MAX_ITERATIONS
                    row[rows.RESIDUAL] = lanes.residual[lane]
                    row[rows.ITERATIONS] = lanes.iterations[lane]
