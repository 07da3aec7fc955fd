"""Where one contact feature ends and the next begins.

A boundary is a function ``e(pose, t)`` that is zero where both features touch in the same place.
All of them depend on the target's position minus the tip's, so that ``de/dt = -de/dx``.
"""

import numpy as np

from fastncm.kernels import constants as c

Array = np.ndarray


def _jaw_end(corner: Array, tangent: Array, point: Array, pose: Array) -> tuple[Array, Array]:
    """Distance of the target's `point` from the jaw's `corner` along the `tangent` there.

    corner, tangent: (S, 2) in the tip's frame; point: (S, 2) in space; pose: (S, 3). Returns e (S,)
    and its derivatives by the pose (S, 3).
    """
    cos, sin = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    dx, dy = point[:, 0] - pose[:, 0], point[:, 1] - pose[:, 1]
    qx, qy = cos * dx + sin * dy, cos * dy - sin * dx
    tx, ty = tangent[:, 0], tangent[:, 1]
    e = tx * (qx - corner[:, 0]) + ty * (qy - corner[:, 1])
    return e, np.column_stack([sin * ty - cos * tx, -sin * tx - cos * ty, tx * qy - ty * qx])


def _edge_ends_at_a(jaw: Array, target: Array, t: Array, pose: Array) -> tuple[Array, Array]:
    point = np.column_stack([t, target[:, c.TARGET_Y]])
    return _jaw_end(jaw[:, [c.AX, c.AY]], jaw[:, [c.TAX, c.TAY]], point, pose)


def _edge_ends_at_b(jaw: Array, target: Array, t: Array, pose: Array) -> tuple[Array, Array]:
    point = np.column_stack([t, target[:, c.TARGET_Y]])
    return _jaw_end(jaw[:, [c.BX, c.BY]], jaw[:, [c.TBX, c.TBY]], point, pose)


def _face_ends_at_a(jaw: Array, target: Array, t: Array, pose: Array) -> tuple[Array, Array]:
    point = np.column_stack([t, target[:, c.TARGET_Y]])
    return _jaw_end(jaw[:, [c.AX, c.AY]], jaw[:, [c.TRX, c.TRY]], point, pose)


def _far_edge_ends_at_a(jaw: Array, target: Array, t: Array, pose: Array) -> tuple[Array, Array]:
    point = np.column_stack([t + target[:, c.TARGET_LENGTH], target[:, c.TARGET_Y]])
    return _jaw_end(jaw[:, [c.AX, c.AY]], jaw[:, [c.TAX, c.TAY]], point, pose)


def _a_at_far_corner(jaw: Array, target: Array, t: Array, pose: Array) -> tuple[Array, Array]:
    arm_x, arm_y = _turned(jaw, c.AX, c.AY, pose)
    e = pose[:, 0] + arm_x - t - target[:, c.TARGET_LENGTH]
    return e, np.column_stack([np.ones_like(t), np.zeros_like(t), -arm_y])


def _face_along_back(jaw: Array, target: Array, t: Array, pose: Array) -> tuple[Array, Array]:
    x, y = _turned(jaw, c.TRX, c.TRY, pose)
    return x, _turn(-y)


def _arc_is_level(jaw: Array, target: Array, t: Array, pose: Array) -> tuple[Array, Array]:
    mx, my = _turned(jaw, c.MX, c.MY, pose)
    return pose[:, 0] + mx - t, np.column_stack([np.ones_like(t), np.zeros_like(t), -my])


def _arc_is_level_at_far_corner(
    jaw: Array, target: Array, t: Array, pose: Array
) -> tuple[Array, Array]:
    return _arc_is_level(jaw, target, t + target[:, c.TARGET_LENGTH], pose)


def _arc_is_upright(jaw: Array, target: Array, t: Array, pose: Array) -> tuple[Array, Array]:
    mx, my = _turned(jaw, c.MX, c.MY, pose)
    e = pose[:, 1] + my - target[:, c.TARGET_Y]
    return e, np.column_stack([np.zeros_like(t), np.ones_like(t), mx])


def _level_at_a(jaw: Array, target: Array, t: Array, pose: Array) -> tuple[Array, Array]:
    x, y = _turned(jaw, c.TAX, c.TAY, pose)
    return y, _turn(x)


