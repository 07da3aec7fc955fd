"""The study's pictures."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from support import RESULTS

from fastncm.plot.style import empty_figure, open_frame, save
from work_precision_parts.front import explicit, pareto

FLOOR = 1e-14
CEILING = 3.0
DARK, RED = "#1b2a49", "#c0392b"
COLOURS = {
    "SLSQP": "#4c8eda",
    "trust-constr": "#8e6bbf",
    "IPOPT": "#1e7d3c",
    "IPOPT, sparse": "#1e7d3c",
    "IPOPT, reduced": "#8fc98f",
    "solve_bvp": "#d98e04",
    "shooting": "#d98e04",
    "root": "#c2458f",
    "least_squares": "#e8a9cf",
    "paper": RED,
    "formula": "0.35",
}
MARKERS = {"formula": "*"}
OWN = {
    "order": (DARK, "o-", "closed form, exact Hessian"),
    "intervals": (DARK, "o-", "closed form, exact Hessian"),
    "BFGS": ("#4c8eda", "s-", "closed form, BFGS"),
    "10a, exact": ("#1e7d3c", "^-", "(10a), exact"),
    "10a, bfgs": ("#8fc98f", "^:", "(10a), BFGS"),
    "10a": ("#1e7d3c", "^-", "(10a), exact"),
    "10b, exact": ("#d98e04", "v-", "(10b), exact"),
    "10b, bfgs": ("#efc57a", "v:", "(10b), BFGS"),
    "10b": ("#d98e04", "v-", "(10b), exact"),
    "recovered friction": (RED, "s-", "recovered friction (14)-(17)"),
    "shear, section psi": ("0.55", "o-", "with shear, section ψ"),
    "shear, section psi+gamma": ("0.75", "o--", "with shear, section ψ+γ"),
    "section psi+gamma": ("0.75", "o--", "with shear, section ψ+γ"),
}


def panels(table: pd.DataFrame) -> list[tuple[str, float, pd.DataFrame]]:
    """Scene, friction and rows, in the order of the table."""
    groups = table.groupby(["scene", "mu"], sort=False)
    return [(str(scene), float(mu), rows) for (scene, mu), rows in groups]


def clipped(errors: pd.Series) -> np.ndarray:
    """Errors as drawn: exact agreement at the floor, no answer at the ceiling."""
    return np.clip(errors.fillna(CEILING), FLOOR, CEILING)


def frame(ax: Axes, title: str) -> None:
    open_frame(ax)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_title(title, fontsize=10, loc="left")


def model_line(ax: Axes, models: pd.DataFrame, scene: str, mu: float, at: float) -> None:
    """The model's own error as a line across the panel, and what the reference is good for; the
    words begin at `at` of the panel's width."""
    about = models[(models["scene"] == scene) & (models["mu"] == mu)].iloc[0]
    words = {"fontsize": 7.5, "color": "0.35", "textcoords": "offset points"}
    across = ("axes fraction", "data")
    if np.isfinite(about["model_error"]):
        ax.axhline(about["model_error"], color="0.4", lw=0.9, ls=(0, (6, 3)), zorder=0)
        ax.annotate("beam against finite elements", (at, about["model_error"]), xycoords=across,
                    xytext=(0, 3), **words)  # fmt: skip
    if about["truth_error"] > 1e-10:
        ax.axhspan(FLOOR, about["truth_error"], color="0.93", zorder=-1)
        ax.annotate("below the error of the reference", (at, about["truth_error"]),
                    xycoords=across, xytext=(0, -9), **words)  # fmt: skip


def limits(ax: Axes, scene: str) -> None:
    ax.set_ylim((1e-8 if scene == "rubber-ellipse" else FLOOR) / 2, 2 * CEILING)


def draw_rivals(table: pd.DataFrame, models: pd.DataFrame) -> None:
    """Error over time of all solvers, a panel for each problem."""
    figure = empty_figure(9.5, 11.0)
    axes = figure.subplots(3, 2, sharex=True)
    for ax, (scene, mu, rows) in zip(axes.flat, panels(table), strict=True):
        frame(ax, f"{scene}, μ = {mu:g}")
        model_line(ax, models, scene, mu, 0.01)
        rivals = rows[rows["solver"] != "fastncm"]
        for (solver, _), some in rivals.groupby(["solver", "series"], sort=False):
            if solver != "paper":
                ax.plot(some["us_alone"], clipped(some["error"]), color=COLOURS[solver], lw=0.7)
            for row, error in zip(some.itertuples(), clipped(some["error"]), strict=True):
                ax.plot(
                    row.us_alone, error, MARKERS.get(solver, "o"), color=COLOURS[solver],
                    ms=9 if solver == "formula" else 4.5, mfc="white" if row.failed else None,
                )  # fmt: skip
        ours = rows[(rows["solver"] == "fastncm") & rows["series"].isin(["order", "intervals"])]
        ax.plot(ours["us_alone"], clipped(ours["error"]), "D--", color=DARK, ms=3.5, lw=1.0)
        if ours["us_sweep"].notna().any():
            ax.plot(ours["us_sweep"], clipped(ours["error"]), "D-", color=DARK, ms=4.5, lw=1.4)
        auto = rows[(rows["solver"] == "fastncm") & (rows["series"] == "rtol")]
        ax.plot(auto["us_sweep"], clipped(auto["error"]), "o", mfc="none", mec=RED, ms=9)
        limits(ax, scene)
    for ax in axes[:, 0]:
        ax.set_ylabel("relative error of the force")
    for ax in axes[-1]:
        ax.set_xlabel("µs of CPU time a solve")
    figure.legend(handles=_legend(axes[0, 0]), loc="outside upper center", ncols=4, frameon=False,
                  fontsize=8.5)  # fmt: skip
    save(figure, RESULTS / "work_precision_rivals.png")


