"""From scenes of direct contact to dimensionless problems."""

import numba
import numpy as np
import pytest
from surfaces import lowered_surface

from fastncm.direct import targets

SQUARE = [[-0.1, 0.0], [0.0, -0.07], [0.1, 0.0], [0.0, 0.07]]
PLANE = {
    "target.shape": "half-plane",
    "path.kind": "translation",
    "path.start": 0.06,
    "path.stop": 0.02,
}
VARIANTS = [
    {"path.steps": 1 + 2},
    {"finger.side": "left", "finger.offset": 0.0},
    {"finger.profile": [[0.0, 0.03], [0.1524, 0.01]]},
    {"model.shear": False},
    {"model.section": "psi+gamma"},
    {"model.surface": "axis"},
    {"friction.mu": 0.3},
    {"target.shape": "circle", "target.radius": 0.07},
    {"target.shape": "polygon", "target.vertices": SQUARE},
    {"target.shape": "polygon", "target.vertices": SQUARE, "solver.contact": "points-on-finger"},
    {"solver.contact": "points-on-target"},
    PLANE,
    PLANE | {"solver.contact": "points-on-target"},
]


@pytest.mark.parametrize("changes", VARIANTS)
@pytest.mark.parametrize("positions", [None, [1.5, 1.6]])
def test_all_scenes_share_one_compilation(changes, positions):
    """A read-only or strided array in one scene only would compile everything once more."""
    ours = lowered_surface(changes, positions).problem
    theirs = lowered_surface().problem
    kinds = [[numba.typeof(value) for value in problem] for problem in (ours, theirs)]
    assert dict(zip(ours._fields, kinds[0], strict=True)) == dict(
        zip(ours._fields, kinds[1], strict=True)
    )


@pytest.mark.parametrize("size", [1e-9, 1e-3, 0.3, 3.0])
def test_all_corners_of_a_square_are_seen_at_any_size(size: float) -> None:
    """Against an interval: a right angle turns more than nodes can follow, however short its
    sides."""
    square = size * np.array([[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]])
    assert targets._sharp(square, interval=1.0).all()
