"""L D L^T factors of small symmetric matrices, for `LANES` designs side by side.

There is no pivoting: the Lagrangian's Hessian is the identity plus the stiffness of the contact
force. It may have a negative eigenvalue (a corner that slides around a small circle) and still be
positive definite along the constraint. By Sylvester's law of inertia the solution is a minimum
where as many pivots are negative as ``A H^-1 A^T`` has negative eigenvalues (Nocedal & Wright 2006,
th. 16.3).
"""

from fastncm.kernels.cache import kernel
from fastncm.kernels.constants import LANES


@kernel
def factorise(a, negative):
    """Overwrite the lower triangle of `a` (m, m, LANES) by its unit factor L, the diagonal by 1 /
    D.

    negative: (LANES,), overwritten: number of negative pivots of each lane.
    """
    m = a.shape[0]
    for lane in range(LANES):
        negative[lane] = 0.0
    for j in range(m):
        for lane in range(LANES):
            negative[lane] += 1.0 if a[j, j, lane] < 0.0 else 0.0
        for lane in range(LANES):
            a[j, j, lane] = 1.0 / a[j, j, lane]
        for i in range(j + 1, m):
            for k in range(i, m):
                for lane in range(LANES):
                    a[k, i, lane] -= a[k, j, lane] * a[i, j, lane] * a[j, j, lane]
        for i in range(j + 1, m):
            for lane in range(LANES):
                a[i, j, lane] *= a[j, j, lane]


@kernel
def solve(a, x):
    """Solve with the factor from `factorise`. x: (m, LANES), right-hand side on entry, solution on
    return."""
    m = a.shape[0]
    for i in range(1, m):
        for k in range(i):
            for lane in range(LANES):
                x[i, lane] -= a[i, k, lane] * x[k, lane]
    for i in range(m):
        for lane in range(LANES):
            x[i, lane] *= a[i, i, lane]
    for i in range(m - 2, -1, -1):
        for k in range(i + 1, m):
            for lane in range(LANES):
                x[i, lane] -= a[k, i, lane] * x[k, lane]
