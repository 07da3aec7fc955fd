"""Paths on the shipped scenes against shooting: forces, events, convergence, order of positions."""

from dataclasses import replace

import numpy as np
import pytest
import shooting
from tracing import CIRCLE, CORNER, LANE_TOLERANCE, lowered_scene, solved_path

from fastncm.kernels import constants as c
from fastncm.kernels.constants import LANES
from fastncm.lowering import lower
from fastncm.path import rows
from fastncm.path.careful import most_constraints
from fastncm.path.events import locate_events
from fastncm.path.review import review
from fastncm.path.run import trace_lanes
from fastncm.path.trace import LONGEST_MOVE, make_trace
from fastncm.scene import load_scene, tabulate
from fastncm.sqp import status

pytestmark = pytest.mark.compiled

EXACT = {CIRCLE: shooting.SNAPFIT_CIRCLE, CORNER: shooting.SNAPFIT_CORNER}
POSITIONS = {
    CIRCLE: [0.0778, 0.0738, 0.0688, 0.0640, 0.0625, 0.0605],
    CORNER: [0.0740, 0.0725, 0.0672, 0.0600, 0.0575, 0.0510],
}
PATH_LENGTH = {CIRCLE: 0.078162 - 0.0600, CORNER: 0.0743 - 0.050}
ORDER = 12


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
@pytest.mark.parametrize(
    ("changes", "exact"),
    [
        ({}, {}),
        (
            {"finger.thickness": [0.0040, 0.0028], "model.shear": True},
            {"thickness": 0.0040, "thickness_tip": 0.0028, "shear": True},
        ),
    ],
)
def test_rows_against_shooting(
    scene: str, changes: dict[str, object], exact: dict[str, object]
) -> None:
    """Force, contact place, tip pose, energy and strain to nine digits."""
    case = replace(EXACT[scene], **exact)
    solved = solved_path(scene, ORDER, changes, POSITIONS[scene])
    assert solved.converged.all()
    length, unit = solved.lowered.scale.length[0], solved.lowered.scale.force[0]
    for i, position in enumerate(POSITIONS[scene]):
        expected = shooting.solve(case, position)
        row = solved.trace.rows[0, i]
        assert unit * row[rows.FORCE] == pytest.approx(expected.normal_force, rel=1e-9)
        force = unit * row[rows.FORCE] * row[[rows.NORMAL_X, rows.NORMAL_Y]]
        exact_force = [expected.force_x, expected.force_y]
        np.testing.assert_allclose(force, exact_force, atol=1e-9 * expected.normal_force)
        contact = length * row[[rows.CONTACT_X, rows.CONTACT_Y]]
        np.testing.assert_allclose(contact, expected.contact_xy, atol=1e-9 * length)
        tip = row[[rows.TIP_X, rows.TIP_Y, rows.TIP_ANGLE]] * [length, length, 1.0]
        np.testing.assert_allclose(tip, expected.tip_pose, rtol=1e-9)
        assert unit * length * row[rows.ENERGY] == pytest.approx(expected.energy, rel=1e-9)
        strain = row[rows.STRAIN] * solved.lowered.scale.strain[0]
        if not changes:  # the largest strain of a taper may lie between the Gauss points
            assert strain == pytest.approx(expected.max_strain, rel=1e-9)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_spectral_convergence(scene: str) -> None:
    """Each mode more takes off at least a factor of four, down to 1e-12."""
    truth = solved_path(scene, 24).force[1:]
    orders = np.arange(2, 13)
    errors = np.array(
        [np.abs(solved_path(scene, int(n)).force[1:] / truth - 1.0).max() for n in orders]
    )
    assert errors[-1] < 1e-12
    falling = errors > 1e-12
    slope = np.polyfit(orders[falling], np.log(errors[falling]), 1)[0]
    assert slope < -np.log(4.0)
    assert errors[orders == 8] < 1e-12


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_high_orders_lose_no_digits(scene: str) -> None:
    truth = solved_path(scene, 16).force[1:]
    for order in (20, 32):
        np.testing.assert_allclose(solved_path(scene, order).force[1:], truth, rtol=1e-12)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_positions_in_any_order(scene: str) -> None:
    walked = solved_path(scene, ORDER)
    shuffle = np.random.default_rng(0).permutation(len(walked.metres))
    solved = solved_path(scene, ORDER, positions=walked.metres[shuffle])
    np.testing.assert_array_equal(solved.status, walked.status[shuffle])
    np.testing.assert_array_equal(solved.feature, walked.feature[shuffle])
    np.testing.assert_allclose(solved.force, walked.force[shuffle], rtol=1e-10)
    np.testing.assert_allclose(solved.tip_angle, walked.tip_angle[shuffle], rtol=1e-10)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_backwards(scene: str) -> None:
    walked = solved_path(scene, ORDER)
    solved = solved_path(scene, ORDER, positions=walked.metres[::-1])
    np.testing.assert_allclose(solved.force, walked.force[::-1], rtol=1e-10)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_one_jump_deep_into_contact(scene: str) -> None:
    walked = solved_path(scene, ORDER)
    for i in (20, 35, 45, 59):
        solved = solved_path(scene, ORDER, positions=[walked.metres[i]])
        assert solved.converged.all()
        assert solved.feature[0] == walked.feature[i]
        assert solved.force[0] == pytest.approx(walked.force[i], rel=1e-10)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_touch_is_located(scene: str) -> None:
    exact = shooting.touch_position(EXACT[scene])
    positions = [exact + 0.001, exact - 0.001, exact - 0.002]
    solved = solved_path(scene, ORDER, positions=positions)
    assert solved.status.tolist() == [status.NO_CONTACT, status.CONVERGED, status.CONVERGED]
    assert solved.force[0] == 0.0
    (touch,) = solved.events()
    assert touch[rows.KIND] == rows.TOUCH
    assert touch[rows.INTERVAL] == 0
    assert touch[rows.FORCE] == 0.0
    length = solved.lowered.scale.length[0]
    assert length * touch[rows.POSITION] == pytest.approx(exact, abs=1e-9 * PATH_LENGTH[scene])
    # the force sets in with the rate of the event's row
    near = solved_path(scene, ORDER, positions=[exact - 1e-6]).force[0]
    assert near == pytest.approx(-touch[rows.FORCE_RATE] * 1e-6 / length, rel=1e-3)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_path_starts_at_first_touch(scene: str) -> None:
    lowered = lowered_scene(scene)
    start = lowered.positions[0, 0] * lowered.scale.length[0]
    exact = shooting.touch_position(EXACT[scene])
    assert start == pytest.approx(exact, abs=1e-9 * PATH_LENGTH[scene])


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
@pytest.mark.parametrize("steps", [5, 17, 60])
def test_peak_is_located(scene: str, steps: int) -> None:
    """The change of feature, seen from both sides, on coarse and fine grids."""
    exact = shooting.peak_position(EXACT[scene])
    solved = solved_path(scene, ORDER, {"path.steps": steps})
    length, unit = solved.lowered.scale.length[0], solved.lowered.scale.force[0]
    touch, before, after = solved.events()
    assert touch[rows.KIND] == rows.TOUCH
    assert (before[rows.KIND], after[rows.KIND]) == (rows.BEFORE_CHANGE, rows.AFTER_CHANGE)
    assert before[rows.FEATURE] == c.ON_EDGE
    assert after[rows.FEATURE] == (c.ON_A if scene == CIRCLE else c.A_UNDERSIDE)
    for row in (before, after):
        found = length * row[rows.POSITION]
        assert found == pytest.approx(exact.position, abs=1e-9 * PATH_LENGTH[scene])
        i = int(row[rows.INTERVAL])
        assert solved.position[i] >= row[rows.POSITION] >= solved.position[i + 1]
    force = unit * before[rows.FORCE]
    assert force == pytest.approx(exact.normal_force, rel=1e-8)
    assert force * before[rows.NORMAL_X] == pytest.approx(exact.force_x, rel=1e-8)


