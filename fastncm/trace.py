"""Solving lowered problems: the order that the tolerance needs, and the SQP for what the lanes
leave over."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from fastncm.first_use import SQP, announce
from fastncm.kernels import constants as c
from fastncm.kernels.basis import grade
from fastncm.kernels.problem import Problem, mode_count, select
from fastncm.lowering import Lowered
from fastncm.path import rows
from fastncm.path.careful import can_be_careful, most_constraints, trace_carefully
from fastncm.path.events import locate_events
from fastncm.path.limit import explain_ends, states_behind
from fastncm.path.overlap import mark_overlaps
from fastncm.path.review import review
from fastncm.path.run import trace_lanes
from fastncm.path.states import States
from fastncm.path.trace import EVENTS, LONGEST_MOVE, Trace, make_trace
from fastncm.sqp import status
from fastncm.sqp.solve import Options

Array = np.ndarray

#: Order to start with for each relative tolerance of the contact force: the estimates of the
#: shipped scenes (1.9e-4, 1.1e-5, 5e-8, 5e-10, 2e-12 for orders 2 to 6; bench/convergence.py). What
#: it does not reach for some design is solved again with more modes.
_FIRST_ORDERS = ((1e-3, 2), (3e-5, 3), (2e-7, 4), (1e-9, 5), (4e-12, 6))
_LAST_RESORT = 8
#: Orders with which fingers without friction that are thinner at the tip than this part of the
#: clamp's thickness are tried again where rows failed: a quarter of a second each.
_MORE_MODES, _THIN = (16, 32), 0.05
#: Designs per call of the compiled code: their rows stay in the second-level cache's neighbourhood.
_CHUNK = 512
#: The KKT residual must be this much smaller than the tolerance of the force ...
_ALGEBRAIC_SHARE = 1e-2
#: ... within these limits: tighter is rounding; looser makes rates inexact, and a step more or
#: less, by a rounding error that differs between compilations, would be seen in the twelfth digit
#: of the work.
_TIGHTEST, _LOOSEST = 1e-13, 1e-12
#: Iterations of the SQP: the exact Hessian needs 5, damped BFGS from far away up to 60.
_EXACT_ITERATIONS, _BFGS_ITERATIONS = 50, 200
#: Options with which rows without friction that the SQP left over are tried again, one after the
#: other. Near a limit point a step of the quadratic model may wind the finger up many times; and a
#: long move may lead to another branch, which ends.
_AGAIN: tuple[dict[str, Any], ...] = (
    {"longest_turn": 0.3},
    {"longest_turn": 0.3, "longest_move": 0.0625},
    {"longest_move": 0.0625},
)


@dataclass(frozen=True)
class Solved:
    """Paths of some of the designs of a `Lowered`, solved with one order.

    designs: (D,) their indices there; problem, trace: of these designs, in this order.
    """

    designs: Array
    order: int
    problem: Problem
    trace: Trace


def kkt_tolerance(rtol: float) -> float:
    """Tolerance of the KKT residual that goes with `solver.rtol`."""
    return min(max(_ALGEBRAIC_SHARE * rtol, _TIGHTEST), _LOOSEST)


def solve_paths(lowered: Lowered) -> Iterator[Solved]:
    """Solve all designs; each comes out once, with the order that its error estimate asks for.

    What a design's order is depends on that design alone, so that a table does not depend on how
    its cases were divided into chunks. What comes out may be overwritten when the next is asked
    for.
    """
    memory = _Memory()
    for chunk in _chunks(lowered):
        rubs = lowered.mu[chunk] > 0.0
        # apart: without friction there is less to do, and the last digit is another one
        yield from _solve_chunk(lowered, chunk[~rubs], memory)
        yield from _solve_chunk(lowered, chunk[rubs], memory)


class _Memory:
    """The large arrays of a trace, one chunk after the other in the same place: the system takes
    longer to find fresh memory than the solver to fill it."""

    def __init__(self) -> None:
        self._arrays: dict[str, Array] = {}

    def take(self, name: str, shape: tuple[int, ...]) -> Array:
        """An array with anything in it."""
        size = math.prod(shape)
        if name not in self._arrays or self._arrays[name].size < size:
            self._arrays[name] = np.empty(size)
        return self._arrays[name][:size].reshape(shape)


def _solve_chunk(
    lowered: Lowered, pending: Array, memory: _Memory, order: int = 0
) -> Iterator[Solved]:
    """`solve_paths` of the designs `pending` (D,), all with friction or all without; with `order`
    modes to start with, where it is given."""
    solver = lowered.scene.solver
    if order == 0:
        order = _first_order(solver.rtol) if solver.order == "auto" else int(solver.order)
    while len(pending):
        problem = lowered.problem(order, pending)
        options = _options(solver.rtol, solver.hessian == "exact")
        trace, truncation = _trace(problem, options, memory)
        _mark_direction(trace, lowered.direction[pending], lowered.turn)
        accepted = np.ones(len(pending), dtype=bool)
        if solver.order == "auto" and order < c.MAX_ORDER:
            accepted = truncation <= solver.rtol
        solved = Solved(pending, order, problem, trace)
        doubted = np.zeros(len(pending), dtype=bool)
        if solver.order == "auto" and order < _MORE_MODES[-1] and problem.form == c.CLOSEST:
            thin = (lowered.mu[pending] == 0.0) & (lowered.ratio[pending] < _THIN)
            doubted = accepted & thin & _unsolved(trace)
        kept = _subset(solved, doubted) if doubted.any() else None
        sure = accepted & ~doubted
        if sure.any():
            yield _explained(solved if sure.all() else _subset(solved, sure), options)
        if kept is not None:
            yield from _with_more_modes(lowered, kept, options, memory)
        pending = pending[~accepted]
        order = min(order + max(1, order // 6), c.MAX_ORDER)


def _with_more_modes(
    lowered: Lowered, doubted: Solved, options: Options, memory: _Memory
) -> Iterator[Solved]:
    """Designs with rows that failed, one by one: as they are, or with the first of `_MORE_MODES`
    that solves more rows. A thin tip that bends as much as to be near its branch's end needs more
    modes than the rows that were solved tell."""
    more = next(modes for modes in _MORE_MODES if modes > doubted.order)
    for at, design in enumerate(doubted.designs):
        one = _subset(doubted, np.arange(len(doubted.designs)) == at)
        (again,) = _solve_chunk(lowered, np.array([design]), memory, more)
        better = _rows_solved(again.trace)[0] > _rows_solved(one.trace)[0]
        yield again if better else _explained(one, options)


def _unsolved(trace: Trace) -> Array:
    """Which designs have rows that may have an answer, but none was found, (D,)."""
    state = trace.rows[:, : trace.contacts.shape[1], rows.STATUS]
    failed = (state > status.NO_CONTACT) & (state != status.INFEASIBLE)
    unsolved: Array = failed.any(axis=1)
    return unsolved


def _rows_solved(trace: Trace) -> Array:
    """How many positions of each design have an answer, (D,)."""
    positions = trace.contacts.shape[1]
    solved: Array = trace.rows[:, :positions, rows.STATUS] <= status.NO_CONTACT
    count: Array = solved.sum(axis=1)
    return count


def _chunks(lowered: Lowered) -> Iterator[Array]:
    """The designs in portions that share a quadrature, each in ascending order."""
    graded = grade(lowered.ratio)
    for one in np.unique(graded):
        designs = np.flatnonzero(graded == one)
        for first in range(0, len(designs), _CHUNK):
            yield designs[first : first + _CHUNK]


def _mark_direction(trace: Trace, direction: Array, turn: int) -> None:
    """Write the sense of the target's motion (D,) into all rows; it turns back after row `turn`."""
    trace.rows[:, :, rows.DIRECTION] = direction[:, None]
    if turn >= trace.contacts.shape[1] - 1:
        return
    place = np.arange(trace.rows.shape[1])
    interval = trace.rows[:, :, rows.INTERVAL]
    event = trace.rows[:, :, rows.KIND] != rows.AT_POSITION
    back = np.where(event, interval >= turn, place > turn)
    trace.rows[:, :, rows.DIRECTION][back] *= -1.0


