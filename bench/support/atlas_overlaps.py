"""What an undeformed finger of the atlas overlaps, judged by the scene's description alone: claims
of no contact, and targets that no bending can clear."""

from functools import lru_cache

import extremes
import numpy as np
from matplotlib.path import Path

import fastncm
from fastncm.scene import Scene
from support import atlas_slsqp

PENETRATION = 1e-5
"""What counts as inside, in finger lengths or sizes of the target."""

EDGE_POINTS = 81
"""Of a jaw that are looked at."""


@lru_cache(maxsize=2)
def _jaw_block(kind: str, block: int) -> extremes.Columns:
    return extremes.jaw_block(kind, block)


def overlaps(kind: str, index: int) -> bool:
    """Whether a scene's undeformed finger is inside the target at the path's end."""
    judge = side_overlaps if kind in extremes.SIDE_KINDS else jaw_overlaps
    return judge(kind, index)


def is_short_block(kind: str, index: int) -> bool:
    """Whether a jaw's target is a block whose underside ends."""
    columns = _jaw_block(kind, index // extremes.BLOCK)
    lengths = columns.get("target.length")
    return lengths is not None and lengths[index % extremes.BLOCK] != "endless"


def jaw_overlaps(kind: str, index: int) -> bool:
    """Whether the undeformed jaw's edge is inside the target at the path's end, or the target's
    reference point inside a jaw with a straight edge, which is a triangle with the finger's tip."""
    columns = _jaw_block(kind, index // extremes.BLOCK)
    chain = atlas_slsqp.JawChain(columns, index % extremes.BLOCK)
    edge = chain.edge(np.linspace(0.0, 1.0, EDGE_POINTS))[0] + [1.0, 0.0]
    if kind.endswith("straight"):
        jaw = Path([[1.0, 0.0], edge[0], edge[-1]])
        if jaw.contains_point([chain.stop, chain.y]):
            return True
    return bool(chain.outside(edge - [chain.stop, chain.y]).min() < -PENETRATION)


@lru_cache
def _base(kind: str) -> Scene:
    return fastncm.load_scene(extremes.base_scene(kind))


@lru_cache(maxsize=2)
def _side_block(kind: str, block: int) -> list[tuple[np.ndarray, extremes.Columns]]:
    return extremes.parts(extremes.side_block(kind, block))


def _side(kind: str, index: int) -> dict[str, object]:
    """`extremes.one`, for many of a block."""
    case = index % extremes.BLOCK
    for rows, columns in _side_block(kind, index // extremes.BLOCK):
        if case in rows:
            return extremes.row(columns, int(np.searchsorted(rows, case)))
    raise IndexError(index)


def side_scene(kind: str, index: int) -> Scene:
    """A scene of direct contact."""
    return _base(kind).replace(_side(kind, index))


def _undeformed(kind: str, index: int) -> tuple[Scene, np.ndarray]:
    """A scene of direct contact and its undeformed finger's nodes (N + 1, 2) at the path's end,
    those of the surface that touches, the clamp first, seen from the target's reference point."""
    scene = side_scene(kind, index)
    where, finger = scene.pose(scene.path.stop), scene.finger
    along = np.array([np.cos(where.base_angle), np.sin(where.base_angle)])
    s = np.linspace(0.0, finger.length, scene.solver.intervals + 1)
    half = 0.5 * np.interp(s, *np.transpose(finger.stations)) * (scene.model.surface == "side")
    half *= 1.0 if finger.side == "right" else -1.0
    side = (finger.offset + s)[:, None] * along + half[:, None] * [along[1], -along[0]]
    return scene, side - [where.target_x, where.target_y]


def clamp_is_covered(kind: str, index: int) -> bool:
    """Whether the touching surface's end at the clamp is inside the target at the path's end."""
    scene, nodes = _undeformed(kind, index)
    return bool(inside(scene, nodes)[0])


def side_overlaps(kind: str, index: int) -> bool:
    """Whether a node of the undeformed finger is inside the target at the path's end."""
    scene, nodes = _undeformed(kind, index)
    return bool(inside(scene, nodes)[1:].any())


def inside(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Whether points (n, 2) in m, seen from the target's reference point, are inside the target
    (n,), by more than PENETRATION."""
    return np.asarray(level(scene, points) < -PENETRATION)


def level(scene: Scene, points: np.ndarray) -> np.ndarray:
    """A function (n,) of points (n, 2) in m, seen from the target's reference point: negative
    inside the target, and as large as the distance in sizes of the target (of a half-plane: in
    finger lengths)."""
    target = scene.target
    if target.shape == "polygon":
        corners = np.array(target.vertices)
        ahead = np.roll(corners, -1, axis=0) - corners
        away = points[:, None] - corners
        depth = ahead[:, 0] * away[..., 1] - ahead[:, 1] * away[..., 0]
        depth /= np.hypot(*ahead.T) * np.hypot(*ahead.T).max()
        return np.asarray(-depth.min(axis=1))
    cos, sin = np.cos(target.tilt), np.sin(target.tilt)
    u, v = points @ [cos, sin], points @ [-sin, cos]
    if target.shape == "half-plane":
        return np.asarray(v / scene.finger.length)
    a, b = (target.radius, target.radius) if target.shape == "circle" else target.semi_axes
    return np.asarray(np.hypot(u / a, v / b) - 1.0)
