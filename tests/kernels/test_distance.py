"""Distances to targets against brute-force minimisation, their derivatives against differences."""

from collections.abc import Callable

import numpy as np
import pytest
from entrance import entrance
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from fastncm.kernels import distance as distances
from fastncm.kernels.distance import (
    ELLIPSE,
    HALF_PLANE,
    POLYGON,
    ellipse_distance,
    polygon_distance,
)

distance = entrance(distances.distance)

SQUARE = np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]])
OBLIQUE = np.array([[[-0.3, -0.2], [0.4, -0.5], [0.9, 0.1], [0.3, 0.6], [-0.2, 0.4]]])
ELLIPSES = [(0.65, 0.4416), (0.4416, 0.65), (1.0, 0.05), (0.3, 0.3)]
Answer = tuple[float, float, float, float]


def nearest_on_ellipse(a: float, b: float, x: float, y: float) -> float:
    """Distance (>= 0) to the outline by search over the ellipse's parameter."""

    def slope(t: float) -> float:  # of half the squared distance
        c, s = np.cos(t), np.sin(t)
        return float((b * s - y) * b * c - (a * c - x) * a * s)

    def length(t: float) -> float:
        return float(np.hypot(a * np.cos(t) - x, b * np.sin(t) - y))

    t = np.linspace(-np.pi, np.pi, 1441)
    slopes = np.array([slope(one) for one in t])
    falls = np.flatnonzero((slopes[:-1] < 0.0) & (slopes[1:] >= 0.0))
    minima = [brentq(slope, t[i], t[i + 1], xtol=1e-15) for i in falls]
    return min(length(one) for one in (*minima, *t))


def nearest_on_polygon(vertices: np.ndarray, x: float, y: float) -> float:
    """Signed distance to a convex polygon from its segments and half-planes."""
    point, lengths, heights = np.array([x, y]), [], []
    for start, end in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
        edge = end - start
        share = np.clip((point - start) @ edge / (edge @ edge), 0.0, 1.0)
        lengths.append(np.hypot(*(point - start - share * edge)))
        outward = np.array([edge[1], -edge[0]]) / np.hypot(*edge)
        heights.append((point - start) @ outward)
    return float(min(lengths) if max(heights) > 0.0 else max(heights))


def check_derivatives(field: Callable[[float, float], Answer], x: float, y: float) -> None:
    """Gradient and Hessian ``kappa t t^T`` against central differences."""
    step = 1e-5
    g, nx, ny, kappa = field(x, y)
    assert np.hypot(nx, ny) == pytest.approx(1.0, abs=1e-14)
    sides = [field(x + step, y), field(x - step, y), field(x, y + step), field(x, y - step)]
    slope = [(sides[0][0] - sides[1][0]) / 2 / step, (sides[2][0] - sides[3][0]) / 2 / step]
    size = max(1.0, abs(kappa)) ** 2
    np.testing.assert_allclose([nx, ny], slope, atol=1e-9 * size)
    hessian = np.array(
        [
            [(sides[0][c] - sides[1][c]) / 2 / step for c in (1, 2)],
            [(sides[2][c] - sides[3][c]) / 2 / step for c in (1, 2)],
        ]
    )
    tangent = np.array([-ny, nx])
    np.testing.assert_allclose(kappa * np.outer(tangent, tangent), hessian, atol=1e-8 * size**1.5)


def in_rings(a: float, b: float) -> list[tuple[float, float]]:
    """Points around an ellipse: near, far and inside (not beyond its centres of curvature)."""
    t = np.linspace(0.1, 6.2, 7)
    return [
        (float((a + off) * np.cos(one)), float((b + off) * np.sin(one)))
        for one in t
        for off in (-0.3 * min(a, b) ** 2 / max(a, b), 1e-9, 0.02, 0.5, 40.0)
    ]


@pytest.mark.parametrize(("a", "b"), ELLIPSES)
def test_ellipse_against_search(a: float, b: float) -> None:
    for x, y in in_rings(a, b):
        sign = 1.0 if (x / a) ** 2 + (y / b) ** 2 > 1.0 else -1.0
        g = ellipse_distance(a, b, x, y)[0]
        expected = sign * nearest_on_ellipse(a, b, x, y)
        assert g == pytest.approx(expected, abs=1e-14 * max(1.0, abs(g)))


@pytest.mark.parametrize(("a", "b"), ELLIPSES)
def test_derivatives_of_an_ellipse(a: float, b: float) -> None:
    for x, y in in_rings(a, b):
        check_derivatives(lambda u, v: ellipse_distance(a, b, u, v), x, y)


