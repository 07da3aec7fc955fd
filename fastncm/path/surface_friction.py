"""The paper's base-moment rule of friction (Lan & Lee 2008, eqs. (14)-(17)) in direct contact:
`friction.model = "recovered"`.

As for jaws (`path.friction`) the shape is the frictionless one, and the force is turned and scaled
so that its moment about the clamp stays. One moment equation is enough for one contact point only;
a row with several has no answer.
"""

import numpy as np

from fastncm.kernels.nodal import NodalProblem
from fastncm.path import surface_rows as rows
from fastncm.sqp import status

Array = np.ndarray


def turn_forces(problem: NodalProblem, mu: Array, table: Array) -> None:
    """Turn the forces of frictionless rows, in place. mu: (D,); table: (D, P, COLUMNS)."""
    loaded = (table[:, :, rows.STATUS] == status.CONVERGED) & (table[:, :, rows.NORMAL] > 0.0)
    loaded &= mu[:, None] > 0.0
    spread = loaded & (table[:, :, rows.CONTACTS] > 1.0)
    table[spread, rows.STATUS] = status.SPREAD_CONTACT
    d, i = np.nonzero(loaded & ~spread)
    row, slope = table[d, i], mu[d]
    cos, sin = np.cos(problem.base[d, i]), np.sin(problem.base[d, i])
    # the contact from the clamp, in space and in the base's frame
    px = row[:, rows.X_MEAN] - problem.arm[d] * cos
    py = row[:, rows.Y_MEAN] - problem.arm[d] * sin
    x, y, turn = problem.placement[d, i, 0], problem.placement[d, i, 1], problem.motion[d, i, 2]
    vx = problem.motion[d, i, 0] - turn * (sin * -px + cos * py - y)
    vy = problem.motion[d, i, 1] + turn * (cos * px + sin * py - x)
    vx, vy = cos * vx - sin * vy, sin * vx + cos * vy
    nx = row[:, rows.FORCE_X] / row[:, rows.NORMAL]
    ny = row[:, rows.FORCE_Y] / row[:, rows.NORMAL]
    side = np.where(nx * vy - ny * vx >= 0.0, slope, -slope)
    lever = px * ny - py * nx
    turned = lever + side * (px * nx + py * ny)
    holds = turned * lever > 0.0
    normal = row[:, rows.NORMAL] * lever / np.where(holds, turned, 1.0)
    fx, fy = normal * (nx - side * ny), normal * (ny + side * nx)
    rate = fx * vx + fy * vy
    speed = np.hypot(vx, vy)
    row[:, rows.FORCE_X], row[:, rows.FORCE_Y], row[:, rows.NORMAL] = fx, fy, normal
    row[:, rows.FRICTION], row[:, rows.WORK_RATE] = slope * normal, rate
    row[:, rows.INSERTION] = rate / np.where(speed > 0.0, speed, 1.0)
    row[~holds, rows.STATUS] = status.NO_EQUILIBRIUM
    table[d, i] = row
