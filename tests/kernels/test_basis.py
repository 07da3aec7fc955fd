"""The energy-orthonormal moments, and the quadrature that they are used with."""

import numpy as np
import pytest
from numpy.polynomial import legendre
from tracing import CIRCLE, CORNER, solved_force

from fastncm.kernels import basis

RATIOS = (1.0, 0.5, 1e-3, 20.0)
ORDERS = (2, 3, 5, 8, 16, 32)


FINE, FINE_WEIGHTS = (0.5 * np.polynomial.legendre.leggauss(150)[i] + (0.5, 0.0)[i] for i in (0, 1))
"""NumPy's rule on [0, 1], in the variable z."""


def grade(ratio: float) -> int:
    return int(basis.grade(np.array([ratio]))[0])


def tables(ratio: float, order: int, shear: bool = True) -> basis.Profile:
    """The profile of one taper, without the leading axis."""
    stacked = basis.profiles(np.array([ratio]), order, shear, grade(ratio))
    return basis.Profile(*(table[0] for table in stacked))


def rule(order: int, ratio: float = 1.0) -> basis.Quadrature:
    graded = grade(ratio)
    return basis.quadrature(basis.quadrature_points(order, graded), graded)


def place(ratio: float, s: np.ndarray) -> np.ndarray:
    """z at s: the logarithm of the thickness over that at the tip."""
    return s if ratio == 1.0 else np.log(1.0 + (ratio - 1.0) * s) / np.log(ratio)


def loads(ratio: float, power: int, order: int, z: np.ndarray) -> np.ndarray:
    """Values (order, R) at `z` of the polynomials orthonormal with the weight thickness**-power."""
    recurrence, values = np.empty((order, 2)), np.empty((len(z), order))
    nodes, weights, _ = basis.quadrature(80)
    _, pace = basis.stretch(ratio, nodes)
    basis.stieltjes(nodes, weights * pace * ratio ** (-power * nodes), recurrence)
    for row, at in zip(values, z, strict=True):
        basis.evaluate(recurrence, at, row)
    return values.T


@pytest.mark.parametrize("ratio", RATIOS)
def test_stretched_nodes_are_even_in_the_logarithm_of_the_thickness(ratio: float) -> None:
    s, pace = basis.stretch(ratio, FINE)
    np.testing.assert_allclose(place(ratio, s), FINE, rtol=1e-12)
    step = 1e-6
    around = basis.stretch(ratio, FINE + step)[0] - basis.stretch(ratio, FINE - step)[0]
    np.testing.assert_allclose(pace, around / (2.0 * step), rtol=1e-7)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("power", [1, 3])
def test_orthonormal_in_the_weight(ratio: float, order: int, power: int) -> None:
    """Under a rule that is not the one of the recurrence."""
    values = loads(ratio, power, order, FINE)
    _, pace = basis.stretch(ratio, FINE)
    products = (values * FINE_WEIGHTS * pace * ratio ** (-power * FINE)) @ values.T
    np.testing.assert_allclose(products, np.eye(order), atol=1e-12)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("order", ORDERS)
def test_slope_is_the_integral_of_the_curvature(ratio: float, order: int) -> None:
    table, z = tables(ratio, order), place(ratio, rule(order, ratio).nodes)
    modes = order + basis.BEYOND
    for q in range(0, len(z), 4):
        inner = z[q] * FINE
        _, pace = basis.stretch(ratio, inner)
        curvature = loads(ratio, 3, modes, inner) * ratio ** (-3.0 * inner)
        expected = z[q] * (curvature * pace) @ FINE_WEIGHTS
        size = np.abs(z[q] * curvature * pace).max()
        np.testing.assert_allclose(table.slope[:, q], expected, atol=1e-13 * size)
    shear = loads(ratio, 1, modes, z) / ratio**z
    np.testing.assert_allclose(table.shear, shear, atol=1e-11 * np.abs(shear).max())


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("order", ORDERS)
def test_angles_are_integrals_from_the_clamp(ratio: float, order: int) -> None:
    """Zero at the clamp, `end` at the tip."""
    modes = order + basis.BEYOND
    angles, shear = basis.fields(ratio, modes, True, np.array([0.0, 1.0]))
    table = tables(ratio, order)
    np.testing.assert_allclose(angles[:, 0], 0.0, atol=1e-15)
    rounding = 1e-13 * np.abs(angles).max()  # at a taper of 1:1000 they reach 700
    np.testing.assert_allclose(table.end, angles[:, 1], rtol=1e-12, atol=rounding)
    np.testing.assert_allclose(table.shear_end, shear[:, 1], rtol=1e-12)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("order", ORDERS)
