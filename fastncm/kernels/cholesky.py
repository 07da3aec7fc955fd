"""Cholesky factors of small matrices, for `LANES` designs side by side."""

import numpy as np

from fastncm.kernels.cache import kernel
from fastncm.kernels.constants import LANES


@kernel
def factorise(a, smallest):
    """Overwrite the lower triangle of `a` (m, m, LANES) by its Cholesky factor, the diagonal inverted.

    smallest: (LANES,), overwritten: the smallest pivot of each lane. A lane with a pivot that is not
    positive has no factor (its entries are finite but mean nothing).
    """
    m = a.shape[0]
    for lane in range(LANES):
        smallest[lane] = np.inf
    for j in range(m):
        for k in range(j):
            for i in range(j, m):
                for lane in range(LANES):
                    a[i, j, lane] -= a[i, k, lane] * a[j, k, lane]
        for lane in range(LANES):
            pivot = a[j, j, lane]
            smallest[lane] = min(smallest[lane], pivot)
            a[j, j, lane] = 1.0 / np.sqrt(pivot) if pivot > 0.0 else 1.0
        for i in range(j + 1, m):
            for lane in range(LANES):
                a[i, j, lane] *= a[j, j, lane]


@kernel
def solve(a, x):
    """Solve with the factor from `factorise`. x: (m, LANES), right-hand side on entry, solution on return."""
    m = a.shape[0]
    for i in range(m):
        for k in range(i):
            for lane in range(LANES):
                x[i, lane] -= a[i, k, lane] * x[k, lane]
        for lane in range(LANES):
            x[i, lane] *= a[i, i, lane]
    for i in range(m - 1, -1, -1):
        for k in range(i + 1, m):
            for lane in range(LANES):
                x[i, lane] -= a[k, i, lane] * x[k, lane]
        for lane in range(LANES):
            x[i, lane] *= a[i, i, lane]
