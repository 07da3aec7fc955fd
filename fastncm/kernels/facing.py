"""Which parts of a jaw and a target face each other at a pose of the tip.

Corners, edge and return face of the jaw in their places (`kernels.constants`); what their distance
is, and which of several pairs is the closest, is said in `kernels.gap`.
"""

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inlined


@inlined
def nearest_part(jaw, d, px, py, x, y, cos, sin):
    """The part of the jaw (`ON_EDGE`, `ON_A`, `ON_B`) that is nearest to the point `(px, py)` in
    space."""
    dx, dy = px - x, py - y
    qx, qy = cos * dx + sin * dy, cos * dy - sin * dx
    ax, ay, bx, by = qx - jaw[d, c.AX], qy - jaw[d, c.AY], qx - jaw[d, c.BX], qy - jaw[d, c.BY]
    behind_a = jaw[d, c.TAX] * ax + jaw[d, c.TAY] * ay < 0.0
    beyond_b = jaw[d, c.TBX] * bx + jaw[d, c.TBY] * by > 0.0
    if behind_a and beyond_b:
        return c.ON_A if ax * ax + ay * ay < bx * bx + by * by else c.ON_B
    if behind_a:
        return c.ON_A
    return c.ON_B if beyond_b else c.ON_EDGE


@inlined
def corner_on_block(qx, qy, underside, face, t, py, x, y, cos, sin):
    """The plane of the block that keeps the jaw's corner `(qx, qy)` out: the code given for it."""
    below = py - (y + sin * qx + cos * qy)
    before = t - (x + cos * qx - sin * qy)
    return face if before > below else underside


@inlined
def foremost_corner(jaw, d, t, py, x, y, cos, sin):
    """The corner of the jaw that is deeper in the block, with the plane that keeps it out. (It need
    not be the one nearest to the block's corner.)"""
    ax, ay = jaw[d, c.AX], jaw[d, c.AY]
    bx, by = jaw[d, c.BX], jaw[d, c.BY]
    a_out = max(t - (x + cos * ax - sin * ay), py - (y + sin * ax + cos * ay))
    b_out = max(t - (x + cos * bx - sin * by), py - (y + sin * bx + cos * by))
    if a_out <= b_out:
        return corner_on_block(ax, ay, c.A_UNDERSIDE, c.A_FACE, t, py, x, y, cos, sin)
    return corner_on_block(bx, by, c.B_UNDERSIDE, c.B_FACE, t, py, x, y, cos, sin)


@inlined
def below_corners(jaw, d, py, y, cos, sin):
    """By how much the block's underside is above the jaw's higher corner."""
    ay = y + sin * jaw[d, c.AX] + cos * jaw[d, c.AY]
    by = y + sin * jaw[d, c.BX] + cos * jaw[d, c.BY]
    return py - max(ay, by)


@inlined
def arc_faces(jaw, d, nx, ny, cos, sin):
    """True where the point of the convex arc with the outward normal `(nx, ny)` in space is on
    it."""
    qx, qy = cos * nx + sin * ny, cos * ny - sin * nx  # the normal in the jaw's frame
    # the jaw's outward normals at a and b are their tangents turned to the left
    after_a = jaw[d, c.TAX] * qx + jaw[d, c.TAY] * qy >= 0.0
    before_b = jaw[d, c.TBX] * qx + jaw[d, c.TBY] * qy <= 0.0
    outward = -(jaw[d, c.TAY] + jaw[d, c.TBY]) * qx + (jaw[d, c.TAX] + jaw[d, c.TBX]) * qy > 0.0
    return jaw[d, c.RHO] > 0.0 and after_a and before_b and outward


