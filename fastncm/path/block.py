"""One block of memory for all that a block of lanes works with."""

import numpy as np

from fastncm.kernels.cache import inlined
from fastncm.kernels.problem import Problem, beyond_count, mode_count
from fastncm.path import lanes, rows, walk

_MOST = tuple(lanes.MOST.values())
_WALK_AT = rows.MEASURING.size_of(_MOST)
_LANES_AT = _WALK_AT + walk.WALK.size_of(_MOST)

_measuring_over = rows.MEASURING.over()
_walk_over = walk.WALK.over(_WALK_AT)
_lanes_over = lanes.LAYOUT.over(_LANES_AT)


def make_block(problem: Problem) -> np.ndarray:
    """A block for the designs of `problem`: bytes, zero."""
    tables = problem.profile
    modes, points = mode_count(problem), problem.rule.weights.shape[0]
    beyond = tables.slope.shape[1] + tables.shear.shape[1] - modes
    return np.zeros(_LANES_AT + lanes.LAYOUT.size_of((modes, points, beyond)), np.uint8)


@inlined
def workspaces(problem, block):
    """The lanes, their walk and what measures them, over a block of `make_block`."""
    sizes = (mode_count(problem), problem.rule.weights.shape[0], beyond_count(problem))
    return _lanes_over(block, sizes), _walk_over(block, sizes), _measuring_over(block, sizes)