def _level_at_b(jaw: Array, target: Array, t: Array, pose: Array) -> tuple[Array, Array]:
    x, y = _turned(jaw, c.TBX, c.TBY, pose)
    return y, _turn(x)


def _upright_at_a(jaw: Array, target: Array, t: Array, pose: Array) -> tuple[Array, Array]:
    x, y = _turned(jaw, c.TAX, c.TAY, pose)
    return x, _turn(-y)


def _upright_at_b(jaw: Array, target: Array, t: Array, pose: Array) -> tuple[Array, Array]:
    x, y = _turned(jaw, c.TBX, c.TBY, pose)
    return x, _turn(-y)


#: What is zero where the contact changes from one feature of a pair to the other.
_BETWEEN = {
    # the target's corner or centre leaves the edge at a, at b
    (c.ON_EDGE, c.ON_A): _edge_ends_at_a,
    (c.ON_EDGE, c.A_UNDERSIDE): _edge_ends_at_a,
    (c.ON_EDGE, c.A_FACE): _edge_ends_at_a,
    (c.ON_EDGE, c.ON_B): _edge_ends_at_b,
    (c.ON_EDGE, c.B_UNDERSIDE): _edge_ends_at_b,
    (c.ON_EDGE, c.B_FACE): _edge_ends_at_b,
    # the centre leaves the return face at a; a leaves the underside at the block's far corner
    (c.ON_A, c.ON_RETURN): _face_ends_at_a,
    (c.FAR_RETURN, c.A_UNDERSIDE): _a_at_far_corner,
    # the far corner leaves the edge at a; the arc is level there
    (c.FAR_EDGE, c.FAR_RETURN): _far_edge_ends_at_a,
    (c.FAR_EDGE, c.A_BACK): _a_at_far_corner,
    (c.FAR_EDGE, c.A_UNDERSIDE): _a_at_far_corner,
    (c.FAR_EDGE, c.ARC_UNDERSIDE): _arc_is_level_at_far_corner,
    # the return face is upright, along the block's back
    (c.FAR_RETURN, c.A_BACK): _face_along_back,
    # the arc is level, upright, at the block's corner
    (c.ON_EDGE, c.ARC_UNDERSIDE): _arc_is_level,
    (c.ON_EDGE, c.ARC_FACE): _arc_is_upright,
    # the arc's level, upright, point reaches one of its ends
    (c.A_UNDERSIDE, c.ARC_UNDERSIDE): _level_at_a,
    (c.B_UNDERSIDE, c.ARC_UNDERSIDE): _level_at_b,
    (c.A_FACE, c.ARC_FACE): _upright_at_a,
    (c.B_FACE, c.ARC_FACE): _upright_at_b,
}


def boundary(
    first: Array, second: Array, jaw: Array, target: Array, t: Array, pose: Array
) -> tuple[Array, Array]:
    """The functions that are zero at the changes between the features `first` and `second` (S,).

    jaw: (S, JAW_COLUMNS); target: (S, TARGET_COLUMNS); t: (S,); pose: (S, 3). Returns e (S,), NaN
    where the two have no common boundary, and its derivatives by the pose (S, 3).
    """
    low, high = np.minimum(first, second), np.maximum(first, second)
    e, derivative = np.full_like(t, np.nan), np.zeros((len(t), 3))
    pair = low * (c.VOID + 1) + high
    for code in np.unique(pair):
        between = _BETWEEN.get((int(code) // (c.VOID + 1), int(code) % (c.VOID + 1)))
        if between is not None:
            at = np.flatnonzero(pair == code)
            e[at], derivative[at] = between(jaw[at], target[at], t[at], pose[at])
    return e, derivative


def _turned(jaw: Array, x: int, y: int, pose: Array) -> tuple[Array, Array]:
    """A vector of the jaw's frame, by its columns, in space."""
    cos, sin = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    return cos * jaw[:, x] - sin * jaw[:, y], sin * jaw[:, x] + cos * jaw[:, y]


def _turn(by_angle: Array) -> Array:
    """Derivatives by the pose of something that depends on the angle alone."""
    zero = np.zeros_like(by_angle)
    return np.column_stack([zero, zero, by_angle])
