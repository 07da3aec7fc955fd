"""The point forms (10a), (10b) of the contact constraints."""

import numpy as np
import pytest
from entrance import entrance
from jaws import TARGET_Y, Pose, jaw_row, jaw_samples, target_row
from scipy.optimize import brentq

from fastncm.kernels import constants as c
from fastncm.kernels import points

constraint_count = entrance(points.constraint_count)
constraint_gap = entrance(points.constraint_gap)
jaw_point = entrance(points.jaw_point)
smallest_gap = entrance(points.smallest_gap)
target_point = entrance(points.target_point)

STEP = 1e-5
JAWS = {
    "segment": jaw_row((0.0, 0.18), (0.34, 0.03)),
    "convex": jaw_row((0.0, 0.15), (0.33, 0.03), 0.88),
    "concave": jaw_row((0.0, 0.15), (0.33, 0.03), -0.88),
}
TARGETS = {"circle": (c.CIRCLE, 0.156), "block": (c.BLOCK, 0.0)}
FORMS = (c.POINTS_ON_FINGER, c.POINTS_ON_TARGET)
POSE = Pose(0.97, -0.14, -0.2, 1.23)
"""The circle overlaps the jaw here, and the block's corner is just inside it."""


def gap_of(
    form: int, count: int, k: int, jaw: np.ndarray, target: str, pose: Pose = POSE
) -> np.ndarray:
    """Constraint `k` of `count` as an array (GAP_COLUMNS,)."""
    (kind, radius), (x, y, psi, t) = TARGETS[target], pose
    return np.array(
        constraint_gap(
            form, count, kind, k, jaw, target_row(radius), 0, t, x, y, np.cos(psi), np.sin(psi)
        )
    )


def smallest(form: int, count: int, jaw: np.ndarray, target: str, pose: Pose) -> float:
    (kind, radius), (x, y, psi, t) = TARGETS[target], pose
    return smallest_gap(
        form, count, kind, jaw, target_row(radius), 0, t, x, y, np.cos(psi), np.sin(psi)
    )


@pytest.mark.parametrize("jaw", JAWS)
def test_points_of_the_jaw_are_evenly_spaced_on_it(jaw: str) -> None:
    expected = jaw_samples(JAWS[jaw], 11)
    found = np.array([jaw_point(JAWS[jaw], 0, k / 10.0) for k in range(11)])
    np.testing.assert_allclose(found[:, :2], expected, atol=1e-14)
    along = np.gradient(jaw_samples(JAWS[jaw], 2001), axis=0, edge_order=2)[::200]
    left = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    np.testing.assert_allclose(found[:, 2:], left, atol=1e-6)


def test_points_of_the_circle_lie_all_around_it() -> None:
    found = np.array(
        [target_point(c.CIRCLE, k, 8, JAWS["segment"], target_row(0.2), 0, 1.5) for k in range(8)]
    )
    arms = found - [1.5, TARGET_Y]
    np.testing.assert_allclose(np.hypot(*arms.T), 0.2, rtol=1e-14)
    assert len(np.unique(arms.round(12), axis=0)) == 8
    np.testing.assert_allclose(arms.sum(axis=0), 0.0, atol=1e-14)


def test_points_of_the_block_lie_on_its_face_and_underside() -> None:
    found = np.array(
        [target_point(c.BLOCK, k, 9, JAWS["segment"], target_row(0.0), 0, 1.5) for k in range(9)]
    )
    assert tuple(found[0]) == (1.5, TARGET_Y)
    on_face = (found[:, 0] == 1.5) & (found[:, 1] > TARGET_Y)
    on_underside = (found[:, 1] == TARGET_Y) & (found[:, 0] > 1.5)
    assert on_face.sum() == on_underside.sum() == 4
    chord = np.hypot(0.34, 0.15)
    assert found[:, 0].max() - 1.5 == pytest.approx(chord, rel=1e-14)
    assert found[:, 1].max() - TARGET_Y == pytest.approx(chord, rel=1e-14)


@pytest.mark.parametrize("jaw", JAWS)
def test_jaw_points_against_the_circle(jaw: str) -> None:
    """(10a): distance of the point from the circle's centre, less the radius."""
    curve = POSE.to_space(jaw_samples(JAWS[jaw], 7))
    expected = np.hypot(*(curve - [POSE.t, TARGET_Y]).T) - 0.156
    found = [gap_of(c.POINTS_ON_FINGER, 7, k, JAWS[jaw], "circle")[c.GAP] for k in range(7)]
    np.testing.assert_allclose(found, expected, atol=1e-14)


