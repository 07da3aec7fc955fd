"""The peak of the insertion force where it is a smooth maximum between two rows.

(A peak that is a kink or a jump is an event, and already a row: `path.events`.) The derivative of
the force by the position is exact, so the maximum is the root of a known function with a bracket:
the Illinois variant of the false position, for all cases of a chunk at once.
"""

import numpy as np

from fastncm.kernels.problem import Problem
from fastncm.path import reduce, rows
from fastncm.path.friction import INSERTION, INSERTION_RATE, turned_forces
from fastncm.path.run import solve_states
from fastncm.path.states import States, make_states
from fastncm.path.trace import Trace

Array = np.ndarray

#: Solves at most, and the bracket or step (in finger lengths) that ends the search.
_STEPS = 40
_LOCATED = 1e-12


def refine_peaks(
    problem: Problem,
    tolerance: float,
    trace: Trace,
    design: Array,
    mu: Array,
    summary: Array,
) -> int:
    """Locate the smooth peaks of cases and write force and position into their summaries.

    design, mu (of the recovered rule): (C,); summary: (C, reduce.COLUMNS). Returns the number of
    shapes solved.
    """
    return sum(
        _refine(problem, tolerance, trace, design, mu, summary, peak)
        for peak in (reduce.PEAK_FORCE, reduce.RETENTION)
    )


def _refine(
    problem: Problem,
    tolerance: float,
    trace: Trace,
    design: Array,
    mu: Array,
    summary: Array,
    peak: int,
) -> int:
    """`refine_peaks` of one way: the summary's columns `peak` (force), position, and the two rows
    between which it lies."""
    cases = np.flatnonzero(summary[:, peak + 2] >= 0.0)
    if not len(cases):
        return 0
    d = design[cases]
    ends = summary[cases, peak + 2 : peak + 4].astype(np.int64)
    bracket = np.stack([trace.rows[d, ends[:, k], rows.POSITION] for k in (0, 1)], axis=1)
    slope = np.stack(
        [_force(trace.rows[d, ends[:, k]], mu[cases])[:, INSERTION_RATE] for k in (0, 1)],
        axis=1,
    )
    states = make_states(
        d, bracket[:, 0], trace.rows[d, ends[:, 0], rows.FEATURE], trace.shapes.shape[2]
    )
    states.u[:] = trace.shapes[d, ends[:, 0]]
    states.force[:] = trace.rows[d, ends[:, 0], rows.FORCE]
    states.side[:] = trace.rows[d, ends[:, 0], rows.SIDE]
    direction = trace.rows[d, ends[:, 0], rows.DIRECTION]
    replaced = np.full(len(cases), -1)
    pending = np.arange(len(cases))
    solves = 0
    for _ in range(_STEPS):
        if not len(pending):
            break
        low, high = slope[pending].T
        share = low / (low - high)
        states.t[pending] = (1.0 - share) * bracket[pending, 0] + share * bracket[pending, 1]
        trial = States(*(field[pending] for field in states))
        # twice: the second call's factor belongs to the converged shape, so that the slope is exact
        solve_states(problem, tolerance, trial)
        solve_states(problem, tolerance, trial)
        solves += len(pending)
        states.u[pending], states.force[pending] = trial.u, trial.force
        trial.row[:, rows.DIRECTION] = direction[pending]
        at = cases[pending]
        force = _force(trial.row, mu[at])
        good = trial.good
        summary[at[good], peak] = force[good, INSERTION]
        summary[at[good], peak + 1] = trial.t[good]
        rate = force[:, INSERTION_RATE]
        end = np.where((rate > 0.0) == (low > 0.0), 0, 1)
        step = np.abs(trial.t - bracket[pending, end])
        bracket[pending, end], slope[pending, end] = trial.t, rate
        again = replaced[pending] == end  # the same end twice: halve the other one's slope
        slope[pending[again], 1 - end[again]] *= 0.5
        replaced[pending] = end
        width = np.abs(bracket[pending, 1] - bracket[pending, 0])
        pending = pending[good & (rate != 0.0) & (step > _LOCATED) & (width > _LOCATED)]
    return solves


def _force(row: Array, mu: Array) -> Array:
    """`turned_forces` of single rows (S, rows.COLUMNS)."""
    out = np.empty((len(row), 1, 7))
    turned_forces(row[:, None, :].copy(), np.arange(len(row)), mu, out)
    return out[:, 0]
