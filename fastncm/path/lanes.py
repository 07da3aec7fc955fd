"""State and workspace of `LANES` designs that walk along their paths side by side."""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import driver, inlined
from fastncm.kernels.constants import LANES
from fastncm.kernels.problem import Basis, beyond_count, mode_count

#: A hold that keeps the gap as it stands: the resultant of several contacts.
AS_STORED = -2


class Lanes(NamedTuple):
    """The lane is the last axis of every array.

    State. design: which design; t: (LANES,) position of the target; hold: feature to keep, -1: the
    nearest; active: bool, to be solved; u: (m, LANES) unknowns; force: multiplier; rub: friction
    force along the contact's tangent ``t = (-ny, nx)``; u_rate, force_rate, rub_rate, pose_rate (3,
    LANES): derivatives by the target's position.

    Friction. mu: (LANES,) coefficient; sticks: bool; side: friction over normal force of a sliding
    contact, +mu or -mu; 0 where it sticks; anchor: slip (`path.slip`) to keep where it sticks, and
    slipped, what it has instead. rubs, holds: (1,) bool, whether any lane has friction, sticks:
    what no lane needs is left out.

    Evaluation. sin, cos: (Q, LANES); pose: (3, LANES); gradient: (2, m, LANES); gap: (GAP_COLUMNS,
    LANES); jacobian: (m, LANES) dg/du; loaded: (3, LANES) the contact's wrench; tangent: (3, LANES)
    that of a unit force along t; arm: (2, LANES) from the tip to the contact.

    Workspace. hessian: (m, m, LANES) and its factor; negative: (LANES,) its negative pivots; down:
    (m, LANES) and across: (3, m, LANES), solutions with it; pull: (3, m, LANES) of
    `path.frictionless`; work: (Q, LANES); fx, fy, moved: (LANES,); pending: bool. Of `path.tip`:
    flexible, change, small: (3, 3, LANES); reach, slide,
    leaned, driven, pushed, held, shift, answer: (3, LANES); inverse: (2, 2, LANES); penalty, crept,
    determinant: (LANES,).

    Outcome. residual: KKT; iterations: int64; good: bool.
    """

    basis: Basis
    design: np.ndarray
    t: np.ndarray
    hold: np.ndarray
    active: np.ndarray
    u: np.ndarray
    force: np.ndarray
    rub: np.ndarray
    u_rate: np.ndarray
    force_rate: np.ndarray
    rub_rate: np.ndarray
    pose_rate: np.ndarray
    mu: np.ndarray
    sticks: np.ndarray
    side: np.ndarray
    anchor: np.ndarray
    slipped: np.ndarray
    rubs: np.ndarray
    holds: np.ndarray
    sin: np.ndarray
    cos: np.ndarray
    pose: np.ndarray
    gradient: np.ndarray
    gap: np.ndarray
    jacobian: np.ndarray
    loaded: np.ndarray
    tangent: np.ndarray
    arm: np.ndarray
    hessian: np.ndarray
    negative: np.ndarray
    down: np.ndarray
    across: np.ndarray
    pull: np.ndarray
    work: np.ndarray
    fx: np.ndarray
    fy: np.ndarray
    moved: np.ndarray
    pending: np.ndarray
    flexible: np.ndarray
    change: np.ndarray
    small: np.ndarray
    reach: np.ndarray
    leaned: np.ndarray
    driven: np.ndarray
    slide: np.ndarray
    pushed: np.ndarray
    held: np.ndarray
    shift: np.ndarray
    answer: np.ndarray
    inverse: np.ndarray
    penalty: np.ndarray
    crept: np.ndarray
    determinant: np.ndarray
    residual: np.ndarray
    iterations: np.ndarray
    good: np.ndarray


@driver
def make_lanes(problem):
    """Lanes for the designs of `problem`."""
    modes, points = mode_count(problem), problem.rule.weights.shape[0]
    beyond = beyond_count(problem)
    basis = Basis(
        np.zeros((modes, points, LANES)),
        np.zeros((modes, LANES)),
        np.zeros((beyond, points, LANES)),
        np.zeros((beyond, LANES)),
        np.ones((points, LANES)),
        np.ones(LANES),
    )
    return Lanes(
        basis=basis,
        design=np.zeros(LANES, np.int64),
        t=np.zeros(LANES),
        hold=np.full(LANES, -1),
        active=np.zeros(LANES, np.bool_),
        u=np.zeros((modes, LANES)),
        force=np.zeros(LANES),
        rub=np.zeros(LANES),
        u_rate=np.zeros((modes, LANES)),
        force_rate=np.zeros(LANES),
        rub_rate=np.zeros(LANES),
        pose_rate=np.zeros((3, LANES)),
        mu=np.zeros(LANES),
        sticks=np.zeros(LANES, np.bool_),
        side=np.zeros(LANES),
        anchor=np.zeros(LANES),
        slipped=np.zeros(LANES),
        rubs=np.zeros(1, np.bool_),
        holds=np.zeros(1, np.bool_),
        sin=np.zeros((points, LANES)),
        cos=np.zeros((points, LANES)),
        pose=np.zeros((3, LANES)),
        gradient=np.zeros((2, modes, LANES)),
        gap=np.zeros((c.GAP_COLUMNS, LANES)),
        jacobian=np.zeros((modes, LANES)),
        loaded=np.zeros((3, LANES)),
        tangent=np.zeros((3, LANES)),
        arm=np.zeros((2, LANES)),
        hessian=np.zeros((modes, modes, LANES)),
        negative=np.zeros(LANES),
        down=np.zeros((modes, LANES)),
        across=np.zeros((3, modes, LANES)),
        pull=np.zeros((3, modes, LANES)),
        work=np.zeros((points, LANES)),
        fx=np.zeros(LANES),
        fy=np.zeros(LANES),
        moved=np.zeros(LANES),
        pending=np.zeros(LANES, np.bool_),
        flexible=np.zeros((3, 3, LANES)),
        change=np.zeros((3, 3, LANES)),
        small=np.zeros((3, 3, LANES)),
        reach=np.zeros((3, LANES)),
        leaned=np.zeros((3, LANES)),
        driven=np.zeros((3, LANES)),
        slide=np.zeros((3, LANES)),
        pushed=np.zeros((3, LANES)),
        held=np.zeros((3, LANES)),
        shift=np.zeros((3, LANES)),
        answer=np.zeros((3, LANES)),
        inverse=np.zeros((2, 2, LANES)),
        penalty=np.zeros(LANES),
        crept=np.zeros(LANES),
        determinant=np.zeros(LANES),
        residual=np.zeros(LANES),
        iterations=np.zeros(LANES, np.int64),
        good=np.zeros(LANES, np.bool_),
    )


@inlined
def known_strides(lanes, modes):
    """Always true, for the right number of modes: behind this LLVM knows the strides of what the
    modes and the contact need, and vectorises loops over the lanes with many arrays in them."""
    return (
        lanes.u.shape[1] == LANES
        and lanes.gap.shape[1] == LANES
        and lanes.jacobian.shape[1] == LANES
        and lanes.loaded.shape[1] == LANES
        and lanes.basis.end.shape[1] == LANES
        and lanes.gradient.shape[1] == modes
        and lanes.gradient.shape[2] == LANES
        and lanes.pull.shape[1] == modes
        and lanes.pull.shape[2] == LANES
        and lanes.across.shape[1] == modes
        and lanes.across.shape[2] == LANES
        and lanes.hessian.shape[1] == modes
        and lanes.hessian.shape[2] == LANES
    )
