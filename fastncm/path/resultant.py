"""Of a design that is solved by itself: the resultant of all contacts, which a row holds, what each
of them does, and the error that several contacts or a point form bring.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inner
from fastncm.kernels.gap import closest_gap
from fastncm.path import rows, several
from fastncm.path.left_out import left_out
from fastncm.sqp.design import Design
from fastncm.sqp.solve import SqpWork, make_work

#: The error that is due to M points, over what the closed form's conditions lack: 0.5 to 7 for M
#: from 10 to 400 on snapfit-circle, with either of the two point forms.
_POINTS = 3.0


class Wide(NamedTuple):
    """Room for one design with the modes that are left out behind its own: slope (Q, m), end (m,),
    u (m,) and the workspaces for all of them."""

    slope: np.ndarray
    end: np.ndarray
    u: np.ndarray
    work: SqpWork
    rubbing: several.Rubbing


def make_wide(modes: int, points: int, pairs: int) -> Wide:
    """Room for `modes` in all."""
    return Wide(
        np.zeros((points, modes)),
        np.zeros(modes),
        np.zeros(modes),
        make_work(modes, points, pairs),
        several.make_rubbing(modes, pairs),
    )


@inner
def resultant(work, rubbing, gap):
    """Write the resultant of all contacts into `gap` (GAP_COLUMNS,), with unit normal force.

    Its direction, its moment about the tip, and the force-weighted mean place; no second
    derivatives. The direction is that of the normal forces together. Returns ``(force, friction
    force)`` of the resultant.
    """
    for column in range(c.GAP_COLUMNS):
        gap[column] = 0.0
    total, fx, fy, turn = 0.0, 0.0, 0.0, 0.0
    for k in range(work.multipliers.shape[0]):
        share, rub, one = work.multipliers[k], rubbing.rub[k], work.at.gaps[:, k]
        if share > 0.0:
            for column in (c.GX, c.GY, c.PX, c.PY):
                gap[column] += share * one[column]
            fx += share * one[c.GX] - rub * one[c.GY]
            fy += share * one[c.GY] + rub * one[c.GX]
            turn += share * one[c.GP] + rub * rubbing.tangent[k, 2]
            total += share
    size = np.sqrt(gap[c.GX] ** 2 + gap[c.GY] ** 2)
    if not size > 0.0:
        return 0.0, 0.0
    nx, ny = gap[c.GX] / size, gap[c.GY] / size
    gap[c.GX], gap[c.GY] = nx, ny
    for column in (c.PX, c.PY):
        gap[column] /= total
    force, friction = fx * nx + fy * ny, fy * nx - fx * ny
    # what friction at the mean place does not turn
    arm_x, arm_y = gap[c.PX] - work.at.pose[0], gap[c.PY] - work.at.pose[1]
    gap[c.GP] = (turn - friction * (arm_x * nx + arm_y * ny)) / force
    return force, friction


@inner
def count_contacts(work, rubbing, lanes, lane, row, contacts):
    """Contacts and sticking ones of the solved `lane` into its row, and what each does into
    `contacts` (C, 4). Returns the last one's feature."""
    touching, sticking, feature = 0, False, c.VOID
    contacts[:, :] = 0.0
    for k in range(work.multipliers.shape[0]):
        force, rub, gap = work.multipliers[k], rubbing.rub[k], work.at.gaps[:, k]
        if force > 0.0:
            touching += 1
            feature = int(gap[c.FEATURE])
            if lanes.mu[lane] > 0.0 and rubbing.kept[k] == several.STICKS:
                sticking, lanes.anchor[lane] = True, rubbing.anchor[k]
            one = contacts[min(touching, contacts.shape[0]) - 1]
            one[0], one[1] = gap[c.PX], gap[c.PY]
            one[2] = force * gap[c.GX] - rub * gap[c.GY]
            one[3] = force * gap[c.GY] + rub * gap[c.GX]
    row[rows.CONTACTS] = touching
    row[rows.STICKING] = touching if sticking else 0  # two contacts stick together
    return feature


@inner
def truncation(problem, lanes, lane, spare, work, rubbing, wide):
    """Estimated relative error of the resultant force of the solved `lane` that is due to the modes
    that are left out: as in `path.rows`, but for its direction, too, and any number of contacts."""
    own, mu = spare.u.shape[0], lanes.mu[lane]
    for k in range(wide.u.shape[0]):
        inside = k < own
        wide.u[k] = spare.u[k] if inside else 0.0
        wide.end[k] = spare.end[k] if inside else lanes.beyond_end[k - own, lane]
        for q in range(wide.slope.shape[0]):
            beyond = lanes.beyond[max(k - own, 0), q, lane]
            wide.slope[q, k] = spare.slope[q, k] if inside else beyond
    for k in range(rubbing.kept.shape[0]):
        wide.work.multipliers[k] = work.multipliers[k]
        wide.rubbing.rub[k] = rubbing.rub[k]
        state = rubbing.kept[k] if mu > 0.0 else several.FORWARD
        wide.rubbing.state[k] = state if work.multipliers[k] > 0.0 else several.OPEN
    design = Design(
        wide.slope,
        wide.end,
        problem.rule.weights,
        problem.jaw,
        problem.target,
        lanes.design[lane],
        problem.kind,
        problem.form,
        problem.points,
    )
    total, size = left_out(design, own, mu, lanes.t[lane], wide.u, wide.work, wide.rubbing)
    return rows.of_truth(rows.SAFETY * total + rows.RESERVE * size)


@inner
def discretisation(problem, lanes, lane):
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
