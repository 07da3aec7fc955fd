"""Gap functions between jaw and target with first and second derivatives (Lan & Lee 2008, eqs. (9),
(10)).

Two formulas serve all pairs:

* `target_point_gap`: a point of the target, `r` inside its surface (the centre of a circle; `r = 0`
  for a sharp corner), in the distance field of the jaw's line, arc or corner. This is (10b).
* `plane_gap`: a point of the jaw (a corner, or the extreme point of a convex arc) in front of a
  plane of the target. With `target_point_gap` for a jaw point it is (10a).

All gaps are signed distances in units of the finger's length, so that a multiplier is a force. A
pose is `(x, y, psi)`: the tip's position and the angle of its section; the jaw turns with ``[[cos,
-sin], [sin, cos]]`` (the paper's (9) prints the inverse). A gap is the tuple

``(g, gx, gy, gp, hxx, hxy, hyy, hxp, hyp, hpp, px, py, feature)``

with the derivatives by the pose, the contact point `(px, py)` in space and the feature's code. The
target moves along x, hence the derivative of `g` by its position is ``-gx``, that of `gx` ``-hxx``
...
"""

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inlined
from fastncm.kernels.facing import (
    arc_faces,
    below_corners,
    corner_feature,
    edge_feature,
    far_edge_feature,
    foremost_corner,
    nearest_part,
    return_feature,
)


@inlined
def target_point_gap(mx, my, rho, nx, ny, px, py, r, x, y, cos, sin, feature):
    """Gap between the circle of radius `r` about the target point `(px, py)` and one curve of the
    jaw.

    The curve is, in the jaw's frame, the arc of centre `(mx, my)` and radius ``|rho|`` (``rho >
    0``: solid inside; ``rho < 0``: solid outside), a corner (``rho = 0``, ``nx = ny = 0``), or the
    straight line through `(mx, my)` with the unit normal `(nx, ny)`.
    """
    dx, dy = px - x, py - y
    qx, qy = cos * dx + sin * dy, cos * dy - sin * dx  # the target point in the jaw's frame
    ex, ey = qx - mx, qy - my
    if nx == 0.0 and ny == 0.0:
        distance = np.sqrt(ex * ex + ey * ey)
        sign = -1.0 if rho < 0.0 else 1.0
        inverse = sign / distance if distance > 0.0 else 0.0
        nx, ny, curvature = ex * inverse, ey * inverse, inverse
        field = sign * distance - rho
    else:
        curvature = 0.0
        field = nx * ex + ny * ey
    # The field's gradient is n, its Hessian curvature t t^T with t = (-ny, nx). With q = R^T (p -
    # x): dq/dx = -R^T, dq/dpsi = (qy, -qx), d2q/dpsi2 = -q.
    wx, wy = cos * nx - sin * ny, sin * nx + cos * ny  # n in space, from the jaw to the target
    along = -ny * qy - nx * qx  # t . dq/dpsi
    hxp = wy + curvature * wy * along
    hyp = -wx - curvature * wx * along
    return (
        field - r,
        -wx,
        -wy,
        nx * qy - ny * qx,
        curvature * wy * wy,
        -curvature * wx * wy,
        curvature * wx * wx,
        hxp,
        hyp,
        curvature * along * along - nx * qx - ny * qy,
        px - r * wx,
        py - r * wy,
        feature,
    )


@inlined
def plane_gap(qx, qy, rho, nx, ny, px, py, x, y, cos, sin, feature):
    """Gap between the jaw's point (or arc) `(qx, qy)`, `rho` in its frame and a plane of the
    target.

    The plane goes through `(px, py)`; `(nx, ny)` is its unit normal out of the target.
    """
    ax, ay = cos * qx - sin * qy, sin * qx + cos * qy
    wx, wy = x + ax, y + ay
    return (
        nx * (wx - px) + ny * (wy - py) - rho,
        nx,
        ny,
        -nx * ay + ny * ax,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        -nx * ax - ny * ay,
        wx - rho * nx,
        wy - rho * ny,
        feature,
    )


