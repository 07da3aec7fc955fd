"""Paths by the SQP: for designs that the lanes' Newton method leaves over, and for the point forms.

The branch that counts is the one that starts at first touch. So where the SQP fails from the
nearest known shape, the target is led there in ever smaller steps from the last position that was
solved.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import driver, inner, kernel
from fastncm.kernels.constants import LANES
from fastncm.kernels.points import constraint_count
from fastncm.kernels.problem import Problem, mode_count
from fastncm.path import newton, rows
from fastncm.path.block import make_block, workspaces
from fastncm.path.lanes import AS_STORED
from fastncm.path.trace import (
    LONGEST_MOVE,
    Trace,
    aim,
    begin_block,
    begin_position,
    is_genuine,
    store,
)
from fastncm.path.walk import forget, remember
from fastncm.sqp import status
from fastncm.sqp.design import Design
from fastncm.sqp.solve import Options, kkt_residual, make_work, solve

#: Numbers of steps in which a position is approached, one after the other until one works.
_STEPS = (1, 4, 16, 64)


class Spare(NamedTuple):
    """One design's tables in lane 0, slope (m, Q, LANES) and end (m, LANES), and its shapes u,
    u_start (m,)."""

    slope: np.ndarray
    end: np.ndarray
    u: np.ndarray
    u_start: np.ndarray


@driver
def make_spare(modes, points):
    """Room for one design."""
    return Spare(
        np.zeros((modes, points, LANES)),
        np.zeros((modes, LANES)),
        np.zeros(modes),
        np.zeros(modes),
    )


@kernel
def most_constraints(problem):
    """Most constraints that any design of the problem has."""
    most = 0
    for d in range(problem.jaw.shape[0]):
        most = max(
            most, constraint_count(problem.form, problem.points, problem.kind, problem.jaw, d)
        )
    return most


@driver
def make_sqp(problem):
    """Workspace of the SQP for every design of the problem."""
    return make_work(mode_count(problem), problem.rule.weights.shape[0], most_constraints(problem))


@inner
def approach(design, start, stop, spare, work, options):
    """Solve at `stop`, coming from the shape ``spare.u_start`` at `start`; the solution is left in
    ``spare.u``.

    Returns ``(status, iterations)``, the iterations of all attempts.
    """
    total = 0
    result = status.MAX_ITERATIONS
    for steps in _STEPS:
        for k in range(spare.u.shape[0]):
            spare.u[k] = spare.u_start[k]
        work.multipliers[:] = 0.0
        count = 0
        for i in range(1, steps + 1):
            t = start + (stop - start) * i / steps
            result, count, iterations, _ = solve(design, t, spare.u, count, work, options)
            total += iterations
            if result != status.CONVERGED:
                break
        if result == status.CONVERGED:
            break
    return result, total


@inner
def _resultant(work, gap):
    """Write the resultant of all contacts into `gap` (GAP_COLUMNS,), with unit force.

    Its direction, its moment about the tip, and the force-weighted mean place; no second
    derivatives. Returns ``(force, contacts)``.
    """
    for column in range(c.GAP_COLUMNS):
        gap[column] = 0.0
    total, contacts = 0.0, 0
    for k in range(work.multipliers.shape[0]):
        share = work.multipliers[k]
        if share > 0.0:
            for column in (c.GX, c.GY, c.GP, c.PX, c.PY):
                gap[column] += share * work.at.gaps[column, k]
            total += share
            contacts += 1
    force = np.sqrt(gap[c.GX] ** 2 + gap[c.GY] ** 2)
    if force > 0.0:
        for column in (c.GX, c.GY, c.GP):
            gap[column] /= force
        for column in (c.PX, c.PY):
            gap[column] /= total
    return force, contacts


@inner
def _solve_lane(problem, lanes, walk, lane, spare, work, options, row, multipliers):
    """Solve the position of `lane` by the SQP; sets the lane's shape, force and `good`, and the
    row's status, residual, iterations and contacts.

    Where the contact is not a single smooth one, the lane holds the resultant ``AS_STORED``.
    """
    d = lanes.design[lane]
    for k in range(spare.u.shape[0]):
        spare.u_start[k] = walk.u[k, lane]
        spare.end[k, 0] = lanes.end[k, lane]
        for q in range(spare.slope.shape[1]):
            spare.slope[k, q, 0] = lanes.slope[k, q, lane]
    design = Design(
        spare.slope,
        spare.end,
        problem.rule.weights,
        problem.jaw,
        problem.target,
        d,
        problem.kind,
        problem.form,
        problem.points,
    )
    result, iterations = approach(design, walk.t[lane], lanes.t[lane], spare, work, options)
    row[rows.POSITION] = lanes.t[lane]
    row[rows.STATUS] = result
    row[rows.ITERATIONS] += iterations
    row[rows.RESIDUAL] = kkt_residual(
        spare.u, work.at.jacobian, work.at.gaps, work.multipliers, c.GAP_ROUNDING
    )
    row[rows.FEATURE] = rows.SEVERAL
    lanes.good[lane] = result == status.CONVERGED
    if not lanes.good[lane]:
        return
    gap = lanes.gap[:, lane]
    force, contacts = _resultant(work, gap)
    row[rows.CONTACTS] = contacts
    for k in range(spare.u.shape[0]):
        lanes.u[k, lane] = spare.u[k]
    lanes.force[lane] = force
    multipliers[:] = 0.0
    for k in range(work.multipliers.shape[0]):
        multipliers[k] = work.multipliers[k]
    single = problem.form == c.CLOSEST and contacts == 1
    lanes.hold[lane] = -1 if single else AS_STORED
    gap[c.FEATURE] = rows.SEVERAL


def trace_carefully(problem: Problem, options: Options, trace: Trace) -> None:
    """`_trace` with a workspace."""
    _trace(problem, options, make_block(problem), trace)


@driver
def _trace(problem, options, block, trace):
    """Solve all positions of all designs by the SQP, in whatever form their constraints have.

    options: `sqp.solve.Options`; trace: `Trace`, zeros on entry. What does not converge is a row
    with a status.
    """
    designs, positions = problem.positions.shape
    modes, points = mode_count(problem), problem.rule.weights.shape[0]
    lanes, walk, measuring = workspaces(problem, block)
    work, spare = make_sqp(problem), make_spare(modes, points)
    going, touching = np.zeros(LANES, np.bool_), np.zeros(LANES, np.bool_)
    longest = np.full(LANES, LONGEST_MOVE)
    for first in range(0, designs, LANES):
        begin_block(problem, first, lanes)
        for lane in range(LANES):
            forget(walk, lane, 0.0)
        for i in range(positions):
            contact = begin_position(problem, i, lanes, walk, going, trace)
            touching[:] = going
            while aim(problem, i, longest, lanes, walk, going):
                for lane in range(LANES):
                    if lanes.active[lane]:
                        d = lanes.design[lane]
                        trace.solves[0] += 1
                        _solve_lane(
                            problem,
                            lanes,
                            walk,
                            lane,
                            spare,
                            work,
                            options,
                            trace.rows[d, i],
                            trace.multipliers[d, i],
                        )
                        # what lies beyond a move that fails is not reached, either
                        there = lanes.t[lane] == problem.positions[d, i]
                        going[lane] = lanes.good[lane] and not there
                newton.refresh(problem, lanes)
                remember(lanes, walk)
            for lane in range(LANES):
                lanes.active[lane] = touching[lane]
                if touching[lane]:
                    d = lanes.design[lane]
                    trace.rows[d, i, rows.POSITION] = problem.positions[d, i]
            for lane in range(LANES):
                single = lanes.hold[lane] != AS_STORED
                if touching[lane] and lanes.good[lane] and single:
                    if not is_genuine(problem, lanes, lane):
                        lanes.good[lane] = False
                        trace.rows[lanes.design[lane], i, rows.STATUS] = status.MAX_ITERATIONS
            if contact:
                rows.measure(problem, lanes, measuring)
                for lane in range(LANES):
                    if lanes.active[lane] and lanes.good[lane]:  # what the SQP itself counted
                        for column in (rows.CONTACTS, rows.RESIDUAL, rows.ITERATIONS):
                            value = trace.rows[lanes.design[lane], i, column]
                            measuring.row[column, lane] = value
                        measuring.row[rows.ESTIMATE, lane] += (
                            rows.ALGEBRAIC * measuring.row[rows.RESIDUAL, lane]
                        )
                store(i, lanes, measuring.row, trace)
