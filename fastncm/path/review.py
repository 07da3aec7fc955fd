"""One look at all rows of a solved trace: what failed, how large its estimates are, where something
happens between two positions."""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import kernel
from fastncm.path import rows
from fastncm.sqp import status

#: What happens between two positions: contact begins, ends, or changes its feature.
BEGINS, ENDS, CHANGES = range(3)


class Review(NamedTuple):
    """What the rows of D designs say.

    worst: (D,) int64, the largest status; truncation: (D,) largest estimate of a solved row without
    the part that more modes cannot mend; event: (E,) int64 BEGINS, ENDS or CHANGES; design,
    interval: (E,) int64, between which positions of which design.
    """

    worst: np.ndarray
    truncation: np.ndarray
    event: np.ndarray
    design: np.ndarray
    interval: np.ndarray


@kernel
def _review(table, first, positions, worst, truncation, event, design, interval):
    """Fill the arrays of a `Review`; returns the number of events."""
    found = 0
    for d in range(table.shape[0]):
        highest, largest = 0.0, 0.0
        for i in range(first, table.shape[1]):
            state = table[d, i, rows.STATUS]
            highest = max(highest, state)
            if state == status.CONVERGED:
                other = rows.ALGEBRAIC * table[d, i, rows.RESIDUAL] + rows.FORCE_ROUNDING
                other += table[d, i, rows.DISCRETE]
                largest = max(largest, table[d, i, rows.ESTIMATE] - other)
            if i == first or i >= positions:
                continue
            before = table[d, i - 1, rows.STATUS]
            what = -1
            if before == status.NO_CONTACT and state == status.CONVERGED:
                what = BEGINS
            elif before == status.CONVERGED and state == status.NO_CONTACT:
                what = ENDS
            elif before == status.CONVERGED and state == status.CONVERGED:
                single, same = True, table[d, i, rows.FEATURE] == table[d, i - 1, rows.FEATURE]
                for j in range(i - 1, i + 1):
                    single = single and table[d, j, rows.FEATURE] < rows.SEVERAL
                    single = single and table[d, j, rows.STICKING] == 0.0
                what = CHANGES if single and not same else -1
            if what >= 0:
                event[found], design[found], interval[found] = what, d, i - 1
                found += 1
        worst[d], truncation[d] = int(highest), largest
    return found


def review(table: np.ndarray, positions: int, first: int = 0) -> Review:
    """Look at `table` (D, positions and events, rows.COLUMNS), from the row `first` of each design
    on."""
    designs = table.shape[0]
    room = designs * max(positions - first - 1, 0)
    seen = Review(
        np.empty(designs, np.int64),
        np.empty(designs),
        *(np.empty(room, np.int64) for _ in range(3)),
    )
    found = _review(table, first, positions, *seen)
    return seen._replace(
        event=seen.event[:found], design=seen.design[:found], interval=seen.interval[:found]
    )
