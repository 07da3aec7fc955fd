"""Where the branch of equilibria with friction ends, and why.

Two things end it. Friction locks: the finger does not slide from first touch on. Or the path passes
a limit point: the branch turns back, and the finger snaps to another equilibrium. Both are told by
the determinant (`path.tip`), which is positive on the branch from first touch. The end is where the
path got to in ever smaller moves of the target; and the equilibrium behind a snap is found by
following the frictionless one, at the first failed row, into friction. The friction that this one
bears is often the critical one, up to which the path reaches that row; it is found by dividing its
bracket. All failed designs are done at once.
"""

import numpy as np

from fastncm.kernels.problem import Problem, mode_count, select
from fastncm.path import rows
from fastncm.path.careful import can_be_careful, most_constraints, trace_carefully
from fastncm.path.run import solve_states, trace_lanes
from fastncm.path.snap import END_ENERGY, END_MU, END_POSITION, END_ROW
from fastncm.path.states import States, make_states, some
from fastncm.path.touch import locate_touches
from fastncm.path.trace import LONGEST_MOVE, Trace, make_trace
from fastncm.sqp import status
from fastncm.sqp.solve import Options

Array = np.ndarray

#: First step and shortest step in mu.
_FIRST_MU, _SHORTEST_MU = 0.05, 1e-9
#: To what share of mu the critical friction is found, and where in a bracket it is looked for, side
#: by side in the lanes.
_CLOSE = 1e-7
_SECTIONS = np.arange(1, 8) / 8.0
#: A step that failed is repeated with this share; one that did not is followed by a longer one.
_SHORTER, _LONGER = 0.25, 1.5
#: Beyond any path: from there a target is free.
_FAR = 64.0


def explain_ends(problem: Problem, options: Options, trace: Trace) -> None:
    """Give the failed rows of a solved trace with friction the status NO_EQUILIBRIUM, and say in
    ``trace.ends`` where their branch ended and why."""
    if not (problem.mu > 0.0).any():
        return
    positions = problem.positions.shape[1]
    failed = _failed(problem, trace)
    d = np.flatnonzero(failed.any(axis=1))
    if not len(d):
        return
    row = failed[d].argmax(axis=1)
    back, friction, released, locks = _look_behind(problem, options.tolerance, trace, d, row)
    trace.ends[d, END_ROW] = row
    trace.ends[d, END_POSITION] = back.t
    trace.ends[d, END_ENERGY] = np.where(released > 0.0, released, np.nan)
    if not locks.all():
        likely = np.minimum(friction, problem.mu[d])[~locks]
        critical = _critical_friction(problem, options, d[~locks], row[~locks], likely)
        trace.ends[d[~locks], END_MU] = critical
    trace.rows[:, :positions, rows.STATUS][failed] = status.NO_EQUILIBRIUM


def states_behind(problem: Problem, tolerance: float, trace: Trace) -> tuple[Array, States]:
    """The designs (S,) of a solved trace whose branch with friction ends although there is another
    equilibrium with less energy, and that one, with the target at the end."""
    failed = _failed(problem, trace)
    d = np.flatnonzero(failed.any(axis=1))
    if not len(d):
        return d, make_states(d, np.zeros(0), d, mode_count(problem))
    row = failed[d].argmax(axis=1)
    back, _, released, locks = _look_behind(problem, tolerance, trace, d, row)
    falls = (released > 0.0) & ~locks
    return d[falls], some(back, falls)


def _failed(problem: Problem, trace: Trace) -> Array:
    """The rows (D, N) with friction that failed."""
    positions = problem.positions.shape[1]
    failed: Array = trace.rows[:, :positions, rows.STATUS] > status.NO_CONTACT
    return failed & (problem.mu[:, None] > 0.0)


def _look_behind(
    problem: Problem, tolerance: float, trace: Trace, d: Array, row: Array
) -> tuple[States, Array, Array, Array]:
    """What the finger snaps to where the branches end before the failed rows, with the target at
    the end; the friction that the equilibrium at the row bears (`_follow_friction`); the energy
    released (S,), NaN where there is nothing to snap to; and whether it locks from the start."""
    start = _start(problem, trace, d, row)
    sense = np.sign(problem.positions[d, row] - start)
    beyond, friction = _follow_friction(problem, tolerance, d, row, sense)
    end = trace.ends[d]
    told = (end[:, END_ROW] == row) & (end[:, END_POSITION] != 0.0) & ~np.isnan(end[:, END_MU])
    stored = np.where(told, end[:, END_ENERGY], trace.rows[d, np.maximum(row - 1, 0), rows.ENERGY])
    beyond.t[:] = np.where(told, end[:, END_POSITION], start)
    solve_states(problem, tolerance, beyond)
    released = stored - beyond.row[:, rows.ENERGY]
    released[~((friction >= problem.mu[d]) & beyond.good)] = np.nan
    return beyond, friction, released, told & (end[:, END_MU] != 0.0)


def _start(problem: Problem, trace: Trace, d: Array, row: Array) -> Array:
    """The target's position (S,) at the last state before the failed rows: a row, or first
    touch."""
    before = np.maximum(row - 1, 0)
    start = problem.positions[d, before]
    free = trace.rows[d, before, rows.STATUS] != status.CONVERGED
    touching = problem.positions[d, row]
    clear = np.where(row > 0, start, touching + _FAR)
    return np.where(free, locate_touches(problem, d, clear, touching), start)


def _dragged(states: States, mu: Array, sense: Array) -> Array:
    """Friction over normal force (S,) of sliding contacts: the target drags the finger along."""
    return np.where(-states.row[:, rows.NORMAL_Y] * sense >= 0.0, mu, -mu)


