"""Structured meshes of eight-node quadrilaterals, in mm.

A mesh is put together from blocks, each a grid of points of odd numbers along both directions.
Every block's sides are surfaces, lists of element faces, which contact needs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

CORNERS_AND_MIDDLES = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1))
"""Of one element in its grid of 3 x 3 points, counter-clockwise, as CalculiX wants them."""
FACES = {"bottom": 1, "right": 2, "top": 3, "left": 4}
"""Numbers of an element's faces by the side that they are on."""


@dataclass(frozen=True)
class Block:
    """A structured part of a mesh."""

    nodes: np.ndarray
    """(n, 2), mm."""
    elements: np.ndarray
    """(i * j, 8) row numbers of nodes; i runs fastest."""
    shape: tuple[int, int]
    """Elements along the first and the second direction."""

    def side(self, name: str) -> list[tuple[int, int]]:
        """Element faces (row number, face number) of a side, in the direction of the grid."""
        across, along = self.shape
        numbers = np.arange(across * along).reshape(along, across)
        cut = {
            "bottom": numbers[0],
            "top": numbers[-1],
            "left": numbers[:, 0],
            "right": numbers[:, -1],
        }
        return [(int(element), FACES[name]) for element in cut[name]]


def block(grid: np.ndarray) -> Block:
    """The block of a grid of points (2 i + 1, 2 j + 1, 2), right-handed, in mm."""
    points = grid.shape[:2]
    used = np.ones(points, bool)
    used[1::2, 1::2] = False  # an eight-node element has no node at its centre
    number = np.full(points, -1)
    number[used] = np.arange(used.sum())
    elements = [
        [number[i + di, j + dj] for di, dj in CORNERS_AND_MIDDLES]
        for j in range(0, points[1] - 1, 2)
        for i in range(0, points[0] - 1, 2)
    ]
    return Block(grid[used], np.array(elements), (points[0] // 2, points[1] // 2))


def ruled(bottom: np.ndarray, top: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Grid between two lines of points (2 i + 1, 2) at the given parts (2 j + 1) of the way."""
    across = heights[None, :, None]
    return bottom[:, None, :] * (1.0 - across) + top[:, None, :] * across


def cuts(ends: Sequence[float], counts: Sequence[int]) -> np.ndarray:
    """Nodes along a line: from each end to the next so many elements of one length, with their
    middles."""
    parts = [
        np.linspace(start, stop, 2 * count + 1)[:-1]
        for start, stop, count in zip(ends[:-1], ends[1:], counts, strict=True)
    ]
    return np.append(np.concatenate(parts), ends[-1])
