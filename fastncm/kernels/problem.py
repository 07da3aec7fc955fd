"""The dimensionless problem: what `lowering` hands to the compiled code.

Lengths are in units of the finger's length L, forces in E I / L^2 of the clamp's section, energies
in E I / L. Nothing below this line knows metres or newtons.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.basis import BEYOND, Profile, Quadrature
from fastncm.kernels.cache import inner, kernel
from fastncm.kernels.constants import CIRCLE, CLOSEST, JAW_COLUMNS, TARGET_COLUMNS


class Problem(NamedTuple):
    """A chunk of D designs that share order, kind of target and form of the constraints.

    rule: Gauss rule of the order (Q points). profile: basis tables of the P different thickness
    profiles, stacked (`kernels.basis.profiles`). profile_of: (D,) int64, which of them. ratio: (D,)
    tip over clamp thickness. shear_stiffness: (D,) kappa G A L^2 / (E I) at the clamp (not read
    without shear). printed_section: 1 where the section turns by psi + gamma as printed. jaw: (D,
    JAW_COLUMNS); target: (D, TARGET_COLUMNS). mu: (D,) friction that acts while the finger bends.
    positions: (D, N) of the target, in the order to solve. kind: CIRCLE or BLOCK; form: CLOSEST,
    POINTS_ON_FINGER or POINTS_ON_TARGET; points: M of the latter two.
    """

    rule: Quadrature
    profile: Profile
    profile_of: np.ndarray
    ratio: np.ndarray
    shear_stiffness: np.ndarray
    printed_section: int
    jaw: np.ndarray
    target: np.ndarray
    mu: np.ndarray
    positions: np.ndarray
    kind: int
    form: int
    points: int


def no_designs() -> Problem:
    """A problem without designs, of the types that all have: compiled code may be made with it."""
    order, points = 1 + BEYOND, 1
    number, table = np.zeros(0), np.zeros((0, order))
    return Problem(
        rule=Quadrature(np.zeros(points), np.zeros(points), np.zeros((points, points))),
        profile=Profile(
            np.zeros((0, order, points)), table, np.zeros((0, 0, points)), table, table
        ),
        profile_of=np.zeros(0, np.int64),
        ratio=number,
        shear_stiffness=number,
        printed_section=0,
        jaw=np.zeros((0, JAW_COLUMNS)),
        target=np.zeros((0, TARGET_COLUMNS)),
        mu=number,
        positions=np.zeros((0, 0)),
        kind=CIRCLE,
        form=CLOSEST,
        points=0,
    )


def select(problem: Problem, designs: np.ndarray) -> Problem:
    """The problem of some of its designs (indices)."""
    each = ("profile_of", "ratio", "shear_stiffness", "jaw", "target", "mu", "positions")
    return problem._replace(**{name: getattr(problem, name)[designs] for name in each})


@kernel
def mode_count(problem):
    """Unknowns of each design: bending modes, and as many shear modes where there is shear."""
    return problem.profile.slope.shape[1] + problem.profile.shear.shape[1] - beyond_count(problem)


@inner
def beyond_count(problem):
    """Tabulated modes that are left out of the unknowns, of all fields together."""
    return 2 * BEYOND if problem.profile.shear.shape[1] > 0 else BEYOND


@inner
def fill_basis(problem, d, lane, lanes):
    """Write the tables of design `d` into `lane` of `lanes` (`path.lanes`).

    The shear functions are divided by sqrt(kappa G A L^2 / E I), which makes them orthonormal in
    the energy.
    """
    p = problem.profile_of[d]
    tables = problem.profile
    points = tables.slope.shape[2]
    order = tables.slope.shape[1] - BEYOND
    lanes.strain_end[lane] = 1.0 / problem.ratio[d] ** 2
    for q in range(points):
        lanes.strain[q, lane] = 1.0 / tables.area[p, q] ** 2
    for k in range(order):
        lanes.end[k, lane] = tables.end[p, k]
        for q in range(points):
            lanes.slope[k, q, lane] = tables.slope[p, k, q]
    for k in range(BEYOND):
        lanes.beyond_end[k, lane] = tables.end[p, order + k]
        for q in range(points):
            lanes.beyond[k, q, lane] = tables.slope[p, order + k, q]
    if tables.shear.shape[1] == 0:
        return
    scale = 1.0 / np.sqrt(problem.shear_stiffness[d])
    end = scale if problem.printed_section else 0.0
    for k in range(order):
        lanes.end[order + k, lane] = end * tables.shear_end[p, k]
        for q in range(points):
            lanes.slope[order + k, q, lane] = scale * tables.shear[p, k, q]
    for k in range(BEYOND):
        lanes.beyond_end[BEYOND + k, lane] = end * tables.shear_end[p, order + k]
        for q in range(points):
            lanes.beyond[BEYOND + k, q, lane] = scale * tables.shear[p, order + k, q]
