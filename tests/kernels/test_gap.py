"""Every gap against brute force: distances to dense samples, difference quotients."""

import numpy as np
import pytest
from entrance import entrance
from hypothesis import given, settings
from hypothesis import strategies as st
from jaws import TARGET_Y, Pose, jaw_row, jaw_samples, target_row
from tracing import CIRCLE, CORNER, lowered_scene

from fastncm.kernels import constants as c
from fastncm.kernels import gap

closest_gap = entrance(gap.closest_gap)
feature_gap = entrance(gap.feature_gap)
several_count = entrance(gap.several_count)
several_feature = entrance(gap.several_feature)
store = entrance(gap.store)

FOURTH_ORDER = ((-2, 1.0 / 12.0), (-1, -2.0 / 3.0), (1, 2.0 / 3.0), (2, -1.0 / 12.0))
"""Central difference quotient: offsets in steps, and weights."""

GRADIENT = [c.GX, c.GY, c.GP]
HESSIAN = [[c.HXX, c.HXY, c.HXP], [c.HXY, c.HYY, c.HYP], [c.HXP, c.HYP, c.HPP]]
FEATURES = {
    "edge": c.ON_EDGE,
    "far edge": c.FAR_EDGE,
    "a": c.ON_A,
    "b": c.ON_B,
    "a underside": c.A_UNDERSIDE,
    "a face": c.A_FACE,
    "b underside": c.B_UNDERSIDE,
    "b face": c.B_FACE,
    "arc underside": c.ARC_UNDERSIDE,
    "arc face": c.ARC_FACE,
}
JAWS = {
    "segment": jaw_row((0.0, 0.18), (0.34, 0.03)),
    "convex": jaw_row((0.0, 0.15), (0.33, 0.03), 0.88),
    "concave": jaw_row((0.0, 0.15), (0.33, 0.03), -0.88),
}

poses = st.builds(
    Pose, st.floats(0.8, 1.0), st.floats(-0.3, 0.05), st.floats(-0.6, 0.2), st.floats(0.6, 1.6)
)
radii = st.sampled_from([0.0, 0.05, 0.156, 0.4])


@st.composite
def jaws(draw: st.DrawFn) -> np.ndarray:
    """A straight, convex or concave jaw of a snap-fit finger's proportions."""
    a = np.array([draw(st.floats(-0.05, 0.05)), draw(st.floats(0.05, 0.2))])
    chord, lead = draw(st.floats(0.2, 0.5)), draw(st.floats(0.1, 0.8))
    b = a + chord * np.array([np.cos(lead), -np.sin(lead)])
    bend = draw(st.sampled_from([0.0, 1.0, -1.0]))
    return jaw_row(tuple(a), tuple(b), bend * draw(st.floats(0.6, 3.0)) * chord)


def evaluate(feature: int, jaw: np.ndarray, radius: float, pose: Pose) -> np.ndarray:
    """`gap.feature_gap` as an array (GAP_COLUMNS,)."""
    x, y, psi, t = pose
    return np.array(
        feature_gap(feature, jaw, target_row(radius), 0, t, x, y, np.cos(psi), np.sin(psi))
    )


def closest(kind: int, jaw: np.ndarray, radius: float, pose: Pose) -> np.ndarray:
    x, y, psi, t = pose
    return np.array(
        closest_gap(kind, -1, jaw, target_row(radius), 0, t, x, y, np.cos(psi), np.sin(psi))
    )


def radius_of_field(feature: int, jaw: np.ndarray, radius: float, pose: Pose) -> float:
    """Distance of the target's point from where the gap has no derivatives: the corner, or the
    centre of the arc."""
    distance = evaluate(feature, jaw, radius, pose)[c.GAP] + radius
    edge = feature in (c.ON_EDGE, c.FAR_EDGE)
    return abs(distance + jaw[0, c.RHO]) if edge else abs(distance)


