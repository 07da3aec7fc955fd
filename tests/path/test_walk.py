"""The predictor: Hermite's polynomial through the last positions."""

from typing import NamedTuple

import numpy as np
import pytest
from entrance import entrance

from fastncm.kernels.constants import LANES
from fastncm.path.walk import predict

predict_alone = entrance(predict)
MODES = 2


class Lanes(NamedTuple):
    """What `predict` reads and writes of the lanes."""

    t: np.ndarray
    active: np.ndarray
    u: np.ndarray
    force: np.ndarray


class Walk(NamedTuple):
    """What `predict` reads of the walk."""

    t: np.ndarray
    t_before: np.ndarray
    u: np.ndarray
    u_before: np.ndarray
    u_rate: np.ndarray
    u_rate_before: np.ndarray
    force: np.ndarray
    force_before: np.ndarray
    force_rate: np.ndarray
    force_rate_before: np.ndarray
    points: np.ndarray
    w0: np.ndarray
    w1: np.ndarray
    r0: np.ndarray
    r1: np.ndarray


def predicted(degree: int, points: int, ahead: float) -> tuple[np.ndarray, np.ndarray]:
    """What is predicted of polynomials of a degree, and what they are there: (MODES + 1,) each."""
    curves = [
        np.polynomial.Polynomial(np.random.default_rng(seed).normal(size=degree + 1))
        for seed in range(MODES + 1)
    ]

    times = [0.7, 0.6]

    def values(t: float, derivative: int) -> np.ndarray:
        one = np.array([(curve.deriv(derivative) if derivative else curve)(t) for curve in curves])
        return np.repeat(one[:, None], LANES, axis=1)

    history = [values(t, derivative) for derivative in (0, 1) for t in times]
    lanes = Lanes(
        np.full(LANES, times[0] + ahead),
        np.ones(LANES, np.bool_),
        np.zeros((MODES, LANES)),
        np.zeros(LANES),
    )
    walk = Walk(
        *(np.full(LANES, t) for t in times),
        *(h[:MODES].copy() for h in history),
        *(h[MODES].copy() for h in history),
        np.full(LANES, points),
        *(np.zeros(LANES) for _ in range(4)),
    )
    predict_alone(lanes, walk)
    return np.append(lanes.u[:, 0], lanes.force[0]), values(times[0] + ahead, 0)[:, 0]


@pytest.mark.parametrize(("points", "degree"), [(0, 0), (1, 1), (2, 3)])
@pytest.mark.parametrize("ahead", [0.1, 0.13, -0.05])
def test_is_exact_for_what_that_many_positions_determine(
    points: int, degree: int, ahead: float
) -> None:
    found, expected = predicted(degree, points, ahead)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-13)
