"""A finger, what it carries and a moving target, as arrays that a deck is written from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .mesh import Block

SLICE = 0.1
"""Thickness of the finite elements out of the plane, mm; forces are scaled to the finger's width.
CalculiX expands plane-stress elements to solid ones, which are too stiff where they are as wide as
the finger (by 10 % for the snap-fits)."""
MERGED = 1e-6
"""Nodes of neighbouring blocks closer than this are one, mm."""

Face = tuple[str, int, int]
"""Part, row number of the element in its part, number of the element's face."""


@dataclass(frozen=True)
class Part:
    """A block under a name."""

    name: str
    block: Block

    def faces(self, side: str, which: slice = slice(None)) -> list[Face]:
        """Element faces along a side of the block."""
        return [(self.name, element, face) for element, face in self.block.side(side)[which]]


@dataclass(frozen=True)
class Model:
    """All that a deck says but the friction and the increments."""

    nodes: np.ndarray
    """(n, 2), mm, at time 0."""
    parts: Mapping[str, np.ndarray]
    """Elements of each part: (m, 8) row numbers of nodes."""
    materials: Mapping[str, tuple[str, str]]
    """Of each part: the material's name and cards."""
    surfaces: Mapping[str, Sequence[Face]]
    pairs: Sequence[tuple[str, str]]
    """Surfaces that may touch. The first one is the slave, whose nodes must not enter the other."""
    stiffness: float
    """Of the contact's penalty, MPa/mm."""
    clamp: np.ndarray
    """Row numbers of the nodes that the finger is held by."""
    motions: Sequence[np.ndarray]
    """Tables (n, 2) of a displacement in mm over the model's time."""
    driven: Sequence[tuple[int, int, int]]
    """Prescribed: row number of a node, direction (1 or 2), number of its motion."""
    times: np.ndarray
    """At which forces are asked for."""
    width: float
    """Of the finger, mm."""


def joined(parts: Sequence[Part]) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Nodes (n, 2) and elements of all parts, coincident nodes of different parts merged."""
    nodes = np.concatenate([part.block.nodes for part in parts])
    kept = np.arange(len(nodes))
    for first, second in cKDTree(nodes).query_pairs(MERGED):
        kept[max(first, second)] = kept[min(first, second)]
    used, renumbered = np.unique(kept, return_inverse=True)
    begins = np.cumsum([0, *(len(part.block.nodes) for part in parts)])
    elements = {
        part.name: renumbered[part.block.elements + begin]
        for part, begin in zip(parts, begins, strict=False)
    }
    return nodes[used], elements
