"""Many cases in one call, against the same cases one by one."""

import numpy as np
import pandas as pd
import pytest

import fastncm
from fastncm.columns import CASE_UNITS, WITHDRAWAL

CIRCLE = fastncm.load_scene("snapfit-circle")


@pytest.mark.parametrize(("model", "shape_paths"), [("equilibrium", 4), ("recovered", 2)])
def test_cases_equal_curves(model: str, shape_paths: int) -> None:
    frame = pd.DataFrame(
        {
            "finger.thickness": [0.0022, 0.0032, 0.0042, 0.0032],
            "friction.mu": [0.0, 0.2, 0.4, 0.2],
            "jaw.height": [0.0089, 0.0089, 0.0080, 0.0080],
        },
        index=[7, 5, 3, 1],
    )
    scene = CIRCLE.replace({"friction.model": model})
    table = fastncm.solve_cases(scene, frame)
    assert list(table.index) == [7, 5, 3, 1]
    shown = [name for name in CASE_UNITS if name not in WITHDRAWAL]
    assert list(table.columns) == [*frame.columns, *shown]
    assert table.attrs["shape_paths"] == shape_paths
    for (_, changes), (_, row) in zip(frame.iterrows(), table.iterrows(), strict=True):
        curve = fastncm.solve(scene.replace(changes.to_dict()))
        assert row["status"] == "converged"
        assert row["peak_force_N"] == pytest.approx(curve.peak.insertion_force_N, rel=1e-12)
        assert row["peak_position"] == pytest.approx(curve.peak.position, rel=1e-12)
        assert row["insertion_work_J"] == pytest.approx(curve.insertion_work_J, rel=1e-12)
        assert row["max_strain"] == pytest.approx(curve.frame()["max_strain"].max(), rel=1e-12)


def test_columns_of_the_way_out_are_there_where_some_case_has_one() -> None:
    frame = pd.DataFrame({"path.withdraw": [False, True]})
    table = fastncm.solve_cases(CIRCLE, frame)
    assert list(table.columns) == ["path.withdraw", *CASE_UNITS]
    assert [list(table[name].notna()) for name in WITHDRAWAL] == 3 * [[False, True]]
    withdrawn = fastncm.solve_cases(CIRCLE.replace({"path.withdraw": True}), frame.iloc[1:, :0])
    assert list(withdrawn.columns) == list(CASE_UNITS)


def test_forces_scale_with_stiffness() -> None:
    """A uniform finger without shear: E, width and thickness cubed only scale the force."""
    frame = pd.DataFrame({"finger.young": [2.62e9, 5.24e9], "finger.thickness": [0.0032, 0.0016]})
    table = fastncm.solve_cases(CIRCLE, frame)
    assert table.attrs["shape_paths"] == 1
    assert table["peak_force_N"][1] == pytest.approx(table["peak_force_N"][0] * 2 / 8, rel=1e-13)
    assert table["max_strain"][1] == pytest.approx(table["max_strain"][0] / 2, rel=1e-13)


def test_shear_and_taper_need_their_own_paths() -> None:
    frame = pd.DataFrame({"finger.thickness": [0.0022, 0.0032]})
    assert fastncm.solve_cases(CIRCLE, frame).attrs["shape_paths"] == 1
    shear = CIRCLE.replace({"model.shear": True})
    assert fastncm.solve_cases(shear, frame).attrs["shape_paths"] == 2


def test_random_jaws_all_converge() -> None:
    """A path that starts at first touch, an overlap of rounding, and the change to corner a."""
    rng = np.random.default_rng(5)
    frame = pd.DataFrame(
        {"jaw.height": rng.uniform(0.007, 0.0119, 500), "jaw.length": rng.uniform(0.018, 0.02, 500)}
    )
    table = fastncm.solve_cases(CIRCLE, frame)
    assert set(table["status"]) == {"converged"}
    assert table.attrs["solves"] == 500 * 62  # 59 positions, touch, change before and after


def test_one_failing_case_does_not_end_the_others() -> None:
    table = fastncm.solve_cases(CIRCLE, pd.DataFrame({"friction.mu": [0.2, 3.0, 0.0]}))
    assert list(table["status"]) == ["converged", "no_equilibrium", "converged"]
    assert list(table["peak_force_N"].isna()) == [False, True, False]
    assert "friction.mu" in table["advice"][1]


def test_cases_that_share_a_snap_are_each_told_of_theirs() -> None:
    """One path for all; the energy that it releases grows with the cube of the thickness."""
    thickness = np.array([0.0026, 0.0032, 0.0042])
    scene = CIRCLE.replace({"friction.mu": 0.9})
    table = fastncm.solve_cases(scene, pd.DataFrame({"finger.thickness": thickness}))
    assert table.attrs["shape_paths"] == 1
    place, energy = (
        table["advice"].str.extract(rf"{word} ([\d.e-]+)", expand=False).astype(float)
        for word in ("limit point at", "releases")
    )
    assert place.nunique() == 1
    np.testing.assert_allclose(energy / energy[0], (thickness / thickness[0]) ** 3, rtol=1e-3)


def test_bad_cases_are_refused() -> None:
    with pytest.raises(fastncm.SceneError, match=r"finger\.thickness"):
        fastncm.solve_cases(CIRCLE, pd.DataFrame({"finger.thickness": [0.003, -1.0]}))
    with pytest.raises(fastncm.SceneError, match="did you mean"):
        fastncm.solve_cases(CIRCLE, pd.DataFrame({"finger.thicknes": [0.003]}))
    with pytest.raises(fastncm.SceneError, match="no cases"):
        fastncm.solve_cases(CIRCLE, pd.DataFrame(index=[]))


def test_public_names() -> None:
    for name in fastncm.__all__:
        assert getattr(fastncm, name) is not None
    assert callable(fastncm.sweep)
    assert callable(fastncm.load)
