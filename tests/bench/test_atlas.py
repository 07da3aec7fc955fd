"""A slice of the atlas: answers to random extreme scenes are never wrong in silence.

The truth for jaws is shooting (`shooting_many`), which is compared with `shooting` first.
"""

from dataclasses import replace

import atlas
import extremes
import numpy as np
import pytest
import shooting
import shooting_many
from support import atlas_runs

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
    last = atlas_runs.last_rows(atlas_runs.run_block(kind, 0, JAWS))
    shot = atlas_runs.judge_by_order(atlas_runs.shoot(kind, 0, last))
    assert shot["found"].sum() >= 0.3 * JAWS
    assert atlas.wrong_in_silence(shot).empty
    assert atlas.unanswered(shot).empty


@pytest.mark.parametrize("kind", extremes.SIDE_KINDS)
def test_random_direct_contact_is_never_wrong_in_silence(kind: str) -> None:
    last = atlas_runs.last_rows(atlas_runs.run_block(kind, 0, 3 * SIDES))
    close = last[
        (last["solver.contact"] == "closest") & (last["solver.intervals"].astype(int) < 99)
    ]
    finer = close.merge(atlas_runs.refine(close.head(3 * SIDES)), on="index")
    assert len(finer) >= 3
    assert atlas.wrong_in_silence(finer).empty


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