@pytest.mark.parametrize("jaw", JAWS)
@pytest.mark.parametrize("t", [0.9, 1.1, 1.23, 1.5])
def test_jaw_points_against_the_block(jaw: str, t: float) -> None:
    """(10a): the largest of the distances to face and underside, and of the block's corner from the
    tangent where its normal points into the block; inside the block always the latter. The tangent
    does not count where the block's corner is beside the edge."""
    pose = POSE._replace(t=t)
    inner = np.array([jaw_point(JAWS[jaw], 0, k / 6.0) for k in range(1, 6)])
    curve = pose.to_space(inner[:, :2])
    normals = pose.to_space(inner[:, 2:]) - pose.to_space(np.zeros((1, 2)))
    before, below = t - curve[:, 0], TARGET_Y - curve[:, 1]
    planes = np.maximum(before, below)
    tangent = normals[:, 0] * before + normals[:, 1] * below
    fine = pose.to_space(jaw_samples(JAWS[jaw], 2001))
    nearest = np.argmin(np.hypot(*(fine - [t, TARGET_Y]).T))
    faces = (normals >= 0.0).all(axis=1) & (0 < nearest < 2000)
    expected = np.where(faces & ((planes <= 0.0) | (tangent > planes)), tangent, planes)
    found = [gap_of(c.POINTS_ON_FINGER, 7, k, JAWS[jaw], "block", pose)[c.GAP] for k in range(1, 6)]
    np.testing.assert_allclose(found, expected, atol=1e-14)


@pytest.mark.parametrize("jaw", JAWS)
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("form", FORMS)
def test_derivatives(jaw: str, target: str, form: int) -> None:
    for k in range(6):
        here = gap_of(form, 6, k, JAWS[jaw], target)
        quotients = np.empty((4, c.GAP_COLUMNS))
        for i in range(4):
            ahead, behind = np.array(POSE), np.array(POSE)
            ahead[i] += STEP
            behind[i] -= STEP
            quotients[i] = gap_of(form, 6, k, JAWS[jaw], target, Pose(*ahead))
            quotients[i] -= gap_of(form, 6, k, JAWS[jaw], target, Pose(*behind))
        quotients /= 2.0 * STEP
        gradient = [c.GX, c.GY, c.GP]
        hessian = [[c.HXX, c.HXY, c.HXP], [c.HXY, c.HYY, c.HYP], [c.HXP, c.HYP, c.HPP]]
        np.testing.assert_allclose(here[gradient], quotients[:3, c.GAP], atol=1e-7)
        np.testing.assert_allclose(here[hessian], quotients[:3, gradient], atol=1e-5)
        assert -here[c.GX] == pytest.approx(quotients[3, c.GAP], abs=1e-7)


@pytest.mark.parametrize("jaw", ["segment", "convex"])
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("form", FORMS)
def test_smallest_gap_where_the_shapes_touch(jaw: str, target: str, form: int) -> None:
    """Zero but for the points' distance from the place of contact, which counts with its square."""

    def exact(t: float) -> float:
        return smallest(c.CLOSEST, 0, JAWS[jaw], target, Pose(1.0, -0.08, -0.1, t))

    touching = Pose(1.0, -0.08, -0.1, brentq(exact, 1.05, 1.7, xtol=1e-15))
    counts = np.array([26, 51, 101, 201, 401, 801])
    errors = np.array([smallest(form, m, JAWS[jaw], target, touching) for m in counts])
    # the points happen to hit or miss the place of contact: bound the errors, do not fit them
    assert np.all(np.abs(errors) <= 1.0 / (counts - 1.0) ** 2 + 1e-14)


@pytest.mark.parametrize(
    ("form", "jaw", "kind", "expected"),
    [
        (c.CLOSEST, "segment", c.CIRCLE, 1),
        (c.CLOSEST, "concave", c.CIRCLE, 3),
        (c.CLOSEST, "segment", c.BLOCK, 5),
        (c.CLOSEST, "convex", c.BLOCK, 1),
        (c.CLOSEST, "concave", c.BLOCK, 5),
        (c.POINTS_ON_FINGER, "segment", c.CIRCLE, 37),
        (c.POINTS_ON_FINGER, "convex", c.BLOCK, 38),
        (c.POINTS_ON_TARGET, "segment", c.CIRCLE, 39),
        (c.POINTS_ON_TARGET, "concave", c.BLOCK, 42),
    ],
)
def test_number_of_constraints(form: int, jaw: str, kind: int, expected: int) -> None:
    assert constraint_count(form, 37, kind, JAWS[jaw], 0) == expected
