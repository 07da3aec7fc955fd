"""A dual active-set method for strictly convex quadratic programs (Goldfarb & Idnani 1983).

    minimise  1/2 d^T H d + f^T d    subject to    A d + c >= 0

It starts at the unconstrained minimum, so it needs no feasible point; it adds the most violated
constraint until none is left, and finds out on the way when constraints contradict each other. From
one SQP iteration to the next the active set hardly changes: it is handed over and only repaired.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import inner

#: Results of `solve_qp`.
SOLVED, INCONSISTENT, CYCLING = 0, 1, 2

#: A constraint whose gradient keeps less than this fraction of its H^-1-norm outside the span of
#: the working set counts as linearly dependent on it.
DEPENDENT = 1e-12
#: Violations below this fraction of the size of the constraint's terms are rounding.
ROUNDING = 1e-14


class QpWork(NamedTuple):
    """Workspace for n unknowns and K constraints; contents mean nothing between calls.

    factor: (n, n) Cholesky factor of H; columns: (n, n) H^-1 a_j of the working set; schur: (n, n)
    and its factor; rhs, direction: (n,); dual: (n + 1,) multipliers of the working set, in its
    order.
    """

    factor: np.ndarray
    columns: np.ndarray
    schur: np.ndarray
    rhs: np.ndarray
    direction: np.ndarray
    dual: np.ndarray


def make_qp_work(n: int) -> QpWork:
    """A workspace for `n` unknowns."""
    return QpWork(
        np.zeros((n, n)),
        np.zeros((n, n)),
        np.zeros((n, n)),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n + 1),
    )


@inner
def cholesky(a, n):
    """Overwrite the lower triangle of the leading n x n block of `a` by its factor; False if
    indefinite."""
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(a[i, i]))
    for j in range(n):
        for i in range(j, n):
            total = a[i, j]
            for k in range(j):
                total -= a[i, k] * a[j, k]
            if i == j:
                if not total > 1e-15 * largest:
                    return False
                a[j, j] = np.sqrt(total)
            else:
                a[i, j] = total / a[j, j]
    return True


@inner
def back_solve(factor, n, x):
    """Solve with the factor of `cholesky`, in place in `x` (n,)."""
    for i in range(n):
        for k in range(i):
            x[i] -= factor[i, k] * x[k]
        x[i] /= factor[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= factor[k, i] * x[k]
        x[i] /= factor[i, i]


@inner
def _dot(a, b):
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@inner
def _column(jacobian, j, work, position):
    """Write H^-1 a_j into column `position` of the workspace."""
    n = work.rhs.shape[0]
    for i in range(n):
        work.rhs[i] = jacobian[j, i]
    back_solve(work.factor, n, work.rhs)
    for i in range(n):
        work.columns[position, i] = work.rhs[i]


@inner
def factor_schur(jacobian, working, count, work):
    """Factor the Schur complement A_W H^-1 A_W^T of the first `count` working constraints."""
    for i in range(count):
        for k in range(i + 1):
            work.schur[i, k] = _dot(jacobian[working[i]], work.columns[k])
    return cholesky(work.schur, count)


@inner
def _drop(working, count, work, position):
    """Take the constraint at `position` out of the working set."""
    for i in range(position, count - 1):
        working[i] = working[i + 1]
        work.dual[i] = work.dual[i + 1]
        for k in range(work.rhs.shape[0]):
            work.columns[i, k] = work.columns[i + 1, k]
    return count - 1


@inner
def _start(linear, jacobian, constant, working, count, work, d):
    """Minimum on the handed-over working set, without those whose multiplier comes out negative.

    Constraints that depend linearly on the ones before are dropped too. Returns the new count; `d`
    and `work.dual` are overwritten.
    """
    n = d.shape[0]
    kept = 0
    for i in range(count):
        working[kept] = working[i]
        _column(jacobian, working[kept], work, kept)
        if kept < n and factor_schur(jacobian, working, kept + 1, work):
            kept += 1
    count = kept
    while True:
        for i in range(n):
            d[i] = -linear[i]
        back_solve(work.factor, n, d)
        if count == 0:
            return 0
        factor_schur(jacobian, working, count, work)
        for i in range(count):
            work.dual[i] = -(constant[working[i]] + _dot(jacobian[working[i]], d))
        back_solve(work.schur, count, work.dual)
        worst, at = 0.0, -1
        for i in range(count):
            if work.dual[i] < worst:
                worst, at = work.dual[i], i
        if at < 0:
            for i in range(count):
                for k in range(n):
                    d[k] += work.dual[i] * work.columns[i, k]
            return count
        count = _drop(working, count, work, at)


@inner
def _most_violated(jacobian, constant, ignored, d):
    """The constraint that is violated most beyond rounding, or -1."""
    worst, at = 0.0, -1
    for j in range(constant.shape[0]):
        if ignored[j]:
            continue
        value, size = constant[j], abs(constant[j])
        for i in range(d.shape[0]):
            term = jacobian[j, i] * d[i]
            value += term
            size += abs(term)
        if value < -ROUNDING * size and value < worst:
            worst, at = value, j
    return at


@inner
def _enter(jacobian, constant, working, count, entering, work, d):
    """Move along the dual until `entering` holds, dropping what blocks. Returns the count, or -1
    where the constraint contradicts the working set (which the caller then solves again without
    it)."""
    n = d.shape[0]
    gradient = jacobian[entering]
    multiplier = 0.0
    while True:
        # direction in the dual (rhs) and in the primal (direction)
        factor_schur(jacobian, working, count, work)
        for i in range(n):
            work.direction[i] = gradient[i]
        back_solve(work.factor, n, work.direction)
        whole = _dot(gradient, work.direction)
        for i in range(count):
            work.rhs[i] = _dot(jacobian[working[i]], work.direction)
        back_solve(work.schur, count, work.rhs)
        for i in range(count):
            for k in range(n):
                work.direction[k] -= work.rhs[i] * work.columns[i, k]
        # longest step that keeps the multipliers non-negative, and the step that reaches the
        # constraint
        dual_step, blocking = np.inf, -1
        for i in range(count):
            if work.rhs[i] > 0.0 and work.dual[i] / work.rhs[i] < dual_step:
                dual_step, blocking = work.dual[i] / work.rhs[i], i
        slope = _dot(gradient, work.direction)
        independent = slope > DEPENDENT * whole and count < n
        primal_step = np.inf
        if independent:
            primal_step = -(constant[entering] + _dot(gradient, d)) / slope
        step = min(dual_step, primal_step)
        if step == np.inf:
            return -1
        for i in range(count):
            work.dual[i] = max(0.0, work.dual[i] - step * work.rhs[i])
        multiplier += step
        if independent:
            for k in range(n):
                d[k] += step * work.direction[k]
        if primal_step <= dual_step:
            working[count] = entering
            work.dual[count] = multiplier
            _column(jacobian, entering, work, count)
            return count + 1
        count = _drop(working, count, work, blocking)


@inner
def solve_qp(linear, jacobian, constant, working, count, work, ignored, d):
    """Solve the program whose factored Hessian is in ``work.factor``.

    linear: (n,) f; jacobian: (K, n) A; constant: (K,) c; working: (n,) the active constraints, the
    first `count` of them handed over, changed in place; ignored: (K,) bool, overwritten:
    constraints that contradict the others; d: (n,), overwritten by the solution. Multipliers are
    left in ``work.dual``, in the order of `working`. Returns ``(status, count)``.
    """
    for j in range(ignored.shape[0]):
        ignored[j] = False
    count = _start(linear, jacobian, constant, working, count, work, d)
    status = SOLVED
    # Every round ends with a larger dual value, so none can come back, except by rounding: the
    # guard.
    for _ in range(10 * (constant.shape[0] + d.shape[0])):
        entering = _most_violated(jacobian, constant, ignored, d)
        if entering < 0:
            return status, count
        for i in range(count):
            if working[i] == entering:  # active and still "violated": rounding on a dependent set
                ignored[entering] = True
        if ignored[entering]:
            continue
        entered = _enter(jacobian, constant, working, count, entering, work, d)
        if entered < 0:
            ignored[entering] = True
            status = INCONSISTENT
            count = _start(linear, jacobian, constant, working, count, work, d)
        else:
            count = entered
    return CYCLING, count
