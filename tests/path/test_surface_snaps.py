"""Snaps in direct contact: told with place and energy, and nothing else is.

The truth of a thin finger whose tip slips off a pin is an elastica with an end force along the
pin's normal, turned by friction: one solution for each direction of the normal, and the target's
position on this branch turns back at the limit point.
"""

import math

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar, root
from surfaces import RUBBER, Solved, solved_surface

import fastncm
from fastncm.sqp import status

pytestmark = pytest.mark.compiled
LENGTH, ARM = RUBBER.finger.length, RUBBER.finger.offset
RADIUS, THICK = 0.02, 0.0004
HEIGHT = ARM + 0.9 * LENGTH
PIN = {
    "path.kind": "translation",
    "path.angle": 0.5 * math.pi,
    "path.y": HEIGHT,
    "path.start": 0.021,
    "path.stop": -0.2,
    "target.shape": "circle",
    "target.radius": RADIUS,
    "finger.thickness": THICK,
    "model.surface": "axis",
    "model.shear": False,
    "solver.intervals": 720,
}
"""A thin finger upright, and a pin pushed through below its tip from the right."""
SWEEP = {name: value for name, value in PIN.items() if name != "path.angle"} | {
    "path.kind": "rotation",
    "path.x": 0.0,
    "path.speed_ratio": 0.0,
    "path.start": math.radians(100.0),
    "path.stop": math.radians(-60.0),
}
"""The same pin above the pivot, and the base turns."""
PLACE = 2e-6
"""Of finger lengths or rad: where the snap is told, and what 720 intervals do to it."""


def shoot(
    phi: float, mu: float, sweeps: bool, guess: np.ndarray
) -> tuple[float, float, np.ndarray]:
    """Position (m or rad) at which the pin's normal at the tip has the direction `phi` in the
    base's frame (turned to point along y), energy over E I / L, and the unknowns: force, moment at
    the clamp, position."""
    force_at = np.array([math.cos(phi), math.sin(phi)])
    force_at = force_at - mu * np.array([-force_at[1], force_at[0]])

    def end(force: float, moment: float) -> np.ndarray:
        fx, fy = force * force_at

        def rates(_: float, u: np.ndarray) -> list[float]:
            c, s = math.cos(u[2]), math.sin(u[2])
            return [c, s, u[3], s * fx - c * fy, 0.5 * u[3] ** 2]

        begin = [0.0, ARM / LENGTH, 0.5 * math.pi, moment, 0.0]
        return solve_ivp(rates, (0.0, 1.0), begin, rtol=1e-11, atol=1e-13, method="DOP853").y[:, -1]

    def miss(u: np.ndarray) -> list[float]:
        x, y, _, moment, _ = end(u[0], u[1])
        back = 0.5 * math.pi - u[2] if sweeps else 0.0
        cx, cy = (0.0, HEIGHT / LENGTH) if sweeps else (u[2], HEIGHT / LENGTH)
        cx, cy = (
            math.cos(back) * cx - math.sin(back) * cy,
            math.sin(back) * cx + math.cos(back) * cy,
        )
        r = RADIUS / LENGTH
        return [moment, x - cx - r * math.cos(phi), y - cy - r * math.sin(phi)]

    found = root(miss, guess, tol=1e-12)
    if np.abs(found.fun).max() > 1e-9:
        return math.nan, math.nan, guess
    energy = float(end(found.x[0], found.x[1])[4])
    return float(found.x[2]) * (1.0 if sweeps else LENGTH), energy, found.x


def limit_point(mu: float, sweeps: bool) -> tuple[float, float]:
    """Position (m or rad) of the limit point on the branch of contact at the tip, and the energy
    there in J."""
    guess = np.array([1.0, 1.0, 1.2 if sweeps else -0.1])
    branch = []
    for phi in np.linspace(2.6, 5.6, 31):
        position, _, guess = shoot(phi, mu, sweeps, guess)
        if math.isnan(position):
            break
        branch.append((position, phi, guess))
    least = min(range(len(branch)), key=lambda k: branch[k][0])
    assert 0 < least < len(branch) - 1
    _, phi, guess = branch[least]
    found = minimize_scalar(
        lambda at: shoot(at, mu, sweeps, guess)[0],
        bounds=(phi - 0.1, phi + 0.1),
        method="bounded",
        options={"xatol": 1e-6},
    )
    position, energy, _ = shoot(found.x, mu, sweeps, guess)
    inertia = RUBBER.finger.width * THICK**3 / 12.0
    return position, energy * RUBBER.finger.young * inertia / LENGTH


