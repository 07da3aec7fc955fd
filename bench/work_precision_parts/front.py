"""What the tables say: Pareto fronts, the time that an accuracy takes, how rtol compares."""

import math

import numpy as np
import pandas as pd

ROUNDING = 1e-11
"""Errors below this are rounding and count as this."""
OTHER_MODELS = ("shear, section psi", "shear, section psi+gamma", "section psi+gamma")
"""Series that solve another model than the panel's."""


def with_time(table: pd.DataFrame) -> pd.DataFrame:
    """With a column us: in a sweep where that is measured, alone where it is not."""
    return table.assign(us=table["us_sweep"].fillna(table["us_alone"]))


def explicit(table: pd.DataFrame) -> pd.DataFrame:
    """fastncm's rows with settings by hand: all but rtol's and other models'."""
    kept = (table["solver"] == "fastncm") & ~table["series"].isin(("rtol", *OTHER_MODELS))
    return with_time(table[kept])


def pareto(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows that no other one beats in both time and error, by time."""
    rows = rows[(rows["failed"] == 0) & rows["error"].notna()].sort_values(["us", "error"])
    error = rows["error"].clip(lower=ROUNDING)
    return rows[error < error.cummin().shift(fill_value=math.inf)]


def rtol_excess(table: pd.DataFrame) -> np.ndarray:
    """Time of each rtol over that of the fastest explicit setting that is as accurate (to 1 % of
    the error)."""
    settings = explicit(table)
    settings = settings[settings["failed"] == 0]
    chosen = with_time(table[(table["solver"] == "fastncm") & (table["series"] == "rtol")])
    ratios = []
    for row in chosen.itertuples():
        as_good = settings["error"] <= 1.01 * max(row.error, ROUNDING)
        ratios.append(row.us / settings.loc[as_good, "us"].min())
    return np.array(ratios)


def time_to(table: pd.DataFrame, solver: str, error: float, column: str = "us") -> float:
    """Shortest time (us a solve) of a solver's rows with at most this error and no failure; NaN
    where none gets there."""
    rows = with_time(table)
    kept = rows["solver"].eq(solver) & (rows["error"] <= error) & rows["failed"].eq(0)
    kept &= ~rows["series"].isin(OTHER_MODELS)
    return float(rows.loc[kept, column].min()) if kept.any() else math.nan
