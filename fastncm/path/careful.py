"""Paths of one design at a time, for those that the lanes' Newton method leaves over: by Newton's
method on the pairs that touch (`path.several`), by the SQP where a state is to be found from afar,
and for the point forms.

The branch that counts is the one that starts at first touch: `path.follow`.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inner, kernel
from fastncm.kernels.constants import LANES
from fastncm.kernels.points import constraint_count
from fastncm.kernels.problem import Problem, mode_count
from fastncm.kernels.shared import share
from fastncm.path import newton, rows, several
from fastncm.path.block import make_block, workspaces
from fastncm.path.follow import Spare, approach, energy, make_spare
from fastncm.path.lanes import AS_STORED
from fastncm.path.resultant import (
    Wide,
    count_contacts,
    discretisation,
    make_wide,
    resultant,
    truncation,
)
from fastncm.path.snap import END_POSITION, note_end, note_loss
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
from fastncm.sqp.solve import Options, SqpWork, kkt_residual, make_work

#: Columns of a row that the solver of single designs writes itself.
_OWN = (rows.CONTACTS, rows.RESIDUAL, rows.ITERATIONS, rows.SIDE, rows.STICKING)


def can_be_careful(problem: Problem) -> np.ndarray:
    """For which designs (D,) more than the lanes' Newton method may be tried: those without
    friction, and jaws that may touch in two places (`kernels.gap.several_count`)."""
    rho = problem.jaw[:, c.RHO]
    careful: np.ndarray = (problem.mu == 0.0) | (rho < 0.0)
    if problem.kind == c.BLOCK:
        careful |= rho == 0.0
    return careful


class Tools(NamedTuple):
    """Workspaces for one design."""

    spare: Spare
    work: SqpWork
    rubbing: several.Rubbing
    wide: Wide


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
def _solve_lane(problem, lanes, walk, lane, tools, options, row, contacts):
    """Solve the position of `lane` by the SQP, or with friction by `path.several`; sets the lane's
    shape, forces and `good`, and the row's status, residual, iterations and contacts. Returns where
    the branch ends, and the energy released there, as `approach` does, or with friction stored.

    Where the contact is not a single smooth one, the lane holds the resultant ``AS_STORED``.
    """
    spare, work, rubbing, wide = tools.spare, tools.work, tools.rubbing, tools.wide
    d, mu = lanes.design[lane], lanes.mu[lane]
    for k in range(spare.u.shape[0]):
        spare.u_start[k] = walk.u[k, lane]
        spare.end[k] = lanes.end[k, lane]
        for q in range(spare.slope.shape[0]):
            spare.slope[q, k] = lanes.slope[k, q, lane]
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
    several.load(lane, walk.feature[lane] == c.VOID, rubbing)
    result, reached, released, iterations = approach(
        design, mu, walk.t[lane], lanes.t[lane], spare, work, rubbing, options
    )
    row[rows.POSITION] = lanes.t[lane]
    row[rows.STATUS] = result
    row[rows.ITERATIONS] += iterations
    row[rows.FEATURE] = rows.SEVERAL
    if mu > 0.0:
        row[rows.RESIDUAL] = several.friction_residual(mu, spare.u, work, rubbing)
    else:
        row[rows.RESIDUAL] = kkt_residual(
            spare.u, work.at.jacobian, work.at.gaps, work.multipliers, c.GAP_ROUNDING
        )
    lanes.good[lane] = result == status.CONVERGED
    if not lanes.good[lane]:
        walk.lost[lane] = mu > 0.0
        return reached, energy(spare.u_start) if mu > 0.0 else released
    gap = lanes.gap[:, lane]
    force, rub = resultant(work, rubbing, gap)
    feature = count_contacts(work, rubbing, lanes, lane, row, contacts)
    for k in range(spare.u.shape[0]):
        lanes.u[k, lane] = spare.u[k]
    several.unload(lane, rubbing)
    single = problem.form == c.CLOSEST and row[rows.CONTACTS] == 1
    lanes.hold[lane] = feature if single else AS_STORED
    lanes.force[lane], lanes.rub[lane] = force, rub if mu > 0.0 else 0.0
    lanes.sticks[lane] = row[rows.STICKING] > 0.0 and single
    lanes.holds[0] = lanes.holds[0] or lanes.sticks[lane]
    lanes.side[lane] = 0.0
    if mu > 0.0 and not lanes.sticks[lane]:
        lanes.side[lane] = np.copysign(mu, rub) if single else rub / force
    row[rows.SIDE] = lanes.side[lane]
    gap[c.FEATURE] = rows.SEVERAL
    if problem.form == c.CLOSEST and not single:
        row[rows.ESTIMATE] = truncation(problem, lanes, lane, spare, work, rubbing, wide)
    return reached, released


@inner
def _note_end(problem, lanes, lane, i, reached, released, trace):
    """Say that the branch from first touch ends on the way to position `i`, and without friction
    what a snap releases there (NaN: nothing is found to snap to). With friction `released` is what
    is stored there."""
    end = trace.ends[lanes.design[lane]]
    if reached == lanes.t[lane]:
        return
    if lanes.mu[lane] > 0.0:
        note_loss(end, i, reached, released)
    elif end[END_POSITION] == 0.0:
        note_end(end, i, reached, released if released > 0.0 else np.nan)


@inner
def _skip_blocked(problem, i, lanes, walk, trace):
    """Leave out the lanes whose way to position `i` leads beyond where they failed, in the sense
    ``walk.blocked`` (0: nowhere); their rows fail like the one before. So do those of a branch with
    friction that is lost."""
    for lane in range(LANES):
        d = lanes.design[lane]
        if walk.lost[lane]:
            trace.rows[d, i, rows.POSITION] = problem.positions[d, i]
            trace.rows[d, i, rows.STATUS] = status.MAX_ITERATIONS
        elif not walk.going[lane]:
            walk.blocked[lane] = 0.0
        elif walk.blocked[lane] * (problem.positions[d, i] - walk.t[lane]) > 0.0:
            walk.going[lane] = False
            trace.rows[d, i, rows.POSITION] = problem.positions[d, i]
            trace.rows[d, i, rows.STATUS] = trace.rows[d, i - 1, rows.STATUS]


def trace_carefully(problem: Problem, options: Options, trace: Trace) -> None:
    """`_trace` with a workspace."""
    modes, points = mode_count(problem), problem.rule.weights.shape[0]
    pairs, tables = most_constraints(problem), problem.profile
    tools = Tools(
        make_spare(modes, points),
        make_sqp(problem),
        several.make_rubbing(modes, pairs),
        make_wide(tables.slope.shape[1] + tables.shear.shape[1], points, pairs),
    )
    _trace(problem, options, make_block(problem), tools, trace)


@inner
def _solve_all(problem, options, block, tools, trace):
    """`_trace` with shared records."""
    designs, positions = problem.positions.shape
    lanes, walk, measuring = workspaces(problem, block)
    for first in range(0, designs, LANES):
        begin_block(problem, first, lanes)
        for lane in range(LANES):
            forget(walk, lane, 0.0)
        for i in range(positions):
            contact = begin_position(problem, i, lanes, walk, trace)
            _skip_blocked(problem, i, lanes, walk, trace)
            for lane in range(LANES):
                walk.touching[lane] = walk.going[lane]
                walk.room[lane] = LONGEST_MOVE
                if walk.going[lane]:
                    way = abs(problem.positions[lanes.design[lane], i] - walk.t[lane])
                    least = c.GAP_ROUNDING * (1.0 + abs(walk.t[lane]))
                    walk.room[lane] = max(min(LONGEST_MOVE, options.longest_move * way), least)
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
                            tools,
                            options,
                            trace.rows[d, i],
                            trace.contacts[d, i],
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
                    if lanes.active[lane] and lanes.good[lane]:  # what was counted there
                        for column in _OWN:
                            value = trace.rows[lanes.design[lane], i, column]
                            measuring.row[column, lane] = value
                        discrete = discretisation(problem, lanes, lane)
                        if problem.form == c.CLOSEST and lanes.hold[lane] == AS_STORED:
                            missing = trace.rows[lanes.design[lane], i, rows.ESTIMATE]
                            missing += rows.FORCE_ROUNDING + measuring.row[rows.DISCRETE, lane]
                            measuring.row[rows.ESTIMATE, lane] = missing
                        measuring.row[rows.DISCRETE, lane] += discrete
                        measuring.row[rows.ESTIMATE, lane] += (
                            rows.ALGEBRAIC * measuring.row[rows.RESIDUAL, lane] + discrete
                        )
                store(i, lanes, measuring.row, trace)


@kernel
def _trace(problem, options, block, tools, trace):
    """Solve all positions of all designs by the SQP, in whatever form their constraints have.

    options: `sqp.solve.Options`; trace: `Trace`, zeros on entry. What does not converge is a row
    with a status.
    """
    _solve_all(share(problem), options, block, share(tools), share(trace))
