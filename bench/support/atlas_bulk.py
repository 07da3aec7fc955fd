"""The atlas's scenes in bulk: many in one call, and what is finished is on disk.

A run writes one file for each call of the solver into results/atlas/ (which git ignores), under the
hash of everything that its answers depend on. A run that was stopped goes on where it was, and one
with another package begins anew.
"""

import hashlib
import os
import time
from collections.abc import Sequence
from pathlib import Path

import extremes
import numpy as np
import pandas as pd
from joblib import Parallel, delayed

import fastncm
from support import ROOT, atlas_runs

BLOCKS_A_CALL = 2
"""The solver's lanes are fuller with many scenes of the same options."""
SMALL = ("friction.mu", "taper", "tip_angle_rad", "kkt_residual", "error_estimate")
"""Columns that are kept in single precision."""
KEPT = {
    "jaws": ("kind", "index", "status", "contacts", "iterations", "advice", "solver.order", *SMALL),
    "sides": ("kind", "index", "status", "contacts", "iterations", "advice", "solver.intervals",
              "solver.contact", "model.section", *SMALL),
}  # fmt: skip

NAMES = tuple(dict.fromkeys(KEPT["jaws"] + KEPT["sides"]))


def contact_of(kind: str) -> str:
    """Which of KEPT holds for a kind of scene."""
    return "sides" if kind in extremes.SIDE_KINDS else "jaws"


def folder() -> Path:
    """Where the files of this package and these scenes are."""
    digest = hashlib.sha256()
    package = Path(fastncm.__file__).parent
    for file in [*sorted(package.rglob("*.py")), Path(extremes.__file__)]:
        digest.update(file.read_bytes())
    digest.update(repr(KEPT).encode())
    return ROOT / "results" / "atlas" / digest.hexdigest()[:16]


def run(kinds: Sequence[str], scenes: int, jobs: int) -> pd.DataFrame:
    """The deepest row of each of the first `scenes` scenes of each kind, with the columns KEPT.

    jobs: processes. ``.attrs["cpu_seconds"]`` is what all of them took, in whichever run.
    """
    home = folder()
    home.mkdir(parents=True, exist_ok=True)
    step = BLOCKS_A_CALL * extremes.BLOCK
    calls = [
        (kind, first, min(step, scenes - first))
        for first in range(0, scenes, step)
        for kind in kinds
    ]
    missing = [call for call in calls if not _file(home, *call).exists()]
    tasks = (delayed(_solve)(home, *call) for call in missing)
    done = Parallel(n_jobs=jobs, return_as="generator_unordered")(tasks)
    for count, said in enumerate(done, start=len(calls) - len(missing) + 1):
        print(f"{count} of {len(calls)}: {said}", flush=True)
    parts = [pd.read_parquet(_file(home, *call)) for call in calls]
    table = pd.concat(parts, ignore_index=True)
    table.attrs = {"cpu_seconds": sum(part.attrs["cpu_seconds"] for part in parts)}
    return table


def _file(home: Path, kind: str, first: int, count: int) -> Path:
    return home / f"{kind}-{first}-{count}.parquet"


def _solve(home: Path, kind: str, first: int, count: int) -> str:
    """Solve `count` scenes from `first` on and write their deepest rows."""
    begin = time.process_time()
    columns = atlas_runs.scenes(kind, first // extremes.BLOCK, count)
    last = deepest(kind, columns).assign(kind=kind)
    last["index"] += first
    kept = last[list(KEPT[contact_of(kind)])]
    with np.errstate(over="ignore"):  # an estimate may be beyond single precision
        kept = kept.astype(dict.fromkeys(SMALL, np.float32) | {"index": np.int32})
    seconds = time.process_time() - begin
    kept.attrs = {"cpu_seconds": seconds}
    file = _file(home, kind, first, count)
    temporary = file.with_suffix(f".{os.getpid()}")
    kept.to_parquet(temporary)
    temporary.replace(file)
    return f"{kind} from {first}, {count} scenes, {seconds:.0f} s of CPU time"


def deepest(kind: str, columns: extremes.Columns) -> pd.DataFrame:
    """The deepest row of each scene of a table. A scene for which the package raises an exception
    has the status "exception"; its advice says which."""
    count = len(columns["finger.length"])
    try:
        return atlas_runs.last_rows(atlas_runs.run_columns(kind, columns))
    except Exception as error:
        if count == 1:
            row = {name: str(columns[name][0]) for name in NAMES if name in columns}
            row |= {"friction.mu": columns["friction.mu"][0], "index": 0, "status": "exception"}
            row |= {"contacts": 0, "iterations": 0, "advice": f"{type(error).__name__}: {error}"}
            return pd.DataFrame([{name: row.get(name, np.nan) for name in NAMES}])
    half = count // 2
    parts = [
        deepest(kind, {name: column[part] for name, column in columns.items()})
        for part in (slice(half), slice(half, count))
    ]
    parts[1]["index"] += half
    return pd.concat(parts, ignore_index=True)
