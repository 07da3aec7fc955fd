"""How fast does the contact force converge: in the order, and in the number of points M?

The truth is shooting on the exact equilibrium equation (tests/shooting.py), whose own error is
about 1e-13. The order's convergence is that of the default contact form, with the error estimate
beside it. The point forms (10a) and (10b) are compared at an order where only M matters. On
snapfit-corner they contain the corners of jaw and block as points of their own, so they are exact
for every M; the picture shows snapfit-circle.
"""

import numpy as np
from matplotlib.axes import Axes
from support import RESULTS, ROOT, markdown_table, read_json, shooting, write_json

import fastncm
from fastncm.plot.style import empty_figure, open_frame, save

CASES = {"snapfit-circle": shooting.SNAPFIT_CIRCLE, "snapfit-corner": shooting.SNAPFIT_CORNER}
POSITIONS = {
    "snapfit-circle": [0.0760, 0.0719, 0.0688, 0.0660, 0.0640, 0.0625, 0.0610],
    "snapfit-corner": [0.0719, 0.0688, 0.0660, 0.0620, 0.0590, 0.0565],
}
"""Target positions in m; from the last but one (circle) and last (corner) corner a touches."""
ORDERS = range(2, 13)
POINTS = [10, 20, 40, 80, 160, 320]
FORMS = {"points-on-finger": "(10a), points of the jaw", "points-on-target": "(10b), of the circle"}
FORM_ORDER = 8
ORDER_RTOL = 1e-12
POINTS_RTOL = 1e-9
FLOOR = 1e-16
"""Exact agreement is drawn here."""
COLOURS = {"snapfit-circle": "#1b2a49", "snapfit-corner": "#c0392b"}
STYLES = {"points-on-finger": "o-", "points-on-target": "s--"}
FORM_COLOURS = {"points-on-finger": "#1b2a49", "points-on-target": "#4c8eda"}


def main() -> None:
    truth = {scene: true_forces(scene) for scene in CASES}
    figure = empty_figure(8.0, 3.6)
    left, right = figure.subplots(1, 2)
    orders = [by_order(scene, truth[scene]) for scene in CASES]
    points = [by_points(scene, form, truth[scene]) for scene in CASES for form in FORMS]
    draw_orders(left, orders)
    draw_points(right, points)
    file = save(figure, RESULTS / "convergence.png")

    print(file.relative_to(ROOT))
    write_json("convergence", {"orders": list(ORDERS), "by_order": orders, "by_points": points})
    print(section())


def headlines() -> list[str]:
    figures, _ = read_json("convergence")
    worst = [max(np.max(r["error"][i]) for r in figures["by_order"]) for i in (3, 5)]
    rates = [r["rate"] for r in figures["by_points"] if r["scene"] == "snapfit-circle"]
    return [
        f"{figures['orders'][3]} modes give the force of both snap-fit scenes to {worst[0]:.0e}, "
        f"{figures['orders'][5]} to {worst[1]:.0e}; the paper's M points converge with order "
        f"{min(rates):.1f} to {max(rates):.1f} in M."
    ]


def section() -> str:
    figures, where = read_json("convergence")
    by_order, by_points = figures["by_order"], figures["by_points"]
    head = ["order"]
    for result in by_order:
        head += [result["scene"], "estimate", "estimate / error"]
    rows = []
    for i, order in enumerate(figures["orders"]):
        cells = [str(order)]
        for result in by_order:
            error, estimate = np.array(result["error"][i]), np.array(result["estimate"][i])
            ratio = estimate / np.maximum(error, FLOOR)
            cells += [f"{error.max():.1e}", f"{estimate.max():.1e}"]
            cells += [f"{ratio.min():.2g} to {ratio.max():.2g}"]
        rows.append(cells)
    over_points = [
        [str(count), *(f"{max(result['error'][i]):.1e}" for result in by_points)]
        for i, count in enumerate(by_points[0]["points"])
    ]
    over_points.append(["rate", *(f"{result['rate']:.2f}" for result in by_points)])
    return "\n\n".join(
        [
            "## Convergence",
            f"`bench/convergence.py`, {where}: relative error of the contact force against "
            "shooting, largest of all positions, and its estimate.",
            "![error over the order and over M](results/convergence.png)",
            markdown_table(head, rows),
            "The same over M, and the rate from the smallest to the largest M:",
            markdown_table(["M", *(f"{r['scene']} {r['form']}" for r in by_points)], over_points),
        ]
    )


