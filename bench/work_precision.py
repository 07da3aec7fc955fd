"""Error against run time: fastncm over its settings, optimisers, `solve_bvp`, the paper's
algorithm and the design guides' formula, on the same positions, one core, one process.

The error is that of the contact force, the largest over the positions, relative to the true force:
by shooting on the exact equilibrium equation for the snap-fits (good to 1e-12), by our own solve
with 10,000 intervals for rubber-ellipse, where no exact solution is known to us; its distance from
5,000 intervals is taken for its error. Time is CPU time, the best of several runs, without
compilation and setting up. Every solver follows the path from position to position and starts from
what it has solved; rivals get what makes them fast (see `support/rivals*.py`).
"""

import math

import pandas as pd
from support import markdown_table, read_table, write_table
from support.one_core import on_one_core
from work_precision_parts import closed_form, ours, theirs
from work_precision_parts.front import rtol_excess, time_to
from work_precision_parts.pictures import draw_formula, draw_own, draw_rivals, panels
from work_precision_parts.problems import jaw_problem, surface_problem

JAW_FRICTIONS = (0.0, 0.2)
SURFACE_FRICTIONS = (0.0, 0.5)
ACCURACIES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
WORDS = {
    "fastncm": "fastncm",
    "formula": "closed-form formula",
    "paper": "the paper's algorithm",
}
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
        rows += ours.surface_rows(problem)
        if mu == 0.0:
            rows += theirs.surface_rows(problem)
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
    circle = of(table, "snapfit-circle", 0.0)
    ours_us = time_to(circle, "fastncm", 1e-6)
    alone = time_to(circle, "fastncm", 1e-6, "us_alone")
    rivals = pd.Series({name: time_to(circle, name, 1e-6) for name in RIVALS_OF_JAWS}).dropna()
    best, theirs_us = rivals.idxmin(), rivals.min()
    excess = max(rtol_excess(rows).max() for _, _, rows in panels(table) if has_rtol(rows))
    off = 100.0 * (peaks["formula_N"] / peaks["shooting_N"] - 1.0)
    model = models["model_error"].dropna()
    return [
        f"snapfit-circle to 1e-6 takes fastncm {ours_us:.2g} µs a solve in a sweep and "
        f"{alone:.2g} µs where one path is all there is to solve; the quickest rival, {best}, "
        f"takes {theirs_us:.3g} µs: {theirs_us / ours_us:.0f} and {theirs_us / alone:.1f} times "
        "as long.",
        f"`solver.rtol` costs at most {excess:.2f} times the best setting by hand.",
        f"The beam itself is {100 * model.min():.2g} to {100 * model.max():.2g} % off finite "
        f"elements; the design guides' formula is {off.min():.0f} to {off.max():+.0f} % off in "
        "the peak insertion force.",
    ]


RIVALS_OF_JAWS = ("SLSQP", "trust-constr", "IPOPT", "solve_bvp")


def has_rtol(rows: pd.DataFrame) -> bool:
    return bool((rows["series"] == "rtol").any())


def of(table: pd.DataFrame, scene: str, mu: float) -> pd.DataFrame:
    """The rows of one problem."""
    return table[(table["scene"] == scene) & (table["mu"] == mu)]


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
        *(times(scene, mu, rows) for scene, mu, rows in panels(table)),
        same_intervals(table),
        own_settings(table),
        failures(table),
        models_text(models),
        formula(peaks),
    ]
    return "\n\n".join(part for part in parts if part)


INTRODUCTION = """\
Error: of the contact force, the largest over the positions, relative to the true force there.
Time: CPU time a solve, best of several runs, without compiling and setting up. "In a sweep":
`solve_cases` with designs that differ, everything included; "alone": the solves of a single path,
its events located, too. All optimisers solve the same discretisation, with exact compiled
derivatives and warm starts extrapolated from the positions before, and are told which part of the
jaw touches."""


def times(scene: str, mu: float, rows: pd.DataFrame) -> str:
    """Times over accuracies, a line for each solver."""
    cells = []
    for solver in rows["solver"].unique():
        columns = ("us_sweep", "us_alone") if solver == "fastncm" else ("us_alone",)
        for column in columns:
            found = [time_to(rows, solver, accuracy, column) for accuracy in ACCURACIES]
            if solver == "fastncm" and all(math.isnan(us) for us in found):
                continue  # in direct contact a sweep takes as long
            name = WORDS.get(solver, solver)
            if solver == "fastncm":
                name += ", alone" if column == "us_alone" else ", in a sweep"
            cells.append([name, *("-" if math.isnan(us) else f"{us:.3g}"
                                                   for us in found)])  # fmt: skip
    head = [f"{scene}, μ = {mu:g}", *(f"{accuracy:.0e}" for accuracy in ACCURACIES)]
    return markdown_table(head, sorted(cells, key=lambda line: not line[0].startswith("fastncm")))


def own_settings(table: pd.DataFrame) -> str:
    """Which settings are on the front, and rtol."""
    lines = []
    for scene, mu, rows in panels(table):
        if has_rtol(rows):
            ratios = rtol_excess(rows)
            lines.append([f"{scene}, μ = {mu:g}", f"{pd.Series(ratios).median():.2f}",
                          f"{ratios.max():.2f}"])  # fmt: skip
    return "\n\n".join(
        [
            "### Settings of fastncm",
            "![Settings and their Pareto front](results/work_precision_own.png)",
            "The front is that of all settings by hand but those of another model (shear). Time of "
            "a solve by `solver.rtol` over that of the fastest setting by hand that is as "
            "accurate, over eleven tolerances from 1e-2 to 1e-12:",
            markdown_table(["", "median", "largest"], lines),
            "In direct contact `solver.rtol` does not choose N.",
        ]
    )


