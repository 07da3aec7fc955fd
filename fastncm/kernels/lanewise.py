"""Products of small vectors and matrices, for `LANES` designs side by side."""

from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.constants import LANES

_3, _4, _5 = (0,) * 3, (0,) * 4, (0,) * 5


@inner
def dot(one, other, out):
    """``out[lane] = sum_k one[k, lane] other[k, lane]``. one, other: (m, LANES); out: (LANES,).

    As in `kernels.symmetric` the usual sizes are unrolled inside of one loop over the lanes.
    """
    known = one.shape[1] == LANES and other.shape[1] == LANES
    if known and one.shape[0] == 3:
        _dot(one, other, out, _3)
    elif known and one.shape[0] == 4:
        _dot(one, other, out, _4)
    elif known and one.shape[0] == 5:
        _dot(one, other, out, _5)
    else:
        for lane in range(LANES):
            out[lane] = one[0, lane] * other[0, lane]
        for k in range(1, one.shape[0]):
            for lane in range(LANES):
                out[lane] += one[k, lane] * other[k, lane]


@inlined
def _dot(one, other, out, size):
    for lane in range(LANES):
        total = 0.0
        for k in range(len(size)):
            total += one[k, lane] * other[k, lane]
        out[lane] = total


@inner
def multiply(matrix, vector, out):
    """``out = matrix vector``. matrix: (3, 3, LANES); vector, out: (3, LANES), not the same."""
    for i in range(3):
        for lane in range(LANES):
            out[i, lane] = (
                matrix[i, 0, lane] * vector[0, lane]
                + matrix[i, 1, lane] * vector[1, lane]
                + matrix[i, 2, lane] * vector[2, lane]
            )
