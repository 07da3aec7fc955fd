"""Friction in equilibrium, on paths: forces against shooting, sticking, locking, the energy
balance."""

from dataclasses import replace

import numpy as np
import pytest
import shooting

import fastncm

CIRCLE = fastncm.load_scene("snapfit-circle").replace({"solver.rtol": 1e-10})
CORNER = fastncm.load_scene("snapfit-corner").replace({"solver.rtol": 1e-10})

FORCES = [
    (CIRCLE, shooting.SNAPFIT_CIRCLE, 0.0738, {0.2: 1.0669, 0.4: 1.5779}),
    (CIRCLE, shooting.SNAPFIT_CIRCLE, 0.0688, {0.2: 3.4418, 0.4: 5.1436}),
    (CORNER, shooting.SNAPFIT_CORNER, 0.0652, {0.2: 2.1782, 0.4: 3.2465}),
    (CORNER, shooting.SNAPFIT_CORNER, 0.0580, {0.2: 3.5136, 0.4: 5.3599}),
]
"""Scene, exact case, position (m), and the issue's insertion forces (N) by friction."""


@pytest.mark.parametrize(("scene", "case", "position", "figures"), FORCES)
def test_insertion_force(
    scene: fastncm.Scene, case: shooting.ShootingCase, position: float, figures: dict[float, float]
) -> None:
    for mu, figure in figures.items():
        exact = shooting.solve(replace(case, mu=mu), position)
        row = (
            fastncm.solve(scene.replace({"friction.mu": mu}), positions=[position]).frame().iloc[0]
        )
        assert row["insertion_force_N"] == pytest.approx(figure, abs=1e-4)
        assert row["force_x_N"] == pytest.approx(exact.force_x, rel=1e-8)
        assert row["force_y_N"] == pytest.approx(exact.force_y, rel=1e-8)
        assert row["friction_force_N"] == pytest.approx(mu * row["normal_force_N"], rel=1e-12)


@pytest.mark.parametrize("feature_position", [0.0612, 0.0604])
def test_force_on_the_corner_of_the_jaw(feature_position: float) -> None:
    """The circle slides around corner a; with a taper and shear."""
    changes = {
        "finger.thickness": [0.0040, 0.0028],
        "model.shear": True,
        "friction.mu": 0.3,
        "solver.order": 12,
    }
    case = replace(
        shooting.SNAPFIT_CIRCLE, thickness=0.0040, thickness_tip=0.0028, shear=True, mu=0.3
    )
    exact = shooting.solve(case, feature_position)
    assert exact.feature == "corner"
    row = fastncm.solve(CIRCLE.replace(changes), positions=[feature_position]).frame().iloc[0]
    assert row["force_x_N"] == pytest.approx(exact.force_x, rel=1e-8)
    assert row["force_y_N"] == pytest.approx(exact.force_y, rel=1e-8)
    assert row["energy_J"] == pytest.approx(exact.energy, rel=1e-8)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_without_friction_both_models_agree(scene: fastncm.Scene) -> None:
    ours = fastncm.solve(scene).frame()
    recovered = fastncm.solve(scene.replace({"friction.model": "recovered"})).frame()
    assert ours.equals(recovered)


@pytest.mark.parametrize(
    ("scene", "case"), [(CIRCLE, shooting.SNAPFIT_CIRCLE), (CORNER, shooting.SNAPFIT_CORNER)]
)
def test_friction_that_locks_at_touch(scene: fastncm.Scene, case: shooting.ShootingCase) -> None:
    """The undeformed finger gives way as long as a C b > 0, with its flexibility C, the wrench a of
    a unit normal force and b of one on the edge of the friction cone."""
    point, outward = shooting._jaw(case, "edge", shooting.touch_place(case))
    arm = (point - [case.length, 0.0]) / case.length
    flexibility = np.array([[0.0, 0.0, 0.0], [0.0, 1.0 / 3.0, 0.5], [0.0, 0.5, 1.0]])

    def wrench(force: np.ndarray) -> np.ndarray:
        return np.array([*force, arm[0] * force[1] - arm[1] * force[0]])

    normal, drag = wrench(-outward), wrench(np.array([-outward[1], outward[0]]))
    critical = -(normal @ flexibility @ normal) / (normal @ flexibility @ drag)
    below = fastncm.solve(scene.replace({"friction.mu": critical - 5e-3, "path.steps": 200}))
    assert below.frame()["status"].iloc[1] == "converged"
    above = fastncm.solve(scene.replace({"friction.mu": critical + 1e-4}))
    assert above.status == "no_equilibrium"
    assert set(above.frame()["status"].iloc[1:]) == {"no_equilibrium"}
    assert float(above.advice.split("up to ")[1].rstrip(".")) == pytest.approx(critical, abs=1e-6)
