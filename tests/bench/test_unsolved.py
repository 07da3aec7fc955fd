"""Scenes without an answer though there is one: each a case, with its cause and what is known.

tests/unsolved.csv lists scenes of `extremes` without friction that have no answer though other
means find one (the package with smaller steps or other modes, or the branch from first touch,
followed by SLSQP). `bench/atlas.py` judges all of them, drops what is solved and adds what it
finds; here are the first of each kind. None of them may ever show a wrong number. Below are
others, looked into one by one.
"""

from pathlib import Path

import extremes
import numpy as np
import pandas as pd
import pytest
from support import atlas_causes, atlas_kept, atlas_runs

pytestmark = pytest.mark.compiled

EACH = 2
"""Scenes of a kind that are taken from the file."""
FILE = pd.read_csv(Path(__file__).parents[1] / "unsolved.csv").groupby("kind").head(EACH)
CASES = [
    # with friction: jams, or the branch from first touch ends
    ("circle-straight", 2, "shooting finds an equilibrium that slides on one contact"),
    ("circle-straight", 15, "200 positions and shooting find none"),
    ("circle-straight", 30, "shooting finds an equilibrium that slides on one contact"),
    ("circle-convex", 3, "the finger snaps; shooting finds an equilibrium on another branch"),
    ("corner-convex", 0, "shooting finds an equilibrium that slides on one contact"),
    ("corner-concave", 19, "shooting finds an equilibrium that slides on one contact"),
    ("corner-straight", 3, "200 positions and shooting find none"),
    # without friction
    ("circle-concave", 123, "the last force before is far above those that moved the finger there"),
    ("ellipse", 332, "the target covers the clamp: no bending clears it"),
    ("circle", 49, "the target covers the clamp: no bending clears it"),
    ("circle", 69, "30 positions do not solve it"),
    ("ellipse", 163, "30 positions do not solve it"),
    ("polygon", 13, "the target covers the clamp: no bending clears it"),
    ("half-plane", 78, "with friction; 30 positions solve it"),
    ("half-plane", 1003, "the plane meets the clamped end"),
]
KNOWN = pd.DataFrame(CASES, columns=["kind", "index", "known"])


@pytest.mark.parametrize("kind", [*extremes.JAW_KINDS, *extremes.SIDE_KINDS])
def test_what_has_no_answer_says_so(kind: str) -> None:
    """Each is either a row without numbers and with advice, or by now an answer, and true."""
    listed = pd.concat([FILE, KNOWN]).query("kind == @kind")
    if listed.empty:
        pytest.skip("no scene of this kind has failed")
    rows = atlas_runs.chosen(kind, listed["index"].unique())
    failed = atlas_causes.failed(rows)
    numbers = ["force_x_N", "force_y_N", "normal_force_N", "error_estimate"]
    assert rows.loc[failed, numbers].isna().all(axis=None)
    last = atlas_runs.last_rows(rows)
    assert last.loc[atlas_causes.failed(last), "advice"].str.len().gt(20).all()
    assert atlas_kept.wrong_rows(kind, rows).empty


def test_a_target_over_the_clamp_is_named() -> None:
    """By geometry no bending clears it; the advice says that the target overlaps the base."""
    covered = KNOWN[KNOWN["known"].str.contains("covers the clamp")]
    for kind, index in covered[["kind", "index"]].itertuples(index=False):
        last = atlas_runs.last_rows(atlas_runs.chosen(kind, np.array([index])))
        row = atlas_causes.described(kind, last).iloc[0]
        assert row["cause"] == atlas_causes.COVERED
        assert row["status"] == "infeasible"
        assert "overlap" in row["advice"]
