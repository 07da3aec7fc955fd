"""The sections of the study's report, from its tables alone."""

import math

import pandas as pd
from support import markdown_table

from work_precision_parts import ours, theirs
from work_precision_parts.front import rtol_excess, time_to
from work_precision_parts.pictures import panels

ACCURACIES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
SURFACE = "rubber-ellipse"
WORDS = {
    "fastncm": "fastncm",
    "formula": "closed-form formula",
    "paper": "the paper's algorithm",
}


def has_rtol(rows: pd.DataFrame) -> bool:
    """Whether rtol is a setting of this problem."""
    return bool((rows["series"] == "rtol").any())


def of(table: pd.DataFrame, scene: str, mu: float) -> pd.DataFrame:
    """The rows of one problem."""
    return table[(table["scene"] == scene) & (table["mu"] == mu)]


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
            markdown_table(["", "", "series", "positions", "largest error", "settings"], silent)
            if silent
            else "There are none.",
        ]
    )


def printed_energy(table: pd.DataFrame) -> str:
    """What the shear energy (5) as printed leads to."""
    rows = table[table["series"] == "(5) as printed"]
    failed, count = rows["failed"].sum(), rows["positions"].sum()
    return (
        "With the paper's shear energy (5) as printed, which does not see an alternating γ, SLSQP "
        f"says that it has converged at {count - failed} of {count} positions of rubber-ellipse "
        f"(N = {', '.join(map(str, theirs.PRINTED_INTERVALS))}), with "
        f"forces that are wrong by {100 * rows['median_error'].median():.0f} %."
    )


def same_intervals(table: pd.DataFrame) -> str:
    """Direct contact with the same discretisation: times of all over N, without friction and
    with."""
    return "\n\n".join(
        [
            "Direct contact, all with the same N intervals, so with the same discretisation error "
            "(µs a solve; `root` and `least_squares` are told which nodes touch):",
            *(_over_intervals(table, mu) for scene, mu, _ in panels(table) if scene == SURFACE),
        ]
    )


def _over_intervals(table: pd.DataFrame, mu: float) -> str:
    rows = of(table, SURFACE, mu)
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
    return markdown_table([f"{SURFACE}, μ = {mu:g}: N", "error", *names], lines)


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
