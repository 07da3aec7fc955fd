"""Helpers of the tests of the compiled core: from a shipped scene to solved rows, in few words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fastncm.kernels.constants import GAP_ROUNDING
from fastncm.kernels.problem import Problem
from fastncm.lowering import Lowered, lower
from fastncm.path import rows
from fastncm.path.careful import most_constraints, trace_carefully
from fastncm.path.events import locate_events
from fastncm.path.review import review
from fastncm.path.run import trace_lanes
from fastncm.path.trace import LONGEST_MOVE, Trace, make_trace
from fastncm.scene import load_scene, tabulate
from fastncm.sqp import status
from fastncm.sqp.solve import Options

CIRCLE, CORNER = "snapfit-circle", "snapfit-corner"

LANE_TOLERANCE = 1e-12
"""KKT residual for the lanes; the last Newton step brings it down to rounding."""
EXACT = Options(1e-11, GAP_ROUNDING, 60, True, 1e-4, 1e-10, np.inf, 1.0)
BFGS = EXACT._replace(exact=False, iterations=200)


@dataclass(frozen=True)
class Solved:
    """One design's solved path. Column names are those of `fastncm.path.rows`, in lower case."""

    lowered: Lowered
    problem: Problem
    trace: Trace

    def __getattr__(self, name: str) -> np.ndarray:
        """A column over the positions (N,), dimensionless."""
        return self.trace.rows[0, : self.problem.positions.shape[1], getattr(rows, name.upper())]

    @property
    def converged(self) -> np.ndarray:
        """(N,) bool."""
        return self.status == status.CONVERGED

    @property
    def metres(self) -> np.ndarray:
        """Positions (N,) in m."""
        return self.problem.positions[0] * self.lowered.scale.length[0]

    @property
    def newtons(self) -> np.ndarray:
        """Contact force (N,) in N."""
        return self.force * self.lowered.scale.force[0]

    def events(self) -> np.ndarray:
        """Rows of the located events (E, rows.COLUMNS)."""
        found = self.trace.rows[0, self.problem.positions.shape[1] :]
        return found[found[:, rows.KIND] > 0]


def lowered_scene(
    scene: str, changes: Mapping[str, Any] | None = None, positions: Sequence[float] | None = None
) -> Lowered:
    """A shipped scene with changes, dimensionless; `positions` in m."""
    (group,) = tabulate(load_scene(scene).replace(dict(changes or {})), {})
    return lower(group, None if positions is None else np.asarray(positions, dtype=np.float64))


def solved_path(
    scene: str,
    order: int,
    changes: Mapping[str, Any] | None = None,
    positions: Sequence[float] | None = None,
    options: Options | None = None,
) -> Solved:
    """Solve a shipped scene: in the lanes, or by the SQP where its `options` are given."""
    lowered = lowered_scene(scene, changes, positions)
    problem = lowered.problem(order, np.arange(1))
    modes = order * (2 if lowered.scene.model.shear else 1)
    trace = make_trace(1, problem.positions.shape[1], modes, most_constraints(problem))
    if options is None:
        trace_lanes(problem, LANE_TOLERANCE, LONGEST_MOVE, trace)
        locate_events(
            problem, LANE_TOLERANCE, trace, review(trace.rows, problem.positions.shape[1])
        )
    else:
        trace_carefully(problem, options, trace)
    return Solved(lowered, problem, trace)


def solved_force(scene: str, order: int) -> np.ndarray:
    """Dimensionless contact forces along the scene's own path without its first row, the touch."""
    solved = solved_path(scene, order)
    assert solved.converged[1:].all()
    return solved.force[1:]
