"""A concave arc around a short block: the one overlap that no pair of features tells.

An arc that is nearly a semicircle bulges beyond its ends. Between two positions far apart a short
block may pass through an end and come to lie across the arc's middle, where neither of its corners
is over the edge and both ends of the arc are clear of it. The finger is not free there, and how it
came there is not known.
"""

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.problem import Problem
from fastncm.path import rows
from fastncm.path.trace import Trace
from fastncm.sqp import status

#: How deep in the block (finger lengths) a point of the arc counts: ten times what still counts as
#: under it (`kernels.constants.UNDER`).
_DEPTH = 1e-8


def mark_overlaps(problem: Problem, trace: Trace) -> bool:
    """Give the rows that claim no contact, where the undeformed arc is inside the block, the status
    MAX_ITERATIONS. Returns whether there are any."""
    around = (problem.jaw[:, c.RHO] < 0.0) & (problem.target[:, c.TARGET_LENGTH] > 0.0)
    designs = np.flatnonzero(around)
    if problem.kind != c.BLOCK or not len(designs):
        return False
    positions = problem.positions[designs]
    state = trace.rows[designs, : positions.shape[1], rows.STATUS]
    inside = _are_inside(problem.jaw[designs], problem.target[designs], positions)
    wrong = inside & (state == status.NO_CONTACT)
    state[wrong] = status.MAX_ITERATIONS
    trace.rows[designs, : positions.shape[1], rows.STATUS] = state
    return bool(wrong.any())


def _are_inside(jaw: np.ndarray, target: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Whether the undeformed arc, its tip at (1, 0), is inside the block at each of the positions
    (D, N): whether its highest point between the block's face and back is above the underside.

    That is an end of the arc, its top, or where the block's face or back crosses it.
    """
    mx, my, radius = 1.0 + jaw[:, c.MX], jaw[:, c.MY], np.abs(jaw[:, c.RHO])
    face = positions + _DEPTH
    back = positions + target[:, c.TARGET_LENGTH, None] - _DEPTH
    high = target[:, c.TARGET_Y, None] + _DEPTH
    inside = np.zeros(positions.shape, dtype=bool)
    for x, y in ((jaw[:, c.AX], jaw[:, c.AY]), (jaw[:, c.BX], jaw[:, c.BY])):
        x = 1.0 + x[:, None]
        inside |= (face < x) & (x < back) & (y[:, None] > high)
    for x in (np.broadcast_to(mx[:, None], face.shape), face, back):
        off = x - mx[:, None]
        rise = np.sqrt(np.maximum(radius[:, None] ** 2 - off**2, 0.0))
        between = (face <= x) & (x <= back) & (np.abs(off) <= radius[:, None])
        for up in (rise, -rise):
            inside |= between & (my[:, None] + up > high) & _on_arc(jaw, off, up)
    return inside


def _on_arc(jaw: np.ndarray, off: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Whether points of the full circle, `off` and `up` (D, N) from its centre, are on the arc,
    which is at most a semicircle: on the other side of the chord than the centre."""
    wide, high = jaw[:, c.BX] - jaw[:, c.AX], jaw[:, c.BY] - jaw[:, c.AY]
    x, y = off + (jaw[:, c.MX] - jaw[:, c.AX])[:, None], up + (jaw[:, c.MY] - jaw[:, c.AY])[:, None]
    below: np.ndarray = wide[:, None] * y - high[:, None] * x <= 0.0
    return below
