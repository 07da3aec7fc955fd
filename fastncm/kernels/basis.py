"""Moments that are orthonormal in the strain energy, tabulated at the Gauss points.

The bending moment of a loaded finger is smooth where its curvature is not: a thin end bends most.
So the curvature is expanded as ``psi'(s) = sum_k u_k p_k(z) / D`` where ``D(s) = (w(s) / w(0))^3``
is the bending stiffness over that of the clamp, and p_k are polynomials of

    z(s) = ln(w(s) / w(0)) / ln(w(1) / w(0)),    z = s on a uniform finger,

which is evenly spaced in the logarithm of the thickness. They are orthonormal: ``integral p_k p_l /
D ds = delta_kl``. The energy is then ``V = 1/2 sum_k u_k^2`` for every taper: no stiffness matrix
is integrated or factorised in the solver, and the unknowns are well scaled whatever the taper. On a
uniform finger the p_k are Legendre's. Shear forces are expanded in the same way with the weight
``1 / A``, ``A(s) = w(s) / w(0)``. (The error of the moment of a finger bent by 0.3 rad, 8 modes,
taper 2:1 and 20:1: 1e-8 and 2e-6; with polynomials in s for the curvature 4e-5 and 0.3.)

(Lan & Lee 2008, eqs. (7), (8), expand psi and gamma in monomials, ill-conditioned beyond order 8.)
"""

import functools
from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import driver, kernel
from fastncm.kernels.constants import MAX_ORDER

#: Modes behind the last one that are tabulated for the error estimate: the first ones left out
#: carry nearly all of the error, and one of them may vanish by symmetry.
BEYOND = 3
#: Gauss points for the tables, more than modes: what is integrated is a product of two modes and of
#: the weight, an exponential of z.
_EXTRA = 24
#: Tapers up to these powers of 2 (either way) share a quadrature, made for the last of them: it
#: follows the angle where the finger is thin. The first one is the plain rule.
_GRADES = (0.25, 1.0, 2.0, 4.0, 7.0, 10.0, 20.0, 1100.0)
#: Further Gauss points of each.
_GRADE_POINTS = (0, 2, 2, 4, 6, 8, 12, 16)
#: Gauss points at most.
MAX_POINTS = MAX_ORDER + 3 + _GRADE_POINTS[-1]


class Quadrature(NamedTuple):
    """Quadrature on [0, 1] for one order and grade: Gauss-Legendre's in the variable z of a taper.

    nodes, weights: shape (Q,). integral: shape (Q, Q), ``integral[i, j]``: weight of the value at
    node j in the integral from 0 to node i.
    """

    nodes: np.ndarray
    weights: np.ndarray
    integral: np.ndarray


class Profile(NamedTuple):
    """Basis of one thickness profile at the Q Gauss points.

    slope: (n, Q) integral of p_k / D from 0 to the node; end: (n,) the same up to the tip; shear:
    (n, Q) shear functions; shear_end: (n,) their values at the tip; area: (Q,) A. n counts the
    BEYOND modes that follow those of the order.
    """

    slope: np.ndarray
    end: np.ndarray
    shear: np.ndarray
    shear_end: np.ndarray
    area: np.ndarray


def grade(ratios: np.ndarray) -> np.ndarray:
    """Which quadrature the linear tapers `ratios` (tip / clamp thickness, (P,)) need: 0 the plain
    one; positive for thick tips, negative for thin ones, (P,) int64."""
    octaves = np.log2(ratios)
    found: np.ndarray = np.searchsorted(_GRADES, np.abs(octaves)) * np.sign(octaves)
    return found.astype(np.int64)


def quadrature_points(order: int, graded: int = 0) -> int:
    """Gauss points for `order` modes: their error stays below that of the modes
    (tests/kernels/test_basis.py)."""
    return order + 3 + _GRADE_POINTS[abs(graded)]


@functools.cache
def quadrature(points: int, graded: int = 0) -> Quadrature:
    """The rule with `points` Gauss points for tapers of a `grade`, and its matrix of running
    integrals."""
    nodes, weights = _unit_gauss(points)
    recurrence = np.empty((points, 2))
    exact_nodes, exact_weights = _unit_gauss(points + _EXTRA)
    stieltjes(exact_nodes, exact_weights, recurrence)
    at_nodes = np.empty((points, points))
    running = np.empty((points, points))
    for i, z in enumerate(nodes):
        evaluate(recurrence, z, at_nodes[:, i])
        integrate(recurrence, z, exact_nodes, exact_weights, running[:, i])
    # the Lagrange polynomial of node j is sum_k weights_j p_k(z_j) p_k(z)
    integral = np.einsum("ki,kj->ij", running, at_nodes * weights)  # no BLAS: see `_unit_gauss`
    if graded == 0:
        return Quadrature(nodes, weights, integral)
    ratio = 2.0 ** (np.sign(graded) * min(_GRADES[abs(graded)], 60.0))
    arc, pace = stretch(ratio, nodes)
    return Quadrature(arc, weights * pace, integral * pace)


