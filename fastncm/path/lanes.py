"""State and workspace of `LANES` designs that walk along their paths side by side."""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import driver
from fastncm.kernels.constants import LANES
from fastncm.kernels.problem import Basis, beyond_count, mode_count

#: A hold that keeps the gap as it stands: the resultant of several contacts.
AS_STORED = -2


class Lanes(NamedTuple):
    """The lane is the last axis of every array.

    State. design: which design; t: (LANES,) position of the target; hold: feature to keep, -1: the
    nearest; active: bool, to be solved; u: (m, LANES) unknowns; force: multiplier; u_rate,
    force_rate: their derivatives by t.

    Evaluation. sin, cos: (Q, LANES); pose: (3, LANES); gradient: (2, m, LANES); gap: (GAP_COLUMNS,
    LANES); jacobian: (m, LANES).

    Workspace. hessian: (m, m, LANES); down, across, along: (m, LANES) solutions with it; pull: (3,
    m, LANES); work: (Q, LANES); fx, fy, moved, negative, compliance: (LANES,); pending: bool.

    Outcome. residual: KKT; iterations: int64; good: bool.
    """

    basis: Basis
    design: np.ndarray
    t: np.ndarray
    hold: np.ndarray
    active: np.ndarray
    u: np.ndarray
    force: np.ndarray
    u_rate: np.ndarray
    force_rate: np.ndarray
    sin: np.ndarray
    cos: np.ndarray
    pose: np.ndarray
    gradient: np.ndarray
    gap: np.ndarray
    jacobian: np.ndarray
    hessian: np.ndarray
    down: np.ndarray
    across: np.ndarray
    along: np.ndarray
    pull: np.ndarray
    work: np.ndarray
    fx: np.ndarray
    fy: np.ndarray
    moved: np.ndarray
    negative: np.ndarray
    compliance: np.ndarray
    pending: np.ndarray
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
        basis,
        np.zeros(LANES, np.int64),
        np.zeros(LANES),
        np.full(LANES, -1),
        np.zeros(LANES, np.bool_),
        np.zeros((modes, LANES)),
        np.zeros(LANES),
        np.zeros((modes, LANES)),
        np.zeros(LANES),
        np.zeros((points, LANES)),
        np.zeros((points, LANES)),
        np.zeros((3, LANES)),
        np.zeros((2, modes, LANES)),
        np.zeros((c.GAP_COLUMNS, LANES)),
        np.zeros((modes, LANES)),
        np.zeros((modes, modes, LANES)),
        np.zeros((modes, LANES)),
        np.zeros((modes, LANES)),
        np.zeros((modes, LANES)),
        np.zeros((3, modes, LANES)),
        np.zeros((points, LANES)),
        np.zeros(LANES),
        np.zeros(LANES),
        np.zeros(LANES),
        np.zeros(LANES),
        np.zeros(LANES),
        np.zeros(LANES, np.bool_),
        np.zeros(LANES),
        np.zeros(LANES, np.int64),
        np.zeros(LANES, np.bool_),
    )
