"""The peak of the insertion force where it is a smooth maximum between two rows.

(A peak that is a kink or a jump is an event, and already a row: `path.events`.) The derivative of
the force by the position is exact, so the maximum is the root of a known function with a bracket:
the Illinois variant of the false position, for `LANES` cases side by side.
"""

import numpy as np

from fastncm.kernels.cache import driver, inlined
from fastncm.kernels.constants import LANES
from fastncm.kernels.problem import fill_basis, mode_count
from fastncm.path import newton, reduce, rows
from fastncm.path.friction import turned_force
from fastncm.path.lanes import make_lanes

#: Solves at most, and the bracket (in finger lengths) that ends the search.
_STEPS = 40
_LOCATED = 1e-12
_SHAPE_STEPS = 8


@inlined
def _start(problem, lanes, lane, shapes, table, design, from_row):
    """Put the case into `lane`, with the shape of the row before its peak."""
    d = design
    lanes.design[lane] = d
    fill_basis(problem, d, lane, lanes.basis)
    lanes.t[lane] = table[d, from_row, rows.POSITION]
    lanes.hold[lane] = int(table[d, from_row, rows.FEATURE])
    lanes.force[lane] = table[d, from_row, rows.FORCE]
    for k in range(lanes.u.shape[0]):
        lanes.u[k, lane] = shapes[d, from_row, k]


@driver
def refine_peaks(problem, tolerance, table, shapes, design, mu, direction, cases, summary):
    """Locate the smooth peaks of `cases` (indices) and write force and position into their
    `summary`.

    table: (D, rows, rows.COLUMNS); shapes: (D, rows, m); design, mu, direction: (C,); summary: (C,
    reduce.COLUMNS). Returns the number of shapes solved.
    """
    modes, points = mode_count(problem), problem.rule.weights.shape[0]
    lanes = make_lanes(problem)
    measuring = rows.make_measuring(points)
    low, high = np.zeros(LANES), np.zeros(LANES)  # the bracket ...
    rate_low, rate_high = np.zeros(LANES), np.zeros(LANES)  # ... and the slopes at its ends
    last = np.zeros(LANES, np.int64)  # the end that was replaced last
    row = np.zeros((1, 1, rows.COLUMNS))
    solves = 0
    for first in range(0, cases.shape[0], LANES):
        for lane in range(LANES):
            lanes.active[lane] = first + lane < cases.shape[0]
            if lanes.active[lane]:
                case = cases[first + lane]
                d = design[case]
                i = int(summary[case, reduce.SMOOTH_FROM])
                j = int(summary[case, reduce.SMOOTH_TO])
                _start(problem, lanes, lane, shapes, table, d, i)
                low[lane], high[lane] = table[d, i, rows.POSITION], table[d, j, rows.POSITION]
                rate_low[lane] = turned_force(table, d, i, mu[case], direction[case])[5]
                rate_high[lane] = turned_force(table, d, j, mu[case], direction[case])[5]
                last[lane] = 0
        newton.correct(problem, lanes, tolerance, _SHAPE_STEPS)
        for _ in range(_STEPS):
            newton.rates(lanes)
            left = False
            for lane in range(LANES):
                if lanes.active[lane]:
                    share = rate_low[lane] / (rate_low[lane] - rate_high[lane])
                    t = low[lane] + share * (high[lane] - low[lane])
                    move = t - lanes.t[lane]
                    lanes.t[lane] = t
                    lanes.force[lane] += move * lanes.force_rate[lane]
                    for k in range(modes):
                        lanes.u[k, lane] += move * lanes.u_rate[k, lane]
                    left = True
                    solves += 1
            if not left:
                break
            # twice: the second call's factor belongs to the converged shape, so that the slope is
            # exact
            newton.correct(problem, lanes, tolerance, _SHAPE_STEPS)
            newton.correct(problem, lanes, tolerance, _SHAPE_STEPS)
            newton.rates(lanes)
            rows.measure(problem, lanes, measuring)
            for lane in range(LANES):
                if not lanes.active[lane]:
                    continue
                case = cases[first + lane]
                for column in range(rows.COLUMNS):
                    row[0, 0, column] = measuring.row[column, lane]
                force = turned_force(row, 0, 0, mu[case], direction[case])
                rate = force[5]
                done = abs(high[lane] - low[lane]) < _LOCATED or rate == 0.0
                step = lanes.t[lane]
                if (rate > 0.0) == (rate_low[lane] > 0.0):
                    done = done or abs(step - low[lane]) < _LOCATED
                    low[lane], rate_low[lane] = step, rate
                    if last[lane] == 1:
                        rate_high[lane] *= 0.5
                    last[lane] = 1
                else:
                    done = done or abs(step - high[lane]) < _LOCATED
                    high[lane], rate_high[lane] = step, rate
                    if last[lane] == 2:
                        rate_low[lane] *= 0.5
                    last[lane] = 2
                if lanes.good[lane]:
                    summary[case, reduce.PEAK_FORCE] = force[4]
                    summary[case, reduce.PEAK_POSITION] = step
                if done or not lanes.good[lane]:
                    lanes.active[lane] = False
    return solves
