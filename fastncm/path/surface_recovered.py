"""Coulomb friction by the paper's base-moment rule (Lan & Lee 2008, eqs. (14)-(17)) in direct
contact: `friction.model = "recovered"`.

As in `path.friction` the shape is the frictionless one; the contact force is turned by friction and
scaled so that its moment about the clamp stays. One moment equation knows one contact point: rows
that touch at several are refused.
"""

import numpy as np

from fastncm.path import surface_rows as rows
from fastncm.sqp import status


def turn_forces(
    table: np.ndarray,
    base: np.ndarray,
    arm: np.ndarray,
    placement: np.ndarray,
    motion: np.ndarray,
    mu: np.ndarray,
) -> None:
    """Turn the forces in the rows of D frictionless paths, in place.

    table: (D, P, surface_rows.COLUMNS); base: (D, P) direction of the base; arm: (D,) of the clamp
    from the pivot; placement, motion: (D, P, 3) of the target in the base's frame; mu: (D,).
    """
    with_friction = mu[:, None] > 0.0
    touching = (table[:, :, rows.STATUS] == status.CONVERGED) & with_friction
    several = touching & (table[:, :, rows.CONTACTS] > 1.0)
    table[several, rows.STATUS] = status.SPREAD_CONTACT
    one = touching & ~several

    cos, sin = np.cos(base), np.sin(base)
    px, py = _into_base(table[:, :, rows.X_MEAN], table[:, :, rows.Y_MEAN], cos, sin)
    px = px - arm[:, None]
    nx, ny = _into_base(table[:, :, rows.FORCE_X], table[:, :, rows.FORCE_Y], cos, sin)
    normal = np.where(one, np.hypot(nx, ny), 1.0)
    nx, ny = nx / normal, ny / normal
    vx = motion[:, :, 0] - motion[:, :, 2] * (py - placement[:, :, 1])
    vy = motion[:, :, 1] + motion[:, :, 2] * (px - placement[:, :, 0])
    side = np.where(nx * vy - ny * vx >= 0.0, mu[:, None], -mu[:, None])  # t = (-ny, nx)
    lever = px * ny - py * nx
    turned = lever + side * (px * nx + py * ny)
    holds = turned * lever > 0.0
    table[one & ~holds, rows.STATUS] = status.NO_EQUILIBRIUM
    normal = normal * np.where(holds, lever / np.where(holds, turned, 1.0), 1.0)
    fx, fy = normal * (nx - side * ny), normal * (ny + side * nx)
    rate, speed = fx * vx + fy * vy, np.hypot(vx, vy)
    answers = {
        rows.FORCE_X: cos * fx - sin * fy,
        rows.FORCE_Y: sin * fx + cos * fy,
        rows.NORMAL: normal,
        rows.FRICTION: mu[:, None] * normal,
        rows.WORK_RATE: rate,
        rows.INSERTION: rate / np.where(speed > 0.0, speed, 1.0),
    }
    for column, values in answers.items():
        table[one, column] = values[one]


def _into_base(
    x: np.ndarray, y: np.ndarray, cos: np.ndarray, sin: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Components in the frame of the base, whose direction has these cos and sin."""
    return cos * x + sin * y, cos * y - sin * x