@inlined
def jaw_gap(jaw, d, part, px, py, r, x, y, cos, sin):
    """`target_point_gap` of the jaw's edge (`ON_EDGE`, `FAR_EDGE`), a corner (`ON_A`, `ON_B`) or
    its return face (`ON_RETURN`, `FAR_RETURN`)."""
    mx, my, rho, nx, ny = jaw[d, c.AX], jaw[d, c.AY], 0.0, 0.0, 0.0
    if part >= c.ON_RETURN:
        nx, ny = -jaw[d, c.TRY], jaw[d, c.TRX]
    elif part == c.ON_B:
        mx, my = jaw[d, c.BX], jaw[d, c.BY]
    elif part != c.ON_A:
        rho = jaw[d, c.RHO]
        if rho == 0.0:
            nx, ny = -jaw[d, c.TAY], jaw[d, c.TAX]
        else:
            mx, my = jaw[d, c.MX], jaw[d, c.MY]
    return target_point_gap(mx, my, rho, nx, ny, px, py, r, x, y, cos, sin, part)


@inlined
def _nothing(g):
    """A pair that does not face each other."""
    return g, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, c.VOID


@inlined
def feature_gap(feature, jaw, target, d, t, x, y, cos, sin):
    """Gap of one given contact feature of design `d`, without asking whether it is the one that
    touches.

    jaw: (D, JAW_COLUMNS), target: (D, TARGET_COLUMNS), `t` the target's position along the path.
    """
    py = target[d, c.TARGET_Y]
    if feature <= c.FAR_RETURN:
        far = feature == c.FAR_RETURN or feature == c.FAR_EDGE
        px = t + target[d, c.TARGET_LENGTH] if far else t
        return jaw_gap(jaw, d, feature, px, py, target[d, c.TARGET_RADIUS], x, y, cos, sin)
    if feature == c.VOID:
        return _nothing(c.VOID_GAP)
    qx, qy, rho = jaw[d, c.AX], jaw[d, c.AY], 0.0
    if feature == c.B_UNDERSIDE or feature == c.B_FACE:
        qx, qy = jaw[d, c.BX], jaw[d, c.BY]
    elif feature == c.ARC_UNDERSIDE or feature == c.ARC_FACE:
        qx, qy, rho = jaw[d, c.MX], jaw[d, c.MY], jaw[d, c.RHO]
    face = feature == c.A_FACE or feature == c.B_FACE or feature == c.ARC_FACE
    nx, ny = (-1.0, 0.0) if face else (0.0, -1.0)
    if feature == c.A_BACK:
        t, nx, ny = t + target[d, c.TARGET_LENGTH], 1.0, 0.0
    return plane_gap(qx, qy, rho, nx, ny, t, py, x, y, cos, sin, feature)


