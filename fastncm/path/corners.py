"""A corner of the jaw on a corner of the block, which only seems to be held there.

The jaw's edge and the block's corner, and the jaw's corner and a side of the block, are two pairs
that the solvers keep apart both (`kernels.gap.several_feature`). Where the two corners meet, one of
them is enough: seen closely, both are round, and pressed on one another they roll off to either
side, with friction as without.
"""

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inner

#: Two contacts in one place (distance in finger lengths), and with one normal (sine of the angle).
_SAME_PLACE, _SAME_NORMAL = 1e-8, 1e-4


@inner
def corners_meet(gaps, force):
    """True where a corner of the jaw presses on the block's corner: two pairs that touch in one
    place with different normals.

    gaps: (GAP_COLUMNS, K) of the pairs; force: (K,) their normal forces.
    """
    for k in range(force.shape[0]):
        for j in range(k):
            if force[j] <= 0.0 or force[k] <= 0.0:
                continue
            apart = abs(gaps[c.PX, j] - gaps[c.PX, k]) + abs(gaps[c.PY, j] - gaps[c.PY, k])
            turned = gaps[c.GX, j] * gaps[c.GY, k] - gaps[c.GY, j] * gaps[c.GX, k]
            if apart <= _SAME_PLACE and abs(turned) > _SAME_NORMAL:
                return True
    return False
