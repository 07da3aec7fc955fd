"""L U factors of unsymmetric 3 x 3 matrices, for `LANES` designs side by side.

There is no pivoting: the matrices are the identity plus the change of a contact force with the tip
that it moves.
"""

from fastncm.kernels.cache import kernel
from fastncm.kernels.constants import LANES


@kernel
def factorise(a):
    """Overwrite `a` (3, 3, LANES) by its factors: below the diagonal L (its diagonal is 1), above
    it U, on it 1 / U."""
    for j in range(3):
        for lane in range(LANES):
            a[j, j, lane] = 1.0 / a[j, j, lane]
        for i in range(j + 1, 3):
            for lane in range(LANES):
                a[i, j, lane] *= a[j, j, lane]
            for k in range(j + 1, 3):
                for lane in range(LANES):
                    a[i, k, lane] -= a[i, j, lane] * a[j, k, lane]


@kernel
def solve(a, x):
    """Solve with the factors from `factorise`. x: (3, LANES), right-hand side on entry, solution on
    return."""
    for i in range(1, 3):
        for k in range(i):
            for lane in range(LANES):
                x[i, lane] -= a[i, k, lane] * x[k, lane]
    for i in range(2, -1, -1):
        for k in range(i + 1, 3):
            for lane in range(LANES):
                x[i, lane] -= a[i, k, lane] * x[k, lane]
        for lane in range(LANES):
            x[i, lane] *= a[i, i, lane]


@kernel
def solve_transposed(a, x):
    """`solve` with the transposed matrix."""
    for i in range(3):
        for k in range(i):
            for lane in range(LANES):
                x[i, lane] -= a[k, i, lane] * x[k, lane]
        for lane in range(LANES):
            x[i, lane] *= a[i, i, lane]
    for i in range(1, -1, -1):
        for k in range(i + 1, 3):
            for lane in range(LANES):
                x[i, lane] -= a[k, i, lane] * x[k, lane]
