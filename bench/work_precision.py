"""Error against run time: fastncm over its settings, optimisers, `solve_bvp`, the paper's
algorithm and the design guides' formula, on the same positions, one core, one process.

The error is that of the contact force, the largest over the positions, relative to the true force:
by shooting on the exact equilibrium equations, for the snap-fits with one contact (good to 1e-12),
for rubber-ellipse with a surface that lies on the ellipse (`tests/shooting_surface.py`).
Time is CPU time, the best of several runs, without
compilation and setting up. Every solver follows the path from position to position and starts from
what it has solved; rivals get what makes them fast (see `support/rivals*.py`).
"""

import pandas as pd
from support import read_table, write_table
from support.one_core import on_one_core
from work_precision_parts import closed_form, ours, text, theirs
from work_precision_parts.front import rtol_excess, time_to
from work_precision_parts.pictures import draw_formula, draw_own, draw_rivals, panels
from work_precision_parts.problems import jaw_problem, surface_problem

JAW_FRICTIONS = (0.0, 0.2)
SURFACE_FRICTIONS = (0.0, 0.5)
TITLE = "## Error against run time"


def main() -> None:
    on_one_core()
    rows: list[dict[str, object]] = []
    about = []
    for name in ("snapfit-circle", "snapfit-corner"):
        for mu in JAW_FRICTIONS:
            problem = jaw_problem(name, mu)
            about.append((name, mu, problem.truth_error, problem.model_error))
            rows += [*theirs.jaw_rows(problem), *ours.jaw_rows(problem)]
            print(f"{name}, mu = {mu}: {len(rows)} rows so far")
    for mu in SURFACE_FRICTIONS:
        problem = surface_problem(mu)
        about.append((problem.name, mu, problem.truth_error, problem.model_error))
        rows += [*ours.surface_rows(problem), *theirs.surface_rows(problem)]
        print(f"{problem.name}, mu = {mu}: {len(rows)} rows so far")
    table = pd.DataFrame(rows)
    models = pd.DataFrame(about, columns=["scene", "mu", "truth_error", "model_error"])
    peaks = closed_form.peaks()
    write_table("work_precision", table, designs=ours.DESIGNS, casadi=theirs.CASADI)
    write_table("work_precision_models", models)
    write_table("work_precision_formula", peaks)
    draw_rivals(table, models)
    draw_own(table, models)
    draw_formula(peaks)
    print(section())


def headlines() -> list[str]:
    """For the first page."""
    table, _ = read_table("work_precision")
    models, _ = read_table("work_precision_models")
    peaks, _ = read_table("work_precision_formula")
    circle = text.of(table, "snapfit-circle", 0.0)
    ours_us = time_to(circle, "fastncm", 1e-6)
    alone = time_to(circle, "fastncm", 1e-6, "us_alone")
    rivals = pd.Series({name: time_to(circle, name, 1e-6) for name in RIVALS_OF_JAWS}).dropna()
    best, theirs_us = rivals.idxmin(), rivals.min()
    optimisers = rivals.drop(list(EQUATIONS), errors="ignore")
    seeks, seeks_us = optimisers.idxmin(), optimisers.min()
    excess = max(rtol_excess(rows).max() for _, _, rows in panels(table) if text.has_rtol(rows))
    off = 100.0 * (peaks["formula_N"] / peaks["shooting_N"] - 1.0)
    model = models["model_error"].dropna()
    return [
        f"snapfit-circle to 1e-6 takes fastncm {ours_us:.2g} µs a solve in a sweep and "
        f"{alone:.2g} µs where one path is all there is to solve; the quickest rival, {best}, "
        f"takes {theirs_us:.3g} µs: {theirs_us / ours_us:.0f} and {theirs_us / alone:.1f} times "
        f"as long; the quickest optimiser, {seeks}, takes {seeks_us:.3g} µs.",
        f"`solver.rtol` costs at most {excess:.2f} times the best setting by hand.",
        f"The beam itself is {100 * model.min():.2g} to {100 * model.max():.2g} % off finite "
        f"elements; the design guides' formula is {off.min():.0f} to {off.max():+.0f} % off in "
        "the peak insertion force.",
    ]


RIVALS_OF_JAWS = ("SLSQP", "trust-constr", "IPOPT", "root", "least_squares", "solve_bvp")
EQUATIONS = ("root", "least_squares", "solve_bvp")
"""Solve for the equilibrium of one contact, not for the shape that does not penetrate."""


def section() -> str:
    """The report's part."""
    table, about = read_table("work_precision")
    models, _ = read_table("work_precision_models")
    peaks, _ = read_table("work_precision_formula")
    machine = about["machine"]
    parts = [
        TITLE,
        f"`bench/work_precision.py`; {machine['cpu']}, Python {machine['python']}, SciPy "
        f"{machine['scipy']}, revision {machine['revision']}, {machine['date']}. {INTRODUCTION}",
        "" if about["casadi"] else "CasADi is not installed here: no IPOPT.",
        "![Error against run time](results/work_precision_rivals.png)",
        "The shortest time (µs a solve) in which a solver gets every position to an accuracy; "
        "-: none of its settings does, or some position failed.",
        *(text.times(scene, mu, rows) for scene, mu, rows in panels(table)),
        text.same_intervals(table),
        text.own_settings(table),
        text.failures(table),
        text.models_text(models),
        text.formula(peaks),
    ]
    return "\n\n".join(part for part in parts if part)


INTRODUCTION = """\
Error: of the contact force, the largest over the positions, relative to the true force there: by
shooting on the exact equations, for rubber-ellipse with the surface lying on the ellipse.
Time: CPU time a solve, best of several runs, without compiling and setting up. "In a sweep":
`solve_cases` with designs that differ, everything included; "alone": the solves of a single path,
its events located, too. All optimisers solve the same discretisation, with exact compiled
derivatives and warm starts extrapolated from the positions before, and are told which part of the
jaw touches; they take no friction, which has no energy. `root` and `least_squares` (MINPACK by
SciPy) get the equilibrium of the sliding contact as a square system, with friction, an exact
compiled Jacobian and the same starts; they are told that there is one contact, which slides; on
rubber-ellipse, which nodes touch, and the whole answer at the first position.
"Shooting" is the reference of rubber-ellipse (`solve_ivp` and `root`) at looser tolerances. The
paper's algorithm (monomials, M points, BFGS) has a merit function in its line search, except where
"printed line search" is said, and friction by (14)-(17); on rubber-ellipse it is its shear energy
(5), given to SLSQP."""


if __name__ == "__main__":
    main()
