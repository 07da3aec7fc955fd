"""Direct contact against IPOPT on the same discretisation (bench/data/README.md)."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from surfaces import solved_surface

from fastncm.sqp import status

pytestmark = pytest.mark.compiled
IPOPT = pd.read_csv(
    Path(__file__).parents[2] / "bench" / "data" / "ipopt_rubber_ellipse.csv",
    dtype={"case": "category"},
)
ANGLES = np.radians([120.0, 108.0, 96.0, 84.0])


@pytest.mark.parametrize("case", list(IPOPT["case"].cat.categories))
def test_forces_energies_and_touching_nodes(case: str) -> None:
    theirs = IPOPT[IPOPT["case"] == case]
    theirs = theirs[theirs["touching"] > 0]  # the barrier leaves 1e-8 N where nothing touches
    changes = json.loads(theirs["changes"].iloc[0])
    ours = solved_surface(changes, theirs["position"].to_numpy())
    assert ours.converged.all()
    assert ours.residual.max() < 1e-9
    force = theirs[["force_x_N", "force_y_N"]].to_numpy()
    np.testing.assert_allclose(ours.newtons, force, atol=1e-6 * np.abs(force).max())
    np.testing.assert_allclose(ours.joules, theirs["energy_J"], rtol=1e-7, atol=1e-10)
    np.testing.assert_allclose(ours.tip_angle, theirs["tip_angle_rad"], atol=1e-6)
    length = ours.lowered.scale.length[0]
    tip = np.column_stack([ours.tip_x, ours.tip_y]) * length
    np.testing.assert_allclose(tip, theirs[["tip_x_m", "tip_y_m"]], atol=1e-7)
    # a node at the end of a contact may have next to no force, and IPOPT's are never nothing
    interval = length / ours.lowered.scene.solver.intervals
    for i, row in enumerate(theirs.itertuples()):
        contacts = ours.touching(i)
        size = np.hypot(contacts["force_x"], contacts["force_y"])
        s = contacts["s"][size > 1e-4 * size.max()] * length
        assert s[0] == pytest.approx(row.s_from_m, abs=1.01 * interval)
        if case == "plane":  # forces fade over many nodes: which are above a part of the largest?
            continue
        assert s[-1] == pytest.approx(row.s_to_m, abs=1.01 * interval)
        assert abs(len(s) - row.touching) <= 2


@pytest.mark.parametrize(
    ("section", "expected"),
    [
        ("psi", [(5.17, -115.20), (-31.35, -243.44), (-90.99, -201.16), (-62.14, -48.43)]),
        ("psi+gamma", [(5.35, -116.22), (-31.55, -252.70), (-93.08, -208.09), (-62.41, -48.75)]),
    ],
)
def test_figures_of_the_issue(section: str, expected: list[tuple[float, float]]) -> None:
    ours = solved_surface({"solver.intervals": 180, "model.section": section}, ANGLES)
    size = np.linalg.norm(expected, axis=1)
    assert (np.abs(ours.newtons - expected).max(axis=1) < 1e-3 * size).all()


def test_energies_and_intervals_of_the_issue() -> None:
    ours = solved_surface({"solver.intervals": 180}, ANGLES)
    np.testing.assert_allclose(ours.joules, [2.45188, 4.19190, 3.53668, 1.20275], atol=1e-4)
    length, interval = ours.lowered.scale.length[0], ours.lowered.scale.length[0] / 180
    starts, ends = [0.0576, 0.0373, 0.0389, 0.061], [0.072, 0.0584, 0.0559, 0.066]
    np.testing.assert_allclose(ours.s_from * length, starts, atol=0.5 * interval)
    np.testing.assert_allclose(ours.s_to * length, ends, atol=0.5 * interval)


def test_the_paper_s_snapshots_touch() -> None:
    """126, 102 and 78 degrees are in contact; at 90 degrees it is near s = 0.05 m."""
    ours = solved_surface({}, np.radians([126.0, 102.0, 90.0, 78.0]))
    assert (ours.status == status.CONVERGED).all()
    assert (ours.contacts > 0).all()
    assert ours.s_mean[2] * ours.lowered.scale.length[0] == pytest.approx(0.05, abs=0.004)
