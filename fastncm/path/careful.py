"""Paths by the SQP: for designs that the lanes' Newton method leaves over, and for the point forms.

The branch that counts is the one that starts at first touch: `path.follow`.
"""

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inner, kernel
from fastncm.kernels.constants import LANES
from fastncm.kernels.gap import closest_gap
from fastncm.kernels.points import constraint_count
from fastncm.kernels.problem import Problem, mode_count
from fastncm.path import newton, rows
from fastncm.path.block import make_block, workspaces
from fastncm.path.follow import approach, make_spare
from fastncm.path.lanes import AS_STORED
from fastncm.path.trace import (
    END_ENERGY,
    END_MU,
    END_POSITION,
    END_ROW,
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
from fastncm.sqp.solve import Options, SqpWork, kkt_residual, make_work

#: The error that is due to M points, over what the closed form's conditions lack: 0.5 to 7 for M
#: from 10 to 400 on snapfit-circle, with either of the two point forms.
_POINTS = 3.0


@kernel
def most_constraints(problem):
    """Most constraints that any design of the problem has."""
    most = 0
    for d in range(problem.jaw.shape[0]):
        most = max(
            most, constraint_count(problem.form, problem.points, problem.kind, problem.jaw, d)
        )
    return most


def make_sqp(problem: Problem) -> SqpWork:
    """Workspace of the SQP for every design of the problem."""
    return make_work(mode_count(problem), problem.rule.weights.shape[0], most_constraints(problem))


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
    row's status, residual, iterations and contacts. Returns where the branch ends, and the energy
    released there, as `approach` does.

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
    result, reached, released, iterations = approach(
        design, walk.t[lane], lanes.t[lane], spare, work, options
    )
    row[rows.POSITION] = lanes.t[lane]
    row[rows.STATUS] = result
    row[rows.ITERATIONS] += iterations
    row[rows.RESIDUAL] = kkt_residual(
        spare.u, work.at.jacobian, work.at.gaps, work.multipliers, c.GAP_ROUNDING
    )
    row[rows.FEATURE] = rows.SEVERAL
    lanes.good[lane] = result == status.CONVERGED
    if not lanes.good[lane]:
        return reached, released
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
    return reached, released


@inner
def _discretisation(problem, lanes, lane):
    """Estimated relative error of the force that is due to the M points, of the refreshed `lane`.

    It is what the closed form's conditions lack at this shape, with the force that fits them best:
    stationarity, which lacks where the points turn the contact's normal, and the gap.
    """
    if problem.form == c.CLOSEST:
        return 0.0
    pose, gradient, end = lanes.pose, lanes.gradient, lanes.end
    psi = pose[2, lane]
    gap = closest_gap(
        problem.kind,
        -1,
        problem.jaw,
        problem.target,
        lanes.design[lane],
        lanes.t[lane],
        pose[0, lane],
        pose[1, lane],
        np.cos(psi),
        np.sin(psi),
    )
    opened, stiffness, largest, slack = 0.0, 0.0, c.GAP_ROUNDING, 0.0
    for k in range(lanes.u.shape[0]):
        opens = gap[1] * gradient[0, k, lane] + gap[2] * gradient[1, k, lane]
        opens += gap[3] * end[k, lane]
        opened += opens * lanes.u[k, lane]
        stiffness += opens * opens
        largest = max(largest, abs(lanes.u[k, lane]))
    for k in range(lanes.u.shape[0]):
        opens = gap[1] * gradient[0, k, lane] + gap[2] * gradient[1, k, lane]
        opens += gap[3] * end[k, lane]
        slack = max(slack, abs(lanes.u[k, lane] - opened / stiffness * opens))
    return _POINTS * (slack / largest + abs(gap[0]) / max(abs(opened), c.GAP_ROUNDING))


@inner
def _note_end(problem, lanes, lane, i, reached, released, trace):
    """Say that the branch from first touch ends on the way to position `i`, and what a snap
    releases there (NaN: nothing is found to snap to)."""
    end = trace.ends[lanes.design[lane]]
    if reached == lanes.t[lane] or end[END_POSITION] != 0.0:
        return
    end[END_ROW], end[END_POSITION], end[END_MU] = i, reached, np.nan
    end[END_ENERGY] = released if released > 0.0 else np.nan


@inner
def _skip_blocked(problem, i, lanes, walk, trace):
    """Leave out the lanes whose way to position `i` leads beyond where they failed, in the sense
    ``walk.blocked`` (0: nowhere); their rows fail like the one before."""
    for lane in range(LANES):
        d = lanes.design[lane]
        if not walk.going[lane]:
            walk.blocked[lane] = 0.0
        elif walk.blocked[lane] * (problem.positions[d, i] - walk.t[lane]) > 0.0:
            walk.going[lane] = False
            trace.rows[d, i, rows.POSITION] = problem.positions[d, i]
            trace.rows[d, i, rows.STATUS] = trace.rows[d, i - 1, rows.STATUS]


def trace_carefully(problem: Problem, options: Options, trace: Trace) -> None:
    """`_trace` with a workspace."""
    modes, points = mode_count(problem), problem.rule.weights.shape[0]
    spare = make_spare(modes, points)
    _trace(problem, options, make_block(problem), make_sqp(problem), spare, trace)


@kernel
def _trace(problem, options, block, work, spare, trace):
    """Solve all positions of all designs by the SQP, in whatever form their constraints have.

    options: `sqp.solve.Options`; trace: `Trace`, zeros on entry. What does not converge is a row
    with a status.
    """
    designs, positions = problem.positions.shape
    lanes, walk, measuring = workspaces(problem, block)
    for lane in range(LANES):
        walk.room[lane] = LONGEST_MOVE
    for first in range(0, designs, LANES):
        begin_block(problem, first, lanes)
        for lane in range(LANES):
            forget(walk, lane, 0.0)
        for i in range(positions):
            contact = begin_position(problem, i, lanes, walk, trace)
            _skip_blocked(problem, i, lanes, walk, trace)
            for lane in range(LANES):
                walk.touching[lane] = walk.going[lane]
            while aim(problem, i, lanes, walk):
                for lane in range(LANES):
                    if lanes.active[lane]:
                        d = lanes.design[lane]
                        trace.solves[0] += 1
                        reached, released = _solve_lane(
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
                        _note_end(problem, lanes, lane, i, reached, released, trace)
                        # what lies beyond a move that fails is not reached, either
                        there = lanes.t[lane] == problem.positions[d, i]
                        walk.going[lane] = lanes.good[lane] and not there
                        ahead = np.sign(lanes.t[lane] - walk.t[lane])
                        walk.blocked[lane] = 0.0 if lanes.good[lane] else ahead
                newton.refresh(problem, lanes)
                remember(lanes, walk)
            for lane in range(LANES):
                lanes.active[lane] = walk.touching[lane]
                if walk.touching[lane]:
                    d = lanes.design[lane]
                    trace.rows[d, i, rows.POSITION] = problem.positions[d, i]
            for lane in range(LANES):
                single = lanes.hold[lane] != AS_STORED
                if walk.touching[lane] and lanes.good[lane] and single:
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
                        discrete = _discretisation(problem, lanes, lane)
                        measuring.row[rows.DISCRETE, lane] = discrete
                        measuring.row[rows.ESTIMATE, lane] += (
                            rows.ALGEBRAIC * measuring.row[rows.RESIDUAL, lane] + discrete
                        )
                store(i, lanes, measuring.row, trace)
