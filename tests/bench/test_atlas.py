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
    atlas_follow,
    atlas_overlaps,
    atlas_rates,
    atlas_runs,
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


def test_a_followed_branch_has_the_same_energy() -> None:
    """A chain of links has that of the polynomials, nearly, along the whole path."""
    for kind in ("circle-straight", "corner-straight"):
        last = atlas_runs.last_rows(atlas_runs.chosen(kind, np.arange(12)))
        smooth = last[(last["status"] == "converged") & (last["friction.mu"] == 0.0)].head(2)
        columns = extremes.jaw_block(kind, 0)
        for row in smooth.itertuples():
            one = np.array([row.index])
            unit = shooting_many.force_unit(columns, one)[0] * columns["finger.length"][row.index]
            branch = atlas_failures.branch(kind, row.index)
            assert branch.what == atlas_follow.REACHED
            assert 0.5 * branch.z @ branch.z == pytest.approx(row.energy_J / unit, rel=0.05)


def test_a_branch_that_snaps_is_followed_behind() -> None:
    """The package tells a snap there, too, and has the shape behind it."""
    row = atlas_runs.last_rows(atlas_runs.chosen("corner-concave", np.array([11]))).iloc[0]
    columns, one = extremes.jaw_block("corner-concave", 0), np.array([11])
    unit = shooting_many.force_unit(columns, one)[0] * columns["finger.length"][11]
    branch = atlas_failures.branch("corner-concave", 11)
    assert "snaps" in row["advice"]
    assert branch.what == atlas_follow.BEHIND
    assert 0.5 * branch.z @ branch.z == pytest.approx(row["energy_J"] / unit, rel=0.02)


def test_branches_in_direct_contact() -> None:
    """The energy of the package's own shapes, and no branch over a target on the clamp."""
    scene = atlas_overlaps.side_scene("half-plane", 1)
    row = atlas_runs.last_rows(atlas_runs.chosen("half-plane", np.array([1]))).iloc[0]
    branch, clamp = atlas_failures.branch("half-plane", 1), scene.finger.stations[0][1]
    unit = scene.finger.young * scene.finger.width * clamp**3 / 12.0 / scene.finger.length
    assert branch.what == atlas_follow.REACHED
    assert 0.5 * branch.z @ branch.z == pytest.approx(row["energy_J"] / unit, rel=0.02)
    assert atlas_failures.branch("ellipse", 332).what != atlas_follow.REACHED


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
    """Of 1,000 scenes 20 have failed, 10 of them tried: of 6 that are followed 2 reach the end, 1
    snaps, for 3 no shape is found; smaller steps solve one of each of these."""
    cause = [""] * 980 + ["not solved"] * 20
    table = pd.DataFrame({"kind": "circle", "cause": cause, "friction.mu": 0.0})
    ours = ["path.steps = 200", ""]
    tried = pd.DataFrame({"cause": "not solved", "friction.mu": 0.0, "kind": "circle",
                          "solved_by": [*ours, ours[0], *ours, "", *ours, *ours],
                          "followed": [*2 * [atlas_follow.REACHED], atlas_follow.BEHIND,
                                       *3 * [atlas_follow.ENDS], *4 * [""]]})  # fmt: skip
    row, whole = atlas_rates.existing(table, tried.assign(index=range(10))).itertuples()
    assert (row.failed, row.judged, row.missing, row.elsewhere, row.nothing) == (20, 6, 3, 1, 2)
    assert whole.cause == atlas_rates.ALL
    np.testing.assert_array_equal(whole.of_missing, row.of_missing)
    exact = binomtest(3, 6).proportion_ci(0.95, "exact")
    limits = 200.0 * np.array([3 / 6, exact.low, exact.high])
    np.testing.assert_allclose(row.of_missing, limits)


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


@pytest.mark.parametrize("index", [6917, 11291])
def test_a_polygon_across_the_finger_is_no_free_position(index: int) -> None:
    """Its corners lie on both sides of the finger, and one is next to the node that is inside."""
    assert atlas_overlaps.side_overlaps("polygon", index)
    last = atlas_runs.last_rows(atlas_runs.chosen("polygon", np.array([index])))
    assert (last["status"] != "no_contact").all()
    assert not ((last["status"] == "converged") & (last["error_estimate"] < 1.0)).any()


def test_overlaps() -> None:
    """Of random scenes, those whose undeformed finger is free say so by both judges."""
    last = atlas_runs.last_rows(atlas_runs.chosen("circle-straight", np.arange(60)))
    free = last.loc[last["status"] == "no_contact", "index"]
    assert len(free) > 5
    assert not any(atlas_overlaps.jaw_overlaps("circle-straight", int(i)) for i in free)
    touching = last.loc[(last["contacts"] > 0) & (last["tip_angle_rad"].abs() > 0.1), "index"]
    assert all(atlas_overlaps.jaw_overlaps("circle-straight", int(i)) for i in touching)
