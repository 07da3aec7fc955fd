"""What a case's row says of its whole path: peaks, work, largest strain and error, status."""

import numpy as np

from fastncm.kernels.cache import inlined, kernel
from fastncm.path import rows
from fastncm.path.friction import turned_force
from fastncm.sqp import status

# --- columns of a summary ------------------------------------------------------------------------
#: Peak insertion force and its position, the rows between which it is a smooth maximum (-1: it is a
#: row); the same of the retention force, which resists the target on its way out; the target's work
#: on the way in and out, and what is stored of it at the end; largest strain and error estimate,
#: iterations, status.
(
    PEAK_FORCE,
    PEAK_POSITION,
    SMOOTH_FROM,
    SMOOTH_TO,
    RETENTION,
    RETENTION_POSITION,
    RETENTION_FROM,
    RETENTION_TO,
    WORK,
    WORK_BACK,
    STORED,
    STRAIN,
    ESTIMATE,
    ITERATIONS,
    STATUS,
    STATUS_IN,
) = range(16)
COLUMNS = 16


@inlined
def _row_of(table, d, positions, place, event):
    """Index of the next row in the order of the path.

    place: of the next position; event: of the next event. An event of interval i stands behind
    position i.
    """
    room = table.shape[1] - positions
    if event < room and table[d, positions + event, rows.KIND] != rows.AT_POSITION:
        if int(table[d, positions + event, rows.INTERVAL]) < place:
            return positions + event
    return place if place < positions else -1


@inlined
def _smooth_maximum(h, f0, f1, r0, r1):
    """Largest value in (0, h) of the cubic with values f0, f1 and slopes r0, r1 at its ends.

    For slopes that point upwards at both ends, inwards (r0 h > 0 > r1 h).
    """
    best = max(f0, f1)
    # slope along z = x / h: a z^2 + b z + c
    a = 6.0 * (f0 - f1) + 3.0 * h * (r0 + r1)
    b = -6.0 * (f0 - f1) - h * (4.0 * r0 + 2.0 * r1)
    c = h * r0
    root = np.sqrt(max(b * b - 4.0 * a * c, 0.0))
    z = 2.0 * c / (-b + root) if -b + root > 0.0 else 0.5
    z = min(max(z, 0.0), 1.0)
    value = (
        (1.0 + 2.0 * z) * (1.0 - z) ** 2 * f0
        + z * z * (3.0 - 2.0 * z) * f1
        + h * z * (1.0 - z) ** 2 * r0
        + h * z * z * (z - 1.0) * r1
    )
    return max(best, value)


@inlined
def _is_smooth(table, d, before, i):
    """True where the force is smooth between two rows: one contact on one feature, which slides in
    one sense."""
    smooth = table[d, i, rows.FEATURE] < rows.SEVERAL
    for column in (rows.FEATURE, rows.SIDE, rows.STICKING):
        smooth = smooth and table[d, i, column] == table[d, before, column]
    return smooth and table[d, i, rows.STICKING] == 0.0


@kernel
def summarise(table, positions, design, mu, out):
    """Summaries of C cases from the rows of their designs.

    table: (D, positions and events, rows.COLUMNS); design, mu (of the recovered rule): (C,); out:
    (C, COLUMNS), overwritten. The peak is the largest row, or, with SMOOTH_FROM and SMOOTH_TO, lies
    between two rows and is to be refined (`path.peaks`). The work is the integral of the cubic
    through the rows and their rates.
    """
    for case in range(out.shape[0]):
        d, m = design[case], mu[case]
        for column in range(COLUMNS):
            out[case, column] = 0.0
        inward = table[d, 0, rows.DIRECTION]
        for way in (PEAK_FORCE, RETENTION):
            out[case, way + 1] = table[d, 0, rows.POSITION]
            out[case, way + 2] = -1.0
        before, f0, r0 = -1, 0.0, 0.0
        worst, touched = 0, False
        place, event = 0, 0
        while True:
            i = _row_of(table, d, positions, place, event)
            if i < 0:
                break
            if i < positions:
                place += 1
            else:
                event += 1
            state = int(table[d, i, rows.STATUS])
            out[case, ITERATIONS] += table[d, i, rows.ITERATIONS]
            sense = table[d, i, rows.DIRECTION]
            _, _, _, _, f1, r1, holds = turned_force(table, d, i, m)
            loaded = state == status.CONVERGED and table[d, i, rows.FORCE] > 0.0
            if loaded and not holds:
                state = status.NO_EQUILIBRIUM
            if state != status.CONVERGED and state != status.NO_CONTACT:
                worst = worst if worst > 0 else state
                if sense == inward and out[case, STATUS_IN] == 0.0:
                    out[case, STATUS_IN] = state
                before = -1
                continue
            if state == status.NO_CONTACT:
                f1, r1 = 0.0, 0.0
            touched = touched or state == status.CONVERGED
            out[case, STRAIN] = max(out[case, STRAIN], table[d, i, rows.STRAIN])
            out[case, ESTIMATE] = max(out[case, ESTIMATE], table[d, i, rows.ESTIMATE])
            peak = PEAK_FORCE if sense == inward else RETENTION
            if before >= 0:
                if table[d, before, rows.DIRECTION] != sense:  # the target has turned back
                    f0, r0 = -f0, -r0
                h = table[d, i, rows.POSITION] - table[d, before, rows.POSITION]
                area = 0.5 * h * (f0 + f1)
                if _is_smooth(table, d, before, i):
                    area += h * h / 12.0 * (r0 - r1)
                    if h * r0 > 0.0 and h * r1 < 0.0:
                        value = _smooth_maximum(h, f0, f1, r0, r1)
                        if value > out[case, peak]:
                            out[case, peak] = value
                            out[case, peak + 2], out[case, peak + 3] = before, i
                out[case, WORK if sense == inward else WORK_BACK] += sense * area
            if f1 > out[case, peak]:
                out[case, peak] = f1
                out[case, peak + 1] = table[d, i, rows.POSITION]
                out[case, peak + 2] = -1.0
            out[case, STORED] = table[d, i, rows.ENERGY]
            before, f0, r0 = i, f1, r1
        if worst > 0:
            out[case, STATUS] = worst
        else:
            out[case, STATUS] = status.CONVERGED if touched else status.NO_CONTACT
