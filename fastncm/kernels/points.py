"""Contact constraints of one design in their three forms (Lan & Lee 2008, eqs. (10a), (10b), and
closed form).

In the point forms one of the two surfaces is replaced by M points: cheap to state for any gap
function, but the contact jumps from point to point, and the force converges only as 1/M or 1/M^2.
"""

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels import gap
from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.facing import nearest_part


@inlined
def constraint_count(form, points, kind, jaw, d):
    """Number of constraints of this form; `points` is M.

    The sharp corners of the surface that is not discretised are constraints too: otherwise they
    catch between two points like in the teeth of a comb.
    """
    if form == c.CLOSEST:
        return gap.several_count(kind, jaw, d)
    if form == c.POINTS_ON_FINGER:
        return points + gap.closest_count(kind, jaw, d) if kind == c.BLOCK else points
    return points + (2 if kind == c.CIRCLE else gap.closest_count(kind, jaw, d))


@inlined
def jaw_point(jaw, d, fraction):
    """The point of the jaw's edge at `fraction` of its length from a to b, and the outward normal
    there, in the jaw's frame: ``(x, y, nx, ny)``."""
    rho = jaw[d, c.RHO]
    if rho == 0.0:
        x = jaw[d, c.AX] + fraction * (jaw[d, c.BX] - jaw[d, c.AX])
        y = jaw[d, c.AY] + fraction * (jaw[d, c.BY] - jaw[d, c.AY])
        return x, y, -jaw[d, c.TAY], jaw[d, c.TAX]
    start = np.arctan2(jaw[d, c.AY] - jaw[d, c.MY], jaw[d, c.AX] - jaw[d, c.MX])
    cross = jaw[d, c.TAX] * jaw[d, c.TBY] - jaw[d, c.TAY] * jaw[d, c.TBX]
    along = jaw[d, c.TAX] * jaw[d, c.TBX] + jaw[d, c.TAY] * jaw[d, c.TBY]
    angle = start + fraction * np.arctan2(cross, along)
    ex, ey = np.cos(angle), np.sin(angle)
    sign = 1.0 if rho > 0.0 else -1.0
    return jaw[d, c.MX] + abs(rho) * ex, jaw[d, c.MY] + abs(rho) * ey, sign * ex, sign * ey


@inlined
def jaw_point_gap(kind, fraction, jaw, target, d, t, x, y, cos, sin):
    """Gap of one point of the jaw against the target (10a).

    Against the block the gap is the largest of three: to its face, to its underside, and of its
    corner to the jaw's tangent at the point. Without the last, a point that has not passed the
    corner yet would hook behind the face although the jaw's edge slides over the corner. (It does
    not count once the corner has left the edge.)
    """
    qx, qy, nx, ny = jaw_point(jaw, d, fraction)
    py, radius = target[d, c.TARGET_Y], target[d, c.TARGET_RADIUS]
    if kind == c.CIRCLE:
        return gap.target_point_gap(qx, qy, 0.0, 0.0, 0.0, t, py, radius, x, y, cos, sin, c.ON_EDGE)
    before = t - (x + cos * qx - sin * qy)
    below = py - (y + sin * qx + cos * qy)
    wx, wy = cos * nx - sin * ny, sin * nx + cos * ny
    plane = max(before, below)
    over_edge = nearest_part(jaw, d, t, py, x, y, cos, sin) == c.ON_EDGE
    if (
        over_edge
        and wx >= 0.0
        and wy >= 0.0
        and (plane <= 0.0 or wx * before + wy * below >= plane)
    ):
        return gap.target_point_gap(qx, qy, 0.0, nx, ny, t, py, 0.0, x, y, cos, sin, c.ON_EDGE)
    nx, ny = (-1.0, 0.0) if before > below else (0.0, -1.0)
    return gap.plane_gap(qx, qy, 0.0, nx, ny, t, py, x, y, cos, sin, c.ON_EDGE)


@inlined
def target_point(kind, k, points, jaw, target, d, t):
    """Point `k` of the target's surface in space: all around the circle, or from the block's corner
    along its face and its underside as far as the jaw is long."""
    py = target[d, c.TARGET_Y]
    if kind == c.CIRCLE:
        angle = 2.0 * np.pi * k / points
        radius = target[d, c.TARGET_RADIUS]
        return t + radius * np.cos(angle), py + radius * np.sin(angle)
    chord = np.sqrt((jaw[d, c.BX] - jaw[d, c.AX]) ** 2 + (jaw[d, c.BY] - jaw[d, c.AY]) ** 2)
    distance = chord * ((k + 1) // 2) / max(points // 2, 1)
    return (t, py + distance) if k % 2 == 1 else (t + distance, py)


@inlined
def constraint_gap(form, points, kind, k, jaw, target, d, t, x, y, cos, sin):
    """Gap of constraint `k` of this form at one pose of the tip."""
    if form == c.POINTS_ON_FINGER and k < points:
        return jaw_point_gap(kind, k / (points - 1.0), jaw, target, d, t, x, y, cos, sin)
    if form == c.POINTS_ON_TARGET and k < points:
        px, py = target_point(kind, k, points, jaw, target, d, t)
        part = nearest_part(jaw, d, px, py, x, y, cos, sin)
        return gap.jaw_gap(jaw, d, part, px, py, 0.0, x, y, cos, sin)
    if form == c.CLOSEST:
        feature = gap.several_feature(kind, k, jaw, target, d, t, x, y, cos, sin)
    elif form == c.POINTS_ON_TARGET and kind == c.CIRCLE:
        feature = c.ON_A if k == points else c.ON_B
    else:  # the sharp corners' own constraints are those of the closed form
        feature = gap.closest_feature(kind, k - points, jaw, target, d, t, x, y, cos, sin)
    return gap.feature_gap(feature, jaw, target, d, t, x, y, cos, sin)


@inner
def smallest_gap(form, points, kind, jaw, target, d, t, x, y, cos, sin):
    """The smallest gap over all constraints at one pose."""
    if form == c.CLOSEST:
        return gap.closest_gap(kind, -1, jaw, target, d, t, x, y, cos, sin)[0]
    smallest = np.inf
    for k in range(constraint_count(form, points, kind, jaw, d)):
        g = constraint_gap(form, points, kind, k, jaw, target, d, t, x, y, cos, sin)
        smallest = min(smallest, g[0])
    return smallest
