"""Scenes that have no answer though there is one, kept as test cases: tests/unsolved.csv."""

import pandas as pd

from support import ROOT
from support.atlas_failures import NOT_TRIED

FILE = ROOT / "tests" / "unsolved.csv"
COLUMNS = ["kind", "index", "cause", "known"]
MOST = 6
"""New ones of a kind and cause in one run."""


def keep(tried: pd.DataFrame) -> None:
    """Add the rows without friction that other means have solved to the file, which loses none."""
    new = tried[tried["friction.mu"].eq(0.0) & ~tried["solved_by"].isin(["", NOT_TRIED])]
    new = new.rename(columns={"solved_by": "known"})[COLUMNS]
    new = new.groupby(["kind", "cause"], sort=False).head(MOST)
    kept = pd.concat([pd.read_csv(FILE), new]) if FILE.exists() else new
    kept = kept.drop_duplicates(["kind", "index"]).sort_values(["kind", "index"])
    kept.to_csv(FILE, index=False)
    print(f"{FILE.name}: {len(kept)} scenes")
