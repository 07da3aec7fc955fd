"""The study's part of the report, from its tables alone."""

import numpy as np
import pandas as pd
from support import markdown_table

from .errors import finest, largest


def against_reference(forces: pd.DataFrame, runs: pd.DataFrame) -> str:
    """CalculiX's largest differences from the reference over the meshes."""
    by = ["scene", "mesh", "mu"]
    table = largest(forces, by).merge(runs, on=by).dropna(subset="reference_%")
    return markdown_table(
        ["scene", "mesh", "μ", "elements", "of the finger", "positions", "largest difference"],
        [
            [
                row.scene, row.mesh, f"{row.mu:g}", f"{row.elements}", f"{row.finger_elements}",
                f"{row.reached} of {row.positions}", f"{error:.2f} %",
            ]
            for row, error in zip(table.itertuples(), table["reference_%"], strict=True)
        ],
    )  # fmt: skip


def against_beam(forces: pd.DataFrame) -> str:
    """The beam's largest differences from the finest meshes."""
    rows = []
    for row in largest(finest(forces), ["scene", "mesh", "mu"]).to_dict("records"):
        recovered = [f"{row['recovered_%']:.2f} %", f"{row['recovered_size_%']:.2f} %"]
        rows.append(
            [
                row["scene"], f"{row['mu']:g}",
                f"{row['equilibrium_%']:.2f} %", f"{row['equilibrium_size_%']:.2f} %",
                *(recovered if row["mu"] > 0 else ["", ""]),
            ]
        )  # fmt: skip
    head = ["scene", "μ", "equilibrium", "its magnitude", "recovered rule", "its magnitude"]
    return markdown_table(head, rows)


def times(runs: pd.DataFrame) -> str:
    """The paper's Tables 2 and 5 in our terms."""
    return markdown_table(
        ["scene", "mesh", "μ", "increments", "iterations", "CalculiX / s", "fastncm / ms", "ratio",
         "in a sweep / µs", "ratio"],
        [
            [
                row.scene, row.mesh, f"{row.mu:g}", f"{row.increments}", f"{row.iterations}",
                f"{row.fem_s:.1f}", f"{1e3 * row.beam_s:.2f}", f"{row.fem_s / row.beam_s:,.0f}",
                f"{1e6 * row.beam_in_sweep_s:.0f}",
                f"{row.fem_s / row.beam_in_sweep_s:,.0f}",
            ]
            for row in runs.itertuples()
        ],
    )  # fmt: skip


def failures(runs: pd.DataFrame) -> str:
    """A sentence on each run that has not reached all positions."""
    short = runs[runs["reached"] < runs["positions"]]
    if short.empty:
        return "CalculiX has reached every position."
    return "\n".join(
        f"- {row.scene}, {row.mesh}, μ = {row.mu:g}: {row.reached} of {row.positions} positions "
        f"({row.message or 'stopped without a word'})"
        for row in short.itertuples()
    )


def sensitivity(forces: pd.DataFrame, runs: pd.DataFrame) -> str:
    """A sentence on what another penalty would change."""
    size = np.hypot(forces["fem_x_N"], forces["fem_y_N"])
    by_penalty = size.groupby(forces["penalty"], sort=True)
    own = by_penalty.get_group(1.0).to_numpy()
    said = []
    for factor, some in by_penalty:
        if factor != 1.0:
            off = abs(some.to_numpy() / own - 1.0)
            reached = np.isfinite(off)
            said.append(
                f"{factor:g} times the penalty by {100 * off[reached].max():.2f} % "
                f"({reached.sum()} of {len(off)} positions reached)"
            )
    first = runs.iloc[0]
    return (
        f"Sensitivity to the penalty ({first['scene']}, {first['mesh']}, μ = {first['mu']:g}): the "
        f"force's magnitude changes with {' and with '.join(said)} at most."
    )
