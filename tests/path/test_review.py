"""One look at all rows, against NumPy's many."""

import numpy as np

from fastncm.path import rows
from fastncm.path.review import BEGINS, CHANGES, ENDS, review
from fastncm.sqp import status

DESIGNS, POSITIONS, EVENTS = 40, 12, 5


def some_rows() -> np.ndarray:
    """Rows with anything in them that the solver may write."""
    random = np.random.default_rng(7)
    table = random.uniform(size=(DESIGNS, POSITIONS + EVENTS, rows.COLUMNS))
    shape = table.shape[:2]
    kinds = [status.CONVERGED, status.NO_CONTACT, status.MAX_ITERATIONS]
    table[:, :, rows.STATUS] = random.choice(kinds, p=[0.6, 0.35, 0.05], size=shape)
    table[:, :, rows.FEATURE] = random.choice([0, 1, 1, rows.SEVERAL], size=shape)
    table[:, :, rows.STICKING] = random.choice([0, 0, 1], size=shape)
    return table


def test_worst_status_and_truncation() -> None:
    table = some_rows()
    seen = review(table, POSITIONS)
    np.testing.assert_array_equal(seen.worst, table[:, :, rows.STATUS].max(axis=1))
    other = rows.ALGEBRAIC * table[:, :, rows.RESIDUAL] + rows.FORCE_ROUNDING
    part = table[:, :, rows.ESTIMATE] - other - table[:, :, rows.DISCRETE]
    part[table[:, :, rows.STATUS] != status.CONVERGED] = 0.0
    np.testing.assert_allclose(seen.truncation, np.maximum(part, 0.0).max(axis=1), rtol=1e-14)
    assert (seen.truncation > 0.0).any()


def test_the_first_rows_may_be_left_out() -> None:
    table = some_rows()
    seen = review(table, POSITIONS, first=POSITIONS)
    np.testing.assert_array_equal(seen.worst, table[:, POSITIONS:, rows.STATUS].max(axis=1))
    assert len(seen.event) == 0


def test_events_are_between_the_positions_where_something_changes() -> None:
    table = some_rows()
    seen = review(table, POSITIONS)
    state = table[:, :POSITIONS, rows.STATUS]
    feature = table[:, :POSITIONS, rows.FEATURE]
    free, touching = state == status.NO_CONTACT, state == status.CONVERGED
    slides = touching & (feature < rows.SEVERAL) & (table[:, :POSITIONS, rows.STICKING] == 0.0)
    expected = {
        BEGINS: free[:, :-1] & touching[:, 1:],
        ENDS: touching[:, :-1] & free[:, 1:],
        CHANGES: slides[:, :-1] & slides[:, 1:] & (feature[:, :-1] != feature[:, 1:]),
    }
    for event, where in expected.items():
        chosen = seen.event == event
        assert chosen.any()
        found = np.column_stack([seen.design[chosen], seen.interval[chosen]])
        np.testing.assert_array_equal(found, np.argwhere(where))
