"""Snaps are told, however small, and nothing else is: the work of the target is what is stored and
what the snaps release."""

import extremes
import numpy as np
import pandas as pd
import pytest
import shooting
import shooting_many
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


@pytest.mark.parametrize(
    ("a_y", "b", "radius", "convex", "circle", "y", "stop"),
    [
        (0.020149, (0.077818, 0.003872), 0.018699, False, 0.006076, 0.003572, 0.053150),
        (0.007956, (0.094423, 0.003728), 0.043402, False, 0.006072, 0.000987, 0.042072),
        (0.007560, (0.084366, 0.005045), 0.019862, False, 0.007196, 0.001730, 0.061969),
        (0.019243, (0.086924, 0.004407), 0.022036, True, 0.008540, 0.002837, 0.043312),
        (0.015519, (0.072551, 0.003316), 0.013231, False, 0.003417, 0.001907, 0.069544),
    ],
)
def test_energy_comes_from_the_target_alone(
    a_y: float,
    b: tuple[float, float],
    radius: float,
    convex: bool,
    circle: float,
    y: float,
    stop: float,
) -> None:
    """Where the branch from first touch ended, rows went on with another one of up to 80 times the
    energy: what was solved must be what the work of the target explains."""
    jaw = {"jaw.a": (0.057, a_y), "jaw.b": b, "jaw.radius": radius, "jaw.convex": convex}
    way = {"path.y": y, "path.stop": stop, "path.steps": 600, "target.radius": circle}
    snapfit = fastncm.load_scene("snapfit-circle")
    frame = fastncm.solve(snapfit.replace({"jaw.shape": "arc"} | jaw | way)).frame()
    force, energy = frame["insertion_force_N"], frame["energy_J"]
    work = 0.5 * (force + force.shift()) * -frame["position"].diff()
    solved = (frame["status"] == "converged") & (frame["status"].shift() == "converged")
    gained = (energy.diff() - work)[solved] / np.maximum(energy, energy.shift())[solved]
    assert solved.sum() > 30
    assert gained.iloc[1:].max() < 0.1


@pytest.mark.parametrize(
    ("a_y", "b", "radius", "circle", "y", "stop"),
    [
        (0.020185, (0.071072, -0.004503), 0.039690, 0.005896, 0.010769, 0.0440),
        (0.020247, (0.065929, 0.002041), 0.053427, 0.006184, 0.004574, 0.0512),
        (0.018827, (0.069031, -0.004431), 0.061359, 0.005481, 0.008207, 0.0440),
    ],
)
def test_a_finger_that_loses_its_hold_snaps_behind_the_target(
    a_y: float, b: tuple[float, float], radius: float, circle: float, y: float, stop: float
) -> None:
    """The advice has the place, and the energy that the work of the target leaves unexplained."""
    jaw = {"jaw.shape": "arc", "jaw.convex": False, "jaw.radius": radius, "target.radius": circle}
    jaw |= {"jaw.a": (0.057, a_y), "jaw.b": b, "path.y": y, "path.stop": stop}
    finger = fastncm.load_scene("snapfit-circle").replace(jaw)
    frame = fastncm.solve(finger.replace({"path.steps": 4000})).frame()
    force, energy = frame["insertion_force_N"], frame["energy_J"]
    work = 0.5 * (force + force.shift()) * -frame["position"].diff()
    lost = (work - energy.diff())[frame["status"] == "converged"]
    at = int(lost.idxmax())
    before = work[at] - 0.5 * force[at] * -frame["position"].diff()[at]  # up to the snap at most
    curve = fastncm.solve(finger)
    place, released = (
        float(curve.advice.split(word)[1].split()[0]) for word in ("limit point at", "releases")
    )
    shortest = 1e-6 * finger.finger.length  # move, to which the place is found
    assert frame["position"][at] - shortest < place < frame["position"][at - 1] + shortest
    assert released == pytest.approx(lost[at], abs=2.0 * abs(before) + 1e-3 * lost[at])
    assert (curve.frame()["status"].isin(["converged", "no_contact"])).all()


def sliding_force(index: int, row: pd.Series, position: float) -> float:
    """Normal force (N) of the exact sliding equilibrium of scene `index` of corner-straight with
    the target at `position` that is next to the claimed `row`; NaN where shooting finds none."""
    columns, case = extremes.jaw_block("corner-straight", 0), np.array([index])
    unit, length = shooting_many.force_unit(columns, case), columns["finger.length"][case]
    claim = shooting_many.Claim(
        row[["force_x_N", "force_y_N"]].to_numpy(float)[None] / unit[:, None],
        row[["contact_x_m", "contact_y_m"]].to_numpy(float)[None] / length[:, None],
        np.array([[row["tip_x_m"] / length[0], row["tip_y_m"] / length[0], row["tip_angle_rad"]]]),
    )
    fingers = shooting_many.fingers(columns, case, np.array([position]))
    with np.errstate(all="ignore"):
        truth = shooting_many.exact(fingers, claim, columns["friction.mu"][case])
    return float(truth.normal[0] * unit[0]) if truth.found[0] else np.nan


@pytest.mark.parametrize("index", [1, 24])
def test_a_snap_with_friction_is_told(index: int) -> None:
    """The rows went on behind it without a word. On either side of the told place shooting finds
    the claimed equilibrium, the one before with the energy that is released above the other; a
    little beyond it, none next to the first."""
    scene = fastncm.load_scene("snapfit-corner").replace(extremes.one("corner-straight", index))
    curve = fastncm.solve(scene)
    assert curve.status == "converged"
    place, released = (
        float(curve.advice.split(word)[1].split()[0]) for word in ("limit point at", "releases")
    )
    step = 3e-6 * scene.finger.length
    way = np.append(np.linspace(curve.frame()["position"].iloc[0], place + step, 40), place - step)
    before, after = (
        row for _, row in fastncm.solve(scene, positions=way).frame().iloc[-2:].iterrows()
    )
    for row in (before, after):
        exact = sliding_force(index, row, row["position"])
        assert row["normal_force_N"] == pytest.approx(exact, rel=1e-6)
    assert released == pytest.approx(before["energy_J"] - after["energy_J"], rel=1e-3)
    lost = sliding_force(index, before, place - 1e3 * step)
    assert not abs(lost / before["normal_force_N"] - 1.0) < 0.1