@inlined
def block_feature(jaw, target, d, t, x, y, cos, sin):
    """The feature by which a straight or convex jaw touches the block.

    Both are convex, so there is one: where the block's corner lies over the edge and the edge's
    normal there points into the block, that pair; else the point of the jaw that is foremost
    against a plane.
    """
    py, rho = target[d, c.TARGET_Y], jaw[d, c.RHO]
    part = nearest_part(jaw, d, t, py, x, y, cos, sin)
    if part == c.ON_EDGE:
        nx, ny = -jaw[d, c.TAY], jaw[d, c.TAX]
        if rho > 0.0:
            nx = cos * (t - x) + sin * (py - y) - jaw[d, c.MX]
            ny = cos * (py - y) - sin * (t - x) - jaw[d, c.MY]
        wx, wy = cos * nx - sin * ny, sin * nx + cos * ny
        if wx >= 0.0 and wy >= 0.0:
            return c.ON_EDGE
        if wx < 0.0:
            return c.ARC_UNDERSIDE if arc_faces(jaw, d, 0.0, 1.0, cos, sin) else c.B_UNDERSIDE
        return c.ARC_FACE if arc_faces(jaw, d, 1.0, 0.0, cos, sin) else c.A_FACE
    if rho > 0.0:
        ahead = t - x - cos * jaw[d, c.MX] + sin * jaw[d, c.MY]  # of the arc's centre
        below = py - y - sin * jaw[d, c.MX] - cos * jaw[d, c.MY]
        tops = arc_faces(jaw, d, 0.0, 1.0, cos, sin)
        if tops and ahead < 0.0:
            return c.ARC_UNDERSIDE
        # an arc that bulges beyond b: where its top is on it, that is deeper under the block
        if below < 0.0 and arc_faces(jaw, d, 1.0, 0.0, cos, sin):
            if tops or ahead - rho >= below_corners(jaw, d, py, y, cos, sin):
                return c.ARC_FACE
    return foremost_corner(jaw, d, t, py, x, y, cos, sin)


@inlined
def far_feature(jaw, target, d, t, x, y, cos, sin, feature):
    """What of the block of finite length touches the convex jaw: its far side, or `feature`.

    Two convex bodies are apart by the largest of their distances along the normals of their sides.
    On the far side these are the normals of the return face and of the block's back; either the
    block's far corner is foremost towards the face, or corner a towards the back. Where a jaw has
    turned, or an arc bends, so far that the edge falls towards a, the far corner may touch that.
    """
    if target[d, c.TARGET_LENGTH] == 0.0:
        return feature
    over = far_edge_feature(0.0, jaw, target, d, t, x, y, cos, sin)
    if over == c.FAR_EDGE:
        near_gap = feature_gap(feature, jaw, target, d, t, x, y, cos, sin)[0]
        if feature_gap(over, jaw, target, d, t, x, y, cos, sin)[0] > near_gap:
            feature = over
    leans_up = cos * jaw[d, c.TRX] - sin * jaw[d, c.TRY] > 0.0  # the return face's outward normal
    leans_back = sin * jaw[d, c.TRX] + cos * jaw[d, c.TRY] > 0.0
    if leans_up and not leans_back:  # the jaw has turned so far that its near corner is foremost
        return feature
    far = c.FAR_RETURN if leans_up else c.A_BACK
    near_gap = feature_gap(feature, jaw, target, d, t, x, y, cos, sin)[0]
    far_gap = feature_gap(far, jaw, target, d, t, x, y, cos, sin)[0]
    return far if far_gap > near_gap else feature


@inlined
def circle_part(jaw, target, d, t, x, y, cos, sin):
    """The part of the jaw that is nearest to the circle's centre, the return face among them.

    Where the centre is inside the jaw, the side it has least to go through.
    """
    py = target[d, c.TARGET_Y]
    part = nearest_part(jaw, d, t, py, x, y, cos, sin)
    if part == c.ON_B:
        return part
    ax = cos * (t - x) + sin * (py - y) - jaw[d, c.AX]
    ay = cos * (py - y) - sin * (t - x) - jaw[d, c.AY]
    if part == c.ON_A:
        return c.ON_RETURN if jaw[d, c.TRX] * ax + jaw[d, c.TRY] * ay < 0.0 else c.ON_A
    if jaw[d, c.TAX] * ay >= jaw[d, c.TAY] * ax:
        return part  # outside of the tangent at a
    edge = jaw_gap(jaw, d, c.ON_EDGE, t, py, 0.0, x, y, cos, sin)[0]
    face = jaw[d, c.TRX] * ay - jaw[d, c.TRY] * ax
    behind = edge < 0.0 and face > edge and (jaw[d, c.RHO] >= 0.0 or face > 0.0)
    return c.ON_RETURN if behind else part