def differences(
    feature: int, jaw: np.ndarray, radius: float, pose: Pose, step: float
) -> np.ndarray:
    """Derivatives of all columns of the gap by x, y, psi and t, shape (4, GAP_COLUMNS)."""
    quotients = np.zeros((4, c.GAP_COLUMNS))
    for i in range(4):
        for offset, weight in FOURTH_ORDER:
            moved = np.array(pose)
            moved[i] += offset * step
            quotients[i] += weight / step * evaluate(feature, jaw, radius, Pose(*moved))
    return quotients


def check_derivatives(feature: int, jaw: np.ndarray, radius: float, pose: Pose) -> None:
    reach = 1.0
    edge = feature in (c.ON_EDGE, c.FAR_EDGE)
    if feature in (c.ON_A, c.ON_B) or (edge and jaw[0, c.RHO] != 0.0):
        reach = min(1.0, radius_of_field(feature, jaw, radius, pose))
    if reach < 0.01:
        return
    here = evaluate(feature, jaw, radius, pose)
    quotients = differences(feature, jaw, radius, pose, 1e-3 * reach)
    np.testing.assert_allclose(here[GRADIENT], quotients[:3, c.GAP], atol=1e-10 / reach)
    np.testing.assert_allclose(here[HESSIAN], quotients[:3, GRADIENT], atol=1e-9 / reach**2)
    # the gap knows only the target's place relative to the tip
    assert -here[c.GX] == pytest.approx(quotients[3, c.GAP], abs=1e-10 / reach)
    np.testing.assert_allclose(-here[HESSIAN[0]], quotients[3, GRADIENT], atol=1e-9 / reach**2)


def applies(feature: int, jaw: np.ndarray) -> bool:
    """Whether this jaw has the feature."""
    return feature < c.ARC_UNDERSIDE or jaw[0, c.RHO] > 0.0


@pytest.mark.parametrize("jaw", JAWS)
@pytest.mark.parametrize("feature", FEATURES)
@pytest.mark.parametrize("radius", [0.0, 0.156])
def test_derivatives(jaw: str, feature: str, radius: float) -> None:
    code = FEATURES[feature]
    if applies(code, JAWS[jaw]):
        check_derivatives(code, JAWS[jaw], radius, Pose(0.97, -0.14, -0.2, 1.23))
        check_derivatives(code, JAWS[jaw], radius, Pose(0.99, -0.05, 0.1, 1.4))


@settings(max_examples=200, deadline=None, derandomize=True)
@given(jaws(), st.sampled_from(sorted(FEATURES.values())), radii, poses)
def test_derivatives_anywhere(jaw: np.ndarray, feature: int, radius: float, pose: Pose) -> None:
    if applies(feature, jaw):
        check_derivatives(feature, jaw, radius, pose)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(jaws(), radii, poses)
def test_value_and_place_of_each_feature(jaw: np.ndarray, radius: float, pose: Pose) -> None:
    """Gap and contact point against plain geometry in space."""
    centre = np.array([pose.t, TARGET_Y])
    ends = pose.to_space(np.array([[jaw[0, c.AX], jaw[0, c.AY]], [jaw[0, c.BX], jaw[0, c.BY]]]))
    for feature, end in ((c.ON_A, ends[0]), (c.ON_B, ends[1])):
        found = evaluate(feature, jaw, radius, pose)
        arm = end - centre
        assert found[c.GAP] == pytest.approx(np.hypot(*arm) - radius, abs=1e-14)
        if np.hypot(*arm) > 1e-6:
            expected = centre + radius * arm / np.hypot(*arm)
            np.testing.assert_allclose(found[[c.PX, c.PY]], expected, atol=1e-9)
    for feature, end in ((c.A_UNDERSIDE, ends[0]), (c.B_UNDERSIDE, ends[1])):
        found = evaluate(feature, jaw, radius, pose)
        np.testing.assert_allclose(
            found[[c.GAP, c.PX, c.PY]], [TARGET_Y - end[1], *end], atol=1e-14
        )
    for feature, end in ((c.A_FACE, ends[0]), (c.B_FACE, ends[1])):
        found = evaluate(feature, jaw, radius, pose)
        np.testing.assert_allclose(found[[c.GAP, c.PX, c.PY]], [pose.t - end[0], *end], atol=1e-14)
    if jaw[0, c.RHO] > 0.0:
        middle, rho = pose.to_space(jaw[:, [c.MX, c.MY]])[0], jaw[0, c.RHO]
        top, right = middle + [0.0, rho], middle + [rho, 0.0]
        for feature, point, value in (
            (c.ARC_UNDERSIDE, top, TARGET_Y - top[1]),
            (c.ARC_FACE, right, pose.t - right[0]),
        ):
            found = evaluate(feature, jaw, radius, pose)
            np.testing.assert_allclose(found[[c.GAP, c.PX, c.PY]], [value, *point], atol=1e-13)