def _legend(ax: Axes) -> list:
    """One entry for each kind of mark."""
    named = {
        "fastncm, 512 designs in a sweep": ("D-", DARK, DARK),
        "fastncm, one path alone": ("D--", DARK, DARK),
        "fastncm, by solver.rtol": ("o", RED, "none"),
        "SciPy SLSQP": ("o-", COLOURS["SLSQP"], None),
        "SciPy trust-constr": ("o-", COLOURS["trust-constr"], None),
        "IPOPT (direct contact: sparse)": ("o-", COLOURS["IPOPT"], None),
        "IPOPT, reduced": ("o-", COLOURS["IPOPT, reduced"], None),
        "SciPy root": ("o-", COLOURS["root"], None),
        "SciPy least_squares": ("o-", COLOURS["least_squares"], None),
        "SciPy solve_bvp (direct: shooting)": ("o-", COLOURS["solve_bvp"], None),
        "the paper's algorithm": ("o-", COLOURS["paper"], None),
        "closed-form formula": ("*", COLOURS["formula"], None),
        "hollow: some positions failed": ("o", "0.5", "white"),
    }
    lines = []
    for label, (style, colour, face) in named.items():
        (line,) = ax.plot([], [], style, color=colour, mfc=face or colour, ms=5, label=label)
        lines.append(line)
    return lines


def draw_own(table: pd.DataFrame, models: pd.DataFrame) -> None:
    """fastncm over its settings, the Pareto front, and where rtol lands."""
    figure = empty_figure(9.5, 12.0)
    axes = figure.subplots(3, 2)
    entries = {}
    for ax, (scene, mu, rows) in zip(axes.flat, panels(table), strict=True):
        frame(ax, f"{scene}, μ = {mu:g}")
        model_line(ax, models, scene, mu, 0.42)
        front = pareto(explicit(rows))
        ax.plot(front["us"], clipped(front["error"]), color="#f3d36b", lw=7, alpha=0.7, zorder=0,
                label="Pareto front")  # fmt: skip
        own = rows[rows["solver"] == "fastncm"]
        for series, some in own.groupby("series", sort=False):
            if series != "rtol":
                colour, style, label = OWN[str(series)]
                us = some["us_sweep"].fillna(some["us_alone"])
                ax.plot(us, clipped(some["error"]), style, color=colour, ms=3.5, lw=0.9,
                        label=label)  # fmt: skip
        auto = own[own["series"] == "rtol"]
        if len(auto):
            ax.plot(auto["us_sweep"], clipped(auto["error"]), "o", mfc="none", mec=RED, ms=9,
                    label="solver.rtol 1e-2 to 1e-12")  # fmt: skip
        entries |= {
            label: mark for mark, label in zip(*ax.get_legend_handles_labels(), strict=True)
        }
        limits(ax, scene)
    figure.legend(entries.values(), entries.keys(), loc="outside upper center", ncols=4,
                  frameon=False, fontsize=8.5)  # fmt: skip
    for ax in axes[:, 0]:
        ax.set_ylabel("relative error of the force")
    for ax in axes[-1]:
        ax.set_xlabel("µs of CPU time a solve")
    save(figure, RESULTS / "work_precision_own.png")


def draw_formula(peaks: pd.DataFrame) -> None:
    """How wrong the closed-form formula's peak is over jaw height and friction."""
    figure = empty_figure(9.0, 3.3)
    axes = figure.subplots(1, 2, sharey=True)
    styles = {0.0: ("o-", DARK), 0.2: ("s-", "#4c8eda"), 0.4: ("^-", RED)}
    for ax, (scene, rows) in zip(axes, peaks.groupby("scene", sort=False), strict=True):
        open_frame(ax)
        ax.set_title(str(scene), fontsize=10, loc="left")
        ax.axhline(0.0, color="0.7", lw=0.8)
        for mu, some in rows.groupby("mu"):
            off = 100.0 * (some["formula_N"] / some["shooting_N"] - 1.0)
            by_height = off.groupby(some["jaw_height_m"]).agg(["min", "max"])
            style, colour = styles[float(mu)]
            at = 1e3 * by_height.index
            ax.plot(at, by_height["max"], style, color=colour, ms=4, label=f"μ = {mu:g}")
            ax.fill_between(at, by_height["min"], by_height["max"], color=colour, alpha=0.3, lw=0)
        ax.set_xlabel("jaw height / mm")
    axes[0].set_ylabel("formula's peak force, error / %")
    axes[1].legend(frameon=False, fontsize=8)
    save(figure, RESULTS / "work_precision_formula.png")
