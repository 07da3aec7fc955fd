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


def boundary(
    first: Array, second: Array, jaw: Array, target: Array, t: Array, pose: Array
) -> tuple[Array, Array]:
    """The functions that are zero at the changes between the features `first` and `second` (S,).

    jaw: (S, JAW_COLUMNS); target: (S, TARGET_COLUMNS); t: (S,); pose: (S, 3). Returns e (S,), NaN
    where the two have no common boundary, and its derivatives by the pose (S, 3).
    """
    low, high = np.minimum(first, second), np.maximum(first, second)
    point = np.column_stack([t, target[:, c.TARGET_Y]])
    zero, one = np.zeros_like(t), np.ones_like(t)
    cos, sin = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    mx = cos * jaw[:, c.MX] - sin * jaw[:, c.MY]
    my = sin * jaw[:, c.MX] + cos * jaw[:, c.MY]
    # tangents at the jaw's ends in space
    ax = cos * jaw[:, c.TAX] - sin * jaw[:, c.TAY]
    ay = sin * jaw[:, c.TAX] + cos * jaw[:, c.TAY]
    bx = cos * jaw[:, c.TBX] - sin * jaw[:, c.TBY]
    by = sin * jaw[:, c.TBX] + cos * jaw[:, c.TBY]
    e_a, d_a = _jaw_end(jaw[:, [c.AX, c.AY]], jaw[:, [c.TAX, c.TAY]], point, pose)
    e_b, d_b = _jaw_end(jaw[:, [c.BX, c.BY]], jaw[:, [c.TBX, c.TBY]], point, pose)
    e_r, d_r = _jaw_end(jaw[:, [c.AX, c.AY]], jaw[:, [c.TRX, c.TRY]], point, pose)
    # corner a from the block's far corner; the return face's normal in space
    arm_x = cos * jaw[:, c.AX] - sin * jaw[:, c.AY]
    arm_y = sin * jaw[:, c.AX] + cos * jaw[:, c.AY]
    far = pose[:, 0] + arm_x - t - target[:, c.TARGET_LENGTH]
    face_x = cos * jaw[:, c.TRX] - sin * jaw[:, c.TRY]
    face_y = sin * jaw[:, c.TRX] + cos * jaw[:, c.TRY]
    edge = low == c.ON_EDGE
    level = (pose[:, 0] + mx - t, np.column_stack([one, zero, -my]))
    upright = (pose[:, 1] + my - point[:, 1], np.column_stack([zero, one, mx]))
    choices = [
        # the target's corner or centre leaves the edge at a, at b
        (edge & np.isin(high, (c.ON_A, c.A_UNDERSIDE, c.A_FACE)), (e_a, d_a)),
        (edge & np.isin(high, (c.ON_B, c.B_UNDERSIDE, c.B_FACE)), (e_b, d_b)),
        # the centre leaves the return face at a; a leaves the underside at the block's far corner
        (_pair(low, high, c.ON_A, c.ON_RETURN), (e_r, d_r)),
        (
            _pair(low, high, c.FAR_RETURN, c.A_UNDERSIDE),
            (far, np.column_stack([one, zero, -arm_y])),
        ),
        # the return face is upright, along the block's back
        (_pair(low, high, c.FAR_RETURN, c.A_BACK), (face_x, _turn(-face_y))),
        # the arc is level, upright, at the block's corner
        (edge & (high == c.ARC_UNDERSIDE), level),
        (edge & (high == c.ARC_FACE), upright),
        # the arc's level, upright, point reaches one of its ends
        (_pair(low, high, c.A_UNDERSIDE, c.ARC_UNDERSIDE), (ay, _turn(ax))),
        (_pair(low, high, c.B_UNDERSIDE, c.ARC_UNDERSIDE), (by, _turn(bx))),
        (_pair(low, high, c.A_FACE, c.ARC_FACE), (ax, _turn(-ay))),
        (_pair(low, high, c.B_FACE, c.ARC_FACE), (bx, _turn(-by))),
    ]
    e, derivative = np.full_like(t, np.nan), np.zeros((len(t), 3))
    for where, (value, by_pose) in choices:
        e[where], derivative[where] = value[where], by_pose[where]
    return e, derivative


def _pair(low: Array, high: Array, first: int, second: int) -> Array:
    """Where the two features are `first` and `second`."""
    pair: Array = (low == first) & (high == second)
    return pair


def _turn(by_angle: Array) -> Array:
    """Derivatives by the pose of something that depends on the angle alone."""
    zero = np.zeros_like(by_angle)
    return np.column_stack([zero, zero, by_angle])
