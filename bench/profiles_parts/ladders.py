"""The solvers' ladders of settings, and what they do with a scene."""

import importlib.util
import math
from collections.abc import Callable, Sequence
from functools import partial

import pandas as pd
from support import rivals, shooting
from support.fastncm_runs import FastNcm
from support.random_scenes import RandomScene
from support.rivals_bvp import BvpRival
from support.rivals_paper import PaperRival
from support.rivals_root import RootRival
from support.rivals_scipy import SciPyRival

ORDER = 8
"""Modes of the three optimisers."""
ACCURACIES = 1e-2, 1e-6
CAP = 2.0
"""CPU seconds at one position, after which a rival has failed."""
QUICK, TRIES = 3e-3, 3
"""What takes less time than this is run as often as this, and the fastest run counts."""
LADDERS: dict[str, tuple[float, ...]] = {
    "fastncm": (1e-2, 1e-4, 1e-6, 1e-8, 1e-10),
    "SLSQP": (1e-4, 1e-7, 1e-10, 1e-13),
    "trust-constr": (1e-8, 1e-14),
    "IPOPT": (1e-6, 1e-8, 1e-10, 1e-12),
    "root": (1e-3, 1e-6, 1e-9),
    "solve_bvp": (1e-3, 1e-5, 1e-7, 1e-9),
    "paper": (50, 200, 800),
}
"""Tolerances; of the paper's algorithm the points M, which decide its error."""
PAPER_ORDER, PAPER_TOL = 4, 1e-6
CASADI = importlib.util.find_spec("casadi") is not None

Run = Callable[[Sequence[float]], pd.DataFrame]


def set_up(solver: str, case: shooting.ShootingCase, step: float) -> Run:
    """The solver at one step of its ladder, ready to be called with positions."""
    if solver == "fastncm":
        return FastNcm(case, step)
    rival: rivals.Rival
    if solver in ("SLSQP", "trust-constr"):
        rival = SciPyRival(case, solver, ORDER, step)
    elif solver == "IPOPT":
        from support.rivals_ipopt import IpoptRival

        rival = IpoptRival(case, ORDER, step)
    elif solver == "root":
        rival = RootRival(case, "root", ORDER, step)
    elif solver == "solve_bvp":
        rival = BvpRival(case, step)
    else:
        rival = PaperRival(case, PAPER_ORDER, int(step), PAPER_TOL)
    return partial(rivals.follow, rival, cap=CAP)


def runs(number: int, scene: RandomScene) -> pd.DataFrame:
    """Every solver's ladder, cold at the last position and warm along the path, as far up as
    needed for the tightest accuracy."""
    rows = []
    for start, chosen in (("cold", slice(-1, None)), ("warm", slice(None))):
        positions, truth = scene.positions[chosen], scene.truth[chosen]
        for solver, ladder in LADDERS.items():
            if solver == "IPOPT" and not CASADI:
                continue
            for step in ladder:
                frame, seconds = timed(set_up(solver, scene.case, step), positions)
                converged = bool(frame["success"].all())
                error = float(rivals.relative_errors(frame, truth).max()) if converged else math.inf
                rows.append((number, start, solver, step, converged, error, seconds))
                if error <= min(ACCURACIES):
                    break
    columns = ["scene", "start", "solver", "step", "converged", "error", "seconds"]
    return pd.DataFrame(rows, columns=columns)


def timed(run: Run, positions: Sequence[float]) -> tuple[pd.DataFrame, float]:
    """The rows and the CPU seconds of a path."""
    best = math.inf
    for _ in range(TRIES):
        frame = run(positions)
        best = min(best, float(frame["seconds"].sum()))
        if best > QUICK:
            break
    return frame, best