@inlined
def several_count(kind, jaw, d):
    """How many pairs of a jaw and a target may touch at once (`several_feature`).

    A convex jaw and a circle, or a convex arc and a block, have one contact. A straight edge may
    lie flat on a side of the block, and a concave arc be touched at both its ends.
    """
    if kind == c.CIRCLE:
        return 3 if jaw[d, c.RHO] < 0.0 else 1
    return 5 if jaw[d, c.RHO] <= 0.0 else 1


@inlined
def several_feature(kind, k, jaw, target, d, t, x, y, cos, sin):
    """The feature of pair `k` of those that must all be apart (`VOID` where they do not face).

    Each pair keeps its number, whatever is nearest: the edge and the target's near point, corner a
    (against the circle with the return face), corner b, the return face and the block's far corner,
    the edge and that.
    """
    if several_count(kind, jaw, d) == 1:
        return _single_feature(kind, jaw, target, d, t, x, y, cos, sin)
    if kind == c.CIRCLE:
        part = circle_part(jaw, target, d, t, x, y, cos, sin)
        if k == 0:
            return part if part == c.ON_EDGE else c.VOID
        if k == 1:
            return part if part == c.ON_RETURN else c.ON_A
        return c.ON_B
    if k == 0:
        return edge_feature(jaw, target, d, t, x, y, cos, sin)
    if k == 3:
        return return_feature(jaw, target, d, t, x, y, cos, sin)
    if k == 4:
        return far_edge_feature(c.FLAT, jaw, target, d, t, x, y, cos, sin)
    return corner_feature(k == 1, jaw, target, d, t, x, y, cos, sin)


@inlined
def _single_feature(kind, jaw, target, d, t, x, y, cos, sin):
    """The feature by which a straight or convex jaw touches the target."""
    if kind == c.CIRCLE:
        return circle_part(jaw, target, d, t, x, y, cos, sin)
    near = block_feature(jaw, target, d, t, x, y, cos, sin)
    return far_feature(jaw, target, d, t, x, y, cos, sin, near)


@inlined
def closest_count(kind, jaw, d):
    """Among how many features the closest is to be looked for."""
    return several_count(kind, jaw, d) if jaw[d, c.RHO] < 0.0 else 1


@inlined
def closest_feature(kind, k, jaw, target, d, t, x, y, cos, sin):
    """Feature `k` of `closest_count` at this pose (`VOID` where nothing faces)."""
    if jaw[d, c.RHO] >= 0.0:
        return _single_feature(kind, jaw, target, d, t, x, y, cos, sin)
    return several_feature(kind, k, jaw, target, d, t, x, y, cos, sin)


@inlined
def closest_gap(kind, hold, jaw, target, d, t, x, y, cos, sin):
    """The smallest gap of all constraints of the closed form; of feature `hold` where that is >=
    0."""
    if hold >= 0:
        return feature_gap(hold, jaw, target, d, t, x, y, cos, sin)
    best = _nothing(np.inf)
    for k in range(closest_count(kind, jaw, d)):
        feature = closest_feature(kind, k, jaw, target, d, t, x, y, cos, sin)
        other = feature_gap(feature, jaw, target, d, t, x, y, cos, sin)
        if other[0] < best[0]:
            best = other
    return best


@inlined
def store(gap, out, i):
    """Write the tuple of a gap into column `i` of `out` (GAP_COLUMNS, ...)."""
    g, gx, gy, gp, hxx, hxy, hyy, hxp, hyp, hpp, px, py, feature = gap
    out[c.GAP, i], out[c.GX, i], out[c.GY, i], out[c.GP, i] = g, gx, gy, gp
    out[c.HXX, i], out[c.HXY, i], out[c.HYY, i] = hxx, hxy, hyy
    out[c.HXP, i], out[c.HYP, i], out[c.HPP, i] = hxp, hyp, hpp
    out[c.PX, i], out[c.PY, i], out[c.FEATURE, i] = px, py, feature
