"""Small slices of the studies of error against run time: errors and counts, never times."""

import math

import numpy as np
import pandas as pd
import pytest
import work_precision
from support import ROOT, rivals, rivals_continuum, shooting
from support.performance import profile
from work_precision_parts import closed_form, front, ours
from work_precision_parts.problems import (
    continuum,
    jaw_problem,
    surface_problem,
    surface_starts,
)

import fastncm

CIRCLE, CORNER = shooting.SNAPFIT_CIRCLE, shooting.SNAPFIT_CORNER


@pytest.mark.compiled
@pytest.mark.parametrize("mu", [0.0, 0.2])
@pytest.mark.parametrize("name", ["snapfit-circle", "snapfit-corner"])
def test_rtol_is_kept(name: str, mu: float) -> None:
    problem = jaw_problem(name, mu, count=4)
    for rtol in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
        frame = fastncm.solve(problem.scene.replace({"solver.rtol": rtol})).frame()
        row = ours.row(problem, "fastncm", "rtol", f"{rtol:g}", frame, problem.truth, 1.0, 1.0)
        assert row["failed"] == 0
        assert row["error"] <= rtol


@pytest.mark.compiled
def test_the_beam_is_within_half_a_percent_of_finite_elements() -> None:
    assert jaw_problem("snapfit-circle", 0.0, count=2).model_error < 5e-3


@pytest.mark.compiled
def test_direct_contact_converges_to_its_reference() -> None:
    problem = surface_problem(0.0, count=3)
    assert problem.truth_error < 1e-5
    frames = [
        fastncm.solve(problem.scene.replace({"solver.intervals": n})).frame() for n in (45, 360)
    ]
    coarse, fine = (
        ours.row(problem, "fastncm", "intervals", "", frame, problem.truth, 1.0, 1.0)["error"]
        for frame in frames
    )
    assert fine < coarse / 8.0  # of first order at least


@pytest.mark.compiled
@pytest.mark.parametrize("mu", [0.0, 0.5])
def test_the_reference_of_direct_contact_is_known_to_1e_10(mu: float) -> None:
    """And looser shooting, a rival, is as wrong as its tolerance, nearly."""
    problem = surface_problem(mu)
    assert problem.truth_error < 1e-10
    start = surface_starts(problem.scene)[0]
    found = rivals_continuum.follow(problem.scene, continuum(mu), problem.positions, start, 1e-6)
    assert found["success"].all()
    assert rivals.relative_errors(found, problem.truth).max() < 1e-5


def test_a_failed_position_has_no_error_but_counts() -> None:
    problem = type("Problem", (), {"name": "any", "mu": 0.0, "truth_error": 0.0})()
    frame = pd.DataFrame(
        {
            "success": [True, False],
            "force_x_N": [1.0, 9.0],
            "force_y_N": [0.1, 9.0],
            "iterations": 3,
        }
    )
    row = ours.row(problem, "rival", "", "", frame, np.array([[1.0, 0.0], [1.0, 0.0]]), 2.0, 1.0)
    assert row["failed"] == 1
    assert row["error"] == pytest.approx(0.1)
    assert row["us_alone"] == pytest.approx(1e6)


def test_the_formula_by_hand() -> None:
    """E = 2620 N/mm², b w³/12 = 25.941 mm⁴, y = 8.9 mm, L = 57 mm; beta = 24.870°."""
    p = 3.0 * 2620.0 * (9.5 * 3.2**3 / 12.0) * 8.9 / 57.0**3
    assert closed_form.peak(CIRCLE) == pytest.approx(p * 8.9 / 19.2, rel=1e-12)
    tilted = shooting.ShootingCase(**{**vars(CIRCLE), "mu": 0.2})
    slope = 8.9 / 19.2
    assert closed_form.peak(tilted) == pytest.approx(
        p * math.tan(math.atan(slope) + math.atan(0.2)), rel=1e-12
    )


@pytest.mark.parametrize("case", [CIRCLE, CORNER], ids=["circle", "corner"])
def test_the_overlap_grows_from_the_first_touch(case: shooting.ShootingCase) -> None:
    touch = shooting.touch_position(case)
    assert closed_form.overlap(case, touch) == pytest.approx(0.0, abs=1e-15)
    if case.target_radius is None:
        assert closed_form.overlap(case, case.a[0]) == pytest.approx(case.a[1] - case.path_y)
    soft = shooting.ShootingCase(**{**vars(case), "young": 1.0})
    near = touch - 1e-7
    assert closed_form.force(soft, near)[1] < 0.0  # downwards


def test_profile_by_hand() -> None:
    """Three tasks: the first solver takes 1, 4 and fails, the second 2, 2, 3."""
    ratios, shares = profile(np.array([[1.0, 4.0, math.inf], [2.0, 2.0, 3.0]]))
    np.testing.assert_array_equal(ratios, [[1.0, 2.0, math.inf], [1.0, 1.0, 2.0]])
    np.testing.assert_allclose(shares, [[1 / 3, 2 / 3, math.nan], [1 / 3, 2 / 3, 1.0]])


def test_what_nobody_solves_stays_in_the_count() -> None:
    ratios, shares = profile(np.array([[1.0, math.inf]]))
    np.testing.assert_array_equal(ratios, [[1.0, math.inf]])
    np.testing.assert_allclose(shares, [[0.5, math.nan]])


def some_rows() -> pd.DataFrame:
    """(solver, series, error, failed, us_alone, us_sweep)."""
    return pd.DataFrame(
        [
            ("fastncm", "order", 1e-2, 0, 9.0, 1.0),
            ("fastncm", "order", 1e-4, 0, 9.0, 2.0),
            ("fastncm", "order", 1e-4, 0, 9.0, 3.0),
            ("fastncm", "order", 1e-6, 1, 9.0, 1.0),  # failed somewhere
            ("fastncm", "BFGS", 1e-6, 0, 5.0, math.nan),  # no sweep
            ("fastncm", "shear, section psi", 1e-9, 0, 1.0, 1.0),  # another model
            ("fastncm", "rtol", 1e-4, 0, 9.0, 3.0),
            ("SLSQP", "", 1e-8, 0, 100.0, math.nan),
        ],
        columns=["solver", "series", "error", "failed", "us_alone", "us_sweep"],
    )


def test_front_by_hand() -> None:
    table = some_rows()
    best = front.pareto(front.explicit(table))
    assert best["error"].tolist() == [1e-2, 1e-4, 1e-6]
    assert best["us"].tolist() == [1.0, 2.0, 5.0]
    np.testing.assert_allclose(front.rtol_excess(table), [1.5])
    assert front.time_to(table, "fastncm", 1e-3) == 2.0
    assert front.time_to(table, "SLSQP", 1e-6) == 100.0
    assert math.isnan(front.time_to(table, "SLSQP", 1e-9))


def test_the_section_is_made_from_the_tables() -> None:
    text = work_precision.section()
    assert text.startswith("## ")
    for line in text.splitlines():
        if line.startswith("!["):
            assert (ROOT / "bench" / line.split("(")[1].rstrip(")")).is_file()
    assert work_precision.headlines()
