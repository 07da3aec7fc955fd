"""The nodal finger against plain NumPy: positions, sides, gaps, energy, carried forces."""

import numpy as np
import pytest
from dense import Dense, differences, section
from surfaces import interpreted, lowered_surface

from fastncm.kernels.nodal import (
    FAR,
    Nodal,
    NodalProblem,
    carry_forces,
    contact_direction,
    make_nodal,
    next_contact,
    place_axis,
    place_surface,
)

pytestmark = interpreted
N = 8
PLACE = (0.55, -0.42, 0.3)
SQUARE = [[-0.1, -0.06], [0.1, -0.06], [0.1, 0.06], [-0.1, 0.06]]
POINTS = {"solver.contact": "points-on-target", "solver.points": 24}
VARIANTS = {
    "right": {},
    "left": {"finger.side": "left"},
    "axis": {"model.surface": "axis"},
    "no shear": {"model.shear": False},
    "points of the target": POINTS,
    "points, left": POINTS | {"finger.side": "left"},
    "polygon's corners": {"target.shape": "polygon", "target.vertices": SQUARE},
}


def bent(changes: dict, seed: int = 1, place=PLACE) -> tuple[NodalProblem, Nodal]:
    """A finger of N intervals with random angles, evaluated."""
    problem = lowered_surface({"solver.intervals": N} | changes).problem
    state, rng = make_nodal(problem), np.random.default_rng(seed)
    state.psi[1:] = np.cumsum(rng.normal(0.03, 0.05, N))
    if problem.shear_flexibility.max() > 0.0:
        state.gamma[1:] = rng.normal(0.0, 0.03, N)
    place_axis(problem, state, N)
    place_surface(problem, 0, *place, state, np.inf)
    return problem, state


@pytest.mark.parametrize("changes", VARIANTS.values(), ids=VARIANTS)
def test_nodes_and_gaps(changes: dict) -> None:
    left = changes.get("finger.side") == "left"
    place = (PLACE[0], -PLACE[1], PLACE[2]) if left else PLACE
    problem, state = bent(changes, place=place)
    dense = Dense(problem, state, place)
    u = dense.unknowns()
    nodes = dense.nodes(u)
    np.testing.assert_allclose(np.column_stack([state.x, state.y]), nodes, atol=1e-15)
    compared = 0
    for k in range(len(state.gap)):
        if state.gap[k] == FAR:
            continue
        point, gap, normal = dense.contact(u, k)
        np.testing.assert_allclose([state.px[k], state.py[k]], point, atol=1e-15)
        assert state.gap[k] == pytest.approx(gap, abs=1e-14)
        np.testing.assert_allclose([state.nx[k], state.ny[k]], normal, atol=1e-13)
        compared += 1
    assert compared >= 5


def test_the_side_that_touches() -> None:
    """Half a thickness to the right of the axis, from clamp to tip; 30 to 17 mm."""
    problem, state = bent({})
    length = 0.1524
    for j in range(N + 1):
        _, left = section(state.psi[j])
        half = 0.5 * (0.030 + (0.017 - 0.030) * j / N) / length
        expected = np.array([state.x[j], state.y[j]]) - half * left
        np.testing.assert_allclose([state.px[j], state.py[j]], expected, atol=1e-15)
    other = np.array([state.x[N], state.y[N]]) + half * left
    np.testing.assert_allclose([state.px[N + 1], state.py[N + 1]], other, atol=1e-15)


def test_beyond_the_last_node_that_takes_part_the_finger_is_straight() -> None:
    problem, state = bent({})
    place_axis(problem, state, 5)
    assert (state.psi[5:] == state.psi[5]).all()
    assert (state.gamma[6:] == 0.0).all()
    direction = section(state.psi[5])[0] / N
    for j in range(6, N + 1):
        step = [state.x[j] - state.x[j - 1], state.y[j] - state.y[j - 1]]
        np.testing.assert_allclose(step, direction, atol=1e-15)


@pytest.mark.parametrize("changes", VARIANTS.values(), ids=VARIANTS)
def test_gradient_of_the_gaps(changes: dict) -> None:
    """The gap's change is the normal times the contact's move with its section."""
    problem, state = bent(changes)
    dense = Dense(problem, state, PLACE)
    u = dense.unknowns()
    for k in range(1, len(state.gap)):
        j = int(state.node[k])
        point, _, normal = dense.contact(u, k)
        if state.gap[k] == FAR or j == 0:
            continue
        # what scales the height over the side is held fixed
        steep = np.hypot(1.0, dense.steepness(u, k))
        expected = differences(
            lambda v, k=k: np.array(dense.contact(v, k)[1] * np.hypot(1.0, dense.steepness(v, k))),
            u,
        )
        arm = point - [state.x[j], state.y[j]]
        lever = arm[0] * normal[1] - arm[1] * normal[0]
        ours = normal @ dense.move(u, j) + lever * dense.turn(j)
        # of a target's point also by the side's slope and bend beside it
        around = [j - 1, j] if j < N else [j - 1]
        for i in around if dense.shears else []:
            ours[i] += state.deepens[k, 1]  # by psi_j - psi_{j-1}
            if i > 0:
                ours[i - 1] -= state.deepens[k, 1]
            ours[N + i] += state.deepens[k, 0] / len(around)
        np.testing.assert_allclose(ours, expected / steep, atol=1e-9)


