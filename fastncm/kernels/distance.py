"""Signed distance of a point to a rigid convex target, with what its derivatives need.

Each function works in the target's own frame and returns ``(g, nx, ny, kappa)``: the distance
(negative inside), its gradient, which is the target's outward unit normal at the closest point, and
the curvature of the level line through the point. The Hessian of a distance field is ``kappa t
t^T`` with the unit tangent ``t = (-ny, nx)``.
"""

import numpy as np

from fastncm.kernels.cache import inlined, kernel

# --- shapes of targets in direct contact ----------------------------------------------------------
ELLIPSE, POLYGON, HALF_PLANE = 0, 1, 2

#: Newton steps for the closest point of an ellipse: convergence is monotone, four are usual.
_STEPS = 60
#: So near to its longer axis (squared shorter semi-axes), a point inside an ellipse lies on it.
_AXIS = 1e-100


@kernel
def ellipse_distance(a, b, x, y):
    """Distance to the ellipse with the semi-axes `a` along x and `b` along y; a circle is one.

    With the longer semi-axis p along u, the shorter one q along v, and ``f = p^2 - q^2``, the
    closest point is ``(p^2 u / (w + f), q^2 v / w)``, where ``F(w) = (p u / (w + f))^2 + (q v /
    w)^2 - 1`` is zero (D. Eberly, "Distance from a Point to an Ellipse"; w = t + q^2). F falls
    and is convex to the right of w = 0, so that Newton's method, once left of the root, climbs to
    it monotonically. On the longer axis between the centres of curvature there is no root, and two
    points at the same distance: one of them is taken.
    """
    if a == b:
        distance = np.sqrt(x * x + y * y)
        inverse = 1.0 / distance if distance > 0.0 else 0.0
        nx, ny = (x * inverse, y * inverse) if distance > 0.0 else (0.0, 1.0)
        return distance - a, nx, ny, inverse
    wide = a > b
    u, v = (abs(x), abs(y)) if wide else (abs(y), abs(x))
    p, q = (a, b) if wide else (b, a)
    pp, qq = p * p, q * q
    focal = pp - qq
    # F >= 0 at this w, since one of its summands is 1 there; near the surface, the first Newton
    # step from w = q^2 is closer, and never beyond the root either
    w = max(p * u - focal, q * v)
    fu, fv = u / p, v / q
    slope = -2.0 * (fu * fu / pp + fv * fv / qq)
    if slope < 0.0:
        w = max(w, qq - (fu * fu + fv * fv - 1.0) / slope)
    if w > _AXIS * qq:
        for _ in range(_STEPS):
            far, near = 1.0 / (w + focal), 1.0 / w
            fu, fv = p * u * far, q * v * near
            f = fu * fu + fv * fv - 1.0
            step = 0.5 * f / (fu * fu * far + fv * fv * near)
            w += step
            if abs(step) <= 1e-16 * w or f <= 0.0:
                break
        cu, cv = pp * u / (w + focal), qq * v / w
    else:
        cu = pp * u / focal
        cv = q * np.sqrt(max(0.0, 1.0 - (cu / p) ** 2))
    gu, gv = cu / pp, cv / qq
    steep = np.sqrt(gu * gu + gv * gv)
    nu, nv = gu / steep, gv / steep
    g = (u - cu) * nu + (v - cv) * nv
    curvature = 1.0 / (pp * qq * steep**3)
    nx, ny = (nu, nv) if wide else (nv, nu)
    nx, ny = np.copysign(nx, x), np.copysign(ny, y)
    return g, nx, ny, curvature / (1.0 + curvature * g)


@kernel
def polygon_distance(vertices, d, x, y):
    """Distance to the convex polygon with the corners ``vertices[d]`` (V, 2), counter-clockwise."""
    g, nx, ny, curvature = -np.inf, 0.0, 1.0, 0.0
    nearest = np.inf
    count = vertices.shape[1]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        ex, ey = vertices[d, j, 0] - vertices[d, i, 0], vertices[d, j, 1] - vertices[d, i, 1]
        length = np.sqrt(ex * ex + ey * ey)
        ex, ey = ex / length, ey / length
        dx, dy = x - vertices[d, i, 0], y - vertices[d, i, 1]
        along, height = dx * ex + dy * ey, dx * ey - dy * ex
        if nearest == np.inf and height > g:  # inside so far: the largest of the (negative) heights
            g, nx, ny = height, ey, -ex
        if height <= 0.0:
            continue
        beyond = along - min(max(along, 0.0), length)
        distance = np.sqrt(height * height + beyond * beyond)
        if distance < nearest:
            g, nx, ny, curvature = height, ey, -ex, 0.0
            if beyond != 0.0:  # nearest to a corner
                nx, ny = (
                    (beyond * ex + height * ey) / distance,
                    (beyond * ey - height * ex) / distance,
                )
                g, curvature = distance, 1.0 / distance
            nearest = distance
    return g, nx, ny, curvature


@inlined
def distance(shape, vertices, d, x, y):
    """Distance of the point `(x, y)` in the target's frame to the surface of target `d`.

    vertices: (D, V, 2), the corners of a POLYGON, the two semi-axes ``[[a, b]]`` of an ELLIPSE. A
    HALF_PLANE lies below the x axis.
    """
    if shape == ELLIPSE:
        return ellipse_distance(vertices[d, 0, 0], vertices[d, 0, 1], x, y)
    if shape == POLYGON:
        return polygon_distance(vertices, d, x, y)
    return y, 0.0, 1.0, 0.0