def test_tables_at_the_gauss_points(ratio: float, order: int) -> None:
    table, nodes = tables(ratio, order), rule(order, ratio).nodes
    modes = order + basis.BEYOND
    assert table.slope.shape == table.shear.shape == (modes, len(nodes))
    angles, shear = basis.fields(ratio, modes, True, nodes)
    for tabulated, values in ((table.slope, angles), (table.shear, shear)):
        rounding = 1e-14 * np.abs(values).max()
        np.testing.assert_allclose(tabulated, values, rtol=1e-13, atol=rounding)
    np.testing.assert_allclose(table.area, 1.0 + (ratio - 1.0) * nodes, rtol=1e-13)


@pytest.mark.parametrize("order", ORDERS)
def test_uniform_finger_has_legendre_polynomials(order: int) -> None:
    modes = order + basis.BEYOND
    table, x = tables(1.0, order), 2.0 * rule(order).nodes - 1.0
    scale = np.sqrt(2.0 * np.arange(modes) + 1.0)
    np.testing.assert_allclose(
        table.shear, (scale * legendre.legvander(x, modes - 1)).T, atol=1e-12
    )
    integrals = legendre.legint(np.diag(scale), lbnd=-1.0) / 2.0
    np.testing.assert_allclose(table.slope, legendre.legval(x, integrals), atol=1e-12)
    np.testing.assert_allclose(table.shear_end, scale, rtol=1e-12)
    np.testing.assert_allclose(table.end, np.eye(modes)[0], atol=1e-14)


def test_without_shear_there_are_no_shear_tables() -> None:
    table = tables(0.5, 4, shear=False)
    assert table.shear.shape == (0, len(rule(4, 0.5).nodes))
    assert table.shear_end.shape == (0,)


@pytest.mark.parametrize("order", [0, 33])
def test_order_out_of_range_is_refused(order: int) -> None:
    with pytest.raises(ValueError, match=r"1 \.\.\. 32"):
        basis.profiles(np.ones(1), order, False)


@pytest.mark.parametrize("points", [3, 5, 13, 35])
def test_running_integrals_of_polynomials_are_exact(points: int) -> None:
    nodes, weights, integral = basis.quadrature(points)
    for degree in range(points):
        exact = nodes ** (degree + 1) / (degree + 1)
        np.testing.assert_allclose(integral @ nodes**degree, exact, atol=1e-14)
    for degree in range(2 * points):
        assert weights @ nodes**degree == pytest.approx(1.0 / (degree + 1), rel=1e-13)


@pytest.mark.compiled
@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
@pytest.mark.parametrize("order", range(2, 11))
def test_quadrature_error_is_below_that_of_the_modes(
    scene: str, order: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The force along the whole path, with the order's Gauss points and with 40."""
    truth = solved_force(scene, 24)
    usual = solved_force(scene, order)
    monkeypatch.setattr("fastncm.kernels.basis.quadrature_points", lambda order, graded: 40)
    monkeypatch.setattr("fastncm.lowering.quadrature_points", lambda order, graded: 40)
    exact = solved_force(scene, order)
    of_the_modes = np.abs(exact / truth - 1.0).max()
    of_the_quadrature = np.abs(usual / exact - 1.0).max()
    assert of_the_quadrature < max(of_the_modes, 1e-13)
