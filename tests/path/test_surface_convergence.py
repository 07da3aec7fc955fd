"""How direct contact converges with N, and how many passes along the finger it takes."""

import numpy as np
import pytest
from surfaces import Solved, solved_surface

pytestmark = pytest.mark.compiled
ANGLES = np.radians(np.linspace(125.0, 79.0, 12))
FINE = 7680


def path(intervals: int, changes: dict | None = None) -> Solved:
    solved = solved_surface({"solver.intervals": intervals} | (changes or {}), ANGLES)
    assert solved.converged.all()
    return solved


def rate(counts: list[int], errors: list[float]) -> float:
    """Slope of the errors over 1/N, least squares."""
    return float(np.polyfit(-np.log(counts), np.log(errors), 1)[0])


@pytest.mark.parametrize("shear", [True, False])
def test_rates_of_energy_and_force(shear: bool) -> None:
    """Energy of second order in 1/N, force at least of first: the largest errors along a path."""
    changes = {"model.shear": shear}
    truth, counts = path(FINE, changes), [30, 60, 120, 240, 480]
    energies, forces = [], []
    for count in counts:
        solved = path(count, changes)
        energies.append(np.abs(solved.energy / truth.energy - 1.0).max())
        far = np.linalg.norm(solved.force - truth.force, axis=1)
        forces.append((far / np.linalg.norm(truth.force, axis=1)).max())
    assert rate(counts, energies) > 1.8
    assert rate(counts, forces) > (1.7 if shear else 0.85)


def test_passes_do_not_grow_with_the_number_of_intervals() -> None:
    """From 45 to 5,760 intervals the passes along the finger per solve stay alike."""
    passes = []
    for count in (45, 180, 720, 2880, 5760):
        trace = path(count).trace
        passes.append(trace.passes[0] / trace.solves[0])
    assert max(passes) < 16.0
    assert passes[-1] < 2.0 * passes[0]


OCTAGON = np.pi * (np.arange(8) + 0.5) / 4.0
FORMS = {
    "octagon": {
        "target.shape": "polygon",
        "target.vertices": [[0.09906 * np.cos(a), 0.06731 * np.sin(a)] for a in OCTAGON],
    },
    "points on target": {"solver.contact": "points-on-target"},
    "as printed": {"model.section": "psi+gamma"},
}


@pytest.mark.parametrize("form", FORMS)
def test_iterations_of_other_forms_do_not_grow_either(form: str) -> None:
    """Along a path in small steps: at corners and at the target's points, too, whose force turns
    with the shear beside them."""
    angles = np.radians(np.linspace(120.0, 84.0, 37))
    for count in (45, 180, 720, *((2880,) if form == "octagon" else ())):
        points = {"solver.points": 4 * count} if form == "points on target" else {}
        solved = solved_surface({"solver.intervals": count} | points | FORMS[form], angles)
        assert solved.converged.all()
        assert np.median(solved.iterations[1:]) <= 4.0
        assert np.mean(solved.iterations[1:]) < 6.0
        if form == "octagon":  # nowhere on its way from edge to corner
            assert np.max(solved.iterations[1:]) <= 25


def test_iterations_do_not_grow_with_the_number_of_intervals() -> None:
    """Along a path in small steps, each from the last."""
    angles = np.radians(np.linspace(120.0, 84.0, 37))
    means = []
    for count in (45, 360, 2880):
        solved = solved_surface({"solver.intervals": count}, angles)
        assert solved.converged.all()
        means.append(solved.iterations[1:].mean())
    assert max(means) < 6.0
    assert means[2] < 1.5 * means[0]
