"""Direct contact where it is hard: overlaps, grazing, single ends, extreme ratios."""

import math

import numpy as np
import pytest
from dense import Dense
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from surfaces import RUBBER, check_equilibrium, solved_surface

import fastncm
from fastncm.kernels.nodal import make_nodal
from fastncm.sqp import status

pytestmark = pytest.mark.compiled
LENGTH, OFFSET = RUBBER.finger.length, RUBBER.finger.offset
ANGLES = np.radians([118.0, 102.0, 86.0])
#: A finger along x from the clamp at x = OFFSET, a circle below its right side.
BELOW = {
    "path.kind": "translation",
    "path.angle": 0.0,
    "path.start": OFFSET,
    "path.stop": OFFSET + LENGTH,
    "target.shape": "circle",
    "target.radius": 0.02,
    "finger.thickness": 0.01,
    "solver.intervals": 40,
}


def raised(height: float, **more: object) -> dict[str, object]:
    """The circle's top this much (m) above the undeformed finger's right side."""
    return BELOW | {"path.y": height - 0.005 - 0.02} | more


def test_a_base_inside_the_target_is_infeasible_with_its_depth() -> None:
    solved = solved_surface(raised(0.003), [OFFSET + 0.001, OFFSET + 0.5 * LENGTH])
    assert list(solved.status) == [status.INFEASIBLE, status.CONVERGED]
    depth = 0.02 - math.hypot(0.001, 0.02 - 0.003)
    assert solved.overlap[0] * LENGTH == pytest.approx(depth, rel=1e-9)
    assert solved.overlap[1] == 0.0


def test_a_target_around_the_whole_finger_is_infeasible() -> None:
    around = raised(0.0, **{"target.radius": 1.0, "path.y": 0.0})
    solved = solved_surface(around, [OFFSET + 0.5 * LENGTH])
    assert solved.status[0] == status.INFEASIBLE
    assert solved.overlap[0] > 1.0


def test_without_contact_nothing_happens() -> None:
    solved = solved_surface(raised(-1e-6), [OFFSET + 0.5 * LENGTH])
    assert solved.status[0] == status.NO_CONTACT
    assert solved.energy[0] == 0.0
    assert (solved.force[0] == 0.0).all()
    assert solved.tip_x[0] * LENGTH == pytest.approx(OFFSET + LENGTH)


@pytest.mark.parametrize("shear", [False, True])
def test_grazing_contact(shear: bool) -> None:
    """The force of a contact so light that the finger bends linearly, down to rounding: P = d / f
    with the cantilever's flexibility at the touching node."""
    finger = RUBBER.finger
    at = 0.5 * LENGTH  # node 20 of 40, the circle's highest point
    inertia, area = finger.width * 0.01**3 / 12, finger.width * 0.01
    kappa = (5 + 5 * finger.poisson) / (6 + 5 * finger.poisson)
    give = at**3 / 3 / finger.young / inertia
    give += shear * at / (kappa * finger.shear_modulus * area)
    give -= LENGTH**3 / 40**2 * 0.5 / 12 / finger.young / inertia  # midpoint rule, 20 intervals
    for depth in (1e-6, 1e-8, 1e-10, 1e-12):
        solved = solved_surface(raised(depth, **{"model.shear": shear}), [OFFSET + at])
        assert solved.converged[0]
        assert solved.contacts[0] == 1
        assert solved.newtons[0, 1] == pytest.approx(depth / give, rel=1e-4 + 1e-16 / depth)
    touch = solved_surface(raised(0.0, **{"model.shear": shear}), [OFFSET + at])
    assert touch.status[0] in (status.CONVERGED, status.NO_CONTACT)
    assert abs(touch.newtons[0, 1]) < 1e-12


def test_the_first_node_alone() -> None:
    """A small circle next to the clamp: a stiff, short lever; all moment in the first interval."""
    first = LENGTH / 40
    small = raised(1e-5, **{"target.radius": 0.004, "path.y": 1e-5 - 0.005 - 0.004})
    solved = solved_surface(small, [OFFSET + first])
    assert solved.converged[0]
    assert solved.s_from[0] == pytest.approx(1 / 40)
    check_equilibrium(solved, 0)
    assert np.ptp(solved.finger(0)["psi"][1:]) < 1e-13


