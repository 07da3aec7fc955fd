"""A slice of the atlas: answers to random extreme scenes are never wrong in silence.

The truth for jaws is shooting (`shooting_many`), which is compared with `shooting` first.
"""

from dataclasses import replace
from pathlib import Path

import extremes
import numpy as np
import pandas as pd
import pytest
import shooting
import shooting_many
from scipy.stats import binomtest
from support import (
    atlas_causes,
    atlas_failures,
    atlas_features,
    atlas_overlaps,
    atlas_rates,
    atlas_runs,
    atlas_slsqp,
    atlas_slsqp_sides,
    atlas_store,
    atlas_truth,
    atlas_verdicts,
)

import fastncm

pytestmark = pytest.mark.compiled

JAWS = 20
SIDES = 5
CASES = {
    "uniform": {},
    "shear": {"shear": True, "thickness": 0.012},
    "taper": {"thickness_tip": 0.0016},
    "friction": {"mu": 0.3},
}


@pytest.mark.parametrize("changes", CASES.values(), ids=CASES)
@pytest.mark.parametrize("base", [shooting.SNAPFIT_CIRCLE, shooting.SNAPFIT_CORNER])
def test_many_are_shot_like_one(base: shooting.ShootingCase, changes: dict[str, object]) -> None:
    case = replace(base, **changes)
    position, zero, length = 0.0688, np.zeros(1, dtype=int), case.length
    one = shooting.solve(case, position)
    tip = case.thickness_tip or case.thickness
    columns = {
        "finger.length": np.array([length]),
        "finger.thickness": np.array([[case.thickness, tip]]),
        "finger.width": np.array([case.width]),
        "finger.young": np.array([case.young]),
        "finger.poisson": np.array([case.poisson]),
        "model.shear": np.array([case.shear]),
        "jaw.a": np.array([case.a]),
        "jaw.b": np.array([case.b]),
        "jaw.return_angle": np.array([0.5 * np.pi]),
        "path.y": np.array([case.path_y]),
    }
    if case.target_radius:
        columns["target.radius"] = np.array([case.target_radius])
    else:
        columns |= {"target.length": np.array(["endless"], dtype=object)}
        columns |= {"jaw.radius": np.array([case.jaw_radius]), "jaw.convex": np.array([True])}
    unit = shooting_many.force_unit(columns, zero)
    aside = 1.0 + 1e-4  # not the answer itself
    claim = shooting_many.Claim(
        aside * np.array([[one.force_x, one.force_y]]) / unit,
        one.contact_xy[None] / length,
        (one.tip_pose / [length, length, 1.0])[None],
    )
    fingers = shooting_many.fingers(columns, zero, np.array([position]))
    truth = shooting_many.exact(fingers, claim, np.array([case.mu]))
    assert truth.found.all()
    assert truth.normal[0] * unit[0] == pytest.approx(one.normal_force, rel=1e-11)


@pytest.mark.parametrize("kind", extremes.JAW_KINDS)
def test_random_jaws_are_never_wrong_in_silence(kind: str) -> None:
    """Every row of every path."""
    judged = atlas_truth.jaws(kind, 0, JAWS)
    assert judged["found"].sum() >= JAWS
    assert judged["judge"].eq("shooting").sum() >= 0.5 * JAWS
    assert atlas_verdicts.wrong_in_silence(judged).empty
    assert atlas_verdicts.unanswered(judged).empty


@pytest.mark.parametrize("kind", extremes.SIDE_KINDS)
def test_random_direct_contact_is_never_wrong_in_silence(kind: str) -> None:
    rows = atlas_runs.chosen(kind, np.arange(3 * SIDES))
    close = rows[(rows["solver.contact"] == "closest") & (rows["contacts"] > 0)]
    close = close[(close["solver.intervals"].astype(int) < 99) & (close["status"] == "converged")]
    judged = atlas_truth.refine(close.reset_index(drop=True))
    assert judged["found"].sum() >= 3
    assert atlas_verdicts.wrong_in_silence(judged).empty