def failures(table: pd.DataFrame) -> str:
    """Positions that failed, and those with a wrong estimate, by series."""
    lines, silent = [], []
    groups = table.groupby(["scene", "mu", "solver", "series"], sort=False)
    for (scene, mu, solver, series), rows in groups:
        heading = [f"{scene}, μ = {mu:g}", WORDS.get(solver, solver), str(series)]
        bad = rows["failed"] > 0
        if bad.any():
            lines.append([*heading, f"{bad.sum()} of {len(rows)}",
                          f"{rows['failed'].max()} of {rows['positions'].max()}"])  # fmt: skip
        if rows["silent"].any():
            wrong = rows[rows["silent"] > 0]
            silent.append([*heading, f"{rows['silent'].sum()} of {rows['positions'].sum()}",
                           f"{wrong['error'].max():.1e}", ", ".join(wrong["setting"].unique()[:3])
                           + (" ..." if len(wrong) > 3 else "")])  # fmt: skip
    return "\n\n".join(
        [
            "### Failures",
            "Settings with positions at which a solver did not converge in its own words:",
            markdown_table(["", "solver", "", "settings", "positions of the worst"], lines),
            printed_energy(table),
            "Wrong in silence: positions of fastncm with status `converged` whose true error "
            f"exceeds {ours.SILENT:g} times the error estimate. The estimate knows nothing of the "
            "points of (10a) and (10b).",
            markdown_table(["", "", "series", "positions", "largest error", "settings"], silent),
        ]
    )


def printed_energy(table: pd.DataFrame) -> str:
    """What the shear energy (5) as printed leads to."""
    rows = table[table["series"] == "(5) as printed"]
    low, high = 100 * rows["error"].min(), 100 * rows["error"].max()
    failed, count = rows["failed"].sum(), rows["positions"].sum()
    return (
        "With the paper's shear energy (5) as printed, which does not see an alternating γ, SLSQP "
        f"says that it has converged at {count - failed} of {count} positions of rubber-ellipse "
        f"(N = {', '.join(map(str, theirs.PRINTED_INTERVALS))}); the largest error of the force is "
        f"{low:.0f} to {high:.0f} %."
    )


def same_intervals(table: pd.DataFrame) -> str:
    """Direct contact with the same discretisation: times of all over N."""
    rows = of(table, "rubber-ellipse", 0.0)
    rows = rows[rows["series"] == "intervals"]
    n = rows["setting"].str.extract(r"N = (\d+)")[0].astype(int)
    wide = rows.assign(N=n).pivot_table(index="N", columns="solver", values="us_alone", sort=False)
    errors = rows[rows["solver"] == "fastncm"].assign(N=n).set_index("N")["error"]
    names = ["fastncm", *(name for name in wide if name != "fastncm")]
    lines = [
        [f"{at}", f"{errors[at]:.1e}",
         *("-" if math.isnan(us) else f"{us:.3g}" for us in wide.loc[at, names])]
        for at in sorted(wide.index)
    ]  # fmt: skip
    return (
        "Direct contact, all with the same N intervals, so with the same discretisation error "
        "(rubber-ellipse, μ = 0; µs a solve):\n\n" + markdown_table(["N", "error", *names], lines)
    )


def models_text(models: pd.DataFrame) -> str:
    """The model's own error."""
    lines = [
        [f"{row.scene}, μ = {row.mu:g}",
         "-" if math.isnan(row.model_error) else f"{100 * row.model_error:.2f} %",
         f"{row.truth_error:.0e}"]
        for row in models.itertuples()
    ]  # fmt: skip
    return "\n\n".join(
        [
            "### The beam's own error",
            "Largest error of the converged force against finite elements (`bench/data/`; for "
            "rubber-ellipse those of a shorter finger on a smaller ellipse), and the error of the "
            "reference that the solvers are judged by:",
            markdown_table(["", "beam", "reference"], lines),
        ]
    )


def formula(peaks: pd.DataFrame) -> str:
    """The closed-form formula's table."""
    off = peaks.assign(off=100.0 * (peaks["formula_N"] / peaks["shooting_N"] - 1.0))
    frictions = sorted(off["mu"].unique())
    lines = []
    for (scene, height), rows in off.groupby(["scene", "jaw_height_m"], sort=False):
        cells = [f"{rows.loc[rows['mu'] == mu, 'off'].mean():+.1f} %" for mu in frictions]
        lines.append([f"{scene}, {1e3 * height:.1f} mm", *cells])
    spread = off.groupby(["scene", "jaw_height_m", "mu"])["off"].agg(lambda x: x.max() - x.min())
    worst = (peaks["fastncm_N"] / peaks["shooting_N"] - 1.0).abs().max()
    low, high = (1e3 * end for end in (peaks["thickness_m"].min(), peaks["thickness_m"].max()))
    return "\n\n".join(
        [
            "### The closed-form formula",
            "`P = 3EIy/L³`, `W = P (μ + tan β)/(1 - μ tan β)`: error of the peak insertion force "
            "over jaw height, against shooting. Both sides are proportional to EI: from a "
            f"thickness of {low:.1f} to {high:.1f} mm the error changes by less than "
            f"{max(spread.max(), 1e-9):.0e} %. fastncm's peaks are within {worst:.0e} of shooting.",
            "![Error of the formula](results/work_precision_formula.png)",
            markdown_table(["jaw height", *(f"μ = {mu:g}" for mu in frictions)], lines),
        ]
    )


if __name__ == "__main__":
    main()
