"""The quadratic program of direct contact against SciPy's non-negative least squares.

Without forces yet the program is strictly convex, and its dual in the multipliers is
``min 1/2 lambda^T M lambda + b^T lambda, lambda >= 0`` with ``M = A H^-1 A^T``. Points of a target
that touch a finger with shear have gaps that depend on more than what their forces work on: there M
is ``A H^-1 B^T``, and the answer is a complementary one.
"""

import numpy as np
import pytest
from dense import Dense
from scipy.optimize import nnls
from surfaces import interpreted, lowered_surface

from fastncm.kernels.nodal import FAR, carry_forces, make_nodal, place_axis, place_surface
from fastncm.sqp.flexibility import make_chain
from fastncm.sqp.interior import separate
from fastncm.sqp.subproblem import UNSETTLED, solve_subproblem

pytestmark = interpreted
SQUARE = [[-0.1, -0.06], [0.1, -0.06], [0.1, 0.06], [-0.1, 0.06]]
CLEAR = 0.6
"""Without shear nothing clears a target that lies over the clamp: this much farther away."""
POINTS = {"solver.contact": "points-on-target", "solver.points": 16, "model.shear": True}
FINGERS = {
    "ellipse": {},
    "left": {"finger.side": "left"},
    "no shear": {"model.shear": False},
    "thin, no shear": {"model.shear": False, "finger.thickness": 0.002},
    "as printed": {"model.section": "psi+gamma"},
    "square": {"target.shape": "polygon", "target.vertices": SQUARE},
    "points": POINTS,
}


class Program:
    """A randomly bent finger that overlaps the target, without forces."""

    def __init__(self, changes: dict, intervals: int, seed: int) -> None:
        self.problem = lowered_surface({"solver.intervals": intervals} | changes).problem
        rng = np.random.default_rng(seed)
        side = 1.0 if self.problem.left else -1.0
        beyond = 0.0 if self.problem.shear_flexibility.any() else CLEAR
        place = (
            beyond + rng.uniform(0.3, 0.8),
            side * rng.uniform(0.3, 0.5),
            rng.uniform(-0.5, 0.5),
        )
        self.state = make_nodal(self.problem)
        self.state.psi[1:] = np.cumsum(rng.normal(0.0, 0.4 / intervals, intervals))
        shears = self.problem.shear_flexibility[0] > 0.0
        self.state.gamma[1:] = np.where(shears, rng.normal(0.0, 0.02, intervals), 0.0)
        place_axis(self.problem, self.state, intervals)
        place_surface(self.problem, 0, *place, self.state, np.inf)
        carry_forces(self.problem, 0, self.state, intervals)
        self.chain, self.size = make_chain(self.problem), intervals
        dense = Dense(self.problem, self.state, place)
        u = dense.unknowns()
        count = len(self.state.gap)
        over = (self.state.gap < FAR) & (self.state.node > 0)
        over[1 : intervals + 2] = True  # all nodes, and of the target's points those over it
        self.points = np.flatnonzero(over)
        no_forces = np.zeros(count)
        hessian = dense.hessian(u, no_forces, no_forces)
        slopes = np.array([dense.gap_slope(u, k) for k in self.points]).reshape(-1, len(u))
        loads = np.array([dense.direction(u, k, 0.0) for k in self.points]).reshape(-1, len(u))
        gradient = dense.energy_slope(u)
        self.matrix = slopes @ np.linalg.solve(hessian, loads.T)
        self.right = self.state.gap[self.points] - slopes @ np.linalg.solve(hessian, gradient)

    def expected(self) -> np.ndarray:
        """Multipliers of the points (P,)."""
        factor = np.linalg.cholesky(self.matrix)  # M = factor factor^T
        answer, _ = nnls(factor.T, -np.linalg.solve(factor, self.right), maxiter=10_000)
        return np.asarray(answer)

    def solve(self, touching: np.ndarray) -> tuple[np.ndarray, int]:
        self.chain.touching[:] = False
        self.chain.touching[self.points[touching]] = True
        self.chain.force[:] = 0.0
        excess, passes = solve_subproblem(self.problem, 0, self.state, self.chain, self.size)
        assert excess != UNSETTLED
        assert excess == 0
        return self.chain.force[self.points].copy(), passes


def check_conditions(program: Program, forces: np.ndarray) -> None:
    """Neither penetration nor pull, one of gap and force is 0: where M is symmetric, a minimum."""
    gaps = program.matrix @ forces + program.right
    assert gaps.min() > -1e-8
    assert forces.min() >= -1e-12 * max(forces.max(), 1.0)
    assert np.abs(gaps * forces).max() < 1e-7 * max(forces.max(), 1.0)


def is_unique(program: Program) -> bool:
    """Whether there are no more contact points than degrees of freedom."""
    problem = program.problem
    return problem.points.shape[1] == 0 and problem.shear_flexibility.max() > 0.0


@pytest.mark.parametrize("changes", FINGERS.values(), ids=FINGERS)
@pytest.mark.parametrize("seed", range(6))
def test_multipliers(changes: dict, seed: int) -> None:
    program = Program(changes, 14, seed)
    forces, _ = program.solve(np.zeros(len(program.points), bool))
    if is_unique(program):
        expected = program.expected()
        np.testing.assert_allclose(forces, expected, atol=1e-6 * expected.max(initial=1e-3))
    check_conditions(program, forces)


@pytest.mark.parametrize("seed", range(4))
def test_any_working_set_to_begin_with_leads_there(seed: int) -> None:
    program = Program({}, 40, seed)
    cold, _ = program.solve(np.zeros(len(program.points), bool))
    rng = np.random.default_rng(seed)
    for share in (0.1, 0.3):
        warm, _ = program.solve(rng.uniform(size=len(cold)) < share)
        np.testing.assert_allclose(warm, cold, atol=1e-8 * max(cold.max(), 1.0))
    again, passes = program.solve(cold > 0.0)
    assert passes == 1
    np.testing.assert_allclose(again, cold, atol=1e-10 * max(cold.max(), 1.0))


@pytest.mark.parametrize("changes", FINGERS.values(), ids=FINGERS)
@pytest.mark.parametrize("seed", range(4))
def test_interior_points_find_the_contacts(changes: dict, seed: int) -> None:
    program = Program(changes, 14, seed)
    chain = program.chain
    found, passes = separate(program.problem, 0, program.state, chain, program.size)
    assert found
    assert passes < 40
    assert not chain.soft.any()
    assert not chain.shift.any()
    touching = chain.touching[program.points].copy()
    if is_unique(program):
        np.testing.assert_array_equal(touching, program.expected() > 0.0)
    forces, passes = program.solve(touching)
    assert passes <= 3
    check_conditions(program, forces)


@pytest.mark.parametrize("changes", [{}, {"model.shear": False}], ids=["shear", "no shear"])
def test_passes_hardly_grow_with_the_number_of_intervals(changes: dict) -> None:
    """Twenty times the nodes, some ten times the contacts: a few passes more."""
    passes = []
    for intervals in (20, 400):
        counts = []
        for seed in range(3):
            program = lowered_surface(changes | {"solver.intervals": intervals}).problem
            state, chain = make_nodal(program), make_chain(program)
            place_axis(program, state, intervals)
            place = (0.3 + 0.1 * seed + CLEAR * (changes != {}), -0.45, 0.2)
            place_surface(program, 0, *place, state, np.inf)
            excess, count = solve_subproblem(program, 0, state, chain, intervals)
            assert excess == 0
            counts.append(count)
        passes.append(np.mean(counts))
    assert passes[1] < passes[0] + 12.0
