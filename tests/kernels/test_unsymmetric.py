"""The small unsymmetric systems against NumPy, a different one in each lane."""

import numpy as np
from entrance import entrance

from fastncm.kernels import unsymmetric
from fastncm.kernels.constants import LANES

factorise = entrance(unsymmetric.factorise)
solve = entrance(unsymmetric.solve)
solve_transposed = entrance(unsymmetric.solve_transposed)


def test_systems_and_their_transposes() -> None:
    rng = np.random.default_rng(2)
    a = np.eye(3)[:, :, None] + 0.3 * rng.normal(size=(3, 3, LANES))
    b = rng.normal(size=(3, LANES))
    factors, x, y = a.copy(), b.copy(), b.copy()
    factorise(factors)
    solve(factors, x)
    solve_transposed(factors, y)
    for lane in range(LANES):
        expected = np.linalg.solve(a[:, :, lane], b[:, lane])
        np.testing.assert_allclose(x[:, lane], expected, rtol=1e-9, atol=1e-12)
        expected = np.linalg.solve(a[:, :, lane].T, b[:, lane])
        np.testing.assert_allclose(y[:, lane], expected, rtol=1e-9, atol=1e-12)
        pivots = np.array([factors[i, i, lane] for i in range(3)])
        determinant = np.linalg.det(a[:, :, lane])
        np.testing.assert_allclose(1.0 / pivots.prod(), determinant, rtol=1e-9)
