"""The polynomial sine and cosine against the C library's."""

import math

import numpy as np
import pytest
from entrance import entrance

from fastncm.kernels import trig

sincos = entrance(trig.sincos)
ERROR = 5e-16
"""Allowed absolute error; that of the C library is below 1.1e-16."""


def errors(angles: np.ndarray) -> tuple[float, float]:
    """Largest errors of sine and cosine over `angles` (n,)."""
    found = np.array([sincos(float(angle)) for angle in angles])
    return np.abs(found - np.column_stack([np.sin(angles), np.cos(angles)])).max(axis=0)


@pytest.mark.parametrize("reach", [0.5, 10.0, 1000.0])
def test_against_the_c_library(reach: float) -> None:
    rng = np.random.default_rng(0)
    sine, cosine = errors(rng.uniform(-reach, reach, 4000))
    assert sine < ERROR
    assert cosine < ERROR


def test_around_multiples_of_a_quarter_pi() -> None:
    """Where the quadrant changes, and where the reduced angle is zero or largest."""
    multiples = np.arange(-1200, 1201) * (math.pi / 4.0)
    for shift in (-1e-9, 0.0, 1e-9):
        sine, cosine = errors(multiples + shift)
        assert sine < ERROR
        assert cosine < ERROR


def test_zero_is_exact() -> None:
    assert sincos(0.0) == (0.0, 1.0)
    assert sincos(-0.0) == (0.0, 1.0)


def test_small_angles_keep_their_digits() -> None:
    for angle in (1e-300, -1e-12, 1e-5):
        assert sincos(angle)[0] == pytest.approx(math.sin(angle), rel=2e-16, abs=0.0)


def test_not_finite_stays_not_finite() -> None:
    assert math.isnan(sincos(math.nan)[0])
