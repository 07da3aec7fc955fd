"""Elimination with row pivots, for one small unsymmetric system whose determinant's sign counts."""

from fastncm.kernels.cache import inner

#: A pivot that is rounding, where all entries are scaled to at most 1.
_PIVOT_ROUNDING = 1e-14


@inner
def eliminate(a, x, scale, n):
    """Solve ``a x = b`` of the leading n equations by elimination with row pivots; b on entry in
    `x`. All are overwritten. Returns the determinant's sign, 0 where a pivot is rounding.

    Rows, then columns, are scaled to entries of at most 1: modes of a thin end are stiff. scale:
    (n,).
    """
    for i in range(n):
        largest = 0.0
        for j in range(n):
            largest = max(largest, abs(a[i, j]))
        if not largest > 0.0:
            return 0.0
        x[i] /= largest
        for j in range(n):
            a[i, j] /= largest
    for j in range(n):
        scale[j] = 0.0
        for i in range(n):
            scale[j] = max(scale[j], abs(a[i, j]))
        if not scale[j] > 0.0:
            return 0.0
        for i in range(n):
            a[i, j] /= scale[j]
    sign = 1.0
    for j in range(n):
        best = j
        for i in range(j + 1, n):
            if abs(a[i, j]) > abs(a[best, j]):
                best = i
        if not abs(a[best, j]) > _PIVOT_ROUNDING:
            return 0.0
        if best != j:
            sign = -sign
            x[j], x[best] = x[best], x[j]
            for k in range(n):
                a[j, k], a[best, k] = a[best, k], a[j, k]
        sign = sign if a[j, j] > 0.0 else -sign
        for i in range(j + 1, n):
            factor = a[i, j] / a[j, j]
            if factor != 0.0:
                x[i] -= factor * x[j]
                for k in range(j + 1, n):
                    a[i, k] -= factor * a[j, k]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= a[i, k] * x[k]
        x[i] /= a[i, i]
    for i in range(n):
        x[i] /= scale[i]
    return sign
