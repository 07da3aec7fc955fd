"""Direct contact: what do N intervals cost and give, and how far is the beam from finite elements?

Tables and a picture:

1. over N: energy and force at four angles of rubber-ellipse against those of the largest N, with
   the rates at which they converge; iterations and CPU time of the whole path, and the slope of
   the time on log-log axes (1: O(N) a solve, with as many iterations at any N);
2. iterations, passes along the finger and failed rows over N for what is not the default: the
   printed section, points on the target (10b), an octagon, friction;
3. against data/fem_ellipse.csv (plane stress, Hencky): a shorter finger on a smaller ellipse, the
   section turned by psi, by psi + gamma as the paper prints it, and without shear.
"""

import math
import time

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from support import DATA, RESULTS, ROOT, markdown_table, print_table, read_json, write_json

import fastncm
from fastncm.direct.lowering import lower_surface
from fastncm.direct.solving import solve_surfaces
from fastncm.path import surface_rows
from fastncm.plot.style import empty_figure, legend, open_frame, save
from fastncm.scene import Scene, tabulate
from fastncm.sqp import status

SCENE = fastncm.load_scene("rubber-ellipse")
INTERVALS = (45, 90, 180, 360, 720, 1440, 2880, 5760)
LARGEST = 10_000
DEGREES = (120, 108, 96, 84)
TIMED_FROM = 90
ROUNDS = 7
SMALL = {
    "finger.length": 0.127,
    "finger.offset": 0.0635,
    "target.semi_axes": [0.04953, 0.033655],
    "path.start": math.radians(84.0),
    "path.stop": math.radians(102.0),
    "path.steps": 37,
    "solver.intervals": 720,
}
"""The scene of the finite elements; the base turns the other way, from no contact."""
MODELS: dict[str, dict[str, object]] = {
    "section ψ": {},
    "section ψ + γ, as printed": {"model.section": "psi+gamma"},
    "no shear": {"model.shear": False},
}
OCTAGON = np.pi * (np.arange(8) + 0.5) / 4.0
OCTAGONAL: dict[str, object] = {
    "target.shape": "polygon",
    "target.vertices": (
        np.array(SCENE.target.semi_axes) * np.column_stack([np.cos(OCTAGON), np.sin(OCTAGON)])
    ).tolist(),
}
FORMS: dict[str, dict[str, object]] = {
    "default": {},
    "μ = 0.3": {"friction.mu": 0.3},
    "no shear": {"model.shear": False},
    "section ψ + γ": {"model.section": "psi+gamma"},
    "octagon": OCTAGONAL,
    "octagon, ψ + γ": OCTAGONAL | {"model.section": "psi+gamma"},
    "(10b), M = 4 N": {"solver.contact": "points-on-target"},
}
FORM_INTERVALS = {"octagon, ψ + γ": 1440, "(10b), M = 4 N": 2880}
"""Up to which N, where more takes minutes: rows that fail are tried many times, and (10b)'s working
set takes many passes."""
COLOURS = {"section ψ": "#1b2a49", "section ψ + γ, as printed": "#4c8eda", "no shear": "0.6"}


def main() -> None:
    refined = over_intervals()
    forms = other_forms()
    compared = against_finite_elements()
    picture(refined, compared)
    write_json(
        "direct_contact",
        {
            "over_intervals": refined.to_dict("records"),
            "time_slope": time_slope(refined),
            "forms": forms.to_dict("records"),
            "finite_elements": compared.to_dict("records"),
        },
    )


def over_intervals() -> pd.DataFrame:
    """Errors, iterations and time of rubber-ellipse over N."""
    exact = at_angles(SCENE.replace({"solver.intervals": LARGEST}))
    rows = []
    for n in INTERVALS:
        scene = SCENE.replace({"solver.intervals": n})
        frame = at_angles(scene)
        force = np.hypot(frame["force_x_N"], frame["force_y_N"])
        off = np.hypot(
            frame["force_x_N"] - exact["force_x_N"], frame["force_y_N"] - exact["force_y_N"]
        )
        path, seconds = timed(scene)
        rows.append(
            {
                "N": n,
                "energy_error": float((frame["energy_J"] / exact["energy_J"] - 1).abs().max()),
                "force_error": float((off / force).max()),
                "estimate": float(frame["error_estimate"].max()),
                "iterations": float(path["iterations"].mean()),
                "most_iterations": int(path["iterations"].max()),
                "us_per_solve": 1e6 * seconds / len(path),
                "converged": bool((path["status"] == "converged").all()),
            }
        )
    table = pd.DataFrame(rows)
    print(f"rubber-ellipse, {len(path)} angles, against N = {LARGEST}:\n")
    print_table(
        ["N", "energy", "force", "estimate", "iterations", "at most", "µs a solve"],
        [
            [
                f"{row.N}",
                f"{row.energy_error:.1e}",
                f"{row.force_error:.1e}",
                f"{row.estimate:.1e}",
                f"{row.iterations:.2f}",
                f"{row.most_iterations}",
                f"{row.us_per_solve:.1f}",
            ]
            for row in table.itertuples()
        ],
    )
    print(f"\nslope of the time from N = {TIMED_FROM} on: {time_slope(table):.2f}\n")
    return table