def on_the_inside(curve: np.ndarray, point: np.ndarray) -> bool:
    """Whether `point` (2,) lies behind the edge `curve` (n, 2), on the finger's own side."""
    arms = point - curve
    nearest = int(np.argmin(np.hypot(*arms.T)))
    if nearest in (0, len(curve) - 1):
        return False
    along = curve[nearest + 1] - curve[nearest - 1]
    return bool(along[0] * arms[nearest, 1] - along[1] * arms[nearest, 0] <= 0.0)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(jaws(), st.sampled_from([0.05, 0.156, 0.4]), poses)
def test_closest_gap_to_a_circle(jaw: np.ndarray, radius: float, pose: Pose) -> None:
    """Against 4,000 points of the jaw's edge and as many of a return face at right angles to it,
    wherever the centre is on the jaw's outside."""
    centre = np.array([pose.t, TARGET_Y])
    corner, along = jaw[0, [c.AX, c.AY]], jaw[0, [c.TAX, c.TAY]]
    upwards = np.array([-along[1], along[0]])
    jaw = jaw.copy()
    jaw[0, [c.TRX, c.TRY]] = upwards
    curve = pose.to_space(jaw_samples(jaw, 4001))
    face = pose.to_space(corner - np.linspace(2.0, 0.0, 4001)[:, None] * upwards)
    distances = np.hypot(*(centre - curve).T)
    nearest = int(np.argmin(distances))
    found = closest(c.CIRCLE, jaw, radius, pose)
    behind_face = (centre - curve[0]) @ (pose.to_space(along[None]) - pose.to_space(0 * along))[0]
    if on_the_inside(curve, centre):
        if behind_face > 0.0:  # deep penetration
            assert found[c.GAP] < -radius + 1e-6
        return
    to_face = np.hypot(*(centre - face).T)
    if behind_face <= 0.0 and to_face.min() < distances[nearest] - 1e-9:
        assert found[c.FEATURE] == c.ON_RETURN
        assert found[c.GAP] == pytest.approx(to_face.min() - radius, abs=1e-3)
        return
    if 0 < nearest < len(curve) - 1:
        assert found[c.FEATURE] == c.ON_EDGE or distances[[0, -1]].min() < distances[nearest] + 1e-7
    spacing = np.hypot(*(curve[1] - curve[0]))
    coarse = spacing**2 / max(spacing, distances[nearest])
    assert -1e-9 <= distances[nearest] - radius - found[c.GAP] <= coarse + 1e-9


@settings(max_examples=300, deadline=None, derandomize=True)
@given(jaws(), poses)
def test_closest_gap_to_a_block(jaw: np.ndarray, pose: Pose) -> None:
    """Against 4,000 points of the jaw. Separated shapes: the distance, except that a corner of the
    jaw counts with the larger of its distances to the two planes. Overlapping shapes: negative."""
    curve = pose.to_space(jaw_samples(jaw, 4001))
    before, below = pose.t - curve[:, 0], TARGET_Y - curve[:, 1]
    outside = np.maximum(before, below)
    spacing = np.hypot(*(curve[1] - curve[0]))
    found = closest(c.BLOCK, jaw, 0.0, pose)[c.GAP]
    if outside.min() < -spacing or on_the_inside(curve, np.array([pose.t, TARGET_Y])):
        assert found < 0.0
    elif outside.min() > spacing:
        distances = np.hypot(np.maximum(before, 0.0), np.maximum(below, 0.0))
        nearest = int(np.argmin(distances))
        assert found <= distances[nearest] + 1e-9
        assert found >= min(distances[nearest], outside[0], outside[-1]) - spacing
        if jaw[0, c.RHO] >= 0.0 and 0 < nearest < len(curve) - 1:
            assert found >= distances[nearest] - spacing