def test_circle_has_a_kink_where_the_corner_takes_over() -> None:
    _, before, after = solved_path(CIRCLE, ORDER).events()
    for column in (rows.FORCE, rows.NORMAL_X, rows.TIP_ANGLE, rows.CONTACT_X):
        assert after[column] == pytest.approx(before[column], rel=1e-9)
    insertion_rate = [
        row[rows.FORCE_RATE] * row[rows.NORMAL_X] + row[rows.FORCE] * row[rows.NORMAL_X_RATE]
        for row in (before, after)
    ]
    assert insertion_rate[0] > 0.0 > insertion_rate[1]


def test_corner_jumps_to_the_underside() -> None:
    _, before, after = solved_path(CORNER, ORDER).events()
    exact = shooting.solve(shooting.SNAPFIT_CORNER, 0.0575, "corner")
    unit = lowered_scene(CORNER).scale.force[0]
    assert before[rows.NORMAL_X] < -0.1
    assert after[rows.NORMAL_X] == 0.0
    assert unit * after[rows.FORCE] == pytest.approx(exact.normal_force, rel=1e-9)
    assert after[rows.FORCE] < 0.95 * before[rows.FORCE]


def test_force_is_constant_on_the_underside() -> None:
    solved = solved_path(CORNER, ORDER)
    beneath = solved.feature == c.A_UNDERSIDE
    assert beneath.sum() > 10
    np.testing.assert_allclose(solved.force[beneath], solved.force[beneath][0], rtol=1e-13)
    assert not solved.normal_x[beneath].any()
    np.testing.assert_allclose(solved.force_rate[beneath], 0.0, atol=1e-12)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_release(scene: str) -> None:
    """Out of contact again on the way back: the same place as the touch."""
    exact = shooting.touch_position(EXACT[scene])
    positions = [exact - 0.003, exact - 0.001, exact + 0.001, exact + 0.002, exact - 0.0005]
    solved = solved_path(scene, ORDER, positions=positions)
    release, touch = solved.events()
    assert (release[rows.KIND], release[rows.INTERVAL]) == (rows.RELEASE, 1)
    assert (touch[rows.KIND], touch[rows.INTERVAL]) == (rows.TOUCH, 3)
    length = solved.lowered.scale.length[0]
    for event in (release, touch):
        assert length * event[rows.POSITION] == pytest.approx(exact, abs=1e-9 * PATH_LENGTH[scene])
        assert event[rows.FORCE] == 0.0


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_rates_are_slopes_along_the_path(scene: str) -> None:
    step = 1e-5
    for position in POSITIONS[scene][1:-1]:
        solved = solved_path(scene, ORDER, positions=[position + step, position, position - step])
        ahead, here, behind = solved.trace.rows[0, :3]
        run = ahead[rows.POSITION] - behind[rows.POSITION]
        for value, rate in (
            (rows.FORCE, rows.FORCE_RATE),
            (rows.NORMAL_X, rows.NORMAL_X_RATE),
            (rows.NORMAL_Y, rows.NORMAL_Y_RATE),
            (rows.CONTACT_X, rows.CONTACT_X_RATE),
            (rows.CONTACT_Y, rows.CONTACT_Y_RATE),
        ):
            slope = (ahead[value] - behind[value]) / run
            assert here[rate] == pytest.approx(slope, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_insertion_force_is_the_slope_of_the_energy(scene: str) -> None:
    """Without friction the target's work is stored."""
    solved = solved_path(scene, ORDER, {"path.steps": 200})
    slope = np.gradient(solved.energy, solved.position, edge_order=2)
    same = solved.feature == c.ON_EDGE
    inside = np.flatnonzero(same)[1:-1]
    push = (solved.force * solved.normal_x)[inside]
    np.testing.assert_allclose(slope[inside], push, rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
@pytest.mark.parametrize(("factor", "young"), [(1e-6, 2.62e9), (1e-6, 4.1), (1e3, 7e11)])
def test_independent_of_units(scene: str, factor: float, young: float) -> None:
    """The same scene in other units of length and of stiffness: the same dimensionless rows."""
    base = lowered_scene(scene).scene.to_dict()
    changes = {"finger.young": young}
    lengths = {
        "finger": ["length", "thickness", "width"],
        "jaw": ["a", "b", "radius"],
        "target": ["radius"],
        "path": ["stop", "y"],
    }
    for part, names in lengths.items():
        for name in names:
            if base[part].get(name) is not None:
                value = np.multiply(base[part][name], factor)
                changes[f"{part}.{name}"] = value.tolist()
    plain, scaled = solved_path(scene, ORDER), solved_path(scene, ORDER, changes)
    np.testing.assert_array_equal(scaled.status, plain.status)
    np.testing.assert_array_equal(scaled.feature, plain.feature)
    for column in ("position", "force", "normal_x", "contact_x", "tip_y", "energy", "strain"):
        np.testing.assert_allclose(
            getattr(scaled, column), getattr(plain, column), rtol=1e-12, atol=1e-15
        )
    np.testing.assert_allclose(
        scaled.events()[:, rows.POSITION], plain.events()[:, rows.POSITION], rtol=1e-12
    )


def test_each_design_is_solved_alone() -> None:
    """Neighbours in the lanes, and the lane itself, do not change an answer."""
    (group,) = tabulate(load_scene(CIRCLE), {"jaw.height": np.linspace(0.0085, 0.0105, LANES + 3)})
    lowered = lower(group)
    everything = None
    for designs in (np.arange(LANES + 3), np.array([LANES + 1]), np.array([3, 0])):
        problem = lowered.problem(6, designs)
        trace = make_trace(len(designs), problem.positions.shape[1], 6, 1)
        trace_lanes(problem, LANE_TOLERANCE, LONGEST_MOVE, trace)
        locate_events(
            problem, LANE_TOLERANCE, trace, review(trace.rows, problem.positions.shape[1])
        )
        if everything is None:
            everything = trace.rows
        for column in (rows.STATUS, rows.KIND, rows.INTERVAL, rows.FEATURE):
            np.testing.assert_array_equal(trace.rows[..., column], everything[designs, :, column])
        for column in (rows.POSITION, rows.FORCE, rows.NORMAL_X, rows.CONTACT_X, rows.ENERGY):
            np.testing.assert_allclose(
                trace.rows[..., column], everything[designs, :, column], rtol=1e-11, atol=1e-13
            )


KINKS = {
    CIRCLE: {"jaw.lead_angle": (0.25, 0.55), "jaw.height": (0.0065, 0.0105)},
    CORNER: {"jaw.convex": (False, False), "jaw.height": (0.0045, 0.0095)},
}


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_no_change_of_feature_goes_without_its_event(scene: str) -> None:
    """200 jaws whose peak is a kink or a jump: it does not depend on the number of positions."""
    rng, count = np.random.default_rng(5), 200
    columns = {name: rng.uniform(*bounds, count) for name, bounds in KINKS[scene].items()}
    if columns.pop("jaw.convex", None) is not None:
        base = load_scene(scene).replace({"jaw.convex": False})
    else:
        base = load_scene(scene)
    peaks, solved = [], np.ones(count, dtype=bool)
    for steps in (8, 20, 60, 200):
        (group,) = tabulate(base.replace({"path.steps": steps}), columns)
        problem = lower(group).problem(6, np.arange(count))
        trace = make_trace(count, steps, 6, most_constraints(problem))
        trace_lanes(problem, LANE_TOLERANCE, LONGEST_MOVE, trace)
        locate_events(
            problem, LANE_TOLERANCE, trace, review(trace.rows, problem.positions.shape[1])
        )
        at_positions = trace.rows[:, :steps]
        solved &= (at_positions[:, 1:, rows.STATUS] == status.CONVERGED).all(axis=1)
        changes = (np.diff(at_positions[:, 1:, rows.FEATURE]) != 0.0).sum(axis=1)
        events = (trace.rows[..., rows.KIND] == rows.BEFORE_CHANGE).sum(axis=1)
        np.testing.assert_array_equal(events[solved], changes[solved])
        before = trace.rows[trace.rows[..., rows.KIND] == rows.BEFORE_CHANGE]
        assert (before[:, rows.RESIDUAL] < 1e-10).all()
        peaks.append((-trace.rows[..., rows.FORCE] * trace.rows[..., rows.NORMAL_X]).max(axis=1))
    assert solved.sum() > 0.7 * count
    for peak in peaks:
        np.testing.assert_allclose(peak[solved], peaks[-1][solved], rtol=1e-9)


@pytest.mark.parametrize(
    ("changes", "steps"),
    [
        ({"jaw.height": 0.00557044835, "jaw.length": 0.0167676968}, 60),
        ({"jaw.height": 0.00806136971, "jaw.length": 0.0133858941}, 30),
        ({"jaw.height": 0.00940931832, "jaw.length": 0.0149076835}, 8),
    ],
)
def test_event_just_beside_a_position(changes: dict[str, float], steps: int) -> None:
    """Concave jaws whose change to the underside is within 1e-4 of a row, before or behind it."""
    coarse = solved_path(CORNER, 6, {**changes, "jaw.convex": False, "path.steps": steps})
    fine = solved_path(CORNER, 6, {**changes, "jaw.convex": False, "path.steps": 600})
    assert coarse.events()[:, rows.KIND].tolist() == fine.events()[:, rows.KIND].tolist()
    for column in (rows.POSITION, rows.FORCE):
        np.testing.assert_allclose(
            coarse.events()[:, column], fine.events()[:, column], rtol=1e-9, atol=1e-12
        )


def test_path_that_never_touches() -> None:
    solved = solved_path(CIRCLE, ORDER, {"path.y": 0.05})
    assert set(solved.status) == {status.NO_CONTACT}
    assert not solved.force.any()
    assert len(solved.events()) == 0
