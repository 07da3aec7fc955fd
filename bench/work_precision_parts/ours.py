"""fastncm over its settings: errors and CPU time, alone and in a sweep."""

import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

import fastncm
from fastncm.direct.lowering import lower_surface
from fastncm.direct.solving import solve_surfaces
from fastncm.lowering import lower
from fastncm.scene import Scene, tabulate
from fastncm.trace import solve_paths
from work_precision_parts.problems import FORCES, Problem, jaw_truth

Changes = Mapping[str, object]

DESIGNS = 512
"""Of a sweep with the closed form; the other forms do not gain from company."""
APART = 1e-9
"""Relative difference of two neighbouring designs' jaw heights: problems of their own."""
BUDGET = 0.25
"""CPU seconds of a measurement, over which the best run counts."""
ROUNDS = 6
"""In which the settings of one problem are measured in turn."""
ORDERS = (*range(2, 13), 14, 16)
RTOLS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
POINTS = (10, 20, 40, 80, 160, 320, 640)
BFGS_ORDERS = (2, 3, 4, 5, 6, 8)
SHEAR_ORDERS = (2, 3, 4, 6, 8, 12, 16)
FORMS = {"points-on-finger": "10a", "points-on-target": "10b"}
FORM_ORDER = 8
INTERVALS = (12, 24, 45, 90, 180, 360, 720, 1440, 2880)
TARGET_POINTS = (90, 360, 1440)
TIGHT = {"solver.rtol": 1e-9}
"""With an order given it is the tolerance of the iteration only."""
SILENT = 10.0
"""A converged row is wrong in silence where its error exceeds the estimate this many times."""
ROUNDING = 1e-11
SAME_MODEL = ("order", "rtol", "BFGS", "10a, exact", "10a, bfgs", "10b, exact", "10b, bfgs",
              "intervals", "10a", "10b", "shear, section psi")  # fmt: skip
"""Series whose estimate can be held against the truth: those with friction, if any, as in it."""


def best_time(run: Callable[[], object], budget: float = BUDGET) -> float:
    """CPU seconds of the fastest run; the first, which may compile, does not count."""
    run()
    best, spent = math.inf, 0.0
    while spent < budget:
        begin = time.process_time()
        run()
        seconds = time.process_time() - begin
        best, spent = min(best, seconds), spent + seconds
    return best


def jaw_settings(mu: float) -> Iterator[tuple[str, str, dict[str, object]]]:
    """Series, setting and changes."""
    for order in ORDERS:
        yield "order", f"order {order}", {"solver.order": order} | TIGHT
    for rtol in RTOLS:
        yield "rtol", f"rtol {rtol:g}", {"solver.rtol": rtol}
    rule: Changes = {"friction.model": "recovered"} if mu > 0.0 else {}
    if mu > 0.0:
        for order in BFGS_ORDERS:
            changes = {"solver.order": order} | TIGHT
            yield "recovered friction", f"order {order}, recovered", changes | rule
    for order in BFGS_ORDERS:
        changes = {"solver.order": order, "solver.hessian": "bfgs", "solver.rtol": 1e-9}
        yield "BFGS", f"order {order}, BFGS", changes | rule
    for form, name in FORMS.items():
        for hessian in ("exact", "bfgs"):
            for points in POINTS:
                changes = {"solver.contact": form, "solver.points": points}
                changes |= {"solver.order": FORM_ORDER, "solver.hessian": hessian}
                changes |= {"solver.rtol": 1e-9}
                label = f"{name}, M = {points}, {hessian}"
                yield f"{name}, {hessian}", label, changes | rule


