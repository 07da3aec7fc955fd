"""L D L^T factors of small symmetric matrices, for `LANES` designs side by side.

There is no pivoting: the Lagrangian's Hessian is the identity plus the stiffness of the contact
force. It may have a negative eigenvalue (a corner that slides around a small circle) and still be
positive definite along the constraint. By Sylvester's law of inertia the solution is a minimum
where as many pivots are negative as ``A H^-1 A^T`` has negative eigenvalues (Nocedal & Wright 2006,
th. 16.3).

The usual sizes have loops of their own: where LLVM knows the size, it unrolls everything inside of
one loop over the lanes, and the intermediate values stay in registers (m = 5: factors 18 -> 3 ns
per design, a solution 10 -> 1 ns).
"""

from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.constants import LANES

_4, _5 = (0,) * 4, (0,) * 5


@inlined
def _has_size(a, m):
    """True for (m, m, LANES): behind this LLVM knows the strides."""
    return a.shape[0] == m and a.shape[1] == m and a.shape[2] == LANES


@inner
def factorise(a, negative):
    """Overwrite the lower triangle of `a` (m, m, LANES) by its unit factor L, the diagonal by 1 /
    D.

    negative: (LANES,), overwritten: number of negative pivots of each lane.
    """
    if _has_size(a, 4):
        _factorise(a, negative, _4)
    elif _has_size(a, 5):
        _factorise(a, negative, _5)
    else:
        _factorise_any(a, negative)


@inlined
def _factorise(a, negative, modes):
    for lane in range(LANES):
        count = 0.0
        for j in range(len(modes)):
            pivot = a[j, j, lane]
            count += 1.0 if pivot < 0.0 else 0.0
            inverse = 1.0 / pivot
            a[j, j, lane] = inverse
            for i in range(j + 1, len(modes)):
                row = a[i, j, lane] * inverse
                for k in range(i, len(modes)):
                    a[k, i, lane] -= a[k, j, lane] * row
            for i in range(j + 1, len(modes)):
                a[i, j, lane] *= inverse
        negative[lane] = count


@inner
def _factorise_any(a, negative):
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


@inner
def solve(a, x):
    """Solve with the factor from `factorise`. x: (m, LANES), right-hand side on entry, solution on
    return."""
    if _has_size(a, 4) and x.shape[1] == LANES:
        _solve(a, x, _4)
    elif _has_size(a, 5) and x.shape[1] == LANES:
        _solve(a, x, _5)
    else:
        _solve_any(a, x)


@inlined
def _solve(a, x, modes):
    for lane in range(LANES):
        for i in range(1, len(modes)):
            for k in range(i):
                x[i, lane] -= a[i, k, lane] * x[k, lane]
        for i in range(len(modes)):
            x[i, lane] *= a[i, i, lane]
        for i in range(len(modes) - 2, -1, -1):
            for k in range(i + 1, len(modes)):
                x[i, lane] -= a[k, i, lane] * x[k, lane]


@inner
def _solve_any(a, x):
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