def _first_order(rtol: float) -> int:
    return next((order for limit, order in _FIRST_ORDERS if rtol >= limit), _LAST_RESORT)


def _options(rtol: float, exact: bool) -> Options:
    return Options(
        tolerance=kkt_tolerance(rtol),
        rounding=c.GAP_ROUNDING,
        iterations=_EXACT_ITERATIONS if exact else _BFGS_ITERATIONS,
        exact=exact,
        armijo=1e-4,
        shortest=1e-8,
        longest_turn=np.inf,
        longest_move=1.0,
    )


def _explained(solved: Solved, options: Options) -> Solved:
    """The same with what is said of failed rows, which takes longer than to solve them: for the
    order that counts only."""
    if solved.problem.form == c.CLOSEST:
        explain_ends(solved.problem, options, solved.trace)
    return solved


def _trace(problem: Problem, options: Options, memory: _Memory) -> tuple[Trace, Array]:
    """Solve one chunk: side by side where the closed form allows it, by the SQP where it must be.

    Returns the trace, and each design's largest estimate of what its order leaves out, (D,).
    """
    constraints = most_constraints(problem)
    positions = problem.positions.shape[1]
    if problem.form != c.CLOSEST or not options.exact:
        trace = make_trace(*_room(problem, constraints))
        trace_carefully(problem, options, trace)
        seen = review(trace.rows, positions)
    else:
        trace, careful = _lanes_trace(memory, _room(problem, constraints)), can_be_careful(problem)
        trace_lanes(problem, options.tolerance, LONGEST_MOVE, trace, ~careful)
        seen = review(trace.rows, positions)
        designs = np.flatnonzero((seen.worst > status.NO_CONTACT) & careful)
        if len(designs):
            announce(SQP)
            _again_carefully(problem, trace, designs, options, gain=0)
            smooth = designs[problem.mu[designs] == 0.0]
            for changes in _AGAIN:
                smooth = smooth[_unsolved(trace)[smooth]]
                if not len(smooth):
                    break
                _again_carefully(problem, trace, smooth, options._replace(**changes), gain=1)
            seen = review(trace.rows, positions)
            rubs = problem.mu[designs] > 0.0
            designs = designs[rubs & (seen.worst[designs] > status.NO_CONTACT)]
        if len(designs):  # a branch that really ends, with friction
            _again_side_by_side(problem, trace, designs, options, careful[designs])
            seen = review(trace.rows, positions)
    if problem.form == c.CLOSEST and _go_on_behind(problem, options, trace):
        seen = review(trace.rows, positions)
    if mark_overlaps(problem, trace):
        seen = review(trace.rows, positions)
    if problem.form == c.CLOSEST:
        locate_events(problem, options.tolerance, trace, seen)
    events = review(trace.rows, positions, first=positions)
    return trace, np.maximum(seen.truncation, events.truncation)


