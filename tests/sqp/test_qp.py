"""The quadratic programs: optimality conditions recomputed, degenerate and contradictory cases."""

from typing import NamedTuple

import numpy as np
import pytest
from entrance import entrance
from scipy.optimize import linprog, minimize

from fastncm.sqp import qp

cholesky, solve_qp = entrance(qp.cholesky), entrance(qp.solve_qp)


class Program(NamedTuple):
    """minimise 1/2 d^T H d + f^T d subject to A d + c >= 0."""

    hessian: np.ndarray
    linear: np.ndarray
    jacobian: np.ndarray
    constant: np.ndarray


class Answer(NamedTuple):
    """The solution d, the multipliers (K,), the working set, and what the solver said."""

    d: np.ndarray
    multipliers: np.ndarray
    working: list[int]
    status: int
    ignored: np.ndarray

    @property
    def given_up(self) -> np.ndarray:
        """(K,) bool: constraints left out because they contradict the working set."""
        inactive = np.ones(len(self.ignored), np.bool_)
        inactive[self.working] = False
        return self.ignored & inactive


def solve(program: Program, warm: tuple[int, ...] = ()) -> Answer:
    n, constraints = len(program.linear), len(program.constant)
    work = qp.make_qp_work(n)
    work.factor[:] = program.hessian
    assert cholesky(work.factor, n)
    working, ignored, d = np.zeros(n, np.int64), np.zeros(constraints, np.bool_), np.zeros(n)
    working[: len(warm)] = warm
    status, count = solve_qp(
        program.linear, program.jacobian, program.constant, working, len(warm), work, ignored, d
    )
    multipliers = np.zeros(constraints)
    multipliers[working[:count]] = work.dual[:count]
    assert len(set(working[:count])) == count
    return Answer(d, multipliers, sorted(working[:count].tolist()), status, ignored)


def check_optimality(program: Program, answer: Answer, tolerance: float = 1e-10) -> None:
    """The KKT conditions, sufficient for a strictly convex program; without what it gave up."""
    d, multipliers = answer.d, answer.multipliers
    values = program.jacobian @ d + program.constant
    gradient = program.hessian @ d + program.linear
    size = 1.0 + np.abs(gradient).max() + np.abs(multipliers).max(initial=0.0)
    np.testing.assert_allclose(
        gradient, program.jacobian.T @ multipliers, atol=tolerance * size, rtol=0.0
    )
    assert values[~answer.given_up].min(initial=0.0) >= -tolerance * (1.0 + np.abs(d).max())
    assert multipliers.min(initial=0.0) >= 0.0
    loaded = multipliers > tolerance * size
    assert np.abs(values[loaded]).max(initial=0.0) <= tolerance * (1.0 + np.abs(d).max())


def random_program(
    rng: np.random.Generator, n: int, constraints: int, slack: float = 0.0
) -> Program:
    """Feasible: all constraints hold at a random point with at most `slack` to spare."""
    root = rng.normal(size=(n, n))
    jacobian = rng.normal(size=(constraints, n))
    point = rng.normal(size=n)
    constant = slack * rng.uniform(size=constraints) - jacobian @ point
    return Program(root @ root.T + 0.1 * np.eye(n), 5.0 * rng.normal(size=n), jacobian, constant)


@pytest.mark.parametrize("n", [1, 2, 4, 9])
@pytest.mark.parametrize("constraints", [1, 3, 12])
def test_random_programs(n: int, constraints: int) -> None:
    rng = np.random.default_rng(100 * n + constraints)
    for _ in range(40):
        program = random_program(rng, n, constraints, slack=1.0)
        answer = solve(program)
        assert answer.status == qp.SOLVED
        check_optimality(program, answer)


def test_against_slsqp() -> None:
    rng = np.random.default_rng(3)
    for _ in range(10):
        program = random_program(rng, 4, 6, slack=1.0)
        expected = minimize(
            lambda d, p=program: 0.5 * d @ p.hessian @ d + p.linear @ d,
            np.zeros(4),
            jac=lambda d, p=program: p.hessian @ d + p.linear,
            constraints={
                "type": "ineq",
                "fun": lambda d, p=program: p.jacobian @ d + p.constant,
                "jac": lambda d, p=program: p.jacobian,
            },
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 200},
        )
        np.testing.assert_allclose(solve(program).d, expected.x, atol=1e-6)


def test_unconstrained_minimum_where_nothing_is_violated() -> None:
    program = random_program(np.random.default_rng(4), 3, 2)
    program = program._replace(constant=np.array([100.0, 100.0]))
    answer = solve(program)
    assert answer.working == []
    np.testing.assert_allclose(answer.d, -np.linalg.solve(program.hessian, program.linear))


@pytest.mark.parametrize("seed", range(5))
def test_warm_start_from_any_working_set(seed: int) -> None:
    """Right, wrong, too large or repeated: the answer is the same."""
    rng = np.random.default_rng(seed)
    n, constraints = 4, 8
    program = random_program(rng, n, constraints, slack=1.0)
    cold = solve(program)
    sets = [
        tuple(rng.permutation(constraints)[:size]) for size in range(1, n + 1) for _ in range(8)
    ]
    for warm in [*sets, tuple(cold.working), (0, 0, 1), (2,) * n]:
        answer = solve(program, warm)
        assert answer.status == qp.SOLVED
        check_optimality(program, answer)
        np.testing.assert_allclose(answer.d, cold.d, atol=1e-10)


