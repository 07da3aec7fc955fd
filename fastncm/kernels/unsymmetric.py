"""L U factors of unsymmetric 3 x 3 matrices, for `LANES` designs side by side.

There is no pivoting: the matrices are the identity plus the change of a contact force with the tip
that it moves. As in `kernels.symmetric` everything is inside of one loop over the lanes.
"""

from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.constants import LANES


@inlined
def _known_strides(a, x):
    """Always true: behind this LLVM knows the strides."""
    return a.shape[1] == 3 and a.shape[2] == LANES and x.shape[1] == LANES


@inner
def factorise(a):
    """Overwrite `a` (3, 3, LANES) by its factors: below the diagonal L (its diagonal is 1), above
    it U, on it 1 / U."""
    if not _known_strides(a, a[0]):
        return
    for lane in range(LANES):
        for j in range(3):
            a[j, j, lane] = 1.0 / a[j, j, lane]
            for i in range(j + 1, 3):
                a[i, j, lane] *= a[j, j, lane]
                for k in range(j + 1, 3):
                    a[i, k, lane] -= a[i, j, lane] * a[j, k, lane]


@inner
def solve(a, x):
    """Solve with the factors from `factorise`. x: (3, LANES), right-hand side on entry, solution on
    return."""
    if not _known_strides(a, x):
        return
    for lane in range(LANES):
        for i in range(1, 3):
            for k in range(i):
                x[i, lane] -= a[i, k, lane] * x[k, lane]
        for i in range(2, -1, -1):
            for k in range(i + 1, 3):
                x[i, lane] -= a[i, k, lane] * x[k, lane]
            x[i, lane] *= a[i, i, lane]


@inner
def solve_transposed(a, x):
    """`solve` with the transposed matrix."""
    if not _known_strides(a, x):
        return
    for lane in range(LANES):
        for i in range(3):
            for k in range(i):
                x[i, lane] -= a[k, i, lane] * x[k, lane]
            x[i, lane] *= a[i, i, lane]
        for i in range(1, -1, -1):
            for k in range(i + 1, 3):
                x[i, lane] -= a[k, i, lane] * x[k, lane]
