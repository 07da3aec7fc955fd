"""Which cases go into one task: cut so that shared problems stay together, the finished left out.

Some axes only scale the answer (thickness of a uniform finger, friction under the recovered
rule): cases that differ in these axes alone share one dimensionless problem. The order of a design
puts them side by side, and the plan hands out whole groups of them, so that every problem is
solved in one task only. The table does not depend on how the design is cut.
"""

from collections.abc import Collection

import numpy as np

from fastncm.sweeping.grid import Grid
from fastncm.sweeping.samples import Samples

MAX_ROWS = 200_000
"""Cases in one task at most: bounds a task's memory. Larger groups are split."""
SKIPPED_ROWS = 100_000
"""Cases looked at together where all are done."""


class Plan:
    """Walks through the cases that are not done; how large a block is may change on the way.

    done: shape (size,), the cases that are left out. It is read while walking.
    """

    def __init__(
        self, design: Grid | Samples, scale_only: Collection[str], max_rows: int, done: np.ndarray
    ) -> None:
        self.max_rows = max_rows
        self._size = design.size
        self._order = design.task_order(scale_only)
        self._done = done
        self._next = 0  # place in the order that the next block starts with
        self.rows_left = int(self._size - np.count_nonzero(done))

    @property
    def problems_left(self) -> int:
        """Groups of cases that are left: about as many dimensionless problems."""
        return -(-self.rows_left // self._order.group)

    def take(self, rows: int) -> np.ndarray | None:
        """The next about `rows` missing cases, one group of them at least; None at the end."""
        while self._next < self._size:
            group = self._order.group
            if group > self.max_rows:
                end = self._next // group * group + group
                stop = min(self._next + self.max_rows, end)
            else:
                stop = self._next + max(1, min(rows, self.max_rows) // group) * group
            stop = min(stop, self._size)
            ids = self._order.case_ids(self._next, stop)
            self._next = stop
            missing = np.asarray(ids[~self._done[ids]])
            if len(missing):
                self.rows_left -= len(missing)
                return missing
            self._skip_finished()
        return None

    def _skip_finished(self) -> None:
        """Go to the group of the next missing case in large steps."""
        group = self._order.group
        step = max(1, SKIPPED_ROWS // group) * group
        while self._next < self._size:
            stop = min(self._next + step, self._size)
            missing = np.flatnonzero(~self._done[self._order.case_ids(self._next, stop)])
            if len(missing):
                self._next += int(missing[0]) // group * group
                return
            self._next = stop
