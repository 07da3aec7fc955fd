"""What a case's row says of its whole path in direct contact: peak, work, strain, error, status.

Plain NumPy over all designs at once: one pass over rows that took thousands of times as long to
solve.
"""

from typing import NamedTuple

import numpy as np

from fastncm.path import surface_rows as rows
from fastncm.sqp import status


class Summary(NamedTuple):
    """Of D paths, dimensionless, each (D,).

    peak_force, peak_position: the vertex of the parabola through the row with the largest insertion
    force and its neighbours; that row itself where one of them is missing. work: of the target
    against the insertion force along the path. status: that of the first row that failed, else
    CONVERGED or, where nothing touches, NO_CONTACT.
    """

    peak_force: np.ndarray
    peak_position: np.ndarray
    work: np.ndarray
    strain: np.ndarray
    estimate: np.ndarray
    iterations: np.ndarray
    status: np.ndarray


def summarise_surfaces(table: np.ndarray) -> Summary:
    """Summaries of D paths from their rows (D, P, surface_rows.COLUMNS)."""
    state = table[:, :, rows.STATUS].astype(np.int64)
    solved = state <= status.NO_CONTACT
    position = table[:, :, rows.POSITION]
    force = np.where(solved, table[:, :, rows.INSERTION], 0.0)
    peak_force, peak_position = _peaks(position, force, state == status.CONVERGED)
    rate = np.where(solved, table[:, :, rows.WORK_RATE], 0.0)
    steps = np.abs(np.diff(position, axis=1))
    work = 0.5 * (steps * (rate[:, 1:] + rate[:, :-1])).sum(axis=1)
    failed = state > status.NO_CONTACT
    first = np.take_along_axis(state, failed.argmax(axis=1)[:, None], axis=1)[:, 0]
    touched = np.where((state == status.CONVERGED).any(axis=1), status.CONVERGED, status.NO_CONTACT)
    return Summary(
        peak_force=peak_force,
        peak_position=peak_position,
        work=work,
        strain=np.where(solved, table[:, :, rows.STRAIN], 0.0).max(axis=1),
        estimate=np.where(solved, table[:, :, rows.ESTIMATE], 0.0).max(axis=1),
        iterations=table[:, :, rows.ITERATIONS].sum(axis=1).astype(np.int64),
        status=np.where(failed.any(axis=1), first, touched),
    )


def _peaks(
    position: np.ndarray, force: np.ndarray, touching: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Largest force and its position, each (D,), by the parabola through three touching rows of
    (D, P)."""
    designs, count = force.shape
    at = force.argmax(axis=1)
    middle = np.clip(at, 1, max(count - 2, 0))
    which = np.arange(designs)
    x1, f1 = position[which, at], force[which, at]
    if count < 3:
        return f1, x1
    x0, x2 = position[which, middle - 1], position[which, middle + 1]
    f0, f2 = force[which, middle - 1], force[which, middle + 1]
    inside = (at == middle) & touching[which, middle - 1] & touching[which, middle + 1]
    inside &= (x1 - x0) * (x2 - x1) > 0.0
    return parabola_vertex(x0, x1, x2, f0, f1, f2, inside)


def parabola_vertex(
    x0: np.ndarray,
    x1: np.ndarray,
    x2: np.ndarray,
    f0: np.ndarray,
    f1: np.ndarray,
    f2: np.ndarray,
    inside: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Value and place of the maximum of the parabolas through three points each, the middle one the
    largest; the middle points themselves where not `inside` or where the parabola is flat."""
    safe = np.where(inside, 1.0, 0.0)
    a, b = safe * (x1 - x0), safe * (x2 - x1)
    with np.errstate(divide="ignore", invalid="ignore"):
        rise, fall = (f1 - f0) / a, (f2 - f1) / b
        curvature = (fall - rise) / (a + b)
        slope = (rise * b + fall * a) / (a + b)
        offset = -slope / (2.0 * curvature)
    good = inside & np.isfinite(offset)
    offset = np.where(good, offset, 0.0)
    value = f1 + np.where(good, 0.5 * slope * offset, 0.0)
    return np.where(good, value, f1), x1 + offset