@inlined
def edge_feature(jaw, target, d, t, x, y, cos, sin):
    """The block's corner over the edge, where the edge's normal points into the block and the
    corner has gone neither beyond corner a, which is then under the block, nor, if the block has a
    back, behind the return face.

    Where the normal points past the block, a corner of the jaw touches first; but close to that the
    edge is flat on a side of the block, and both ends of their contact count.
    """
    py = target[d, c.TARGET_Y]
    if nearest_part(jaw, d, t, py, x, y, cos, sin) != c.ON_EDGE:
        return c.VOID
    ax = cos * (t - x) + sin * (py - y) - jaw[d, c.AX]
    ay = cos * (py - y) - sin * (t - x) - jaw[d, c.AY]
    if target[d, c.TARGET_LENGTH] > 0.0 and jaw[d, c.TRX] * ay > jaw[d, c.TRY] * ax:
        return c.VOID
    below = py - y - sin * jaw[d, c.AX] - cos * jaw[d, c.AY]
    if x + cos * jaw[d, c.AX] - sin * jaw[d, c.AY] > t and below >= -c.UNDER:
        return c.VOID
    nx, ny, size = -jaw[d, c.TAY], jaw[d, c.TAX], 1.0
    if jaw[d, c.RHO] < 0.0:
        nx = jaw[d, c.MX] - cos * (t - x) - sin * (py - y)
        ny = jaw[d, c.MY] - cos * (py - y) + sin * (t - x)
        size = np.sqrt(nx * nx + ny * ny)
    least = -c.FLAT * size
    faces = cos * nx - sin * ny >= least and sin * nx + cos * ny >= least
    return c.ON_EDGE if faces else c.VOID


@inlined
def far_edge_feature(flat, jaw, target, d, t, x, y, cos, sin):
    """The block's far corner over the edge, where the edge's normal points into the block there, or
    by the angle `flat` past it (`edge_feature`)."""
    px, py = t + target[d, c.TARGET_LENGTH], target[d, c.TARGET_Y]
    if px == t or nearest_part(jaw, d, px, py, x, y, cos, sin) != c.ON_EDGE:
        return c.VOID
    qx, qy = cos * (px - x) + sin * (py - y), cos * (py - y) - sin * (px - x)
    wide, high = jaw[d, c.BX] - jaw[d, c.AX], jaw[d, c.BY] - jaw[d, c.AY]
    along = wide * (qx - jaw[d, c.AX]) + high * (qy - jaw[d, c.AY])
    beside = along < 0.0 or along > wide * wide + high * high
    if jaw[d, c.RHO] < 0.0 and beside:  # outside of a cup
        return c.VOID
    nx, ny, size = -jaw[d, c.TAY], jaw[d, c.TAX], 1.0
    if jaw[d, c.RHO] != 0.0:
        sign = 1.0 if jaw[d, c.RHO] > 0.0 else -1.0
        nx, ny = sign * (qx - jaw[d, c.MX]), sign * (qy - jaw[d, c.MY])
        size = np.sqrt(nx * nx + ny * ny)
    least = -flat * size
    faces = sin * ny - cos * nx >= least and sin * nx + cos * ny >= least
    return c.FAR_EDGE if faces else c.VOID


@inlined
def return_feature(jaw, target, d, t, x, y, cos, sin):
    """The far corner of a block that reaches from before the return face to behind it, below
    corner a; where the face's normal points into the block, or nearly so (`edge_feature`)."""
    length = target[d, c.TARGET_LENGTH]
    leans_up = cos * jaw[d, c.TRX] - sin * jaw[d, c.TRY] >= -c.FLAT
    leans_back = sin * jaw[d, c.TRX] + cos * jaw[d, c.TRY] >= -c.FLAT
    if not (leans_up and leans_back):
        return c.VOID
    ax = cos * (t - x) + sin * (target[d, c.TARGET_Y] - y) - jaw[d, c.AX]
    ay = cos * (target[d, c.TARGET_Y] - y) - sin * (t - x) - jaw[d, c.AY]
    outside = jaw[d, c.TRX] * ay - jaw[d, c.TRY] * ax > 0.0
    along = jaw[d, c.TRX] * (ax + cos * length) + jaw[d, c.TRY] * (ay - sin * length)
    return c.FAR_RETURN if length > 0.0 and outside and along <= 0.0 else c.VOID


@inlined
def corner_feature(at_a, jaw, target, d, t, x, y, cos, sin):
    """The plane of the block, its back among them, that keeps the jaw's corner a or b out; `VOID`
    for b behind the back."""
    qx, qy = (jaw[d, c.AX], jaw[d, c.AY]) if at_a else (jaw[d, c.BX], jaw[d, c.BY])
    underside, face = (c.A_UNDERSIDE, c.A_FACE) if at_a else (c.B_UNDERSIDE, c.B_FACE)
    py, length = target[d, c.TARGET_Y], target[d, c.TARGET_LENGTH]
    near = corner_on_block(qx, qy, underside, face, t, py, x, y, cos, sin)
    px = x + cos * qx - sin * qy
    ahead = max(t - px, py - (y + sin * qx + cos * qy))
    if length == 0.0 or px - t - length <= ahead:
        return near
    return c.A_BACK if at_a else c.VOID