def test_a_far_point_keeps_a_lower_bound_of_its_gap() -> None:
    """Points that are certainly beyond the margin are not looked at again; the bound holds."""
    problem, state = bent({}, place=(0.5, -0.9, 0.3))
    state.psi[1:] += 0.01 * np.arange(1, N + 1)
    place_axis(problem, state, N)
    place_surface(problem, 0, 0.52, -0.88, 0.35, state, 0.01)
    _, exact = bent({}, place=(0.52, -0.88, 0.35))
    exact.psi[:] = state.psi
    place_axis(problem, exact, N)
    exact.seen[:] = -np.inf
    place_surface(problem, 0, 0.52, -0.88, 0.35, exact, np.inf)
    assert (state.gap < exact.gap).any()
    assert (state.gap <= exact.gap + 1e-15).all()
    assert (state.gap > 0.01).all()


@pytest.mark.parametrize("changes", VARIANTS.values(), ids=VARIANTS)
def test_carried_forces_and_moments(changes: dict) -> None:
    problem, state = bent(changes)
    problem = problem._replace(mu=np.array([0.4]))
    rng = np.random.default_rng(3)
    far = state.gap == FAR
    state.force[:] = np.where(far | (state.node == 0), 0.0, rng.uniform(0.0, 2.0, len(state.force)))
    state.along[:] = rng.choice([-1.0, 1.0], len(state.along))
    at_clamp = carry_forces(problem, 0, state, N)
    pushes = np.zeros((len(state.force), 2))
    for k in np.flatnonzero(state.force):
        n = np.array([state.nx[k], state.ny[k]])
        pushes[k] = state.force[k] * (n + 0.4 * state.along[k] * np.array([-n[1], n[0]]))
        np.testing.assert_allclose(contact_direction(state, k, 0.4), pushes[k] / state.force[k])
    nodes = np.column_stack([state.x, state.y])
    for i in range(1, N + 1):
        beyond = state.node >= i
        np.testing.assert_allclose(
            [state.fx[i], state.fy[i]], pushes[beyond].sum(axis=0), atol=1e-13
        )
        middle = 0.5 * (nodes[i - 1] + nodes[i])
        arm = np.column_stack([state.px, state.py])[beyond] - middle
        moment = (arm[:, 0] * pushes[beyond, 1] - arm[:, 1] * pushes[beyond, 0]).sum()
        assert state.moment[i] == pytest.approx(moment, abs=1e-13)
    moment = (state.px * pushes[:, 1] - state.py * pushes[:, 0]).sum()
    assert at_clamp == pytest.approx(moment, abs=1e-13)


def test_every_contact_point_is_met_once() -> None:
    _, state = bent(POINTS)
    met = []
    for j in range(N + 1):
        k = next_contact(state, -1, j)
        while k >= 0:
            assert state.node[k] == j
            met.append(k)
            k = next_contact(state, k, j)
    assert sorted(met) == list(range(len(state.gap)))


def test_what_lies_behind_the_side_does_not_touch_it() -> None:
    """A target below touches the right side, and none of the left side's nodes but the tip's."""
    touching = []
    for side in ("right", "left"):
        problem, state = bent({"finger.side": side})
        inner = slice(1, len(problem.step))
        touching.append(np.hypot(state.nx[inner], state.ny[inner]) > 0.5)
    assert touching[0].all()
    assert not touching[1].any()


def test_nodes_beside_a_corner_leave_it_to_the_corner() -> None:
    """A needle's point just in the side, next to a node: both its edges are nearer to the node than
    any that could hold the side; the depth of the node stays known."""
    needle = {
        "target.shape": "polygon",
        "target.vertices": [[0.0, 0.0], [-0.01, -0.3], [0.01, -0.3]],
    }
    problem = lowered_surface({"solver.intervals": N} | needle).problem
    state = make_nodal(problem)
    place_axis(problem, state, N)
    k, tip = 5, N
    place_surface(problem, 0, 0.0, -10.0, 0.0, state, np.inf)
    x, y = state.px[k], state.py[k]
    place_surface(problem, 0, x + 0.1 / N, y + 0.02, 0.0, state, np.inf)
    corner = tip + 2 + int(np.argmax(problem.points[0, :, 1]))
    assert state.gap[corner] == pytest.approx(-0.02, rel=0.1)
    assert state.gap[k] == max(state.seen[k], 0.0)
    assert state.nx[k] == state.ny[k] == 0.0
    place_surface(problem, 0, x + 0.1 / N, y + 3.0 / N, 0.0, state, np.inf)  # far past the node
    assert np.hypot(state.nx[k], state.ny[k]) == pytest.approx(1.0)


@pytest.mark.parametrize("tilt", [-0.5, 0.0, 0.2, 0.9])
def test_the_arc_of_a_needle_s_end_touches_not_its_points(tilt: float) -> None:
    """Over a straight side without taper the least gap is that of the needle's outline itself."""
    a, b = 0.002, 0.05
    needle = {"target.semi_axes": [a, b], "finger.thickness": 0.01, "solver.intervals": N}
    problem = lowered_surface(needle).problem
    state = make_nodal(problem)
    place_axis(problem, state, N)
    t = np.linspace(0.0, 2.0 * np.pi, 400_001)
    axes = problem.vertices[0, 0]
    outline = axes * np.column_stack([np.cos(t), np.sin(t)])
    highest = (np.sin(tilt) * outline[:, 0] + np.cos(tilt) * outline[:, 1]).max()
    place_surface(problem, 0, 0.55, -0.5, tilt, state, np.inf)
    gap = state.gap[N + 2 :].min()
    assert gap == pytest.approx(0.5 + problem.offset[0, 1] - highest, abs=1e-9)
