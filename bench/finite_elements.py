"""How far is the beam from finite elements?

Forces of both snap-fit scenes against data/fem_snapfit.csv (plane stress, rigid jaw, error 0.01 %):
without friction for the plain beam and the one with shear; at mu = 0.2 in sliding equilibrium, as
the finite elements are, and by the recovered rule, which freezes the frictionless shape. All
differences are in % of the force's magnitude and positive where the beam is the stiffer one.
"""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from support import DATA, RESULTS, ROOT, markdown_table, read_json, write_json

import fastncm
from fastncm.plot.style import empty_figure, open_frame, save

SCENES = "snapfit-circle", "snapfit-corner"
MODELS = {
    "μ = 0, no shear": {"friction.mu": 0.0, "model.shear": False},
    "μ = 0, shear": {"friction.mu": 0.0, "model.shear": True},
    "μ = 0.2 recovered, shear": {
        "friction.mu": 0.2,
        "friction.model": "recovered",
        "model.shear": True,
    },
    "μ = 0.2, no shear": {"friction.mu": 0.2, "model.shear": False},
    "μ = 0.2, shear": {"friction.mu": 0.2, "model.shear": True},
}
COLOURS = {
    "μ = 0, no shear": "#4c8eda",
    "μ = 0, shear": "#1b2a49",
    "μ = 0.2 recovered, shear": "#c0392b",
    "μ = 0.2, no shear": "#8fc98f",
    "μ = 0.2, shear": "#1e7d3c",
}
LINE_POSITIONS = 400


def main() -> None:
    fem = pd.read_csv(DATA / "fem_snapfit.csv")
    fem = fem[fem["jaw"] == "rigid"]
    table = pd.concat(
        compared(fem, scene, model) for scene in SCENES for model in MODELS
    ).reset_index(drop=True)
    for (scene, model), rows in table.groupby(["scene", "model"], sort=False):
        print(f"\n{scene}, {model}:\n")
        columns = ["position_m", "fem_N", "force_x_%", "force_y_%", "magnitude_%"]
        print(rows[columns].to_string(index=False, float_format=lambda x: f"{x:.5g}"))
    picture(table, fem)
    write_json("finite_elements", {"rows": table.to_dict("records")})
    print(section())


def headlines() -> list[str]:
    table = pd.DataFrame(read_json("finite_elements")[0]["rows"])
    worst = table.groupby("model")["magnitude_%"].apply(lambda column: column.abs().max())
    return [
        f"With shear the beam's forces are within {worst['μ = 0, shear']:.2f} % of finite elements "
        f"(plane stress) without friction, {worst['μ = 0.2, shear']:.2f} % at μ = 0.2; the paper's "
        f"friction rule is {worst['μ = 0.2 recovered, shear']:.1f} % off there."
    ]


def section() -> str:
    figures, where = read_json("finite_elements")
    head = ["scene", "beam", "force x", "force y", "magnitude"]
    return "\n\n".join(
        [
            "## The beam and finite elements",
            f"`bench/finite_elements.py`, {where}: largest differences over all positions of "
            "`bench/data/fem_snapfit.csv` (plane stress, rigid jaw, error 0.01 %), in % of the "
            "force's magnitude.",
            markdown_table(head, summary(pd.DataFrame(figures["rows"]))),
            "![beam and finite elements](results/finite_elements.png)",
        ]
    )


def compared(fem: pd.DataFrame, scene: str, model: str) -> pd.DataFrame:
    """The rows of one scene and friction coefficient beside the beam's forces."""
    changes = MODELS[model]
    rows = fem[(fem["scene"] == scene) & (fem["mu"] == changes["friction.mu"])]
    beam = fastncm.solve(
        fastncm.load_scene(scene).replace(changes), positions=rows["position_m"].to_numpy()
    ).frame()
    theirs = rows[["force_x_N", "force_y_N"]].to_numpy()
    ours = beam[["force_x_N", "force_y_N"]].to_numpy()
    size = np.hypot(*theirs.T)
    return pd.DataFrame(
        {
            "scene": scene,
            "model": model,
            "position_m": rows["position_m"].to_numpy(),
            "fem_N": size,
            "force_x_%": 100 * (abs(ours[:, 0]) - abs(theirs[:, 0])) / size,
            "force_y_%": 100 * (abs(ours[:, 1]) - abs(theirs[:, 1])) / size,
            "magnitude_%": 100 * (np.hypot(*ours.T) / size - 1.0),
        }
    )


def summary(table: pd.DataFrame) -> list[list[str]]:
    """Largest differences per scene and model, as cells of a table."""
    columns = ["force_x_%", "force_y_%", "magnitude_%"]
    return [
        [scene, model, *(f"{size:.2f} %" for size in rows[columns].abs().max())]
        for (scene, model), rows in table.groupby(["scene", "model"], sort=False)
    ]


def picture(table: pd.DataFrame, fem: pd.DataFrame) -> None:
    figure = empty_figure(8.0, 5.2)
    axes = figure.subplots(2, 2, height_ratios=[2.2, 1.0], sharex="col", sharey="row")
    for column, scene in enumerate(SCENES):
        draw_forces(axes[0, column], fem, scene)
        draw_differences(axes[1, column], table, scene)
    axes[0, 0].set_ylabel("force on the finger / N")
    axes[1, 0].set_ylabel("difference / %")
    axes[0, 0].legend(frameon=False, fontsize=8, loc="upper left")
    file = save(figure, RESULTS / "finite_elements.png")
    print(f"\n{file.relative_to(ROOT)}")


def draw_forces(ax: Axes, fem: pd.DataFrame, scene: str) -> None:
    """Magnitude of the force: the beam as lines, finite elements as markers."""
    open_frame(ax)
    ax.set_title(scene, fontsize=10, loc="left")
    for model, changes in MODELS.items():
        if changes["model.shear"]:
            made = fastncm.load_scene(scene).replace(
                changes | {"path.steps": LINE_POSITIONS, "solver.rtol": 1e-6}
            )
            beam = fastncm.solve(made).frame()
            force = np.hypot(beam["force_x_N"], beam["force_y_N"])
            ax.plot(1e3 * beam["position"], force, color=COLOURS[model], lw=1.2, label=model)
    for mu, marker in ((0.0, "o"), (0.2, "s")):
        rows = fem[(fem["scene"] == scene) & (fem["mu"] == mu)]
        force = np.hypot(rows["force_x_N"], rows["force_y_N"])
        ax.plot(
            1e3 * rows["position_m"],
            force,
            marker,
            mfc="white",
            mec="0.25",
            ms=4.5,
            label=f"finite elements, μ = {mu:g}",
        )


def draw_differences(ax: Axes, table: pd.DataFrame, scene: str) -> None:
    """Difference of the magnitude in %, row by row."""
    open_frame(ax)
    ax.axhline(0.0, color="0.7", lw=0.8)
    for model, colour in COLOURS.items():
        rows = table[(table["scene"] == scene) & (table["model"] == model)]
        ax.plot(
            1e3 * rows["position_m"], rows["magnitude_%"], "o-", color=colour, ms=3, lw=0.8,
            label=model,
        )  # fmt: skip
    ax.invert_xaxis()
    ax.set_xlabel("target position / mm")
    if scene == "snapfit-corner":
        ax.legend(frameon=False, fontsize=8)


if __name__ == "__main__":
    main()
