"""Differences between the forces of finite elements and of the beam."""

import numpy as np
import pandas as pd

MODELS = "equilibrium", "recovered"
GRADES = {"coarse": 0, "medium": 1, "fine": 2}
AGAINST = "reference", *MODELS


def with_differences(forces: pd.DataFrame) -> pd.DataFrame:
    """The table with ..._%, the length of the difference of two force vectors, and ..._size_%, how
    much larger the force is than CalculiX's; both in % of CalculiX's."""
    fem = forces[["fem_x_N", "fem_y_N"]].to_numpy()
    size = np.hypot(*fem.T)
    table = forces.copy()
    for name in AGAINST:
        other = forces[[f"{name}_x_N", f"{name}_y_N"]].to_numpy()
        table[f"{name}_%"] = 100 * np.hypot(*(other - fem).T) / size
        table[f"{name}_size_%"] = 100 * (np.hypot(*other.T) / size - 1.0)
    return table


def largest(forces: pd.DataFrame, by: list[str]) -> pd.DataFrame:
    """Largest differences over the positions of each group, and how many positions there are."""
    table = with_differences(forces)
    columns = [f"{name}{kind}_%" for name in AGAINST for kind in ("", "_size")]
    groups = table.groupby(by, sort=False)
    found = groups[columns].agg(lambda column: column.abs().max())
    return found.assign(compared=groups["fem_x_N"].count()).reset_index()


def finest(forces: pd.DataFrame) -> pd.DataFrame:
    """The rows of each scene's finest mesh."""
    grade = forces["mesh"].map(GRADES)
    return forces[grade == grade.groupby(forces["scene"]).transform("max")]
