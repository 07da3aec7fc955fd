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

#: Points of the arc that are looked at, and how deep in the block (finger lengths) one counts.
_POINTS = 65
_DEPTH = 1e-9


def mark_overlaps(problem: Problem, trace: Trace) -> bool:
    """Give the rows that claim no contact, where the undeformed arc is inside the block, the status
    MAX_ITERATIONS. Returns whether there are any."""
    around = (problem.jaw[:, c.RHO] < 0.0) & (problem.target[:, c.TARGET_LENGTH] > 0.0)
    designs = np.flatnonzero(around)
    if problem.kind != c.BLOCK or not len(designs):
        return False
    positions = problem.positions[designs]
    x, y = _arc(problem.jaw[designs])
    target = problem.target[designs]
    high = y - target[:, c.TARGET_Y, None] > _DEPTH
    ahead = x[:, None, :] - positions[:, :, None]
    within = (ahead > _DEPTH) & (ahead < target[:, c.TARGET_LENGTH, None, None] - _DEPTH)
    inside = (within & high[:, None, :]).any(axis=2)
    state = trace.rows[designs, : positions.shape[1], rows.STATUS]
    wrong = inside & (state == status.NO_CONTACT)
    state[wrong] = status.MAX_ITERATIONS
    trace.rows[designs, : positions.shape[1], rows.STATUS] = state
    return bool(wrong.any())


def _arc(jaw: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (D, _POINTS) of the arcs from a to b with the undeformed finger, its tip at (1, 0)."""
    mx, my = jaw[:, c.MX], jaw[:, c.MY]
    begin = np.arctan2(jaw[:, c.AY] - my, jaw[:, c.AX] - mx)
    end = np.arctan2(jaw[:, c.BY] - my, jaw[:, c.BX] - mx)
    turn = (end - begin + np.pi) % (2.0 * np.pi) - np.pi  # an arc is at most a semicircle
    angle = begin[:, None] + turn[:, None] * np.linspace(0.0, 1.0, _POINTS)
    radius = np.abs(jaw[:, c.RHO, None])
    return 1.0 + mx[:, None] + radius * np.cos(angle), my[:, None] + radius * np.sin(angle)
