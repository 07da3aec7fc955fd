"""Where the target first touches the undeformed finger: `path.start = "touch"`.

In a translation the target comes from +x while the finger stands still and straight, so that each
of its points meets the target's outline where a horizontal line through it does: in closed form for
every shape. In a rotation the finger turns towards the side that touches (`path.surface_touch`).
"""

import numpy as np

from fastncm.kernels.nodal import NodalProblem
from fastncm.path.surface_touch import turn_to_touch
from fastncm.path.surface_way import make_walk
from fastncm.scene import CaseGroup, Scene

Array = np.ndarray


def first_touches(group: CaseGroup) -> Array:
    """(C,) positions in m of the target's reference point at the first touch of each case.

    Where the target does not touch before its path ends, it starts a finger's length before.
    """
    scene, v = group.scene, group.values
    touch = np.empty(len(group.rows))
    for case in range(len(touch)):
        value = {key: float(values[case]) for key, values in v.items()}
        touch[case] = _first_touch(scene, value)
    beyond = v["stop"] + v["length"]
    return np.where(touch > v["stop"], touch, beyond)


def rotation_touches(problem: NodalProblem, target: Array, stop: Array) -> Array:
    """(D,) directions of the base in rad at the first touch on the way to `stop` (D,), rad.

    target: (D, 4), its x at pi/2, speed ratio, y, in finger lengths, and tilt. Where the finger
    does not touch within half a turn, it starts a radian before.
    """
    touch = np.empty(len(stop))
    turn_to_touch(
        problem, make_walk(problem), np.ascontiguousarray(target), np.ascontiguousarray(stop), touch
    )
    return touch


def _first_touch(scene: Scene, value: dict[str, float]) -> float:
    """The largest position at which a surface point lies on the target; -inf where none does."""
    points = _surface_points(scene, value)
    reached = points[:, 0] - _left_edge(scene, value, points[:, 1] - value["y"])
    first = float(reached.max())
    if scene.target.vertices is None:
        return first
    corners = np.array(scene.target.vertices)
    hit = _rightmost(points, corners[:, 1] + value["y"]) - corners[:, 0]
    return max(first, float(hit.max()))


def _surface_points(scene: Scene, value: dict[str, float]) -> Array:
    """(N + 1, 2) in m: the undeformed finger's side at its nodes, the clamp left out, and the tip's
    other corner."""
    s = np.linspace(0.0, value["length"], scene.solver.intervals + 1)
    if scene.finger.profile is not None:
        thickness = np.interp(s, *np.transpose(scene.finger.profile))
    else:
        thickness = np.linspace(value["thickness_clamp"], value["thickness_tip"], len(s))
    half = 0.5 * thickness * (scene.model.surface == "side")
    if scene.finger.side == "left":
        half = -half
    along = np.array([np.cos(value["path_angle"]), np.sin(value["path_angle"])])
    right = np.array([along[1], -along[0]])
    axis = (value["offset"] + s)[:, None] * along
    side = axis + half[:, None] * right
    return np.vstack([side[1:], axis[-1] - half[-1] * right])


def _left_edge(scene: Scene, value: dict[str, float], height: Array) -> Array:
    """x of the target's left outline, seen from its reference point, at the heights above that;
    +inf where the target is not, or has no left end."""
    target = scene.target
    if target.vertices is not None:
        corners = np.array(target.vertices)
        return -_rightmost(np.vstack([corners, corners[:1]]) * [-1.0, 1.0], height)
    if target.shape == "half-plane":
        normal_x, normal_y = -np.sin(value["tilt"]), np.cos(value["tilt"])
        if normal_x >= 0.0:
            return np.full_like(height, np.inf)
        wall: Array = -normal_y * height / normal_x
        return wall
    circle = target.shape == "circle"
    a, b = (value["target_radius"],) * 2 if circle else (value["semi_x"], value["semi_y"])
    tilt = 0.0 if circle else value["tilt"]
    cos, sin = np.cos(tilt), np.sin(tilt)
    # (x cos + y sin)^2 / a^2 + (y cos - x sin)^2 / b^2 = 1 for x
    square = (cos / a) ** 2 + (sin / b) ** 2
    mixed = cos * sin * height * (1.0 / a**2 - 1.0 / b**2)
    rest = height**2 * ((sin / a) ** 2 + (cos / b) ** 2) - 1.0
    root = mixed**2 - square * rest
    edge = (-mixed - np.sqrt(np.maximum(root, 0.0))) / square
    return np.where(root >= 0.0, edge, np.inf)


def _rightmost(line: Array, height: Array) -> Array:
    """Largest x of a polyline (n, 2) at each height; -inf where it does not get there."""
    (x0, y0), (x1, y1) = line[:-1].T, line[1:].T
    low, high = np.minimum(y0, y1), np.maximum(y0, y1)
    at = height[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(y1 == y0, 0.0, (at - y0) / (y1 - y0))
    x = np.where(y1 == y0, np.maximum(x0, x1), x0 + share * (x1 - x0))
    largest: Array = np.where((at >= low) & (at <= high), x, -np.inf).max(axis=1)
    return largest
