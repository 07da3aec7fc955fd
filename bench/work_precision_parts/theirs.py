"""The rivals over their tolerances and discretisations: errors and CPU time, failures kept."""

import importlib.util
import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import pandas as pd
from support import rivals, rivals_continuum
from support.rivals_bvp import BvpRival
from support.rivals_paper import PaperRival
from support.rivals_root import RootRival
from support.rivals_scipy import SciPyRival
from support.rivals_surface import SurfaceRival
from support.rivals_surface_root import SurfaceRoot

import fastncm
from fastncm.scene import Pose
from work_precision_parts import closed_form
from work_precision_parts.ours import BUDGET, best_time, row
from work_precision_parts.problems import Problem, continuum, surface_starts

Row = dict[str, object]

CASADI = importlib.util.find_spec("casadi") is not None
ORDERS = (4, 6)
"""Their truncation errors are about 5e-8 and 2e-12 (bench/convergence.py)."""
SLSQP_FTOL = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13, 1e-15)
TRUST_TOL = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14)
IPOPT_TOL = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13)
ROOT_TOL = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
BVP_TOL = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
PAPER_ORDERS = (4, 6, 8)
PAPER_POINTS = {"snapfit-circle": 50, "snapfit-corner": 20}
PAPER_MORE_POINTS = (20, 80, 320)
PAPER_TOL = (1e-4, 1e-6, 1e-8)
SURFACE_INTERVALS = {
    "SLSQP": (12, 24, 45, 90, 180),
    "trust-constr": (12, 24, 45),
    "IPOPT, sparse": (12, 24, 45, 90, 180, 360),
    "IPOPT, reduced": (12, 24, 45, 90),
}
SURFACE_TOL = {"SLSQP": 1e-10, "trust-constr": 1e-8, "IPOPT, sparse": 1e-9, "IPOPT, reduced": 1e-9}
SURFACE_LOOSER = {
    "SLSQP": (45, (1e-2, 1e-4, 1e-6)),
    "trust-constr": (24, (1e-2, 1e-4, 1e-6)),
    "IPOPT, sparse": (90, (1e-1, 1e-3, 1e-5)),
    "IPOPT, reduced": (45, (1e-1, 1e-3, 1e-5)),
}
"""N, and the tolerances at that N beside the one above."""
SURFACE_ROOT_INTERVALS = (12, 24, 45, 90)
SURFACE_ROOT_LOOSER = (1e-2, 1e-4, 1e-6)
"""At N = 45, beside ROOT_TOL's 1e-10."""
CONTINUUM_ERRORS = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
"""Of a step of the integration."""
PRINTED_INTERVALS = (24, 45, 90)
"""For the shear energy (5) as printed; the paper has 90."""
CAP = 10.0
"""CPU seconds at one position after which a rival is given up in direct contact."""
APPROACH = 20
"""Positions of the base from 180 degrees to the path's start, without contact at first, by which
general optimisers reach the right side of the ellipse (`bench/ipopt.py`); not timed."""


def jaw_rows(problem: Problem) -> Iterator[Row]:
    """Every rival on a snap-fit. The optimisers have no friction that an energy could stand for."""
    case = problem.case
    assert case is not None
    if problem.mu == 0.0:
        for order in ORDERS:
            for ftol in SLSQP_FTOL:
                rival = SciPyRival(case, "SLSQP", order, ftol)
                yield path_row(problem, "SLSQP", f"order {order}", f"ftol {ftol:g}", rival)
        for tolerance in TRUST_TOL:
            rival = SciPyRival(case, "trust-constr", 6, tolerance)
            yield path_row(problem, "trust-constr", "order 6", f"gtol {tolerance:g}", rival)
        if CASADI:
            from support.rivals_ipopt import IpoptRival

            for tolerance in IPOPT_TOL:
                rival = IpoptRival(case, 6, tolerance)
                yield path_row(problem, "IPOPT", "order 6", f"tol {tolerance:g}", rival)
    for method in ("root", "least_squares"):
        for order in ORDERS:
            for tolerance in ROOT_TOL:
                rival = RootRival(case, method, order, tolerance)
                setting = f"tol {tolerance:g}"
                yield path_row(problem, method, f"order {order}", setting, rival)
    for tolerance in BVP_TOL:
        yield path_row(problem, "solve_bvp", "", f"tol {tolerance:g}", BvpRival(case, tolerance))
    points = PAPER_POINTS[problem.name]
    for order in PAPER_ORDERS:
        for tolerance in PAPER_TOL:
            rival = PaperRival(case, order, points, tolerance)
            setting = f"order {order}, M = {points}, tol {tolerance:g}"
            yield path_row(problem, "paper", "M as printed", setting, rival)
    for more in PAPER_MORE_POINTS:
        rival = PaperRival(case, 4, more, 1e-6)
        yield path_row(problem, "paper", "other M", f"order 4, M = {more}, tol 1e-06", rival)
    rival = PaperRival(case, 4, points, 1e-6, "printed")
    yield path_row(problem, "paper", "printed line search", f"order 4, M = {points}", rival)
    yield formula_row(problem)


