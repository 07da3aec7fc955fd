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
    against the insertion force on its way in. retention_force: the largest that resists it on the
    way back, withdrawal_work: against it there, stored: strain energy at the end less that at the
    start; NaN where the path does not come back. status: that of the first row that failed, else
    CONVERGED or, where nothing touches, NO_CONTACT.
    """

    peak_force: np.ndarray
    peak_position: np.ndarray
    work: np.ndarray
    retention_force: np.ndarray
    withdrawal_work: np.ndarray
    stored: np.ndarray
    strain: np.ndarray
    estimate: np.ndarray
    iterations: np.ndarray
    status: np.ndarray


def summarise_surfaces(table: np.ndarray, sense: np.ndarray, turn: int) -> Summary:
    """Summaries of D paths from their rows (D, P, surface_rows.COLUMNS).

    sense: (D,) +1 or -1, in which insertion changes the position; where positions go the other way,
    the target takes work back. turn: the last row of the way in.
    """
    state = table[:, :, rows.STATUS].astype(np.int64)
    solved = state <= status.NO_CONTACT
    position = table[:, :, rows.POSITION]
    force = np.where(solved, table[:, :, rows.INSERTION], 0.0)
    touching = state == status.CONVERGED
    ahead = slice(turn + 1)
    peak_force, peak_position = _peaks(position[:, ahead], force[:, ahead], touching[:, ahead])
    rate = np.where(solved, table[:, :, rows.WORK_RATE], 0.0)
    steps = sense[:, None] * np.diff(position, axis=1)
    work = _work(steps[:, :turn], rate[:, ahead])
    none = np.full(len(table), np.nan)
    retention, work_back, stored = none, none, none
    if turn < position.shape[1] - 1:
        back = slice(turn + 1, None)
        retention, _ = _peaks(position[:, back], force[:, back], touching[:, back])
        reversed_rate = np.concatenate([-rate[:, turn : turn + 1], rate[:, back]], axis=1)
        work_back = _work(-steps[:, turn:], reversed_rate)
        energy = np.where(solved, table[:, :, rows.ENERGY], 0.0)
        stored = energy[:, -1] - energy[:, 0]
    failed = state > status.NO_CONTACT
    first = np.take_along_axis(state, failed.argmax(axis=1)[:, None], axis=1)[:, 0]
    touched = np.where((state == status.CONVERGED).any(axis=1), status.CONVERGED, status.NO_CONTACT)
    return Summary(
        peak_force=peak_force,
        peak_position=peak_position,
        work=work,
        retention_force=np.maximum(retention, 0.0),
        withdrawal_work=work_back,
        stored=stored,
        strain=np.where(solved, table[:, :, rows.STRAIN], 0.0).max(axis=1),
        estimate=np.where(solved, table[:, :, rows.ESTIMATE], 0.0).max(axis=1),
        iterations=table[:, :, rows.ITERATIONS].sum(axis=1).astype(np.int64),
        status=np.where(failed.any(axis=1), first, touched),
    )


def _work(steps: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Integrals (D,) of the rates (D, P) over the steps (D, P - 1)."""
    total: np.ndarray = 0.5 * (steps * (rate[:, 1:] + rate[:, :-1])).sum(axis=1)
    return total


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
    around = which, middle + np.array([[-1], [0], [1]])
    x, f = position[around], force[around]
    inside = (at == middle) & touching[around].all(axis=0)
    inside &= (x[1] - x[0]) * (x[2] - x[1]) > 0.0
    vertex, place = parabola_vertex(x, f)
    good = inside & np.isfinite(vertex)
    return np.where(good, vertex, f1), np.where(good, place, x1)


def parabola_vertex(x: np.ndarray, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Value and place, each (D,), of the vertices of the parabolas through three points each, (3,
    D), the middle ones the largest; NaN or infinite where a parabola is flat or a point double."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = x[1] - x[0], x[2] - x[1]
        rise, fall = (f[1] - f[0]) / a, (f[2] - f[1]) / b
        curvature = (fall - rise) / (a + b)
        slope = (rise * b + fall * a) / (a + b)
        offset = -slope / (2.0 * curvature)
        return f[1] + 0.5 * slope * offset, x[1] + offset