def at_angles(scene: Scene) -> pd.DataFrame:
    """The rows at DEGREES, reached along the path."""
    way = np.unique(np.concatenate([np.arange(78, 127, 0.5), DEGREES]))[::-1]
    frame = fastncm.solve(scene, positions=np.radians(way)).frame()
    picked: pd.DataFrame = frame[np.isin(way, DEGREES)].reset_index(drop=True)
    return picked


def timed(scene: Scene) -> tuple[pd.DataFrame, float]:
    """The scene's own path, and the CPU seconds of its solution; best of the rounds."""
    lowered = lower_surface(tabulate(scene, {})[0])
    frame, best = fastncm.solve(scene).frame(), math.inf
    for _ in range(ROUNDS):
        begin = time.process_time()
        list(solve_surfaces(lowered, shapes=False))
        best = min(best, time.process_time() - begin)
    return frame, best


def other_forms() -> pd.DataFrame:
    """Iterations and passes a solve along the scene's own path, its first row left out."""
    rows = []
    for name, changes in FORMS.items():
        for n in INTERVALS:
            points = {"solver.points": 4 * n} if "solver.contact" in changes else {}
            if n > FORM_INTERVALS.get(name, n):
                continue
            scene = SCENE.replace(changes | {"solver.intervals": n} | points)
            trace = next(iter(solve_surfaces(lower_surface(tabulate(scene, {})[0]), False))).trace
            iterations = trace.rows[0, 1:, surface_rows.ITERATIONS]
            rows.append(
                {
                    "form": name,
                    "N": n,
                    "iterations": float(iterations.mean()),
                    "most_iterations": int(iterations.max()),
                    "usual_iterations": float(np.median(iterations)),
                    "passes": float(trace.passes[0] / trace.solves[0]),
                    "failed": int(
                        (trace.rows[0, :, surface_rows.STATUS] > status.NO_CONTACT).sum()
                    ),
                }
            )
    table = pd.DataFrame(rows)
    print_table(*forms_table(table))
    print()
    return table


