"""Snaps are told, however small, and nothing else is: the work of the target is what is stored and
what the snaps release."""

import numpy as np
import pandas as pd
import pytest
import shooting
from hard_jaws import SNAPPING, scene

import fastncm

pytestmark = pytest.mark.compiled

STOP = 0.0633


@pytest.mark.parametrize("steps", [23, 97, 120])
def test_a_small_snap_is_told(steps: int) -> None:
    """As the circle's contact comes to corner a the branch turns back: shooting has the place, and
    the energies of the state there and of that with the circle on the corner."""
    edge = shooting.peak_position(SNAPPING)

    def miss(unknowns: np.ndarray) -> np.ndarray:
        target, _ = shooting._contact(SNAPPING, "corner", *unknowns)
        return target - np.array([edge.position, SNAPPING.path_y]) / SNAPPING.length

    start = edge.normal_force / shooting._force_unit(SNAPPING)
    force, turn = shooting._newton(miss, np.array([0.95 * start, 0.1]))
    assert turn > 1e-3  # the state at the event itself is the other root
    corner = shooting._result(SNAPPING, "corner", edge.position, force, turn)
    released = edge.energy - corner.energy
    assert 1e-6 < released < 1e-5
    curve = fastncm.solve(scene(SNAPPING, **{"path.stop": STOP, "path.steps": steps}))
    assert curve.status == "converged"
    assert f"limit point at {edge.position:.9g} m" in curve.advice
    assert f"releases {released:.4g} J" in curve.advice
    events = curve.events().set_index("event")
    after = events.loc["after_change"]
    assert after["insertion_force_N"] == pytest.approx(-corner.force_x, rel=1e-7)
    assert after["energy_J"] == pytest.approx(corner.energy, rel=1e-8)


def random_jaw(rng: np.random.Generator) -> dict[str, object]:
    """A jaw and a circle about as in the paper's example, far apart in shape."""
    a = np.array([0.057, rng.uniform(0.004, 0.020)])
    b = a + [rng.uniform(0.008, 0.030), -rng.uniform(0.003, 0.020)]
    radius = rng.uniform(0.002, 0.012)
    return {
        "jaw.a": tuple(a.tolist()),
        "jaw.b": tuple(b.tolist()),
        "target.radius": radius,
        "path.y": b[1] + rng.uniform(0.3, 0.95) * (a[1] - b[1]) + 0.9 * radius,
        "path.start": "touch",
        "path.stop": a[0] + rng.uniform(0.0, 0.015),
        "path.steps": 200,
    }


def test_what_is_lost_is_told() -> None:
    """Of random jaws: where the work is all stored, no snap is told; where some of it is missing,
    it is what the events release, and the advice says so."""
    rng, base = np.random.default_rng(8), fastncm.load_scene("snapfit-circle")
    told = quiet = 0
    for _ in range(160):
        curve = fastncm.solve(base.replace(random_jaw(rng)))
        if curve.status != "converged":
            assert curve.status == "no_contact"
            continue
        stored = curve.frame()["energy_J"]
        lost = curve.insertion_work_J - stored.iloc[-1]
        released = energy_drops(curve.events())
        assert lost == pytest.approx(released, abs=3e-3 * stored.max())
        snaps = "snaps" in curve.advice
        assert snaps == (released > 1e-9 * stored.max())
        told, quiet = told + snaps, quiet + (not snaps)
    assert told >= 2
    assert quiet >= 80


def energy_drops(events: pd.DataFrame) -> float:
    """Energy (J) that is missing behind the changes of contact."""
    kind, energy = events["event"], events["energy_J"]
    before = energy[kind == "before_change"].to_numpy()
    after = energy[kind == "after_change"].to_numpy()
    assert len(before) == len(after)
    return float((before - after).sum())
