"""Where Python calls the compiled lanes: whole paths, or single states.

Both are one compiled function, so that what they share (Newton's method, the rows) is compiled
once.
"""

import numpy as np

from fastncm.kernels.cache import driver
from fastncm.kernels.constants import LANES
from fastncm.kernels.problem import Problem, beyond_count, mode_count
from fastncm.path.lanes import make_lanes
from fastncm.path.rows import make_measuring
from fastncm.path.states import States, make_states, solve_all
from fastncm.path.trace import Trace, make_trace, trace_paths
from fastncm.path.walk import make_walk

_NO_INDEX, _NO_POSITION = np.zeros(0, np.int64), np.zeros(0)


@driver
def _run_lanes(problem, tolerance, longest, trace, states):
    """Solve all positions of all designs where `trace` has room for them, and all `states`."""
    modes, points = mode_count(problem), problem.rule.weights.shape[0]
    lanes, walk = make_lanes(problem), make_walk(modes)
    measuring = make_measuring(points, beyond_count(problem))
    if trace.rows.shape[0] > 0:
        going, touching = np.zeros(LANES, np.bool_), np.zeros(LANES, np.bool_)
        room = np.zeros(LANES)
        trace_paths(
            problem, tolerance, longest, lanes, walk, measuring, going, touching, room, trace
        )
    solve_all(problem, tolerance, lanes, measuring, states)


def trace_lanes(problem: Problem, tolerance: float, longest: float, trace: Trace) -> None:
    """`path.trace.trace_paths` with a workspace."""
    none = make_states(_NO_INDEX, _NO_POSITION, _NO_INDEX, trace.shapes.shape[2])
    _run_lanes(problem, tolerance, longest, trace, none)


def solve_states(problem: Problem, tolerance: float, states: States) -> None:
    """`path.states.solve_all` with a workspace."""
    none = make_trace(0, 0, states.u.shape[1], 0)
    _run_lanes(problem, tolerance, 0.0, none, states)
