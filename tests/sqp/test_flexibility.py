"""The O(N) step against the dense KKT matrix, whose Hessian comes from finite differences."""

import numpy as np
import pytest
from dense import Dense
from surfaces import interpreted, lowered_surface

from fastncm.kernels.nodal import (
    FAR,
    Nodal,
    carry_forces,
    friction_ratio,
    make_nodal,
    place_axis,
    place_surface,
)
from fastncm.sqp.chain_step import solve_chain
from fastncm.sqp.flexibility import Chain, make_chain

pytestmark = interpreted
N = 9
PLACE = (0.55, -0.42, 0.3)
SQUARE = [[-0.06, -0.06], [0.06, -0.06], [0.06, 0.06], [-0.06, 0.06]]
POINTS = {"solver.contact": "points-on-target", "solver.points": 24}
PLANE = {
    "target.shape": "half-plane",
    "path.kind": "translation",
    "path.start": 0.06,
    "path.stop": 0.02,
}
FINGERS = {
    "right": {},
    "left": {"finger.side": "left"},
    "axis": {"model.surface": "axis"},
    "no shear": {"model.shear": False},
    "plane": PLANE,
    "as printed": {"model.section": "psi+gamma"},
    "as printed, left": {"model.section": "psi+gamma", "finger.side": "left"},
    "points of the target": POINTS,
    "points, left": POINTS | {"finger.side": "left"},
    "points, as printed": POINTS | {"model.section": "psi+gamma"},
    "points, left, no shear": POINTS | {"finger.side": "left", "model.shear": False},
    "polygon's corners": {"target.shape": "polygon", "target.vertices": SQUARE},
}
#: Fingers whose matrix is symmetric, and so has an inertia.
COUNTED = ("right", "left", "axis", "no shear", "plane", "as printed", "as printed, left")
#: Contact points that touch: single, neighbours, gaps between, the tip's two corners.
SETS = {"one": (5,), "run": (4, 5, 6), "tip": (2, N), "corners": (2, N, N + 1), "none": ()}


def cases(fingers: dict, sets: dict) -> pytest.MarkDecorator:
    """All pairs, but the tip's corners where they are one: without a thickness."""
    pairs = [
        pytest.param(changes, touching, id=f"{finger}, {which}")
        for finger, changes in fingers.items()
        for which, touching in sets.items()
        if (finger, which) != ("axis", "corners")
    ]
    return pytest.mark.parametrize(("changes", "touching"), pairs)