def path_row(problem: Problem, solver: str, series: str, setting: str, rival: rivals.Rival) -> Row:
    """One rival's path: its errors, and the best time of the rounds that fit into the budget."""
    frame, seconds = best_path(lambda: rivals.follow(rival, problem.positions))
    return row(problem, solver, series, setting, frame, problem.truth, seconds, math.nan)


def best_path(run: Callable[[], pd.DataFrame]) -> tuple[pd.DataFrame, float]:
    """The rows, and the shortest CPU seconds of a path; the first run may compile."""
    frame = run()
    best, spent = math.inf, 0.0
    while spent < BUDGET:
        frame = run()
        seconds = float(frame["seconds"].sum())
        best, spent = min(best, seconds), spent + seconds
    return frame, best


def formula_row(problem: Problem) -> Row:
    """The closed-form formula of the design guides, as far as the jaw's edge touches."""
    case = problem.case
    assert case is not None
    on_edge = closed_form.on_edge(case, problem.positions)
    positions, truth = problem.positions[on_edge], problem.truth[on_edge]
    forces = np.array([closed_form.force(case, position) for position in positions])
    frame = pd.DataFrame({"success": True, "iterations": 0, "force_x_N": forces[:, 0]})
    frame["force_y_N"] = forces[:, 1]
    seconds = best_time(lambda: [closed_form.force(case, position) for position in positions])
    return row(problem, "formula", "", "P = 3EIy/L³", frame, truth, seconds, math.nan)


def surface_rows(problem: Problem) -> Iterator[Row]:
    """Every rival on rubber-ellipse: shooting on the continuum; `root` and `least_squares`; and
    without friction optimisers, the same discretisation for all but the paper's: its energy (5) is
    given to SLSQP as printed."""
    start = surface_starts(problem.scene)[0]
    for local in CONTINUUM_ERRORS:
        run = partial(rivals_continuum.follow, problem.scene, continuum(problem.mu),
                      problem.positions, start, local)  # fmt: skip
        frame, seconds = best_path(run)
        yield row(problem, "shooting", "", f"local error {local:g}", frame, problem.truth, seconds,
                  math.nan)  # fmt: skip
    for method in ("root", "least_squares"):
        for n in SURFACE_ROOT_INTERVALS:
            yield root_row(problem, method, "intervals", n, ROOT_TOL[-2])
        for tolerance in SURFACE_ROOT_LOOSER:
            yield root_row(problem, method, "tolerance", 45, tolerance)
    if problem.mu > 0.0:
        return
    for solver, intervals in SURFACE_INTERVALS.items():
        if solver.startswith("IPOPT") and not CASADI:
            continue
        for n in intervals:
            yield surface_row(problem, solver, "intervals", n, SURFACE_TOL[solver])
        n, looser = SURFACE_LOOSER[solver]
        for tolerance in looser:
            yield surface_row(problem, solver, "tolerance", n, tolerance)
    for n in PRINTED_INTERVALS:
        yield surface_row(problem, "paper", "(5) as printed", n, 1e-8)


def root_row(problem: Problem, method: str, series: str, n: int, tolerance: float) -> Row:
    """`root` or `least_squares` along the path."""
    scene = problem.scene.replace({"solver.intervals": n})
    curve = fastncm.solve(scene, positions=problem.positions)
    poses = [scene.pose(x) for x in problem.positions]
    frame, seconds = best_path(lambda: SurfaceRoot(scene, method, tolerance).follow(poses, curve))
    setting = f"N = {n}, tol {tolerance:g}"
    return row(problem, method, series, setting, frame, problem.truth, seconds, math.nan)


def surface_row(problem: Problem, solver: str, series: str, n: int, tolerance: float) -> Row:
    """One rival along the path, from a base that is turned away; the faster of two runs."""
    scene = problem.scene.replace({"solver.intervals": n})
    first = scene.pose(problem.positions[0])
    turned = np.linspace(math.pi, problem.positions[0], APPROACH)
    approach = [first._replace(base_angle=angle) for angle in turned]
    poses: list[Pose] = [*approach, *(scene.pose(x) for x in problem.positions)]
    if solver.startswith("IPOPT"):
        from ipopt_baseline import Baseline

        form = "sparse" if solver.endswith("sparse") else "reduced"
        run = partial(Baseline(scene, form, tolerance).solve_path, poses)
    elif solver == "paper":
        run = partial(SurfaceRival(scene, "SLSQP", tolerance, printed=True).follow, poses, CAP)
    else:
        run = partial(SurfaceRival(scene, solver, tolerance).follow, poses, CAP)
    frames = [run().iloc[APPROACH:] for _ in range(1 if solver == "trust-constr" else 2)]
    seconds = min(float(frame["seconds"].mean()) for frame in frames) * len(frames[0])
    setting = f"N = {n}, tol {tolerance:g}"
    return row(problem, solver, series, setting, frames[0], problem.truth, seconds, math.nan)
