"""The energy-orthonormal polynomials, and the quadrature that they are used with."""

import numpy as np
import pytest
from numpy.polynomial import legendre
from tracing import CIRCLE, CORNER, solved_force

from fastncm.kernels import basis

RATIOS = (1.0, 0.5, 1e-3)
ORDERS = (2, 3, 5, 8, 16, 32)


def tables(ratio: float, order: int, shear: bool = True) -> basis.Profile:
    """The profile of one taper, without the leading axis."""
    return basis.Profile(*(table[0] for table in basis.profiles([ratio], order, shear)))


def rule(order: int) -> basis.Quadrature:
    return basis.quadrature(basis.quadrature_points(order))


def running_integral(values: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Integrals from 0 of the polynomials with `values` (n, Q) at the nodes: at the nodes, and at 1."""
    nodes, weights, _ = rule(order)
    x = 2.0 * nodes - 1.0
    degrees = np.arange(order)
    coefficients = (2 * degrees[:, None] + 1) * (legendre.legvander(x, order - 1).T * weights)
    integrals = legendre.legint(coefficients @ values.T, lbnd=-1.0) / 2.0
    return legendre.legval(x, integrals), legendre.legval(1.0, integrals)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("order", ORDERS)
def test_orthonormal_in_the_energy(ratio: float, order: int) -> None:
    table, weights = tables(ratio, order), rule(order).weights
    bending = (table.curvature * weights * table.stiffness) @ table.curvature.T
    shear = (table.shear * weights * table.area) @ table.shear.T
    np.testing.assert_allclose(bending, np.eye(order), atol=1e-12)
    np.testing.assert_allclose(shear, np.eye(order), atol=1e-12)


@pytest.mark.parametrize("ratio", RATIOS)
def test_stiffness_and_area_of_a_linear_taper(ratio: float) -> None:
    table, nodes = tables(ratio, 4), rule(4).nodes
    thickness = 1.0 + (ratio - 1.0) * nodes
    np.testing.assert_allclose(table.area, thickness, rtol=1e-14)
    np.testing.assert_allclose(table.stiffness, thickness**3, rtol=1e-14)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("order", ORDERS)
def test_slope_is_the_integral_of_the_curvature(ratio: float, order: int) -> None:
    table = tables(ratio, order)
    slope, end = running_integral(table.curvature, order)
    size = np.abs(table.curvature).max()
    np.testing.assert_allclose(table.slope, slope, atol=1e-13 * size)
    np.testing.assert_allclose(table.end, end, atol=1e-13 * size)


@pytest.mark.parametrize("order", ORDERS)
def test_uniform_finger_has_legendre_polynomials(order: int) -> None:
    table, nodes = tables(1.0, order), rule(order).nodes
    scale = np.sqrt(2.0 * np.arange(order) + 1.0)
    exact = scale * legendre.legvander(2.0 * nodes - 1.0, order - 1)
    np.testing.assert_allclose(table.curvature, exact.T, atol=1e-12)
    np.testing.assert_allclose(table.shear, exact.T, atol=1e-12)
    np.testing.assert_allclose(table.shear_end, scale, rtol=1e-12)
    np.testing.assert_allclose(table.end, np.eye(order)[0], atol=1e-14)


@pytest.mark.parametrize("ratio", RATIOS)
def test_shear_functions_at_the_tip(ratio: float) -> None:
    """The tip is outside the Gauss points: extrapolate the polynomial through them."""
    order = 5
    table, nodes = tables(ratio, order), rule(order).nodes
    fit = np.linalg.lstsq(legendre.legvander(2 * nodes - 1, order - 1), table.shear.T, rcond=None)
    np.testing.assert_allclose(table.shear_end, fit[0].sum(axis=0), rtol=1e-11)


def test_without_shear_there_are_no_shear_tables() -> None:
    table = tables(0.5, 4, shear=False)
    assert table.shear.shape == (0, 7)
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
    monkeypatch.setattr("fastncm.kernels.basis.quadrature_points", lambda order: 40)
    monkeypatch.setattr("fastncm.lowering.quadrature_points", lambda order: 40)
    exact = solved_force(scene, order)
    of_the_modes = np.abs(exact / truth - 1.0).max()
    of_the_quadrature = np.abs(usual / exact - 1.0).max()
    assert of_the_quadrature < max(of_the_modes, 1e-13)
