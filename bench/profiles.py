"""Performance profiles (Dolan & Moré 2002) of all solvers over random snap-fits.

Each scene is solved at one position from the undeformed finger ("cold") and along a path of
positions, each from those before ("warm"). A solver solves a task where it converges in its own
words and the contact force is right, within an accuracy, at every position; truth is by shooting.
Same accuracy first: every solver has a ladder of settings, from loose to tight, and the cheapest
that is accurate enough counts, chosen with the truth in hand. What no setting solves counts as
infinite time. fastncm runs as for everybody, one scene at a time; what it takes where the scenes
are solved together is given beside.
"""

import importlib.util
import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from support import RESULTS, markdown_table, read_table, rivals, shooting, write_table
from support.fastncm_runs import FastNcm, solve_together
from support.one_core import on_one_core
from support.performance import profile
from support.random_scenes import RandomScene, random_scenes
from support.rivals_bvp import BvpRival
from support.rivals_paper import PaperRival
from support.rivals_scipy import SciPyRival

from fastncm.plot.style import empty_figure, open_frame, save

SCENES = 500
SEED = 20261122
POSITIONS = 6
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
    "solve_bvp": (1e-3, 1e-5, 1e-7, 1e-9),
    "paper": (50, 200, 800),
}
"""Tolerances; of the paper's algorithm the points M, which decide its error."""
PAPER_ORDER, PAPER_TOL = 4, 1e-6
COLOURS = {
    "fastncm": "#1b2a49",
    "SLSQP": "#4c8eda",
    "trust-constr": "#8e6bbf",
    "IPOPT": "#1e7d3c",
    "solve_bvp": "#d98e04",
    "paper": "#c0392b",
}
CASADI = importlib.util.find_spec("casadi") is not None

Run = Callable[[Sequence[float]], pd.DataFrame]


def main() -> None:
    on_one_core()
    scenes, again = random_scenes(SCENES, POSITIONS, SEED)
    print(f"{len(scenes)} scenes, {again} drawn again")
    runs(0, scenes[0])  # compiles
    table = pd.concat([runs(i, scene) for i, scene in enumerate(scenes)], ignore_index=True)
    together = solve_together(scenes, LADDERS["fastncm"], ACCURACIES)
    notes = {"seed": SEED, "drawn_again": again, "order": ORDER, "cap_s": CAP}
    write_table("profiles", table, **notes)
    write_table("profiles_together", together, **notes)
    picture(table)
    print(section())


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


def times(table: pd.DataFrame, start: str, accuracy: float) -> pd.DataFrame:
    """Seconds (scenes, solvers) of the cheapest setting that is accurate enough; inf: none is."""
    rows = table[table["start"] == start]
    seconds = rows["seconds"].where(rows["error"] <= accuracy, math.inf)
    wide = rows.assign(seconds=seconds).pivot_table(
        index="scene", columns="solver", values="seconds", aggfunc="min"
    )
    return wide[[name for name in COLOURS if name in wide.columns]]


def picture(table: pd.DataFrame) -> None:
    figure = empty_figure(9.5, 6.6)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for row, start in zip(axes, ("cold", "warm"), strict=True):
        for ax, accuracy in zip(row, ACCURACIES, strict=True):
            draw(ax, times(table, start, accuracy))
            place = "one position, cold" if start == "cold" else f"{POSITIONS} positions, warm"
            ax.set_title(f"{place}, force to {accuracy:.0e}", fontsize=10, loc="left")
    for ax in axes[:, 0]:
        ax.set_ylabel("share of the scenes solved")
    for ax in axes[-1]:
        ax.set_xlabel("within this many times the time of the fastest")
    axes[0, 0].legend(frameon=False, fontsize=8, loc="lower right")
    save(figure, RESULTS / "profiles.png")


