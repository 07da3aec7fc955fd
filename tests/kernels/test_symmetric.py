"""The small symmetric systems against NumPy, a different one in each lane."""

import numpy as np
import pytest
from entrance import entrance

from fastncm.kernels import symmetric
from fastncm.kernels.constants import LANES

factorise = entrance(symmetric.factorise)
solve = entrance(symmetric.solve)


@pytest.mark.parametrize("modes", [1, 4, 5, 7])
def test_solutions_and_signs(modes: int) -> None:
    """Indefinite matrices, too; 4 and 5 modes have loops of their own."""
    rng = np.random.default_rng(modes)
    a = rng.normal(size=(modes, modes, LANES))
    a = a + a.transpose(1, 0, 2) + 3.0 * np.eye(modes)[:, :, None] * rng.choice([-1, 1], LANES)
    b = rng.normal(size=(modes, LANES))
    factors, x, negative = a.copy(), b.copy(), np.zeros(LANES)
    factorise(factors, negative)
    solve(factors, x)
    for lane in range(LANES):
        matrix = a[:, :, lane]
        assert negative[lane] == (np.linalg.eigvalsh(matrix) < 0.0).sum()
        condition = np.linalg.cond(matrix)
        expected = np.linalg.solve(matrix, b[:, lane])
        error = np.abs(x[:, lane] - expected).max() / np.abs(expected).max()
        assert error < 1e-13 * condition**2
