"""The atlas's runs: random scenes in bulk, and what is true of them by other means."""

import time

import extremes
import numpy as np
import pandas as pd
import shooting_many

import fastncm
from fastncm.cases import solve_chunk

NOTED = ("friction.mu", "solver.order", "model.shear", "path.steps")
NOTED_SIDE = (
    "friction.mu",
    "solver.intervals",
    "model.shear",
    "model.section",
    "model.surface",
    "solver.contact",
    "path.kind",
    "path.steps",
)
SOLVED = ("converged", "no_contact")


def run_block(kind: str, block: int, count: int = extremes.BLOCK) -> pd.DataFrame:
    """One row for each position of the first `count` scenes of a block, with the columns of
    `Curve.frame`, the scene's index and what the heat maps need of it."""
    side = kind in extremes.SIDE_KINDS
    scene = fastncm.load_scene(extremes.base_scene(kind))
    if side:
        portions = extremes.parts(extremes.first(extremes.side_block(kind, block), count))
    else:
        portions = [(np.arange(count), extremes.first(extremes.jaw_block(kind, block), count))]
    found = []
    begin = time.process_time()
    for rows, columns in portions:
        if not len(rows):
            continue
        base = scene.replace(extremes.row(columns, 0))
        result = solve_chunk(base, columns, curves=True)
        assert result.curves is not None
        table = pd.DataFrame(result.curves)
        case = table.pop("case").to_numpy()
        table["index"] = rows[case] + block * extremes.BLOCK
        thickness, length = columns["finger.thickness"], columns["finger.length"]
        table["taper"] = (thickness[:, 1] / thickness[:, 0])[case]
        table["slenderness"] = (thickness[:, 0] / length)[case]
        table["length"] = length[case]
        for name in NOTED_SIDE if side else NOTED:
            column = columns[name][case]
            table[name] = column.astype(str) if column.dtype == object else column
        table["advice"] = result.cases["advice"][case]
        found.append(table)
    table = pd.concat(found, ignore_index=True)
    table.insert(0, "kind", kind)
    table.attrs["seconds"] = time.process_time() - begin
    return table


def last_rows(table: pd.DataFrame) -> pd.DataFrame:
    """The deepest position of each scene."""
    return table.groupby("index").tail(1).reset_index(drop=True)


def shoot(kind: str, block: int, table: pd.DataFrame) -> pd.DataFrame:
    """The rows that are converged on one sliding contact, with the true normal force by shooting.

    Adds true_force (EI/L^2), error and rounding (relative; what rounding may do to any answer) and
    found (whether shooting closed from the claimed answer).
    """
    chosen = (table["status"] == "converged") & (table["contacts"] == 1)
    chosen &= (table["sticking"] == 0) & (table["normal_force_N"] > 0.0)
    table = table[chosen].reset_index(drop=True)
    rows = table["index"].to_numpy() - block * extremes.BLOCK
    columns = extremes.jaw_block(kind, block)
    unit, length = shooting_many.force_unit(columns, rows), columns["finger.length"][rows]
    claim = shooting_many.Claim(
        table[["force_x_N", "force_y_N"]].to_numpy() / unit[:, None],
        table[["contact_x_m", "contact_y_m"]].to_numpy() / length[:, None],
        np.column_stack(
            [table["tip_x_m"] / length, table["tip_y_m"] / length, table["tip_angle_rad"]]
        ),
    )
    fingers = shooting_many.fingers(columns, rows, table["position"].to_numpy())
    truth = shooting_many.exact(fingers, claim, table["friction.mu"].to_numpy())
    return table.assign(
        true_force=truth.normal,
        error=np.abs(table["normal_force_N"] / unit / truth.normal - 1.0),
        rounding=truth.rounding / np.abs(truth.normal),
        found=truth.found,
    )


def judge_by_order(shot: pd.DataFrame) -> pd.DataFrame:
    """The true errors of `shoot`, those that shooting does not close by the same scene with other
    modes: a thin end makes shooting from the tip sensitive beyond double precision."""
    shot = shot.assign(judge=np.where(shot["found"], "shooting", ""))
    for i in np.flatnonzero(~shot["found"]):
        kind, index = shot.at[i, "kind"], int(shot.at[i, "index"])
        other = 32 if shot.at[i, "solver.order"] != "32" else 24
        finer = solve_again(kind, index, {"solver.order": other}).iloc[-1]
        if finer["status"] == "converged":
            error = abs(shot.at[i, "normal_force_N"] / finer["normal_force_N"] - 1.0)
            shot.loc[i, ["found", "error", "judge"]] = True, error, f"order {other}"
            shot.loc[i, "rounding"] = 10.0 * finer["error_estimate"]
    return shot


def solve_again(kind: str, index: int, changes: dict[str, object]) -> pd.DataFrame:
    """A scene's path once more, with other settings of the solver."""
    made = extremes.one(kind, index) | changes
    return fastncm.solve(fastncm.load_scene(extremes.base_scene(kind)).replace(made)).frame()


def refine(table: pd.DataFrame, times: int = 8) -> pd.DataFrame:
    """Error of the converged rows of direct contact against the same scenes with more intervals:
    columns index, error, rounding, found."""
    found = []
    for _, row in table[table["status"] == "converged"].iterrows():
        intervals = min(times * int(row["solver.intervals"]), 10_000)
        if intervals == int(row["solver.intervals"]):
            continue
        changes = {"solver.intervals": intervals, "solver.points": 90 * times}
        finer = solve_again(row["kind"], int(row["index"]), changes).iloc[-1]
        if finer["status"] != "converged":
            found.append({"index": row["index"], "found": False})
            continue
        force, truth = (
            np.array([one["force_x_N"], one["force_y_N"]], dtype=float) for one in (row, finer)
        )
        found.append(
            {
                "index": row["index"],
                "error": np.hypot(*(force - truth)) / np.hypot(*truth),
                "finer_estimate": finer["error_estimate"],
                "rounding": 1e-9 + finer["error_estimate"],  # so well is the truth known
                "found": True,
            }
        )
    return pd.DataFrame(found)


def retry(kind: str, index: int, ways: tuple[dict[str, object], ...]) -> str:
    """The first of the `ways` (changes) by which the deepest position of a scene is solved; empty
    where none does."""
    for changes in ways:
        if solve_again(kind, index, changes)["status"].iloc[-1] in SOLVED:
            return ", ".join(f"{name} = {value}" for name, value in changes.items())
    return ""