def test_slsqp_finds_the_same_shape() -> None:
    """A chain of 30 links has the energy of the polynomials, nearly."""
    last = atlas_runs.last_rows(atlas_runs.chosen("circle-straight", np.arange(20)))
    smooth = last[(last["status"] == "converged") & (last["friction.mu"] == 0.0)].head(3)
    columns = extremes.jaw_block("circle-straight", 0)
    for row in smooth.itertuples():
        one = np.array([row.index])
        unit = shooting_many.force_unit(columns, one)[0] * columns["finger.length"][row.index]
        good, _, energy = atlas_slsqp.solve(atlas_slsqp.shape_of(columns, row.index))
        assert good
        assert energy == pytest.approx(row.energy_J / unit, rel=0.03)


def test_slsqp_finds_a_shape_in_direct_contact() -> None:
    """Where the package has one, and none where the target covers the clamp."""
    last = atlas_runs.last_rows(atlas_runs.chosen("circle", np.arange(12)))
    touching = last[(last["status"] == "converged") & (last["contacts"] > 0)]
    smooth = touching.loc[touching["friction.mu"] == 0.0, "index"].head(3)
    assert len(smooth) >= 2
    assert all(atlas_slsqp_sides.solve("circle", int(index)) for index in smooth)
    assert not atlas_slsqp_sides.solve("ellipse", 332)


def test_friction_is_followed_by_shooting() -> None:
    """From frictionless answers to those with friction, where the package has them."""
    last = atlas_runs.last_rows(atlas_runs.chosen("circle-straight", np.arange(60)))
    slides = last[(last["status"] == "converged") & (last["friction.mu"] > 0.0)]
    slides = slides[(slides["contacts"] == 1) & (slides["sticking"] == 0)]
    indices = slides["index"].to_numpy()
    smooth = atlas_runs.chosen("circle-straight", indices, {"friction.mu": 0.0})
    smooth = atlas_runs.last_rows(smooth).set_index("index").loc[indices].reset_index()
    known = ((smooth["contacts"] == 1) & (smooth["status"] == "converged")).to_numpy()
    found = atlas_failures.slide(
        "circle-straight", smooth[known].reset_index(), slides["friction.mu"].to_numpy()[known]
    )
    assert len(found) >= 5
    assert found.mean() > 0.8


@pytest.mark.parametrize("taper", [1e-2, 0.1, 10.0, 1e3])
def test_tapers_of_any_ratio_converge(taper: float) -> None:
    """Polynomials for the curvature were wrong by factors of up to 10,000."""
    scene = fastncm.load_scene("snapfit-circle")
    ends = (0.0032 * min(1.0, 1.0 / taper), 0.0032 * min(taper, 1.0))
    curve = fastncm.solve(scene.replace({"finger.thickness": ends}), positions=[0.07, 0.066])
    row = curve.frame().iloc[-1]
    case = replace(shooting.SNAPFIT_CIRCLE, thickness=ends[0], thickness_tip=ends[1])
    truth = shooting.solve(case, 0.066, "edge")
    assert row["status"] == "converged"
    assert curve.order <= 20
    error = abs(row["normal_force_N"] / truth.normal_force - 1.0)
    assert error <= 10.0 * row["error_estimate"] <= 1e-5


