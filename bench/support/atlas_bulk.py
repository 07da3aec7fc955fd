"""The atlas's scenes in bulk: many in one call, of which the deepest row of each is kept."""

from collections.abc import Sequence

import extremes
import numpy as np
import pandas as pd

from support import atlas_causes, atlas_runs, atlas_store
from support.atlas_store import Piece

BLOCKS_A_CALL = 2
"""The solver's lanes are fuller with many scenes of the same options."""
SMALL = ("friction.mu", "taper", "tip_angle_rad", "kkt_residual", "error_estimate")
"""Columns that are kept in single precision."""
COMMON = ("kind", "index", "status", "contacts", "iterations", "path.steps", "rows", "unsolved",
          "cause", "snapped", "overlaps", *SMALL)  # fmt: skip
KEPT = {
    "jaws": (*COMMON, "solver.order"),
    "sides": (*COMMON, "solver.intervals", "solver.contact", "model.section"),
}


def run(kinds: Sequence[str], scenes: int, jobs: int, seconds: float) -> pd.DataFrame:
    """The deepest row of each of the first `scenes` scenes of each kind, with the columns KEPT; of
    as many as are begun in so many seconds, beside those of earlier runs.

    rows: of the scene's path; unsolved: how many of them have no answer.
    """
    step = BLOCKS_A_CALL * extremes.BLOCK
    calls = [
        (kind, first, min(step, scenes - first))
        for first in range(0, scenes, step)
        for kind in kinds
    ]
    pieces = [Piece("-".join(map(str, call)), deepest, call) for call in calls]
    return atlas_store.run("scenes", pieces, jobs, seconds)


def deepest(kind: str, first: int, count: int) -> pd.DataFrame:
    """The deepest rows of `count` scenes from `first` on."""
    columns = atlas_runs.scenes(kind, first // extremes.BLOCK, count)
    table = atlas_runs.solved(kind, columns)
    table["index"] += first
    failed = atlas_causes.failed(table)
    last = atlas_runs.last_rows(table)
    last["rows"] = last["row"] + 1
    last["unsolved"] = failed.groupby(table["index"]).sum().loc[last["index"]].to_numpy()
    last = atlas_causes.described(kind, last)
    kept = last[list(KEPT["sides" if kind in extremes.SIDE_KINDS else "jaws"])]
    with np.errstate(over="ignore"):  # an estimate may be beyond single precision
        return kept.astype(dict.fromkeys(SMALL, np.float32) | {"index": np.int32})