@pytest.mark.parametrize(("a", "b"), ELLIPSES)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_on_the_axes_of_an_ellipse(a: float, b: float, sign: float) -> None:
    """Outside by plain subtraction; the curvature of the level line is 1 / (r + g)."""
    for off in (0.0, 0.01, 3.0):
        along = ellipse_distance(a, b, sign * (a + off), 0.0)
        np.testing.assert_allclose(along, [off, sign, 0.0, 1.0 / (b * b / a + off)], atol=1e-14)
        across = ellipse_distance(a, b, 0.0, sign * (b + off))
        np.testing.assert_allclose(across, [off, 0.0, sign, 1.0 / (a * a / b + off)], atol=1e-13)


@pytest.mark.parametrize(("a", "b"), ELLIPSES)
@pytest.mark.parametrize("share", [0.0, 1e-14, 1e-6, 0.3, 0.8, 0.999])
def test_inside_on_the_axes_of_an_ellipse(a: float, b: float, share: float) -> None:
    """Between the centres of curvature two points are nearest: either one's normal will do."""
    for x, y in ((share * a, 0.0), (-share * a, 0.0), (0.0, share * b), (0.0, -share * b)):
        g, nx, ny, _ = ellipse_distance(a, b, x, y)
        assert g == pytest.approx(-nearest_on_ellipse(a, b, x, y), abs=1e-13)
        on_x, on_y = x - g * nx, y - g * ny
        assert (on_x / a) ** 2 + (on_y / b) ** 2 == pytest.approx(1.0, abs=1e-11)


@given(
    a=st.floats(0.02, 5.0),
    b=st.floats(0.02, 5.0),
    x=st.floats(-8.0, 8.0),
    y=st.floats(-8.0, 8.0),
)
@settings(max_examples=150, deadline=None)
def test_closest_point_of_any_ellipse(a: float, b: float, x: float, y: float) -> None:
    """It lies on the outline, the normal is the outline's there, and none other is nearer."""
    g, nx, ny, kappa = ellipse_distance(a, b, x, y)
    assert np.isfinite([g, nx, ny]).all()
    assert (g > 0.0) == ((x / a) ** 2 + (y / b) ** 2 > 1.0) or abs(g) < 1e-12
    size = max(a, b, abs(x), abs(y))
    assert abs(g) == pytest.approx(nearest_on_ellipse(a, b, x, y), abs=1e-11 * size)
    if g > 0.0:
        assert kappa > 0.0


@pytest.mark.parametrize("vertices", [SQUARE, OBLIQUE])
def test_polygon_against_its_segments(vertices: np.ndarray) -> None:
    for x in np.linspace(-1.5, 2.0, 24):
        for y in np.linspace(-1.5, 1.9, 24):
            g = polygon_distance(vertices, 0, x, y)[0]
            assert g == pytest.approx(nearest_on_polygon(vertices[0], x, y), abs=1e-14)


@pytest.mark.parametrize(
    ("x", "y"), [(1.3, 0.5), (1.4, 1.3), (-0.6, -0.2), (0.3, 5.0), (0.5, 0.8), (0.9, 0.45)]
)
@pytest.mark.parametrize("vertices", [SQUARE, OBLIQUE])
def test_derivatives_of_a_polygon(vertices: np.ndarray, x: float, y: float) -> None:
    check_derivatives(lambda u, v: polygon_distance(vertices, 0, u, v), x, y)


def test_corner_of_a_polygon_is_touched_at_zero() -> None:
    for x, y in OBLIQUE[0]:
        g, nx, ny, _ = polygon_distance(OBLIQUE, 0, x, y)
        assert g == pytest.approx(0.0, abs=1e-15)
        assert np.hypot(nx, ny) == pytest.approx(1.0, abs=1e-14)


def test_the_shapes_have_one_entrance() -> None:
    axes = np.array([[[0.6, 0.4]], [[0.5, 0.5]]])
    assert distance(ELLIPSE, axes, 1, 0.8, 0.6) == ellipse_distance(0.5, 0.5, 0.8, 0.6)
    assert distance(ELLIPSE, axes, 0, 0.8, 0.6) == ellipse_distance(0.6, 0.4, 0.8, 0.6)
    assert distance(POLYGON, SQUARE, 0, 2.0, 0.4) == (1.0, 1.0, 0.0, 0.0)
    assert distance(HALF_PLANE, axes, 0, 2.0, -0.4) == (-0.4, 0.0, 1.0, 0.0)
