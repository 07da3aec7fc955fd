"""The error estimate of direct contact against the true error, with 7,680 intervals as the truth.

The true error of a single position swings through zero as the contact passes from node to node, so
that only its lower side can be asserted everywhere, and how far above it lies along a path.
"""

import numpy as np
import pytest
from surfaces import PLANE, Solved, solved_surface

pytestmark = pytest.mark.compiled
ANGLES = np.radians(np.linspace(125.3, 78.7, 14))
TRUTH = 7680
VARIANTS = {
    "plain": {},
    "no shear": {"model.shear": False},
    "thin": {"finger.thickness": 0.01},
    "thin, no shear": {"finger.thickness": 0.004, "model.shear": False},
    "tapered": {"finger.thickness": [0.030, 0.003]},
    "axis": {"model.surface": "axis"},
    "circle": {"target.shape": "circle", "target.radius": 0.067},
    "as printed": {"model.section": "psi+gamma"},
    "plane": PLANE,
}


def path(changes: dict, intervals: int) -> Solved:
    at = ANGLES if "path.kind" not in changes else np.array([0.054, 0.045, 0.035, 0.028, 0.024])
    solved = solved_surface(changes | {"solver.intervals": intervals}, at)
    assert solved.converged.all()
    return solved


@pytest.mark.parametrize("changes", VARIANTS.values(), ids=VARIANTS)
def test_never_below_the_true_error_and_seldom_far_above(changes: dict) -> None:
    # as printed, many passes are needed where N is large
    truth = path(changes, 1440 if changes == VARIANTS["as printed"] else TRUTH)
    size = np.linalg.norm(truth.force, axis=1)
    for intervals in (12, 23, 45, 90, 180):
        solved = path(changes, intervals)
        error = np.linalg.norm(solved.force - truth.force, axis=1) / size
        ratio = solved.estimate / np.maximum(error, 1e-12)
        assert ratio.min() >= 1.0, intervals
        assert np.median(ratio) <= 40.0, intervals
        # against the largest error along the path, which does not swing through zero
        assert solved.estimate.max() <= 80.0 * error.max(), intervals


@pytest.mark.parametrize(("intervals", "points"), [(45, 90), (90, 1440), (360, 360), (360, 1440)])
def test_points_of_the_target_are_estimated_too(intervals: int, points: int) -> None:
    """Also where they are much denser than the sections on which their forces act."""
    truth = path({}, TRUTH)
    size = np.linalg.norm(truth.force, axis=1)
    form = {"solver.contact": "points-on-target", "solver.points": points}
    solved = path(form, intervals)
    error = np.linalg.norm(solved.force - truth.force, axis=1) / size
    assert (solved.estimate >= error).all()
    assert np.median(solved.estimate / error) <= 40.0