@pytest.mark.parametrize("psi", [-0.3, -0.35, -0.39])
def test_a_steep_convex_jaw_that_has_passed(psi: float) -> None:
    """Against 4,000 points of the jaw: it lies under the block's underside, corner b nearest to the
    block's corner and corner a highest."""
    jaw = jaw_row((0.0, 0.0017), (0.0111, -0.0551), 0.0458)
    pose = Pose(1.0, TARGET_Y + 0.02, psi, 0.91)
    curve = pose.to_space(jaw_samples(jaw, 4001))
    corner = np.array([pose.t, TARGET_Y])
    assert np.argmin(np.hypot(*(curve - corner).T)) == len(curve) - 1
    found = closest(c.BLOCK, jaw, 0.0, pose)
    assert found[c.GAP] == pytest.approx(TARGET_Y - curve[:, 1].max(), abs=1e-6)


def test_a_round_jaw_deep_in_the_block() -> None:
    """Against 4,000 points of the jaw: the arc bulges beyond b, next to which the block's corner
    is; with corners alone it would be free."""
    jaw = jaw_row((0.0, 0.00211), (0.7171, -0.15443), 0.37108)
    pose = Pose(1.0, TARGET_Y + 0.15408, 0.0, 1.39881)
    beyond = pose.to_space(jaw_samples(jaw, 4001)) - [pose.t, TARGET_Y]
    depth = min(beyond[:, 0].max(), beyond[:, 1].max())
    found = closest(c.BLOCK, jaw, 0.0, pose)
    assert found[c.FEATURE] == c.ARC_FACE
    assert found[c.GAP] == pytest.approx(-depth, abs=1e-6)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.floats(0.06, 0.3), st.floats(-0.9, 0.9), st.floats(0.01, 0.2), st.floats(0.02, 0.1))
def test_a_short_block_over_a_round_jaw(
    height: float, psi: float, length: float, above: float
) -> None:
    """Against 8,000 points of a nearly half-round jaw, whose top passes under the block: one of the
    block's corners or its underside is nearest to the arc's inside."""
    jaw = jaw_row((-0.2, 0.1), (0.1, 0.1), 0.1505)
    pose = Pose(1.0, TARGET_Y - height, psi, 0.8 + height)
    curve = pose.to_space(jaw_samples(jaw, 8001))
    pose = pose._replace(y=pose.y - (curve[:, 1].max() - TARGET_Y) - above)
    curve = pose.to_space(jaw_samples(jaw, 8001))
    x, y, psi, t = pose
    aside = np.maximum(np.maximum(t - curve[:, 0], curve[:, 0] - t - length), 0.0)
    distances = np.hypot(aside, TARGET_Y - curve[:, 1])
    nearest = int(np.argmin(distances))
    target = target_row(0.0, length)
    found = closest_gap(c.BLOCK, -1, jaw, target, 0, t, x, y, np.cos(psi), np.sin(psi))
    if 0 < nearest < len(curve) - 1:
        assert found[c.GAP] == pytest.approx(distances[nearest], abs=1e-6)
        if aside[nearest] > 1e-3 and curve[nearest, 0] > t + length:
            assert found[c.FEATURE] == c.FAR_EDGE


