"""Which of the snaps that were met on the paths of fingers in direct contact are told."""

import numpy as np

from fastncm.path import surface_rows as rows
from fastncm.sqp import status

#: Energy over the largest that was stored before, below which a snap is rounding.
_NOTHING = 1e-7


def drop_doubtful_snaps(table: np.ndarray) -> None:
    """Take out of the rows (D, P, surface_rows.COLUMNS), in place, the snaps that may be none.

    Those that release next to nothing; and where contact goes on, those that release less of what
    was stored than forces beside them may be wrong by: between nodes that are far apart contact
    moves by jumps.
    """
    touching = table[:, :, rows.STATUS] == status.CONVERGED
    energy = np.where(touching, table[:, :, rows.ENERGY], 0.0)
    wrong = np.where(touching, np.minimum(table[:, :, rows.ESTIMATE], 1.0), 0.0)
    released = table[:, 1:, rows.RELEASED]
    largest = np.maximum.accumulate(energy, axis=1)[:, :-1]
    doubt = np.maximum(wrong[:, 1:], wrong[:, :-1]) * energy[:, :-1] * touching[:, 1:]
    released[released < np.maximum(_NOTHING * largest, doubt)] = 0.0
