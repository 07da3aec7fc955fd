"""The full grid over a study's axes, addressed by `case_id` and never written out whole."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import prod

import numpy as np


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

    def positions(self, case_ids: np.ndarray) -> tuple[np.ndarray, ...]:
        """Where the cases, shape (C,), lie on each axis: one index array of shape (C,) per axis."""
        return np.unravel_index(case_ids, self.shape)

    def columns(self, case_ids: np.ndarray) -> dict[str, np.ndarray]:
        """Values of the cases, shape (C,): one column of shape (C,) per axis."""
        positions = self.positions(case_ids)
        return {
            name: values[index]
            for (name, values), index in zip(self.axes.items(), positions, strict=True)
        }

    def case_ids(self, chosen: Mapping[str, Sequence[int]]) -> np.ndarray:
        """The cases at chosen indices of some axes, the other axes held at their middle value.

        Returns case ids in ascending order, shape (product of the numbers of indices,).
        """
        index = [chosen.get(name, [n // 2]) for name, n in zip(self.axes, self.shape, strict=True)]
        return np.ravel_multi_index(np.ix_(*index), self.shape).ravel()