def test_duplicate_constraints() -> None:
    rng = np.random.default_rng(6)
    for _ in range(40):
        once = random_program(rng, 3, 4, slack=1.0)
        twice = once._replace(
            jacobian=np.vstack([once.jacobian, once.jacobian, 2.0 * once.jacobian]),
            constant=np.concatenate([once.constant, once.constant, 2.0 * once.constant]),
        )
        answer = solve(twice)
        assert answer.status == qp.SOLVED
        check_optimality(twice, answer)
        np.testing.assert_allclose(answer.d, solve(once).d, atol=1e-10)
        check_optimality(twice, solve(twice, (0, 4, 8)))


def test_parallel_constraints() -> None:
    """The tighter one of two that differ only in the constant ends up active."""
    for loose_first in (True, False):
        constant = np.array([-1.0, -2.0] if loose_first else [-2.0, -1.0])
        program = Program(np.eye(2), np.zeros(2), np.array([[1.0, 0.0]] * 2), constant)
        answer = solve(program)
        assert answer.status == qp.SOLVED
        np.testing.assert_allclose(answer.d, [2.0, 0.0], atol=1e-14)
        assert answer.multipliers.sum() == pytest.approx(2.0)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_degenerate_vertex(n: int) -> None:
    """Many more constraints than unknowns through one point: no cycling, from any working set."""
    rng = np.random.default_rng(n)
    for _ in range(40):
        program = random_program(rng, n, 4 * n)
        # turn the normals so that there is a way out of the vertex (else rounding empties the set)
        way_out = rng.normal(size=n)
        sign = np.sign(program.jacobian @ way_out)
        program = program._replace(
            jacobian=sign[:, None] * program.jacobian, constant=sign * program.constant
        )
        answer = solve(program)
        assert answer.status == qp.SOLVED
        check_optimality(program, answer)
        warm = solve(program, tuple(rng.permutation(4 * n)[:n]))
        assert warm.status == qp.SOLVED
        np.testing.assert_allclose(warm.d, answer.d, atol=1e-8)


def test_pyramid() -> None:
    """The apex of a regular pyramid, from straight above: every face is equally violated."""
    faces = 12
    angles = 2.0 * np.pi * np.arange(faces) / faces
    jacobian = np.column_stack([np.cos(angles), np.sin(angles), np.ones(faces)])
    program = Program(np.eye(3), np.array([0.0, 0.0, 1.0]), jacobian, np.zeros(faces))
    answer = solve(program)
    assert answer.status == qp.SOLVED
    check_optimality(program, answer)
    np.testing.assert_allclose(answer.d, 0.0, atol=1e-12)


def test_nearly_dependent_constraints() -> None:
    rng = np.random.default_rng(8)
    for tilt in 10.0 ** -np.arange(3, 16):
        jacobian = np.array([[1.0, 0.0, 0.0], [1.0, tilt, 0.0], [1.0, 0.0, -tilt]])
        program = Program(np.eye(3), rng.normal(size=3), jacobian, np.array([-1.0, -1.0, -1.0]))
        answer = solve(program)
        assert answer.status == qp.SOLVED
        check_optimality(program, answer, 1e-8)


def test_contradicting_constraints_are_reported() -> None:
    """x >= 1 and x <= -1; the rest is solved without the one that came too late."""
    jacobian = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]])
    program = Program(np.eye(2), np.zeros(2), jacobian, np.array([-1.0, -1.0, -3.0]))
    answer = solve(program)
    assert answer.status == qp.INCONSISTENT
    assert answer.given_up.sum() == 1
    assert answer.given_up[:2].any()
    check_optimality(program, answer)
    assert answer.d[1] == pytest.approx(3.0)


def test_status_tells_feasible_from_infeasible() -> None:
    """Random constraints, with SciPy's linear programming as the judge."""
    rng = np.random.default_rng(9)
    seen = set()
    for _ in range(60):
        n, constraints = 3, 9
        program = random_program(rng, n, constraints)
        program = program._replace(constant=rng.normal(size=constraints) - 0.3)
        # the largest t with A d + c >= t tells how far from the limit the case is
        judge = linprog(
            [0.0] * n + [-1.0],
            A_ub=np.column_stack([-program.jacobian, np.ones(constraints)]),
            b_ub=program.constant,
            bounds=[(None, None)] * n + [(None, 1.0)],
        )
        answer = solve(program)
        assert answer.status == (qp.SOLVED if judge.x[-1] >= 0.0 else qp.INCONSISTENT)
        assert answer.given_up.any() == (answer.status == qp.INCONSISTENT)
        check_optimality(program, answer, 1e-8)
        seen.add(answer.status)
    assert seen == {qp.SOLVED, qp.INCONSISTENT}


@pytest.mark.parametrize("scale", [1e-8, 1e8])
def test_scaled_constraints(scale: float) -> None:
    rng = np.random.default_rng(10)
    for _ in range(20):
        program = random_program(rng, 4, 6, slack=1.0)
        scaled = program._replace(
            jacobian=scale * program.jacobian, constant=scale * program.constant
        )
        np.testing.assert_allclose(solve(scaled).d, solve(program).d, atol=1e-9)


def test_cholesky_refuses_an_indefinite_matrix() -> None:
    assert not cholesky(np.array([[1.0, 2.0], [2.0, 1.0]]), 2)
    assert not cholesky(np.zeros((2, 2)), 2)
    assert not cholesky(np.array([[1.0, np.nan], [np.nan, 1.0]]), 2)
    factor = np.array([[4.0, 9.0], [2.0, 5.0]])
    assert cholesky(factor, 2)
    np.testing.assert_allclose(np.tril(factor), [[2.0, 0.0], [1.0, 2.0]])
