"""Where Python calls the compiled lanes: whole paths, or single states.

Both are one compiled function, so that what they share (Newton's method, the rows) is compiled
once.
"""

import numpy as np

from fastncm.kernels.cache import kernel
from fastncm.kernels.problem import Problem
from fastncm.kernels.shared import share
from fastncm.path.block import make_block, workspaces
from fastncm.path.states import States, make_states, solve_all
from fastncm.path.trace import Trace, make_trace, trace_paths

_NO_INDEX, _NO_POSITION, _NO_DESIGN = np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.bool_)


@kernel
def _run_lanes(problem, tolerance, longest, over, behind, block, trace, states):
    """Solve all positions of all designs where `trace` has room for them, and all `states`."""
    kept = share(problem)
    lanes, walk, measuring = workspaces(kept, block)
    if trace.rows.shape[0] > 0:
        late = share(behind)
        trace_paths(kept, tolerance, longest, over, late, lanes, walk, measuring, share(trace))
    solve_all(kept, tolerance, lanes, measuring, share(states))


def trace_lanes(
    problem: Problem,
    tolerance: float,
    longest: float,
    trace: Trace,
    over: np.ndarray | None = None,
    behind: States | None = None,
) -> None:
    """`path.trace.trace_paths` with a workspace; over: None: no path goes over a snap; behind:
    None: nothing is known there."""
    over = np.zeros(problem.positions.shape[0], np.bool_) if over is None else over
    none = make_states(_NO_INDEX, _NO_POSITION, _NO_INDEX, trace.shapes.shape[2])
    behind = none if behind is None else behind
    _run_lanes(problem, tolerance, longest, over, behind, make_block(problem), trace, none)


def solve_states(problem: Problem, tolerance: float, states: States) -> None:
    """`path.states.solve_all` with a workspace."""
    none = make_trace(0, 0, states.u.shape[1], 0)
    late = make_states(_NO_INDEX, _NO_POSITION, _NO_INDEX, states.u.shape[1])
    _run_lanes(problem, tolerance, 0.0, _NO_DESIGN, late, make_block(problem), none, states)