class Step:
    """A bent finger with forces on some contacts, and the step that the package takes."""

    def __init__(
        self, changes: dict, touching=(), stuck=(), mu=0.0, load=1.0, size=N, seed=0
    ) -> None:
        problem = lowered_surface({"solver.intervals": N} | changes, mu=mu).problem
        self.problem, self.size, self.mu = problem, size, mu
        self.state: Nodal = make_nodal(problem)
        state, rng = self.state, np.random.default_rng(seed)
        state.psi[1 : size + 1] = np.cumsum(rng.normal(0.03, 0.05, size))
        if problem.shear_flexibility.max() > 0.0:
            state.gamma[1 : size + 1] = rng.normal(0.0, 0.03, size)
        place_axis(problem, state, size)
        x, y, angle = PLACE
        place = (x, -y if problem.left else y, angle)  # on the side that touches
        place_surface(problem, 0, *place, state, np.inf)
        touches = (state.gap < FAR) & ((state.nx != 0.0) | (state.ny != 0.0))
        near = np.flatnonzero(touches & (state.node > 0) & (state.node <= size))
        touching, stuck = np.array(touching, int), np.array(stuck, int)
        if problem.points.shape[1] > 0:  # of the target's points only few lie over the finger
            over = near[near > N + 1]
            _, one_each = np.unique(state.node[over], return_index=True)
            over = over[one_each]
            touching, stuck = over[touching % len(over)], over[stuck % len(over)]
        self.touching = np.unique(touching)
        state.along[:] = rng.choice([-1.0, 1.0], len(state.along))
        state.force[near] = load * rng.uniform(0.2, 1.5, len(near)) * rng.choice([0, 1], len(near))
        state.force[self.touching] = load * rng.uniform(0.2, 1.5, len(self.touching))
        state.stuck[stuck] = True
        state.shear[stuck] = rng.uniform(-0.5, 0.5, len(stuck))
        state.slide[stuck] = rng.normal(0.0, 0.01, len(stuck))
        carry_forces(problem, 0, state, size)
        self.chain: Chain = make_chain(problem)
        self.chain.touching[self.touching] = True
        self.dense = Dense(problem, state, place)

    def take(self, own: float = 1.0) -> int:
        return solve_chain(self.problem, 0, self.state, self.chain, self.size, own)

    @property
    def ratios(self) -> np.ndarray:
        """Friction over normal force (K,)."""
        count = len(self.state.force)
        return np.array([friction_ratio(self.state, k, self.mu) for k in range(count)])

    def system(self, own: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Matrix and right-hand side for (du, -lambda, -shear of what sticks).

        own 0: the answer to a target that comes nearer by 1 at all contacts.
        """
        dense, state = self.dense, self.state
        u = dense.unknowns()
        held = [k for k in self.touching if state.stuck[k]]
        rows = [dense.gap_slope(u, k) for k in self.touching]
        rows += [dense.tangent(u, k) for k in held]
        columns = [
            dense.direction(u, k, 0.0 if state.stuck[k] else self.ratios[k]) for k in self.touching
        ]
        columns += [dense.tangent(u, k) for k in held]
        m = len(rows)
        a, b = np.reshape(rows, (m, len(u))), np.reshape(columns, (m, len(u)))
        matrix = np.block(
            [[dense.hessian(u, state.force, self.ratios), b.T], [a, np.zeros((m, m))]]
        )
        gaps = state.gap[self.touching] if own else np.full(len(self.touching), -1.0)
        slides = own * state.slide[held]
        return matrix, -np.concatenate([own * dense.energy_slope(u), gaps, slides])

    def check(self, own: float = 1.0) -> None:
        """The step solves the dense system."""
        self.take(own)
        matrix, right = self.system(own)
        answer = np.linalg.solve(matrix, right)
        n, dense, chain = N, self.dense, self.chain
        unknowns = len(dense.unknowns())
        tolerance = 1e-7 * np.abs(answer[:unknowns]).max()
        np.testing.assert_allclose(chain.dpsi[1:], answer[:n], atol=tolerance)
        if dense.shears:
            np.testing.assert_allclose(chain.dgamma[1:], answer[n:unknowns], atol=tolerance)
        forces = -answer[unknowns:]
        tolerance = 1e-7 * np.abs(forces).max(initial=1e-6)
        count = len(self.touching)
        np.testing.assert_allclose(chain.force[self.touching], forces[:count], atol=tolerance)
        held = [k for k in self.touching if self.state.stuck[k]]
        np.testing.assert_allclose(chain.shear[held], forces[count:], atol=tolerance)
        assert (np.delete(chain.force, self.touching) == 0.0).all()


@cases(FINGERS, SETS)
def test_step_and_forces(changes: dict, touching: tuple[int, ...]) -> None:
    Step(changes, touching).check()


@cases(FINGERS, SETS)
def test_step_with_friction(changes: dict, touching: tuple[int, ...]) -> None:
    """The force's direction is not the gap's gradient: the matrix is not symmetric."""
    Step(changes, touching, mu=0.6).check()


@pytest.mark.parametrize("changes", FINGERS.values(), ids=FINGERS)
@pytest.mark.parametrize("stuck", [(4,), (5,)])
def test_step_with_sticking_contacts(changes: dict, stuck: tuple[int, ...]) -> None:
    Step(changes, (4, 5, 6), stuck=stuck, mu=0.6).check()


@pytest.mark.parametrize("mu", [0.0, 0.5])
@pytest.mark.parametrize("changes", FINGERS.values(), ids=FINGERS)
def test_answer_to_a_target_that_comes_nearer(changes: dict, mu: float) -> None:
    Step(changes, (4, 5, 6), mu=mu).check(own=0.0)


@pytest.mark.parametrize("load", [0.01, 20.0, 200.0])
@cases({name: FINGERS[name] for name in COUNTED}, SETS)
def test_negative_pivots_are_negative_eigenvalues(changes, touching, load) -> None:
    """The excess is 0 where the step leads to a minimum: m of m + U eigenvalues negative."""
    for seed in range(2):
        step = Step(changes, touching, load=load, seed=seed)
        excess = step.take()
        negative = int((np.linalg.eigvalsh(step.system()[0]) < 0.0).sum())
        assert excess == negative - len(step.touching)
        assert load != 0.01 or excess == 0


def test_a_large_load_leaves_no_minimum() -> None:
    assert Step({}, SETS["one"], load=200.0).take() > 0


@pytest.mark.parametrize("changes", [{}, {"finger.side": "left"}, PLANE])
def test_gaps_after_the_step(changes: dict) -> None:
    step = Step(changes, (3, 6))
    step.take()
    u = step.dense.unknowns()
    du = np.concatenate([step.chain.dpsi[1:], step.chain.dgamma[1:]])
    for k in range(1, len(step.state.gap)):
        expected = step.state.gap[k] + step.dense.gap_slope(u, k) @ du
        assert step.chain.gap[k] == pytest.approx(expected, abs=1e-12)
    np.testing.assert_allclose(step.chain.gap[[3, 6]], 0.0, atol=1e-14)


def test_what_lies_beyond_takes_no_part() -> None:
    """With the finger straight beyond node 6, the step is that of the whole finger."""
    whole, part = Step({}, (3, 5), load=1.0, size=6), Step({}, (3, 5), load=1.0, size=6)
    whole.size = N
    carry_forces(whole.problem, 0, whole.state, N)
    whole.take()
    part.take()
    np.testing.assert_allclose(part.chain.dpsi[:7], whole.chain.dpsi[:7], atol=1e-14)
    np.testing.assert_allclose(whole.chain.dpsi[7:], whole.chain.dpsi[6], atol=1e-14)
    np.testing.assert_allclose(part.chain.force, whole.chain.force, atol=1e-12)