def _critical_friction(
    problem: Problem, options: Options, d: Array, row: Array, likely: Array
) -> Array:
    """Friction (S,) up to which the branch from first touch reaches the failed rows (NaN: none).

    likely: (S,) where to look first (NaN: nowhere).
    """
    low, high = np.zeros(len(d)), problem.mu[d].copy()
    close = _CLOSE * high
    first = np.column_stack([close, likely - 0.4 * close, likely + 0.4 * close])
    inside = (low[:, None] < first) & (first < high[:, None])  # False for NaN
    first = np.where(inside, first, 0.5 * high[:, None])
    pending = np.arange(len(d))
    while len(pending):
        bottom, top = low[pending, None], high[pending, None]
        trial = bottom + (top - bottom) * _SECTIONS
        if first.size:
            trial, first = np.sort(np.column_stack([trial, first]), axis=1), first[:0]
        through = _get_through(problem, options, d[pending], row[pending], trial)
        ladder = np.column_stack([bottom, trial, top])
        reached = np.cumprod(through, axis=1).sum(axis=1)
        place = np.arange(len(pending))
        low[pending], high[pending] = ladder[place, reached], ladder[place, reached + 1]
        pending = pending[(high - low > close)[pending]]
    for i in np.flatnonzero(can_be_careful(problem)[d] & (high < problem.mu[d])):
        low[i] = _raise(problem, options, d[i : i + 1], int(row[i]), low[i], high[i], likely[i])
    return np.where(low > 0.0, low, np.nan)


def _raise(
    problem: Problem,
    options: Options,
    d: Array,
    row: int,
    low: float,
    beyond: float,
    likely: float,
) -> float:
    """Critical friction of one design ``d = [d]`` by `path.careful`, where the lanes get through
    with `low` and not with `beyond`."""
    high, close = float(problem.mu[d[0]]), _CLOSE * float(problem.mu[d[0]])
    for guess in (beyond, likely - 0.4 * close, likely + 0.4 * close):
        if low < guess < high:
            through = _get_through_carefully(problem, options, d, row, guess)
            low, high = (guess, high) if through else (low, guess)
    while high - low > close:
        middle = 0.5 * (low + high)
        through = _get_through_carefully(problem, options, d, row, middle)
        low, high = (middle, high) if through else (low, middle)
    return low


def _get_through(problem: Problem, options: Options, d: Array, row: Array, mu: Array) -> Array:
    """Whether (S, n) the branches of the designs `d` (S,) reach the rows `row` (S,) with the
    friction `mu` (S, n), by the lanes."""
    each = mu.shape[1]
    part = _with_friction(problem, np.repeat(d, each), int(row.max()), mu.ravel())
    trace = make_trace(mu.size, part.positions.shape[1], mode_count(problem), 1)
    trace_lanes(part, options.tolerance, LONGEST_MOVE, trace)
    state = trace.rows[np.arange(mu.size), np.repeat(row, each), rows.STATUS]
    through: Array = (state == status.CONVERGED).reshape(mu.shape)
    return through


def _get_through_carefully(
    problem: Problem, options: Options, d: Array, row: int, mu: float
) -> bool:
    """The same of one design by `path.careful`."""
    part = _with_friction(problem, d, row, np.array([mu]))
    trace = make_trace(1, row + 1, mode_count(problem), most_constraints(part))
    trace_carefully(part, options, trace)
    return bool(trace.rows[0, row, rows.STATUS] == status.CONVERGED)


def _with_friction(problem: Problem, d: Array, last: int, mu: Array) -> Problem:
    """The designs `d` (S,) with the friction `mu` (S,) on their ways to the row `last`."""
    part = select(problem, d)
    positions = np.ascontiguousarray(part.positions[:, : last + 1])
    return part._replace(positions=positions, mu=mu)


def _follow_friction(
    problem: Problem, tolerance: float, d: Array, row: Array, sense: Array
) -> tuple[States, Array]:
    """The states at the failed rows with as much friction, at most mu, as the branch from the
    frictionless shape bears; and how much that is (NaN: there is no frictionless shape)."""
    smooth, modes = (
        _with_friction(problem, d, int(row.max()), np.zeros(len(d))),
        mode_count(problem),
    )
    trace = make_trace(len(d), smooth.positions.shape[1], modes, 1)
    trace_lanes(smooth, tolerance, LONGEST_MOVE, trace)
    states = make_states(d, problem.positions[d, row], np.full(len(d), -1), modes)
    own = np.arange(len(d))
    states.u[:] = trace.shapes[own, row]
    states.force[:] = trace.rows[own, row, rows.FORCE]
    states.row[:] = trace.rows[own, row]
    mu = problem.mu[d]
    signed = _dragged(states, mu, sense)
    solved = trace.rows[own, row, rows.STATUS] == status.CONVERGED
    _raise_friction(problem, tolerance, states, signed)
    return states, np.where(solved, np.abs(states.side), np.nan)


def _raise_friction(problem: Problem, tolerance: float, states: States, stop: Array) -> None:
    """Lead frictionless `states` to the side `stop` (S,), as far as each gets. They are left as the
    last ones that were solved."""
    states.side[:] = np.copysign(0.0, stop)
    step = np.full(len(stop), _FIRST_MU)
    pending = np.arange(len(stop))
    while len(pending):
        way = stop[pending] - states.side[pending]
        done = np.abs(way) <= step[pending]
        trial = some(states, pending)
        move = np.copysign(step[pending], way)
        trial.side[:] = np.where(done, stop[pending], trial.side + move)
        solve_states(problem, tolerance, trial)
        good = trial.good
        for mine, new in zip(states, trial, strict=True):
            mine[pending[good]] = new[good]
        step[pending] *= np.where(good, _LONGER, _SHORTER)
        pending = pending[np.where(good, ~done, step[pending] > _SHORTEST_MU)]