@pytest.mark.parametrize("node", [12, 16])
def test_friction_next_to_the_clamp_of_a_thick_finger_without_shear(node: int) -> None:
    """The contact sticks from the first: sliding, friction's couple would undo the deflection. The
    cantilever's surface point answers by ``s^3 / 3``, ``h s^2 / 2`` and ``h^2 s`` over E I along
    the normal and along the side, half a thickness h from the axis."""
    half, at, depth = 0.015, LENGTH * node / 400, 1e-5
    beside = {
        "finger.thickness": 2.0 * half,
        "model.shear": False,
        "solver.intervals": 400,
        "target.shape": "circle",
        "target.radius": 0.01,
        "path.kind": "translation",
        "path.angle": 0.5 * math.pi,
        "path.y": OFFSET + at,
        "path.start": half + 0.01 + 1e-4,
        "path.stop": half + 0.01 - depth,
        "path.steps": 2,
        "friction.mu": 0.3,
    }
    finger = RUBBER.finger
    stiffness = finger.young * finger.width * (2.0 * half) ** 3 / 12.0
    gives = np.array([[at**3 / 3, half * at**2 / 2], [half * at**2 / 2, half**2 * at]])
    normal, along = stiffness * np.linalg.solve(gives, [depth, 0.0])
    row = fastncm.solve(RUBBER.replace(beside)).frame().iloc[-1]
    assert (row["status"], row["contacts"], row["sticking"]) == ("converged", 1, 1)
    assert row["normal_force_N"] == pytest.approx(normal, rel=0.01)
    assert row["friction_force_N"] == pytest.approx(abs(along), rel=0.01)


def test_tip_alone() -> None:
    solved = solved_surface(raised(0.002), [OFFSET + LENGTH + 0.003])
    assert solved.converged[0]
    assert solved.s_from[0] == solved.s_to[0] == 1.0
    check_equilibrium(solved, 0)


def test_contact_over_more_than_half_the_finger() -> None:
    """A plane turned against the finger: all but its first part lies flat on it."""
    plane = {
        "target.shape": "half-plane",
        "target.tilt": math.pi / 2,
        "path.kind": "translation",
        "path.angle": 1.3,
        "path.start": 0.06,
        "path.stop": 0.02,
    }
    for intervals in (45, 360):
        solved = solved_surface(plane | {"solver.intervals": intervals}, [0.045, 0.03, 0.0225])
        assert solved.converged.all()
        assert solved.contacts[-1] > 0.5 * intervals
        check_equilibrium(solved, 2)
        assert abs(solved.force[-1, 1]) < 1e-10 * abs(solved.force[-1, 0])


def test_a_tip_of_a_hundredth_of_the_clamp_s_thickness() -> None:
    solved = solved_surface({"finger.thickness": [0.030, 0.0003]}, ANGLES)
    assert solved.converged.all()
    for i in range(len(ANGLES)):
        check_equilibrium(solved, i)


@pytest.mark.parametrize("shear", [False, True])
@pytest.mark.parametrize("thick", [[0.0005, 0.3], [0.005, 0.000005]])
def test_a_tip_much_stiffer_or_weaker_than_the_clamp(shear: bool, thick: list[float]) -> None:
    """Axis against a circle: the force of light contact is the depth over a linear cantilever's
    flexibility, here by quadrature."""
    finger, at = RUBBER.finger, 0.75 * LENGTH
    kappa = (5 + 5 * finger.poisson) / (6 + 5 * finger.poisson)

    def flexibility(s: float) -> float:
        w = thick[0] + (thick[1] - thick[0]) * s / LENGTH
        bent = (at - s) ** 2 / (finger.young * finger.width * w**3 / 12)
        return bent + shear / (kappa * finger.shear_modulus * finger.width * w)

    give = quad(flexibility, 0.0, at, epsabs=0.0, epsrel=1e-10, limit=200)[0]
    axis = {"model.surface": "axis", "finger.thickness": thick, "model.shear": shear}
    for depth in (1e-7, 1e-5):
        raised_by = {"path.y": depth - 0.02, "solver.intervals": 10_000}
        solved = solved_surface(BELOW | axis | raised_by, [OFFSET + at])
        assert solved.converged[0]
        assert solved.newtons[0, 1] == pytest.approx(depth / give, rel=2e-3)


@pytest.mark.parametrize(
    ("semi_axes", "tilt", "thick", "intervals"),
    [
        ([0.0952, 0.0787], -0.669, [0.0344, 0.0497], 107),
        ([0.1089, 0.0725], -0.678, [0.0305, 0.0396], 104),
        ([0.0831, 0.0322], 0.520, [0.0317, 0.0210], 55),
        ([0.0566, 0.0992], 0.0769, [0.0197, 0.0234], 64),
        ([0.0481, 0.1189], 0.775, [0.0163, 0.0230], 114),
        ([0.0649, 0.1013], 0.315, [0.0109, 0.0094], 162),
    ],
)
def test_contact_next_to_the_clamp_without_shear(semi_axes, tilt, thick, intervals) -> None:
    """Few nodes, large forces, where many contacts come and go on the way."""
    changes = {
        "target.semi_axes": semi_axes,
        "target.tilt": tilt,
        "finger.thickness": thick,
        "model.shear": False,
        "solver.intervals": intervals,
    }
    solved = solved_surface(changes, np.radians([124.0, 120.0, 112.0, 104.0, 96.0]))
    assert np.isin(solved.status, (status.CONVERGED, status.INFEASIBLE)).all()
    for i in np.flatnonzero(solved.converged):
        check_equilibrium(solved, int(i))


