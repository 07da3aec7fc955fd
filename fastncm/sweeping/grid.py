"""The full grid over a study's axes, addressed by `case_id` and never written out whole."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import prod

import numpy as np
import pyarrow as pa

from fastncm.sweeping.arrow import arrow_values


@dataclass(frozen=True)
class Grid:
    """Every combination of the axes' values.

    A case is numbered row by row in the order in which the axes are declared (the last axis
    varies fastest), as `itertools.product` would list them.

    axes: dotted name -> values, shape (n,), of any dtype.
    """

    axes: Mapping[str, np.ndarray]

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(len(values) for values in self.axes.values())

    @property
    def size(self) -> int:
        return prod(self.shape)

    def columns(self, case_ids: np.ndarray) -> dict[str, np.ndarray]:
        """Values of the cases, shape (C,): one column of shape (C,) per axis."""
        positions = np.unravel_index(case_ids, self.shape)
        return {
            name: values[index]
            for (name, values), index in zip(self.axes.items(), positions, strict=True)
        }

    def arrow_columns(self, case_ids: np.ndarray) -> dict[str, pa.Array]:
        """The same for a table. The type is that of the whole axis, so that all parts agree."""
        positions = np.unravel_index(case_ids, self.shape)
        return {
            name: arrow_values(values).take(pa.array(index))
            for (name, values), index in zip(self.axes.items(), positions, strict=True)
        }

    def task_order(self, scale_only: Collection[str]) -> "GridOrder":
        """The order in which cases are solved: shared problems side by side."""
        return GridOrder(self, scale_only)

    def case_ids(self, chosen: Mapping[str, Sequence[int]]) -> np.ndarray:
        """The cases at chosen indices of some axes, the other axes held at their middle value.

        Returns case ids in ascending order, shape (product of the numbers of indices,).
        """
        index = [chosen.get(name, [n // 2]) for name, n in zip(self.axes, self.shape, strict=True)]
        return np.ravel_multi_index(np.ix_(*index), self.shape).ravel()


class GridOrder:
    """A grid walked through with its inner axes, those that only scale the answer, fastest.

    group: how many cases, one behind the other, share one problem.
    """

    def __init__(self, grid: Grid, scale_only: Collection[str]) -> None:
        self._shape = grid.shape
        inner = [i for i, name in enumerate(grid.axes) if name in scale_only]
        outer = [i for i, name in enumerate(grid.axes) if name not in scale_only]
        self._axes = outer + inner
        self.group = prod(grid.shape[i] for i in inner)

    def case_ids(self, start: int, stop: int) -> np.ndarray:
        """The cases at places `start` to `stop` of the order, shape (stop - start,)."""
        walked = np.unravel_index(np.arange(start, stop), [self._shape[i] for i in self._axes])
        index = [walked[self._axes.index(i)] for i in range(len(self._shape))]
        return np.asarray(np.ravel_multi_index(index, self._shape))
