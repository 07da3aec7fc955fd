"""Which cases go into one task: the grid is cut so that shared problems stay together.

Some axes only scale the answer (thickness of a uniform finger, friction under the recovered
rule): cases that differ in these axes alone share one dimensionless problem. The plan calls such
axes *inner*, the others *outer*, and hands out blocks of whole outer points, each with all its
inner points, so that every problem is solved in one task only. The table does not depend on how
the grid is cut.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from math import prod

import numpy as np

from fastncm.sweeping.grid import Grid

MAX_ROWS = 200_000
"""Cases in one task at most: bounds a task's memory. More inner points than this are split."""


@dataclass(frozen=True)
class Block:
    """Outer points `outer` × inner points `inner`, both half-open ranges of row-major numbers."""

    outer: tuple[int, int]
    inner: tuple[int, int]

    @property
    def rows(self) -> int:
        return (self.outer[1] - self.outer[0]) * (self.inner[1] - self.inner[0])


class Plan:
    """Walks through a grid block by block; how large a block is may change on the way."""

    def __init__(self, grid: Grid, scale_only: Collection[str], max_rows: int) -> None:
        self.grid = grid
        self.max_rows = max_rows
        self._inner_axes = [i for i, name in enumerate(grid.axes) if name in scale_only]
        self._outer_axes = [i for i, name in enumerate(grid.axes) if name not in scale_only]
        self.inner_size = prod(grid.shape[i] for i in self._inner_axes)
        self.outer_size = prod(grid.shape[i] for i in self._outer_axes)
        self._next = (0, 0)  # outer and inner point that the next block starts with

    @property
    def rows_left(self) -> int:
        outer, inner = self._next
        return (self.outer_size - outer) * self.inner_size - inner

    def take(self, rows: int) -> Block | None:
        """The next block of about `rows` cases (one outer point at least), None at the end."""
        outer, inner = self._next
        if outer == self.outer_size:
            return None
        if self.inner_size > self.max_rows:
            end = min(inner + self.max_rows, self.inner_size)
            self._next = (outer + 1, 0) if end == self.inner_size else (outer, end)
            return Block((outer, outer + 1), (inner, end))
        points = max(1, min(rows, self.max_rows) // self.inner_size)
        end = min(outer + points, self.outer_size)
        self._next = (end, 0)
        return Block((outer, end), (0, self.inner_size))

    def blocks(self, rows: int) -> Iterator[Block]:
        """What is left, in blocks of about `rows` cases."""
        while (block := self.take(rows)) is not None:
            yield block

    def case_ids(self, block: Block) -> np.ndarray:
        """Case ids of a block, shape (block.rows,): inner points of the first outer point first."""
        shape = self.grid.shape
        outer = np.repeat(np.arange(*block.outer), block.inner[1] - block.inner[0])
        inner = np.tile(np.arange(*block.inner), block.outer[1] - block.outer[0])
        index = np.zeros((len(shape), len(outer)), dtype=np.int64)
        for axes, numbers in ((self._outer_axes, outer), (self._inner_axes, inner)):
            if axes:
                index[axes] = np.unravel_index(numbers, [shape[i] for i in axes])
        return np.asarray(np.ravel_multi_index(tuple(index), shape))