def snaps(solved: Solved) -> np.ndarray:
    """The rows on the way to which the finger snaps."""
    found: np.ndarray = np.flatnonzero(solved.released)
    return found


@pytest.mark.parametrize("sweeps", [False, True], ids=["pushed", "swept"])
@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_a_finger_that_slips_off_a_pin(mu: float, sweeps: bool) -> None:
    position, energy = limit_point(mu, sweeps)
    scene = RUBBER.replace((SWEEP if sweeps else PIN) | {"friction.mu": mu})
    unit = 1.0 if sweeps else LENGTH
    for steps in (2, 61):
        changes = (SWEEP if sweeps else PIN) | {"path.steps": steps}
        solved = solved_surface(changes, mu=mu)
        (i,) = snaps(solved)
        assert solved.status[i] == status.NO_CONTACT
        assert solved.snap[i] * unit == pytest.approx(position, abs=PLACE * unit)
        scale = solved.lowered.scale
        released = solved.released[i] * scale.force[0] * scale.length[0]
        assert released == pytest.approx(energy, rel=3e-3)
    curve = fastncm.solve(scene.replace({"path.steps": 61}))
    word = f"rad ({math.degrees(solved.snap[i]):.6f} degrees)" if sweeps else "m"
    said = f"limit point at {solved.snap[i] * unit:.9g} {word}: the finger snaps"
    assert said in curve.frame()["advice"][i]
    assert said in curve.advice
    assert said in fastncm.solve_cases(scene, pd.DataFrame({"path.steps": [61]}))["advice"][0]
    events = curve.events().set_index("event")
    assert list(events.index) == ["touch", "before_change", "after_change", "release"]
    assert (events["interval"].iloc[1:] == i - 1).all()
    for name in ("before_change", "after_change", "release"):
        assert events["position"][name] == pytest.approx(position, abs=PLACE * unit)
    assert events["energy_J"]["before_change"] == pytest.approx(energy, rel=3e-3)
    assert events["energy_J"]["after_change"] == 0.0 == events["insertion_force_N"]["after_change"]
    before = curve.frame().iloc[i - 1]
    assert events["insertion_force_N"]["before_change"] < before["insertion_force_N"]


@pytest.mark.parametrize("mu", [0.0, 0.5])
@pytest.mark.parametrize("changes", [{}, {"path.start": math.radians(78), "path.stop": 2.19}])
def test_shipped_scenes_do_not_snap(mu: float, changes: dict[str, float]) -> None:
    assert not snaps(solved_surface(changes, mu=mu)).size


def test_what_is_lost_is_told() -> None:
    """Of random pins, ellipses and fingers, without friction: the target's work is stored, or
    released by snaps."""
    rng, told, quiet = np.random.default_rng(8), 0, 0
    for _ in range(60):
        size = rng.uniform(0.01, 0.06, 2)
        changes = PIN | {
            "path.y": ARM + rng.uniform(0.3, 1.0) * LENGTH,
            "path.start": 0.08,
            "path.stop": rng.uniform(-0.12, 0.0),
            "target.shape": "ellipse",
            "target.semi_axes": size.tolist(),
            "target.tilt": rng.uniform(-1.5, 1.5),
            "finger.thickness": [rng.uniform(0.001, 0.02), rng.uniform(0.001, 0.01)],
            "model.surface": "side",
            "model.shear": True,
            "path.steps": 400,
            "solver.intervals": 90,
        }
        changes.pop("target.radius")
        solved = solved_surface(changes)
        if not np.isin(solved.status, (status.CONVERGED, status.NO_CONTACT)).all():
            continue
        x, power = solved.lowered.positions[0], solved.work_rate
        before, after = power[:-1].copy(), power[1:].copy()
        at = snaps(solved)
        # a step with a snap: to its place at the old power, from there at the new one
        share = (solved.snap[at] - x[at - 1]) / (x[at] - x[at - 1])
        before[at - 1], after[at - 1] = (
            2.0 * share * before[at - 1],
            2.0 * (1 - share) * after[at - 1],
        )
        work = -0.5 * np.diff(x) * (before + after)
        lost = work.sum() - solved.energy[-1]
        most = solved.energy.max()
        assert lost == pytest.approx(solved.released.sum(), abs=5e-3 * most)
        told, quiet = told + bool(at.size), quiet + (not at.size)
    assert told >= 5
    assert quiet >= 20