def test_too_few_intervals_show_in_the_estimate() -> None:
    truth = solved_surface({"solver.intervals": 2000}, ANGLES)
    coarse = solved_surface({"solver.intervals": 4}, ANGLES)
    assert coarse.converged.all()
    error = np.linalg.norm(coarse.force - truth.force, axis=1)
    error /= np.linalg.norm(truth.force, axis=1)
    assert (coarse.estimate > error).all()
    assert coarse.estimate.min() > 1e-2


def test_energy_is_below_that_of_any_admissible_shape_around() -> None:
    """Random bends and shears added to the solution: where no node penetrates, V is larger."""
    solved = solved_surface({"solver.intervals": 12}, ANGLES)
    rng = np.random.default_rng(5)
    problem = solved.problem
    for i in range(len(ANGLES)):
        dense = Dense(problem, make_nodal(problem), tuple(problem.placement[0, i]))
        u = np.concatenate([solved.trace.psi[0, i, 1:], solved.trace.gamma[0, i, 1:]])
        least = dense.energy(u)
        assert least == pytest.approx(solved.energy[i], rel=1e-12)
        admissible = 0
        for _ in range(1500):
            size = 10.0 ** rng.uniform(-5.0, -0.5)
            v = u + size * rng.normal(size=u.shape) * rng.choice([0.0, 1.0], u.shape)
            if min(dense.contact(v, k)[1] for k in range(1, 14)) >= 0.0:
                admissible += 1
                assert dense.energy(v) > least
        assert admissible > 20


@given(
    a=st.floats(0.03, 0.12),
    b=st.floats(0.03, 0.12),
    tilt=st.floats(-1.5, 1.5),
    clamp=st.floats(0.004, 0.035),
    taper=st.floats(0.05, 1.5),
    shear=st.booleans(),
    mu=st.sampled_from([0.0, 0.0, 0.2, 0.6]),
    intervals=st.integers(16, 60),
)
@settings(
    max_examples=60,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)
def test_rows_of_any_scene(a, b, tilt, clamp, taper, shear, mu, intervals) -> None:
    """What converged neither penetrates nor pulls, is in equilibrium, and says its residual. No
    answer, and without friction, is only where the target is about to cover the clamp."""
    changes = {
        "target.semi_axes": [a, b],
        "target.tilt": tilt,
        "finger.thickness": [clamp, clamp * taper],
        "model.shear": shear,
        "solver.intervals": intervals,
    }
    solved = solved_surface(changes, np.radians([124.0, 120.0, 112.0, 104.0, 96.0]), mu)
    allowed = (status.CONVERGED, status.NO_CONTACT, status.INFEASIBLE)
    if mu == 0.0:
        unsolved = np.flatnonzero(~np.isin(solved.status, allowed))
        answered = np.flatnonzero(solved.converged | (solved.status == status.INFEASIBLE))
        for i in unsolved:
            assert solved.status[answered[answered > i][0]] == status.INFEASIBLE
    problem = solved.problem
    for i in np.flatnonzero(solved.converged):
        assert solved.residual[i] < 1e-8
        assert solved.estimate[i] > 0.0
        if solved.contacts[i] == 0:
            continue
        check_equilibrium(solved, int(i))
        dense = Dense(problem, make_nodal(problem), tuple(problem.placement[0, i]))
        fields = [solved.trace.psi[0, i, 1:], solved.trace.gamma[0, i, 1:]]
        u = np.concatenate(fields[: 1 + shear])
        forces = solved.trace.contact[0, i, :, 3:]
        deflection = 2.0 * solved.energy[i] / solved.normal[i]
        for k in range(1, intervals + 2):
            _, gap, normal = dense.contact(u, k)
            assert gap > -1e-7 * deflection - 1e-15
            push, rub = forces[k] @ normal, forces[k] @ [-normal[1], normal[0]]
            assert push >= 0.0
            assert abs(rub) <= mu * push + 1e-10 * solved.normal[i]
            if push > 1e-6 * solved.normal[i]:
                assert abs(gap) < 1e-6 * deflection + 1e-15