def draw(ax: Axes, wide: pd.DataFrame) -> None:
    open_frame(ax)
    ratios, shares = profile(wide.to_numpy().T)
    for solver, ratio, share in zip(wide.columns, ratios, shares, strict=True):
        kept = np.isfinite(ratio)
        label = "the paper's algorithm" if solver == "paper" else solver
        at, height = np.append(ratio[kept], 1e4), np.append(share[kept], kept.mean())
        ax.step(at, height, where="post", color=COLOURS[solver], lw=1.5, label=label)
    ax.set_xscale("log")
    ax.set_xlim(0.9, 3e3)
    ax.set_ylim(0.0, 1.03)


def summary(table: pd.DataFrame, start: str, accuracy: float) -> str:
    """A line for each solver: solved, fastest, median time."""
    wide = times(table, start, accuracy)
    lines = []
    for solver in wide.columns:
        seconds = wide[solver]
        solved = np.isfinite(seconds)
        fastest = (seconds <= wide.min(axis=1)) & solved
        both = solved & np.isfinite(wide["fastncm"])
        ratio = (seconds[both] / wide["fastncm"][both]).median() if both.any() else math.nan
        last = table[(table["start"] == start) & (table["solver"] == solver)]
        last = last.groupby("scene").last()
        silent = int((last["converged"] & (last["error"] > accuracy)).sum())
        lines.append([solver, f"{solved.sum()}", f"{silent}", f"{fastest.sum()}",
                      "-" if not solved.any() else f"{1e6 * seconds[solved].median():.0f}",
                      "-" if math.isnan(ratio) else f"{ratio:.3g}"])  # fmt: skip
    head = [f"{start}, {accuracy:.0e}", "solved", "converged, not accurate", "fastest",
            "median µs a task", "times fastncm's"]  # fmt: skip
    return markdown_table(head, lines)


def headlines() -> list[str]:
    """For the first page."""
    table, _ = read_table("profiles")
    wide = times(table, "warm", min(ACCURACIES))
    solved = np.isfinite(wide).sum()
    others = ", ".join(f"{name} {solved[name]}" for name in wide.columns if name != "fastncm")
    return [
        f"Of {len(wide)} random snap-fits along {POSITIONS} positions fastncm solves "
        f"{solved['fastncm']} to {min(ACCURACIES):.0e} ({others})."
    ]


def section() -> str:
    """The report's part."""
    table, about = read_table("profiles")
    together, _ = read_table("profiles_together")
    machine = about["machine"]
    return "\n\n".join(
        [
            "## Performance profiles over random snap-fits",
            f"`bench/profiles.py`; {machine['cpu']}, SciPy {machine['scipy']}, revision "
            f"{machine['revision']}, {machine['date']}; seed {about['seed']}.",
            f"{table['scene'].nunique()} random scenes ({about['drawn_again']} draws had no "
            "solution by shooting and were drawn again): straight and arc-shaped jaws before "
            "circles and blocks, with random lead angles, heights and radii, without friction. "
            f"The optimisers have {about['order']} modes. Each solver's time is that of its "
            "cheapest setting that gets the force right at every position; where none does, or "
            f"one position takes more than {about['cap_s']:g} s, it has failed. The error of the "
            "paper's algorithm is that of its points, up to "
            f"M = {table.loc[table['solver'] == 'paper', 'step'].max():.0f} here.",
            "![Performance profiles](results/profiles.png)",
            *(
                summary(table, start, accuracy)
                for start in ("cold", "warm")
                for accuracy in ACCURACIES
            ),
            together_text(together),
        ]
    )


def together_text(together: pd.DataFrame) -> str:
    """fastncm with all scenes at once."""
    within = [f"within {accuracy:.0e}" for accuracy in ACCURACIES]
    lines = [
        [f"{row['rtol']:.0e}", row["start"], f"{row['us_per_scene']:.3g}",
         *(f"{row[name]}" for name in within)]
        for row in together.to_dict("records")
    ]  # fmt: skip
    head = ["rtol", "start", "µs a scene", *within]
    return "The same scenes by fastncm side by side:\n\n" + markdown_table(head, lines)


if __name__ == "__main__":
    main()
