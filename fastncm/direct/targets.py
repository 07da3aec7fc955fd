"""A target in direct contact: its outline, and those points of it that are contact points."""

import numpy as np

from fastncm.kernels.nodal import AROUND
from fastncm.scene import Scene

Array = np.ndarray

#: Corners of a polygon are contact points where an edge beside them is longer than this part of an
#: interval of the finger, or where the outline turns by this angle (rad) within an interval.
_EDGE, _TURN = 1.0, 0.2
#: No nodes touch up to this part of an interval (and less) beside a point of an ellipse; halvings
#: that find where that is.
_BESIDE, _HALVINGS = 0.6, 40


def target_vertices(scene: Scene, semi_x: Array, semi_y: Array, length: Array) -> Array:
    """(D, V, 2): corners of a polygon; ``[[a, b]]`` of an ellipse; nothing of a half-plane."""
    if scene.target.vertices is not None:
        corners: Array = np.array(scene.target.vertices) / length[:, None, None]
        return corners
    return np.ascontiguousarray(np.column_stack([semi_x, semi_y])[:, None, :])


def target_points(scene: Scene, vertices: Array) -> Array:
    """Points (D, M, 2) of the target that are contact points: `solver.points` all around it (10b),
    or, where the finger's nodes are (10a), what is too sharp to be seen by them: a polygon's
    corners, and where an ellipse is as sharp as those."""
    shape, interval = scene.target.shape, 1.0 / scene.solver.intervals
    if scene.solver.contact != "points-on-target":
        if shape == "half-plane" or scene.solver.contact != "closest":
            return np.zeros((len(vertices), 0, 2))
        if shape == "polygon":
            return np.ascontiguousarray(vertices[:, _sharp(vertices, interval)])
        return _sharp_ends(vertices[:, 0], interval)
    fraction = np.arange(scene.solver.points) / scene.solver.points
    if shape == "half-plane":  # as far as the finger reaches to both sides
        along = 4.0 * fraction - 2.0
        points = np.stack([along, np.zeros_like(along)], axis=-1)
        everywhere: Array = np.broadcast_to(points, (len(vertices), *points.shape)).copy()
        return everywhere
    if shape == "polygon":
        corners = len(vertices[0])
        low = (fraction * corners).astype(np.int64)
        share = (fraction * corners - low)[None, :, None]
        edges = np.roll(vertices, -1, axis=1) - vertices
        return np.ascontiguousarray(vertices[:, low] + share * edges[:, low])
    angle = 2.0 * np.pi * fraction
    return np.ascontiguousarray(vertices * np.column_stack([np.cos(angle), np.sin(angle)]))


def _sharp_ends(axes: Array, interval: float) -> Array:
    """Points (D, M, 2) of the ellipses with the semi-axes `axes` (D, 2) where their radius of
    curvature is below an `interval`; M = 0 where no ellipse has any.

    About both ends of the longer axis the outline's normal turns by the same angle from point to
    point. A last one on each side is where the nodes touch again (`kernels.nodal`), so that no part
    of the outline lies between. An ellipse without sharp ends has all its points in its centre,
    where nothing touches.
    """
    long, short = np.maximum(*axes.T)[:, None], np.minimum(*axes.T)[:, None]
    # at the angle t between normal and long axis the radius is (long short)^2 / size^3 with
    # size^2 = short^2 + (long^2 - short^2) cos^2 t
    size = ((long * short) ** 2 / interval) ** (2.0 / 3.0)
    sharp = long**2 > size
    if not sharp.any():
        return np.zeros((len(axes), 0, 2))
    focal = np.where(long > short, long**2 - short**2, 1.0)
    limit = np.arccos(np.sqrt(np.clip((size - short**2) / focal, 0.0, 1.0)))
    low, high, last = limit, np.full_like(limit, 0.5 * np.pi), _outline(long, short, limit)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        away = np.linalg.norm(_outline(long, short, middle) - last, axis=-1)
        low = np.where(away < _BESIDE * interval, middle, low)
        high = np.where(away < _BESIDE * interval, high, middle)
    turned = np.hstack([-high, limit * np.linspace(-1.0, 1.0, AROUND // 2 - 1), high])
    end = _outline(long, short, turned)
    points = np.concatenate([end, -end], axis=1)
    points = np.where((axes[:, 0] >= axes[:, 1])[:, None, None], points, points[..., ::-1])
    found: Array = np.where(sharp[:, :, None], points, 0.0)
    return found


def _outline(long: Array, short: Array, angle: Array) -> Array:
    """Points (D, K, 2), first along the longer axis, of ellipses where the normal is at the `angle`
    (D, K) to it; long, short: (D, 1)."""
    along, across = long * np.cos(angle), short * np.sin(angle)
    size = np.hypot(along, across)[..., None]
    point: Array = np.stack([long * along, short * across], axis=-1) / size
    return point


def _sharp(vertices: Array, interval: float) -> Array:
    """(V,) bool: which corners of the polygons (D, V, 2) nodes an `interval` apart would not see.

    Where a smooth outline is given by many short edges, the nodes see it as they see an ellipse.
    """
    ahead = np.roll(vertices, -1, axis=1) - vertices
    length = np.hypot(*np.moveaxis(ahead, -1, 0))
    direction = np.unwrap(np.arctan2(ahead[..., 1], ahead[..., 0]), axis=1)
    longer = np.maximum(length, np.roll(length, 1, axis=1)) > _EDGE * interval
    # the outline's direction over its length, twice around: how far it turns about each corner
    turns = np.zeros(vertices.shape[:2], dtype=bool)
    for d in range(len(vertices)):
        at = np.concatenate([[0.0], np.cumsum(np.tile(length[d], 3))])
        around = np.concatenate([direction[d] + 2.0 * np.pi * k for k in range(3)])
        corner = at[len(length[d]) + np.arange(len(length[d]))]
        before = np.searchsorted(at, corner - 0.5 * interval, side="right") - 1
        after = np.searchsorted(at, corner + 0.5 * interval, side="right") - 1
        # a polygon smaller than an interval turns by all that is known of it
        after, before = np.minimum(after, len(around) - 1), np.maximum(before, 0)
        turns[d] = around[after] - around[before] > _TURN
    sharp: Array = (longer | turns).any(axis=0)
    return sharp