def true_forces(scene: str) -> np.ndarray:
    """Forces (positions, 2) in N by shooting."""
    found = [shooting.solve(CASES[scene], position) for position in POSITIONS[scene]]
    return np.array([[one.force_x, one.force_y] for one in found])


def errors(
    scene: str, changes: dict[str, object], truth: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Relative error of the force at each position, and the solver's estimate of it."""
    made = fastncm.load_scene(scene).replace(changes)
    frame = fastncm.solve(made, positions=POSITIONS[scene]).frame()
    forces = frame[["force_x_N", "force_y_N"]].to_numpy()
    error = np.hypot(*(forces - truth).T) / np.hypot(*truth.T)
    return error, frame["error_estimate"].to_numpy()


def by_order(scene: str, truth: np.ndarray) -> dict:
    """Errors and estimates, both (orders, positions)."""
    found = [
        errors(scene, {"solver.order": order, "solver.rtol": ORDER_RTOL}, truth) for order in ORDERS
    ]
    return {
        "scene": scene,
        "positions": POSITIONS[scene],
        "error": [error.tolist() for error, _ in found],
        "estimate": [estimate.tolist() for _, estimate in found],
    }


def by_points(scene: str, form: str, truth: np.ndarray) -> dict:
    """Errors (M, positions) of one point form, and the rate of the largest ones."""
    found = []
    for count in POINTS:
        changes = {"solver.contact": form, "solver.points": count}
        changes |= {"solver.order": FORM_ORDER, "solver.rtol": POINTS_RTOL}
        found.append(errors(scene, changes, truth)[0])
    largest = np.max(found, axis=1)
    rate = -np.polyfit(np.log(POINTS), np.log(np.maximum(largest, FLOOR)), 1)[0]
    return {
        "scene": scene,
        "form": form,
        "points": POINTS,
        "positions": POSITIONS[scene],
        "error": [error.tolist() for error in found],
        "rate": rate,
    }


def draw_orders(ax: Axes, results: list[dict]) -> None:
    open_frame(ax)
    for result in results:
        colour = COLOURS[result["scene"]]
        error, estimate = np.array(result["error"]), np.array(result["estimate"])
        ax.semilogy(ORDERS, np.maximum(error, FLOOR), ".", color=colour, ms=4, alpha=0.35)
        ax.semilogy(ORDERS, error.max(axis=1), "o-", color=colour, ms=4, label=result["scene"])
        ax.semilogy(ORDERS, estimate.max(axis=1), ":", color=colour)
    ax.semilogy([], [], ":", color="0.4", label="error estimate")
    ax.set_xlabel("order (modes of the shape)")
    ax.set_ylabel("relative error of the contact force")
    ax.set_ylim(1e-15, 1e-2)
    ax.legend(frameon=False, fontsize=8)


def draw_points(ax: Axes, results: list[dict]) -> None:
    open_frame(ax)
    for result in results:
        if result["scene"] == "snapfit-circle":
            form = result["form"]
            largest = np.max(result["error"], axis=1)
            ax.loglog(POINTS, largest, STYLES[form], color=FORM_COLOURS[form], ms=4,
                      label=FORMS[form])  # fmt: skip
    ends = np.array([POINTS[0], POINTS[-1]])
    for rate, name in ((1, "1/M"), (2, "1/M²")):
        ax.loglog(ends, 0.12 * (ends / ends[0]) ** -rate, color="0.75", lw=0.8, zorder=0)
        ax.text(1.05 * ends[1], 0.12 * (ends[1] / ends[0]) ** -rate, name, fontsize=8, color="0.45",
                va="center")  # fmt: skip
    ax.set_xlim(8, 450)
    ax.set_xlabel("points M (snapfit-circle)")
    ax.legend(frameon=False, fontsize=8)


if __name__ == "__main__":
    main()
