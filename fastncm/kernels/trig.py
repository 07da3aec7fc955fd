"""Sine and cosine as a branch-free polynomial, which LLVM vectorises across designs.

Numba calls the scalar ``sin`` and ``cos`` of the C library one after the other; the Cody & Waite
reduction with the minimax coefficients of Cephes (S. Moshier) runs on all lanes at once.
"""

import numpy as np

from fastncm.kernels.cache import inlined

_TWO_OVER_PI = 0.6366197723675814
# pi/2 in three parts (fdlibm, s_rem_pio2.c): products of the first two with integers below 2^20 are
# exact
_HALF_PI_1 = 1.57079632673412561417
_HALF_PI_2 = 6.07710050630396597660e-11
_HALF_PI_3 = 2.02226624871116645580e-21


@inlined
def sincos(x):
    """Sine and cosine of one angle (rad). Returns ``(sin x, cos x)``, error below 2.3e-16."""
    n = np.floor(x * _TWO_OVER_PI + 0.5)
    r = ((x - n * _HALF_PI_1) - n * _HALF_PI_2) - n * _HALF_PI_3
    z = r * r
    s = 1.58962301576546568060e-10
    s = s * z - 2.50507477628578072866e-8
    s = s * z + 2.75573136213857245213e-6
    s = s * z - 1.98412698295895385996e-4
    s = s * z + 8.33333333332211858878e-3
    s = s * z - 1.66666666666666307295e-1
    s = r + r * z * s
    c = -1.13585365213876817300e-11
    c = c * z + 2.08757008419747316778e-9
    c = c * z - 2.75573141792967388112e-7
    c = c * z + 2.48015872888517045348e-5
    c = c * z - 1.38888888888730564116e-3
    c = c * z + 4.16666666666665929218e-2
    c = (1.0 - 0.5 * z) + z * z * c
    # Quadrant n mod 4 without a branch: an odd one swaps sine and cosine, the upper two change the
    # sign.
    half = np.floor(0.5 * n)
    odd = n - 2.0 * half
    sign = 1.0 - 2.0 * (half - 2.0 * np.floor(0.5 * half))
    return sign * (s + odd * (c - s)), sign * (c - odd * (c + s))
