"""Where one contact feature ends and the next begins.

A boundary is a function ``e(pose, t)`` that is zero where both features touch in the same place.
All of them depend on the target's position minus the tip's, so that ``de/dt = -de/dx``.
"""

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inlined


@inlined
def _jaw_end(cx, cy, tx, ty, px, py, x, y, cos, sin):
    """Distance of the point `(px, py)` in space from the jaw's corner `(cx, cy)` along the tangent
    there."""
    dx, dy = px - x, py - y
    qx, qy = cos * dx + sin * dy, cos * dy - sin * dx
    wx, wy = cos * tx - sin * ty, sin * tx + cos * ty
    return tx * (qx - cx) + ty * (qy - cy), -wx, -wy, tx * qy - ty * qx, True


@inlined
def _one_of(first, second, feature, other):
    """True where {first, second} = {feature, other}."""
    return (first == feature and second == other) or (first == other and second == feature)


@inlined
def boundary(first, second, jaw, target, d, t, x, y, cos, sin):
    """The function that is zero at the change between the features `first` and `second`.

    Returns ``(e, de/dx, de/dy, de/dpsi, known)``; `known` is False where the two have no common
    boundary.
    """
    py = target[d, c.TARGET_Y]
    low, high = min(first, second), max(first, second)
    if low == c.ON_EDGE and high in (c.ON_A, c.A_UNDERSIDE, c.A_FACE):
        return _jaw_end(
            jaw[d, c.AX], jaw[d, c.AY], jaw[d, c.TAX], jaw[d, c.TAY], t, py, x, y, cos, sin
        )
    if low == c.ON_EDGE and high in (c.ON_B, c.B_UNDERSIDE, c.B_FACE):
        return _jaw_end(
            jaw[d, c.BX], jaw[d, c.BY], jaw[d, c.TBX], jaw[d, c.TBY], t, py, x, y, cos, sin
        )
    mx, my = cos * jaw[d, c.MX] - sin * jaw[d, c.MY], sin * jaw[d, c.MX] + cos * jaw[d, c.MY]
    if low == c.ON_EDGE and high == c.ARC_UNDERSIDE:  # the arc is level at the block's corner
        return x + mx - t, 1.0, 0.0, -my, True
    if low == c.ON_EDGE and high == c.ARC_FACE:
        return y + my - py, 0.0, 1.0, mx, True
    # the arc's level (upright) point reaches one of its ends: the tangent there is level (upright)
    ax, ay = cos * jaw[d, c.TAX] - sin * jaw[d, c.TAY], sin * jaw[d, c.TAX] + cos * jaw[d, c.TAY]
    bx, by = cos * jaw[d, c.TBX] - sin * jaw[d, c.TBY], sin * jaw[d, c.TBX] + cos * jaw[d, c.TBY]
    if _one_of(first, second, c.A_UNDERSIDE, c.ARC_UNDERSIDE):
        return ay, 0.0, 0.0, ax, True
    if _one_of(first, second, c.B_UNDERSIDE, c.ARC_UNDERSIDE):
        return by, 0.0, 0.0, bx, True
    if _one_of(first, second, c.A_FACE, c.ARC_FACE):
        return ax, 0.0, 0.0, -ay, True
    if _one_of(first, second, c.B_FACE, c.ARC_FACE):
        return bx, 0.0, 0.0, -by, True
    return 0.0, 0.0, 0.0, 0.0, False