def jaw_rows(problem: Problem) -> list[dict[str, object]]:
    """One row for each setting; with shear its own truth."""
    chosen = [
        (series, setting, problem.scene.replace(changes), problem.truth)
        for series, setting, changes in jaw_settings(problem.mu)
    ]
    if problem.mu == 0.0 and problem.case is not None:
        truth = jaw_truth(replace(problem.case, shear=True), problem.positions)
        for section in ("psi", "psi+gamma"):
            for order in SHEAR_ORDERS:
                changes = {"model.shear": True, "model.section": section, "solver.order": order}
                scene = problem.scene.replace(changes | TIGHT)
                chosen.append((f"shear, section {section}", f"order {order}", scene, truth))
    runs = [times_of(scene) for _, _, scene, _ in chosen]
    best = np.full((len(runs), 2), math.nan)
    for _ in range(ROUNDS):
        for i, (alone, sweep) in enumerate(runs):
            best[i, 0] = np.fmin(best[i, 0], best_time(alone, BUDGET / ROUNDS / 5))
            if sweep is not None:
                best[i, 1] = np.fmin(best[i, 1], best_time(sweep, BUDGET / ROUNDS) / DESIGNS)
    return [
        row(problem, "fastncm", series, setting, fastncm.solve(scene).frame(), truth, *best[i])
        for i, (series, setting, scene, truth) in enumerate(chosen)
    ]


def times_of(scene: Scene) -> tuple[Callable[[], object], Callable[[], object] | None]:
    """What is timed: a path alone (its solves, the problem being set up), and a sweep
    (`solve_cases`, everything included) where the form gains from it."""
    lowered = lower(tabulate(scene, {})[0])

    def alone() -> object:
        return list(solve_paths(lowered))

    if scene.solver.contact != "closest" or scene.solver.hessian != "exact":
        return alone, None
    assert scene.jaw is not None
    heights = scene.jaw.height * (1.0 + APART * np.arange(DESIGNS))
    table = pd.DataFrame({"jaw.height": heights})
    return alone, lambda: fastncm.solve_cases(scene, table)


def surface_rows(problem: Problem) -> Iterator[dict[str, object]]:
    """One row for each setting of rubber-ellipse."""
    for n in INTERVALS:
        yield surface_row(problem, "intervals", f"N = {n}", {"solver.intervals": n})
    for n in INTERVALS[:-3]:
        changes = {"solver.intervals": n, "model.section": "psi+gamma"}
        yield surface_row(problem, "section psi+gamma", f"N = {n}, psi+gamma", changes)
    if problem.mu > 0.0:
        return
    for n in INTERVALS[:-3]:
        changes = {"solver.intervals": n, "solver.contact": "points-on-finger"}
        yield surface_row(problem, "10a", f"N = {n}, 10a", changes)
    for points in TARGET_POINTS:
        changes = {"solver.intervals": 90, "solver.contact": "points-on-target"}
        changes |= {"solver.points": points}
        yield surface_row(problem, "10b", f"N = 90, 10b, M = {points}", changes)


def surface_row(problem: Problem, series: str, setting: str, changes: Changes) -> dict[str, object]:
    """Errors of one setting and the time of its path's solves."""
    scene = problem.scene.replace(changes)
    frame = fastncm.solve(scene).frame()
    lowered = lower_surface(tabulate(scene, {})[0])
    alone = best_time(lambda: list(solve_surfaces(lowered, shapes=False)))
    return row(problem, "fastncm", series, setting, frame, problem.truth, alone, math.nan)


def row(
    problem: Problem,
    solver: str,
    series: str,
    setting: str,
    frame: pd.DataFrame,
    truth: np.ndarray,
    alone: float,
    sweep: float,
) -> dict[str, object]:
    """A row of the study's table; times are of the whole path, in seconds."""
    good = np.asarray(
        frame["status"] == "converged" if "status" in frame else frame["success"], dtype=bool
    )
    forces, true = frame[FORCES].to_numpy(dtype=float)[good], truth[good]
    error = np.hypot(*(forces - true).T) / np.hypot(*true.T)
    estimated = "error_estimate" in frame and series in SAME_MODEL
    silent = 0
    if estimated and (problem.mu == 0.0 or series in ("order", "rtol", "intervals")):
        known = SILENT * frame["error_estimate"].to_numpy()[good]
        silent = int((error > known + max(ROUNDING, 2.0 * problem.truth_error)).sum())
    count = len(frame)
    return {
        "scene": problem.name,
        "mu": problem.mu,
        "solver": solver,
        "series": series,
        "setting": setting,
        "error": float(error.max()) if len(error) else math.nan,
        "median_error": float(np.median(error)) if len(error) else math.nan,
        "positions": count,
        "failed": int(count - good.sum()),
        "silent": silent,
        "us_alone": 1e6 * alone / count,
        "us_sweep": 1e6 * sweep / count,
        "iterations": float(frame["iterations"].mean()),
    }