@settings(max_examples=300, deadline=None, derandomize=True)
@given(jaws(), poses)
def test_pairs_are_apart_where_edge_and_block_are(jaw: np.ndarray, pose: Pose) -> None:
    """Against 4,000 points of a straight or concave edge; a convex arc has one pair."""
    curve = pose.to_space(jaw_samples(jaw, 4001))
    outside = np.maximum(pose.t - curve[:, 0], TARGET_Y - curve[:, 1])
    spacing = np.hypot(*(curve[1] - curve[0]))
    x, y, psi, t = pose
    of_pose = (jaw, target_row(0.0), 0, t, x, y, np.cos(psi), np.sin(psi))
    features = [
        several_feature(c.BLOCK, k, *of_pose) for k in range(several_count(c.BLOCK, jaw, 0))
    ]
    smallest = min(feature_gap(feature, *of_pose)[c.GAP] for feature in features)
    if jaw[0, c.RHO] > 0.0:
        assert smallest == pytest.approx(closest(c.BLOCK, jaw, 0.0, pose)[c.GAP], abs=1e-14)
    elif outside.min() < -spacing:
        assert smallest < 0.0
    elif outside.min() > spacing and not on_the_inside(curve, np.array([pose.t, TARGET_Y])):
        assert smallest > 0.0


def test_an_edge_flat_on_the_face_touches_at_both_ends() -> None:
    jaw = JAWS["segment"]
    lead = np.arctan2(0.15, 0.34)
    psi = lead - 0.5 * np.pi
    a = Pose(1.0, 0.1, psi, 1.0).to_space(np.array([[0.0, 0.18]]))[0]
    x, y, cos, sin = 1.0, 0.1, np.cos(psi), np.sin(psi)
    of_pose = (jaw, target_row(0.0), 0, a[0], x, y, cos, sin)
    both = [several_feature(c.BLOCK, k, *of_pose) for k in range(3)]
    assert both[:2] == [c.ON_EDGE, c.A_FACE]
    for feature in both[:2]:
        assert feature_gap(feature, *of_pose)[c.GAP] == pytest.approx(0.0, abs=1e-15)


def test_held_feature_is_not_questioned() -> None:
    """Beyond the jaw's end the line of the edge goes on, which events rely on."""
    jaw, pose = JAWS["segment"], Pose(1.0, 0.0, 0.0, 0.8)
    x, y, psi, t = pose
    held = closest_gap(
        c.CIRCLE, c.ON_EDGE, jaw, target_row(0.1), 0, t, x, y, np.cos(psi), np.sin(psi)
    )
    assert held[c.FEATURE] == c.ON_EDGE
    assert closest(c.CIRCLE, jaw, 0.1, pose)[c.FEATURE] == c.ON_A
    np.testing.assert_array_equal(held, evaluate(c.ON_EDGE, jaw, 0.1, pose))


def test_void_feature_never_binds() -> None:
    found = evaluate(c.VOID, JAWS["convex"], 0.0, Pose(1.0, 0.0, 0.0, 1.0))
    assert found[c.GAP] == c.VOID_GAP
    assert not found[1 : c.PX].any()


def test_store_keeps_the_order_of_the_columns() -> None:
    out = np.zeros((c.GAP_COLUMNS, 3))
    store(tuple(float(i) for i in range(12)) + (c.ON_A,), out, 1)
    np.testing.assert_array_equal(out[:, 1], [*range(12), c.ON_A])
    assert not out[:, [0, 2]].any()


@pytest.mark.parametrize(
    ("scene", "changes", "expected"),
    [
        (CIRCLE, {}, ((0.0, 0.0105), (0.0192, 0.0016), 0.0)),
        (CORNER, {}, ((0.0, 0.0085), (0.019, 0.0016), 0.05)),
        (CORNER, {"jaw.convex": False}, ((0.0, 0.0085), (0.019, 0.0016), -0.05)),
    ],
)
@pytest.mark.compiled
def test_lowered_jaws(
    scene: str,
    changes: dict[str, bool],
    expected: tuple[tuple[float, float], tuple[float, float], float],
) -> None:
    """The tables from `lowering` are those from plain geometry in these tests."""
    angle = 1.2
    row = jaw_row(*expected, 0.057, face=(np.cos(angle), np.sin(angle)))
    lowered = lowered_scene(scene, {**changes, "jaw.return_angle": angle})
    used = np.arange(c.JAW_COLUMNS)
    if row[0, c.RHO] == 0.0:
        used = used[(used < c.MX) | (used >= c.RHO)]
    np.testing.assert_allclose(lowered.jaw[:, used], row[:, used], atol=1e-14)
    assert lowered.jaw[0, c.RHO] == pytest.approx(row[0, c.RHO])