def _go_on_behind(problem: Problem, options: Options, trace: Trace) -> bool:
    """Solve paths with friction again that end where the finger snaps to a state that is known;
    whether there are any."""
    designs, behind = states_behind(problem, options.tolerance, trace)
    if len(designs):
        over = np.ones(len(designs), dtype=bool)
        _again_side_by_side(problem, trace, designs, options, over, behind)
    return len(designs) > 0


def _again_carefully(
    problem: Problem, trace: Trace, designs: Array, options: Options, gain: int
) -> None:
    """A second attempt at `designs` by the SQP, taken over by `_replace`."""
    part = select(problem, designs)
    second = make_trace(*_room(part, most_constraints(part)))
    trace_carefully(part, options, second)
    _replace(trace, second, designs, gain)


def _again_side_by_side(
    problem: Problem,
    trace: Trace,
    designs: Array,
    options: Options,
    over: Array,
    behind: States | None = None,
) -> None:
    """A second attempt at `designs` in the lanes (`trace_lanes`), taken over where it solves more
    rows."""
    part = select(problem, designs)
    second = make_trace(*_room(part, most_constraints(part)))
    trace_lanes(part, options.tolerance, LONGEST_MOVE, second, over, behind)
    _replace(trace, second, designs, gain=1)


def _replace(trace: Trace, second: Trace, designs: Array, gain: int) -> None:
    """Take over the second attempt at `designs` where it solves at least `gain` more rows."""
    solved: Array = second.rows[:, :, rows.STATUS] <= status.NO_CONTACT
    before: Array = trace.rows[designs, :, rows.STATUS] <= status.NO_CONTACT
    better = solved.sum(axis=1) >= before.sum(axis=1) + gain
    for mine, new in zip(trace[:-1], second[:-1], strict=True):
        mine[designs[better]] = new[better]
    trace.solves[0] += second.solves[0]


def _room(problem: Problem, constraints: int) -> tuple[int, int, int, int, int]:
    """Sizes of the trace of a problem, as `make_trace` takes them."""
    designs, positions = problem.positions.shape
    sense = np.sign(np.diff(problem.positions, axis=1))
    turns = int((sense[:, 1:] * sense[:, :-1] < 0.0).sum(axis=1).max(initial=0))
    events = min(EVENTS * (1 + turns), max(EVENTS, positions))
    return designs, positions, mode_count(problem), constraints, events


def _lanes_trace(memory: _Memory, sizes: tuple[int, int, int, int, int]) -> Trace:
    """`make_trace` for the lanes, which clear what they fill."""
    designs, positions, modes, constraints, events = sizes
    count = positions + events
    return make_trace(designs, positions, 0, constraints, -positions)._replace(
        rows=memory.take("rows", (designs, count, rows.COLUMNS)),
        shapes=memory.take("shapes", (designs, count, modes)),
    )


def _subset(solved: Solved, chosen: Array) -> Solved:
    trace = solved.trace
    fields = {name: getattr(trace, name)[chosen] for name in trace._fields if name != "solves"}
    return Solved(
        solved.designs[chosen],
        solved.order,
        select(solved.problem, np.flatnonzero(chosen)),
        trace._replace(**fields),
    )
