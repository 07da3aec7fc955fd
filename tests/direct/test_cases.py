"""Many cases of direct contact in one call and in sweeps, against the same cases one by one."""

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

import fastncm
from fastncm.cases import case_units, scale_only_names, solve_chunk
from fastncm.columns import CASE_UNITS, WITHDRAWAL
from fastncm.sweeping import Study

RUBBER = fastncm.load_scene("rubber-ellipse").replace({"path.steps": 20})
THICKNESS = [(0.03, 0.017), (0.025, 0.017)]


def test_cases_equal_curves() -> None:
    frame = pd.DataFrame(
        {
            "finger.thickness": [*THICKNESS, THICKNESS[0]],
            "path.y": [0.12065, 0.12, 0.123],
            "model.surface": ["side", "side", "axis"],
        },
        index=[7, 5, 3],
    )
    table = fastncm.solve_cases(RUBBER, frame)
    assert list(table.index) == [7, 5, 3]
    assert set(CASE_UNITS) - set(WITHDRAWAL) <= set(table.columns)
    assert table.attrs["shape_paths"] == 3
    for (_, changes), (_, row) in zip(frame.iterrows(), table.iterrows(), strict=True):
        curve = fastncm.solve(RUBBER.replace(changes.to_dict()))
        assert row["status"] == "converged"
        # in the table the peak is that of a parabola through three rows
        assert row["peak_force_N"] == pytest.approx(curve.peak.insertion_force_N, rel=2e-2)
        assert row["peak_force_N"] >= curve.frame()["insertion_force_N"].max()
        assert row["peak_position"] == pytest.approx(curve.peak.position, abs=0.02)
        assert row["insertion_work_J"] == pytest.approx(curve.insertion_work_J, rel=1e-12)
        assert row["max_strain"] == pytest.approx(curve.frame()["max_strain"].max(), rel=1e-12)
        assert row["positions"] == 20


def test_without_shear_young_and_width_only_scale() -> None:
    scene = RUBBER.replace({"model.shear": False})
    assert {"finger.young", "finger.width"} <= scale_only_names(scene)
    assert "finger.young" not in scale_only_names(RUBBER)
    frame = pd.DataFrame({"finger.young": [4.8e6, 4.8e9], "finger.width": [0.025, 0.05]})
    table = fastncm.solve_cases(scene, frame)
    assert table.attrs["shape_paths"] == 1
    assert table["peak_force_N"][1] == pytest.approx(2000 * table["peak_force_N"][0], rel=1e-12)
    assert table["peak_position"][1] == table["peak_position"][0]


def test_with_shear_a_finger_is_softer_or_stiffer_by_young_and_shear_modulus_together() -> None:
    frame = pd.DataFrame(
        {"finger.young": [4.8e3, 4.8e6, 4.8e9], "finger.shear_modulus": [1.71e3, 1.71e6, 1.71e9]}
    )
    forces = fastncm.solve_cases(RUBBER, frame)["peak_force_N"]
    np.testing.assert_allclose(forces / forces[1], [1e-3, 1.0, 1e3], rtol=1e-9)


def test_curves_of_cases_are_those_of_solve() -> None:
    result = solve_chunk(RUBBER, {"path.y": [0.12065, 0.123]}, curves=True)
    table = pd.DataFrame(result.curves)
    for case, y in enumerate((0.12065, 0.123)):
        rows = table[table["case"] == case].drop(columns="case").reset_index(drop=True)
        expected = fastncm.solve(RUBBER.replace({"path.y": y})).frame()
        pd.testing.assert_frame_equal(rows, expected, rtol=1e-10, check_like=False)


def test_jaws_and_sides_in_one_table() -> None:
    circle = fastncm.load_scene("snapfit-circle")
    table = fastncm.solve_cases(
        circle.replace({"path.start": 0.075, "path.stop": 0.07}),
        pd.DataFrame({"jaw.shape": ["segment", "none"]}),
    )
    assert list(table["status"]) == ["converged", "no_contact"]


def test_a_study_of_direct_contact(tmp_path) -> None:
    axes = {"finger.thickness": THICKNESS, "path.start": [2.1, 2.15]}
    run = fastncm.sweep(Study(RUBBER, axes, curves=True), tmp_path / "out", jobs=1)
    assert (run.rows, run.failed) == (4, 0)
    cases = fastncm.load(tmp_path / "out")
    assert cases.attrs["units"]["peak_position"] == "rad"
    assert cases.attrs["units"]["path.start"] == "rad"
    curves = fastncm.load(tmp_path / "out", "curves")
    assert len(curves) == 80
    assert curves.attrs["units"]["position"] == "rad"
    assert curves.attrs["units"]["contact_from_m"] == "m"
    assert curves.groupby("case_id")["position"].first().tolist() == [2.1, 2.15, 2.1, 2.15]
    file = next((tmp_path / "out" / "curves").glob("*.parquet"))
    assert pq.read_schema(file).field("position").metadata[b"unit"] == b"rad"


def test_units_of_cases() -> None:
    assert case_units(RUBBER)["peak_position"] == "rad"
    assert case_units(fastncm.load_scene("snapfit-circle")) == CASE_UNITS
