"""Many cases at once are what the same cases are one by one."""

import time

import numpy as np
import pandas as pd
import pytest

from fastncm.errors import SceneError
from fastncm.scene import load_scene, tabulate

CIRCLE = load_scene("snapfit-circle")
CORNER = load_scene("snapfit-corner")
MANY = 100_000
KEYS = {
    "length", "thickness_clamp", "thickness_tip", "width", "young", "poisson", "shear_modulus",
    "a_x", "a_y", "b_x", "b_y", "jaw_radius", "return_angle", "target_radius", "target_length",
    "start", "stop", "y", "mu",
    "offset", "semi_x", "semi_y", "tilt", "path_angle", "path_x", "speed_ratio",
}  # fmt: skip


def numeric_columns(count: int) -> dict[str, np.ndarray]:
    random = np.random.default_rng(7)
    return {
        "finger.thickness": random.uniform(0.002, 0.004, (count, 2)),
        "finger.young": random.uniform(1e9, 3e9, count),
        "finger.poisson": random.uniform(0.0, 0.4, count),
        "jaw.lead_angle": random.uniform(0.3, 0.5, count),
        "jaw.height": random.uniform(0.004, 0.01, count),
        "friction.mu": random.uniform(0.0, 0.8, count),
        "path.stop": random.uniform(0.055, 0.065, count),
    }


def test_one_scene_is_a_table_of_one_case():
    (group,) = tabulate(CORNER, {})
    assert group.scene == CORNER
    assert group.rows.tolist() == [0]
    assert set(group.values) == KEYS
    value = {key: array.item() for key, array in group.values.items()}
    assert (value["a_x"], value["a_y"]) == CORNER.jaw.a
    assert (value["b_x"], value["b_y"]) == CORNER.jaw.b
    assert (value["thickness_clamp"], value["thickness_tip"]) == (0.0032, 0.0032)
    assert (value["jaw_radius"], value["stop"], value["y"]) == (0.05, 0.05, 0.0026)
    assert value["shear_modulus"] == pytest.approx(2.62e9 / 2.7)
    assert np.isnan([value["target_radius"], value["start"]]).all()


def test_each_row_equals_the_scene_replaced():
    columns = numeric_columns(MANY)
    (group,) = tabulate(CIRCLE, columns)
    assert np.array_equal(group.rows, np.arange(MANY))
    assert all(array.shape == (MANY,) for array in group.values.values())
    for row in np.random.default_rng(8).integers(0, MANY, 20):
        alone = CIRCLE.replace({name: column[row].tolist() for name, column in columns.items()})
        (single,) = tabulate(alone, {})
        for key in KEYS:
            np.testing.assert_array_equal(group.values[key][row], single.values[key][0], key)


def test_a_hundred_thousand_cases_need_milliseconds():
    columns = numeric_columns(MANY)
    seconds = []
    for _ in range(3):
        begin = time.perf_counter()
        tabulate(CIRCLE, columns)
        seconds.append(time.perf_counter() - begin)
    assert min(seconds) < 0.05  # 4 ms where this was written


def test_lists_frames_and_arrays_are_the_same_table():
    columns = {"finger.width": np.array([0.01, 0.02]), "path.steps": np.array([5, 5])}
    (expected,) = tabulate(CIRCLE, columns)
    lists = {name: column.tolist() for name, column in columns.items()}
    for same in (lists, pd.DataFrame(columns), pd.DataFrame(columns).astype(object)):
        (group,) = tabulate(CIRCLE, same)
        assert group.scene == expected.scene
        for key in KEYS:
            np.testing.assert_array_equal(group.values[key], expected.values[key])


def test_cases_are_grouped_by_their_options():
    columns = {
        "model.shear": [True, False, True, False, True],
        "path.start": ["touch", 0.08, 0.08, 0.07, "touch"],
        "solver.order": ["auto", 4, 4, 4.0, "auto"],
        "finger.width": [1.0, 2.0, 3.0, 4.0, 5.0],
    }
    groups = tabulate(CIRCLE, columns)
    assert [group.rows.tolist() for group in groups] == [[0, 4], [1, 3], [2]]
    assert [group.scene.model.shear for group in groups] == [True, False, True]
    assert [group.scene.path.start for group in groups] == ["touch", 0.08, 0.08]
    assert [group.values["width"].tolist() for group in groups] == [[1, 5], [2, 4], [3]]
    np.testing.assert_array_equal(groups[0].values["start"], [np.nan, np.nan])
    np.testing.assert_array_equal(groups[1].values["start"], [0.08, 0.07])


def test_thickness_may_mix_numbers_and_pairs():
    (group,) = tabulate(CIRCLE, {"finger.thickness": [0.003, [0.004, 0.002]]})
    assert group.values["thickness_clamp"].tolist() == [0.003, 0.004]
    assert group.values["thickness_tip"].tolist() == [0.003, 0.002]


def test_shear_modulus_is_worked_out_where_it_is_left_out():
    columns = {"finger.shear_modulus": [None, 5e8], "finger.poisson": [0.0, 0.0]}
    (group,) = tabulate(CIRCLE, columns)
    assert group.values["shear_modulus"].tolist() == [1.31e9, 5e8]
    assert group.scene.finger.shear_modulus is None


def test_no_cases_are_no_groups():
    assert tabulate(CIRCLE, {"finger.width": []}) == []


@pytest.mark.parametrize(
    ("columns", "why"),
    [
        ({"finger.width": [1.0, -2.0]}, r"finger\.width = -2\.0 \(case 1\): must be .* than 0"),
        ({"finger.width": [1.0, "wide"]}, r"finger\.width = 'wide' \(case 1\)"),
        ({"finger.width": [1.0, True]}, r"finger\.width = True \(case 1\)"),
        ({"finger.width": np.array([True, True])}, r"finger\.width = True \(case 0\)"),
        ({"finger.width": np.ones((2, 2))}, r"finger\.width = .* \(case 0\)"),
        ({"finger.shear_modulus": [1e9, np.nan]}, r"finger\.shear_modulus = nan \(case 1\)"),
        ({"jaw.b": [[0.08, 0.0], [0.057, 0.0105]]}, r"jaw\.b = .*\(case 1\): must be a point away"),
        ({"solver.order": [4, 5, 1]}, r"solver\.order = 1 \(case 2\)"),
        ({"jaw.height": [0.01, 0.0], "jaw.lead_angle": [0.4, 0.0]}, r"jaw\.lead_angle.*\(case 1\)"),
        ({"finger.width": [1.0], "friction.mu": [0.0, 0.1]}, "must be equally long"),
        ({"finger.width": 1.0}, "one entry per case"),
        ({"solver.contact": "closest"}, "one entry per case"),
        ({"finger.widht": [1.0]}, r"did you mean 'finger\.width'"),
        ({"target.shape": ["circle", "block"], "target.radius": [1.0, 1.0]}, "does not belong"),
    ],
)
def test_bad_cases_are_named(columns, why):
    with pytest.raises(SceneError, match=why):
        tabulate(CIRCLE, columns)


def test_the_case_number_counts_in_the_whole_table():
    columns = {"model.shear": [True, False, False], "jaw.radius": [0.05, 0.05, 0.001]}
    with pytest.raises(SceneError, match=r"jaw\.radius = 0\.001 \(case 2\)"):
        tabulate(CORNER, columns)