def forms_table(table: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """Head and rows of the table of the other forms."""
    return (
        ["", "N", "iterations", "median", "at most", "passes a solve", "failed rows"],
        [
            [r.form, f"{r.N:,}", f"{r.iterations:.1f}", f"{r.usual_iterations:.0f}",
             f"{r.most_iterations}", f"{r.passes:.1f}", f"{r.failed}"]
            for r in table.itertuples()
        ],
    )  # fmt: skip


def time_slope(table: pd.DataFrame) -> float:
    """Of log time over log N by least squares."""
    large = table[table["N"] >= TIMED_FROM]
    return float(np.polyfit(np.log(large["N"]), np.log(large["us_per_solve"]), 1)[0])


def against_finite_elements() -> pd.DataFrame:
    """The beam's forces at the angles of the finite elements, differences in % of the force."""
    fem = pd.read_csv(DATA / "fem_ellipse.csv").query("material == 'Hencky'")
    theirs = fem[["force_x_N", "force_y_N"]].to_numpy()
    size = np.hypot(*theirs.T)
    rows = []
    for name, changes in MODELS.items():
        ours = beam(changes, fem["phi_deg"].to_numpy())
        rows.append(
            pd.DataFrame(
                {
                    "model": name,
                    "degrees": fem["phi_deg"].to_numpy(),
                    "fem_N": size,
                    "magnitude_%": 100 * (np.hypot(*ours.T) / size - 1),
                    "vector_%": 100 * np.hypot(*(ours - theirs).T) / size,
                }
            )
        )
    table = pd.concat(rows, ignore_index=True)
    print("Magnitude of the force against finite elements, in %:\n")
    wide = table.pivot_table(index="degrees", columns="model", values="magnitude_%")
    print_table(
        ["degrees", *MODELS],
        [[f"{d}", *(f"{wide.loc[d, name]:+.1f}" for name in MODELS)] for d in wide.index],
    )
    return table


def beam(changes: dict[str, object], degrees: np.ndarray) -> np.ndarray:
    """Forces (len(degrees), 2) in N of the small scene."""
    scene = SCENE.replace(SMALL | changes)
    frame = fastncm.solve(scene).frame()
    at = np.searchsorted(frame["position"], np.radians(degrees) - 1e-9)
    forces: np.ndarray = frame[["force_x_N", "force_y_N"]].to_numpy()[at]
    return forces


def picture(refined: pd.DataFrame, compared: pd.DataFrame) -> None:
    figure = empty_figure(10.0, 3.4)
    left, middle, right = figure.subplots(1, 3)
    draw_errors(left, refined)
    draw_time(middle, refined)
    open_frame(right)
    right.axhline(0.0, color="0.7", lw=0.8)
    for name, rows in compared[compared["model"] != "no shear"].groupby("model", sort=False):
        right.plot(
            rows["degrees"], rows["magnitude_%"], "o-", color=COLOURS[name], ms=3, label=name
        )
    right.set(xlabel="φ / °", ylabel="force against finite elements / %")
    legend(right, "")
    file = save(figure, RESULTS / "direct_contact.png")
    print(f"\n{file.relative_to(ROOT)}")


def draw_errors(ax: Axes, table: pd.DataFrame) -> None:
    """Errors over N, with the slopes 1 and 2 to compare."""
    open_frame(ax)
    ax.loglog(table["N"], table["energy_error"], "o-", color="#1b2a49", ms=3, label="energy")
    ax.loglog(table["N"], table["force_error"], "s-", color="#c0392b", ms=3, label="force")
    ax.loglog(table["N"], table["estimate"], ":", color="#c0392b", label="its estimate")
    ends = table["N"].iloc[[0, -1]].to_numpy()
    for order in (1, 2):
        line = table["energy_error"].iloc[0] * (ends / ends[0]) ** -float(order)
        ax.loglog(ends, line, color="0.8", lw=0.8, zorder=0)
    ax.set(xlabel="N", ylabel="relative error")
    legend(ax, "")


def draw_time(ax: Axes, table: pd.DataFrame) -> None:
    """Time of a solve over N, with the slope 1 to compare."""
    open_frame(ax)
    ax.loglog(table["N"], table["us_per_solve"], "o-", color="#1b2a49", ms=3)
    ends = table["N"].iloc[[0, -1]].to_numpy()
    ax.loglog(ends, table["us_per_solve"].iloc[-1] * ends / ends[-1], color="0.8", lw=0.8, zorder=0)
    ax.set(xlabel="N", ylabel="µs a contact solve")


def headlines() -> list[str]:
    """For the first page."""
    figures, _ = read_json("direct_contact")
    table = pd.DataFrame(figures["over_intervals"])
    first, last = table.iloc[0], table.iloc[-1]
    return [
        f"Direct contact takes {first['iterations']:.1f} iterations a solve with N = "
        f"{first['N']:.0f} and {last['iterations']:.1f} with {last['N']:,.0f}; time grows as "
        f"N^{figures['time_slope']:.2f}."
    ]


def section() -> str:
    """The report's part."""
    figures, about = read_json("direct_contact")
    table = pd.DataFrame(figures["over_intervals"])
    compared = pd.DataFrame(figures["finite_elements"])
    rows = [
        [f"{row.N}", f"{row.energy_error:.1e}", f"{row.force_error:.1e}", f"{row.estimate:.1e}",
         f"{row.iterations:.2f}", f"{row.most_iterations}", f"{row.us_per_solve:.1f}"]
        for row in table.itertuples()
    ]  # fmt: skip
    wide = compared.pivot_table(index="degrees", columns="model", values="magnitude_%")
    beams = [name for name in MODELS if name in wide.columns]
    return "\n\n".join(
        [
            "## Direct contact over N, and finite elements",
            f"`bench/direct_contact.py`, {about}: rubber-ellipse, errors against N = {LARGEST:,} "
            f"at {', '.join(map(str, DEGREES))} degrees; iterations and CPU time of the whole path "
            f"(slope of the time on logarithmic axes from N = {TIMED_FROM} on: "
            f"{figures['time_slope']:.2f}).",
            "![Direct contact](results/direct_contact.png)",
            markdown_table(
                ["N", "energy", "force", "its estimate", "iterations", "at most", "µs a solve"],
                rows,
            ),  # fmt: skip
            "Iterations of a solve along the same path (its first row left out) for what is not "
            "the default; the step knows how a contact at a target's point turns with the shear "
            "and the bending beside it. A pass is one way along the finger: there is one for each "
            "change of the working set.",
            markdown_table(*forms_table(pd.DataFrame(figures["forms"]))),
            "Magnitude of the force against finite elements (`bench/data/fem_ellipse.csv`, a "
            "shorter finger on a smaller ellipse), in %:",
            markdown_table(
                ["degrees", *beams],
                [
                    [f"{at:g}", *(f"{wide.loc[at, name]:+.1f}" for name in beams)]
                    for at in wide.index
                ],  # fmt: skip
            ),
        ]
    )


if __name__ == "__main__":
    main()