def test_rates_of_unsolved_scenes_by_hand() -> None:
    """Of 1,000 scenes 20 have failed, 10 of them tried: 2 solved by smaller steps, and SLSQP solves
    1 of the 4 that it gets of the other 8."""
    cause = [""] * 980 + ["not solved"] * 20
    table = pd.DataFrame({"kind": "circle", "cause": cause, "friction.mu": 0.0})
    by = ["path.steps = 200"] * 2 + ["SLSQP"] + [""] * 3 + [atlas_failures.NOT_TRIED] * 4
    tried = pd.DataFrame({"cause": "not solved", "friction.mu": 0.0, "solved_by": by})
    tried = tried.assign(kind="circle", index=range(10))
    (row,) = atlas_rates.existing(table, tried).itertuples()
    assert (row.failed, row.tried, row.ours, row.asked, row.theirs) == (20, 10, 2, 4, 1)
    assert row.rate_ours == pytest.approx(200.0 * 2 / 10)
    assert row.rate_theirs == pytest.approx(200.0 * 8 / 10 * 1 / 4)
    exact = binomtest(2, 10).proportion_ci(0.95, "exact")
    assert (row.low_ours, row.high_ours) == pytest.approx((200.0 * exact.low, 200.0 * exact.high))


def test_features_are_those_of_the_scenes() -> None:
    """Counted by hand from the scenes' own columns, one by one."""
    indices = np.arange(40)
    for kind in ("circle-straight", "ellipse"):
        rows = atlas_runs.last_rows(atlas_runs.chosen(kind, indices))
        table = atlas_causes.described(kind, rows)
        judged = pd.DataFrame(columns=list(atlas_truth.JUDGED)).astype({"found": bool})
        tally = atlas_features.tally(table, judged).set_index("feature")
        made = [extremes.one(kind, int(index)) for index in indices]
        stiff = sum(scene["finger.young"] > 1e12 for scene in made)
        thick = sum(max(scene["finger.thickness"]) > 0.2 * scene["finger.length"] for scene in made)
        assert tally.loc["E above 1e12 Pa", "scenes"] == stiff > 0
        assert tally.loc["w/L above 0.2", "scenes"] == thick > 0
        assert tally.loc["E above 1e12 Pa", "converged"] <= stiff


def test_a_scene_that_raises_is_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    """The others of its call are solved all the same."""

    def solve(kind: str, columns: extremes.Columns) -> pd.DataFrame:
        if (columns["path.stop"] == bad).any():
            raise IndexError("out of bounds")
        count = len(columns["path.stop"])
        return pd.DataFrame({"kind": kind, "index": range(count), "status": "converged"})

    columns = extremes.first(extremes.jaw_block("circle-straight", 0), 7)
    bad = columns["path.stop"][4]
    monkeypatch.setattr(atlas_runs, "run_columns", solve)
    rows = atlas_runs.solved("circle-straight", columns)
    assert rows["index"].tolist() == list(range(7))
    assert rows["status"].tolist() == ["converged"] * 4 + ["exception"] + ["converged"] * 2
    assert rows["advice"].iloc[4] == "IndexError: out of bounds"


def test_pieces_are_made_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is done is read again; where time is up, the rest is left for the next run."""
    made = []

    def make(number: int) -> pd.DataFrame:
        made.append(number)
        return pd.DataFrame({"number": [number]})

    monkeypatch.setattr(atlas_store, "folder", lambda: tmp_path)
    pieces = [atlas_store.Piece(f"piece-{i}", make, (i,)) for i in range(3)]
    first = atlas_store.run("pieces", pieces[:2], 1)
    late = atlas_store.run("pieces", pieces, 1, seconds=-1.0)
    whole = atlas_store.run("pieces", pieces, 1)
    assert made == [0, 1, 2]
    assert first["number"].tolist() == late["number"].tolist() == [0, 1]
    assert whole["number"].tolist() == [0, 1, 2]


def test_overlaps() -> None:
    """Of random scenes, those whose undeformed finger is free say so by both judges."""
    last = atlas_runs.last_rows(atlas_runs.chosen("circle-straight", np.arange(60)))
    free = last.loc[last["status"] == "no_contact", "index"]
    assert len(free) > 5
    assert not any(atlas_overlaps.jaw_overlaps("circle-straight", int(i)) for i in free)
    touching = last.loc[(last["contacts"] > 0) & (last["tip_angle_rad"].abs() > 0.1), "index"]
    assert all(atlas_overlaps.jaw_overlaps("circle-straight", int(i)) for i in touching)