def stretch(ratio: float, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The arc length s at `z` of a linear taper, and ds/dz there."""
    if ratio == 1.0:
        return z, np.ones_like(z)
    grows = np.log(ratio)
    return np.expm1(grows * z) / np.expm1(grows), grows * np.exp(grows * z) / np.expm1(grows)


@functools.cache
def _unit_gauss(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of the Gauss-Legendre rule on [0, 1].

    By Newton's method on P_n from Tricomi's guess. NumPy's and SciPy's rules come from LAPACK,
    whose last bit depends on the number of threads: a table would then depend on which process
    solved a case.
    """
    x = np.cos(np.pi * (np.arange(points, 0, -1) - 0.25) / (points + 0.5))
    for _ in range(10):
        before, value = np.zeros(points), np.ones(points)
        slope_before, slope = np.zeros(points), np.zeros(points)
        for k in range(1, points + 1):
            slope_before, slope = slope, slope_before + (2 * k - 1) * value
            before, value = value, ((2 * k - 1) * x * value - (k - 1) * before) / k
        x = x - value / slope
        x = (x - x[::-1]) / 2.0
    # as in numpy.polynomial.legendre.leggauss: the product is the least sensitive to the nodes'
    # rounding
    weights = 1.0 / (before * slope)
    weights = weights + weights[::-1]
    return (x + 1.0) / 2.0, weights / weights.sum()


@driver
def stieltjes(nodes, weights, recurrence):
    """Three-term recurrence of the polynomials orthonormal for the discrete measure `weights` on
    `nodes`.

    recurrence: (n, 2), overwritten: ``b_{k} phi_k = (s - a_k) phi_{k-1} - b_{k-1} phi_{k-2}``, row
    k holds ``(a_k, b_k)``, row 0 ``(0, |1|)``. Stieltjes' procedure (Gautschi 2004, sec. 2.2.3),
    stable in double precision for the smooth weights used here.
    """
    n = recurrence.shape[0]
    count = nodes.shape[0]
    before = np.zeros(count)
    current = np.empty(count)
    total = 0.0
    for i in range(count):
        total += weights[i]
    recurrence[0, 0] = 0.0
    recurrence[0, 1] = np.sqrt(total)
    for i in range(count):
        current[i] = 1.0 / recurrence[0, 1]
    b = 0.0
    for k in range(1, n):
        a = 0.0
        for i in range(count):
            a += weights[i] * nodes[i] * current[i] * current[i]
        norm = 0.0
        for i in range(count):
            value = (nodes[i] - a) * current[i] - b * before[i]
            before[i] = current[i]
            current[i] = value
            norm += weights[i] * value * value
        b = np.sqrt(norm)
        for i in range(count):
            current[i] /= b
        recurrence[k, 0] = a
        recurrence[k, 1] = b


@kernel
def evaluate(recurrence, s, out):
    """Values of all polynomials at `s`. out: (n,), overwritten."""
    n = recurrence.shape[0]
    out[0] = 1.0 / recurrence[0, 1]
    before, b = 0.0, 0.0
    for k in range(1, n):
        value = ((s - recurrence[k, 0]) * out[k - 1] - b * before) / recurrence[k, 1]
        before, b = out[k - 1], recurrence[k, 1]
        out[k] = value


@driver
def integrate(recurrence, s, nodes, weights, out):
    """Integrals of all polynomials from 0 to `s` by the rule (`nodes`, `weights`) on [0, 1].

    out: (n,), overwritten. Exact where the rule has at least n / 2 points.
    """
    n = recurrence.shape[0]
    values = np.empty(n)
    for k in range(n):
        out[k] = 0.0
    for i in range(nodes.shape[0]):
        evaluate(recurrence, s * nodes[i], values)
        for k in range(n):
            out[k] += s * weights[i] * values[k]


@driver
def fill_profile(ratio, exact_nodes, exact_weights, nodes, profile):
    """Tables of a linear taper with tip thickness / clamp thickness = `ratio`, written into
    `profile`.

    exact_nodes, exact_weights: the rule for the integrals in z; nodes: (Q,) where to tabulate, in
    s. The shear part is left out where `profile.shear` has no rows.
    """
    count = exact_nodes.shape[0]
    order = profile.slope.shape[0]
    recurrence = np.empty((order, 2))
    weighted = np.empty(count)
    column = np.empty(order)
    grows = np.log(ratio)
    pace = grows / (ratio - 1.0) if ratio != 1.0 else 1.0  # ds = pace w dz
    for i in range(count):
        weighted[i] = exact_weights[i] * pace * np.exp(-2.0 * grows * exact_nodes[i])
    stieltjes(exact_nodes, weighted, recurrence)
    _integrate_moments(recurrence, 1.0, grows, pace, exact_nodes, exact_weights, profile.end)
    for q in range(nodes.shape[0]):
        z = np.log1p((ratio - 1.0) * nodes[q]) / grows if ratio != 1.0 else nodes[q]
        profile.area[q] = 1.0 + (ratio - 1.0) * nodes[q]
        _integrate_moments(recurrence, z, grows, pace, exact_nodes, exact_weights, column)
        for k in range(order):
            profile.slope[k, q] = column[k]
    if profile.shear.shape[0] == 0:
        return
    for i in range(count):
        weighted[i] = exact_weights[i] * pace
    stieltjes(exact_nodes, weighted, recurrence)
    evaluate(recurrence, 1.0, column)
    for k in range(order):
        profile.shear_end[k] = column[k] / ratio
    for q in range(nodes.shape[0]):
        z = np.log1p((ratio - 1.0) * nodes[q]) / grows if ratio != 1.0 else nodes[q]
        evaluate(recurrence, z, column)
        for k in range(order):
            profile.shear[k, q] = column[k] / profile.area[q]


@driver
def _integrate_moments(recurrence, z, grows, pace, nodes, weights, out):
    """Integrals of all ``p_k / D`` from the clamp to `z`. out: (n,), overwritten."""
    n = recurrence.shape[0]
    values = np.empty(n)
    for k in range(n):
        out[k] = 0.0
    for i in range(nodes.shape[0]):
        evaluate(recurrence, z * nodes[i], values)
        weight = z * weights[i] * pace * np.exp(-2.0 * grows * z * nodes[i])
        for k in range(n):
            out[k] += weight * values[k]


@driver
def _fill_profiles(ratios, exact_nodes, exact_weights, nodes, tables):
    for i in range(ratios.shape[0]):
        fill_profile(
            ratios[i],
            exact_nodes,
            exact_weights,
            nodes,
            Profile(
                tables.slope[i],
                tables.end[i],
                tables.shear[i],
                tables.shear_end[i],
                tables.area[i],
            ),
        )


def profiles(ratios: np.ndarray, order: int, shear: bool, graded: int = 0) -> Profile:
    """Tables of all linear tapers `ratios` (tip / clamp thickness, shape (P,)) of one `grade`,
    stacked along axis 0.

    order: modes per field (2 to 32); shear: whether the shear functions are wanted.
    """
    if not 1 <= order <= MAX_ORDER:
        raise ValueError(f"order must lie in 1 ... {MAX_ORDER}, got {order}")
    count, points = len(ratios), quadrature_points(order, graded)
    bending = order + BEYOND
    modes = bending if shear else 0
    tables = Profile(
        slope=np.empty((count, bending, points)),
        end=np.empty((count, bending)),
        shear=np.empty((count, modes, points)),
        shear_end=np.empty((count, modes)),
        area=np.empty((count, points)),
    )
    exact_nodes, exact_weights = _unit_gauss(bending + _EXTRA)
    _fill_profiles(
        np.ascontiguousarray(ratios, dtype=np.float64),
        exact_nodes,
        exact_weights,
        quadrature(points, graded).nodes,
        tables,
    )
    return tables


def fields(ratio: float, order: int, shear: bool, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values at the points `s` (R,) of the first `order` bending angles (integrals of p_k / D) and
    shear functions.

    Each (order, R); the second has no rows without `shear`.
    """
    points = len(s)
    tables = Profile(
        slope=np.empty((order, points)),
        end=np.empty(order),
        shear=np.empty((order if shear else 0, points)),
        shear_end=np.empty(order if shear else 0),
        area=np.empty(points),
    )
    exact_nodes, exact_weights = _unit_gauss(order + _EXTRA)
    nodes = np.ascontiguousarray(s, dtype=np.float64)
    fill_profile(ratio, exact_nodes, exact_weights, nodes, tables)
    return tables.slope, tables.shear
