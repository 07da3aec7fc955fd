"""Fingers in direct contact: the solution of dimensionless problems, and shapes in space."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fastncm.direct.lowering import LoweredSurface
from fastncm.path import surface_rows
from fastncm.path.surface_friction import turn_forces
from fastncm.path.surface_limit import find_critical_friction, select_fingers
from fastncm.path.surface_snaps import drop_doubtful_snaps
from fastncm.path.surface_trace import SurfaceTrace, make_surface_trace, trace_surfaces
from fastncm.path.surface_way import make_walk

Array = np.ndarray

#: The KKT residual's part of `solver.rtol`, and its limits: below is rounding, above equilibrium of
#: each row would not hold to 1e-9.
_ALGEBRAIC_SHARE, _TIGHTEST, _LOOSEST = 1e-2, 1e-13, 1e-10
#: Fingers in one call of the compiled code.
_CHUNK = 512


@dataclass(frozen=True)
class SolvedSurface:
    """Paths of some of the fingers of a `LoweredSurface`. designs: (D,) their indices there."""

    designs: Array
    trace: SurfaceTrace


def solve_surfaces(lowered: LoweredSurface, shapes: bool) -> Iterator[SolvedSurface]:
    """Solve all fingers; each comes out once. shapes: whether to keep angles and forces."""
    everything = lowered.problem
    tolerance = min(max(_ALGEBRAIC_SHARE * lowered.scene.solver.rtol, _TIGHTEST), _LOOSEST)
    for first in range(0, len(lowered.positions), _CHUNK):
        chosen = slice(first, first + _CHUNK)
        problem = select_fingers(everything, chosen)
        trace = make_surface_trace(problem, shapes)
        trace_surfaces(problem, make_walk(problem), tolerance, trace)
        find_critical_friction(problem, tolerance, trace)
        drop_doubtful_snaps(trace.rows)
        if lowered.scene.friction.model == "recovered":
            turn_forces(problem, lowered.turned[chosen], trace.rows)
        yield SolvedSurface(np.arange(first, first + len(problem.positions)), trace)


def finger_at(lowered: LoweredSurface, solved: SolvedSurface, d: int, i: int) -> dict[str, Array]:
    """The finger `d` of `solved` at position `i` in space, dimensionless: s, x, y, psi, gamma,
    moment (N + 1,) at its nodes; needs the shapes."""
    problem, trace, design = lowered.problem, solved.trace, solved.designs[d]
    psi, gamma, contact = trace.psi[d, i], trace.gamma[d, i], trace.contact[d, i]
    base, arm = problem.base[design, i], problem.arm[design]
    theta = 0.5 * (psi[1:] + psi[:-1]) + gamma[1:]
    x = np.concatenate([[0.0], np.cumsum(problem.step * np.cos(theta))])
    y = np.concatenate([[0.0], np.cumsum(problem.step * np.sin(theta))])
    # the moment about each node of the forces that act beyond it
    at, px, py, fx, fy = contact[contact[:, 3:].any(axis=1)].T
    turn = (px - x[:, None]) * fy - (py - y[:, None]) * fx
    moment = np.where(at > problem.arc[:, None], turn, 0.0).sum(axis=1)
    between = np.concatenate([gamma[1:2], 0.5 * (gamma[1:-1] + gamma[2:]), gamma[-1:]])
    x_space, y_space = _in_space(base, arm + x, y)
    return {
        "s": problem.arc,
        "x": x_space,
        "y": y_space,
        "psi": base + psi,
        "gamma": between,
        "moment": moment,
    }


def contacts_at(lowered: LoweredSurface, solved: SolvedSurface, d: int, i: int) -> dict[str, Array]:
    """The k touching points of finger `d` of `solved` at position `i` in space, dimensionless: s,
    x, y, force_x, force_y (k,); needs the shapes."""
    problem, design = lowered.problem, solved.designs[d]
    contact = solved.trace.contact[d, i]
    s, px, py, fx, fy = contact[contact[:, 3:].any(axis=1)].T
    base = problem.base[design, i]
    x, y = _in_space(base, problem.arm[design] + px, py)
    force_x, force_y = _in_space(base, fx, fy)
    if len(s) == 1:  # that of the row, which the recovered rule may have turned
        row = solved.trace.rows[d, i]
        force_x, force_y = row[[surface_rows.FORCE_X]], row[[surface_rows.FORCE_Y]]
    return {"s": s, "x": x, "y": y, "force_x": force_x, "force_y": force_y}


def _in_space(base: float, x: Array, y: Array) -> tuple[Array, Array]:
    """Vectors of the base's frame in space."""
    return np.cos(base) * x - np.sin(base) * y, np.sin(base) * x + np.cos(base) * y
